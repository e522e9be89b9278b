#include "nephele/modeling/felt/detail/functions.h"
#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using V = VectorField;
using M = MatrixField;

/// The root and the square cost a fraction of a power.
S power(const S& base, const S& exponent) {
  const float* const constant = nephele::detail::constantOf(exponent.node());
  if (constant != nullptr && *constant == 0.5f) return sqrt(base);
  if (constant != nullptr && *constant == 2.0f) return square(base);
  return pow(base, exponent);
}

template <class T>
void addSums(Registry& r, const std::string& type) {
  r.add(type + " operator+(" + type + " a, " + type + " b)", "Sum, point by point.", "",
        [](const T& a, const T& b) { return a + b; });
  r.add(type + " operator-(" + type + " a, " + type + " b)", "Difference, point by point.", "",
        [](const T& a, const T& b) { return a - b; });
  r.add(type + " operator-(" + type + " a)", "The opposite.", "", [](const T& a) { return -a; });
}

template <class T>
void addMultiples(Registry& r, const std::string& type) {
  r.add(type + " operator*(" + type + " a, scalarfield b)", "Multiple, point by point.", "",
        [](const T& a, const S& b) { return a * b; });
  r.add(type + " operator*(scalarfield a, " + type + " b)", "Multiple, point by point.", "",
        [](const S& a, const T& b) { return a * b; });
  r.add(type + " operator/(" + type + " a, scalarfield b)",
        "Part, point by point; infinite or no number where `b` is 0.", "",
        [](const T& a, const S& b) { return a / b; });
}

}  // namespace

void addFieldArithmetic(Registry& r) {
  r.group("operators");
  addSums<S>(r, "scalarfield");
  addSums<V>(r, "vectorfield");
  addSums<M>(r, "matrixfield");
  r.add("scalarfield operator*(scalarfield a, scalarfield b)", "Product, point by point.", "",
        [](const S& a, const S& b) { return a * b; });
  r.add("scalarfield operator/(scalarfield a, scalarfield b)",
        "Quotient, point by point; infinite or no number where `b` is 0.", "",
        [](const S& a, const S& b) { return a / b; });
  r.add("scalarfield operator^(scalarfield a, scalarfield b)",
        "`a` to the power `b`, point by point; no number where `a` is negative and `b` no integer.",
        "scalarfield root = identity().x ^ 0.5;", [](const S& a, const S& b) { return power(a, b); });
  addMultiples<V>(r, "vectorfield");
  addMultiples<M>(r, "matrixfield");
  r.add("scalarfield operator*(vectorfield a, vectorfield b)", "Inner product, as in the notes.",
        "scalarfield r = sqrt(identity() * identity());", [](const V& a, const V& b) { return dot(a, b); });
  r.add("vectorfield operator*(matrixfield a, vectorfield b)", "Matrix times column.", "",
        [](const M& a, const V& b) { return a * b; });
  r.add("vectorfield operator*(vectorfield a, matrixfield b)", "Row times matrix.", "",
        [](const V& a, const M& b) { return transpose(b) * a; });
  r.add("matrixfield operator*(matrixfield a, matrixfield b)", "Matrix product.", "",
        [](const M& a, const M& b) { return a * b; });
}

}  // namespace nephele::felt
