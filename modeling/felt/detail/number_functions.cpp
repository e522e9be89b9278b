#include <algorithm>

#include "nephele/modeling/felt/detail/functions.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::felt {

namespace {

using S = ScalarField;
using V = VectorField;
using M = MatrixField;

double inDomain(const char* name, double value, bool isIn, const char* domain) {
  if (!isIn)
    throw CallError(Code::outOfRange,
                    std::string(name) + " of " + shown(value, {Kind::number}) + ": " + domain);
  return value;
}

/// A function of a number and the same of a field.
template <class OfNumber, class OfField>
void addPair(Registry& r, const std::string& name, const std::string& parameter, const std::string& text,
             OfNumber ofNumber, OfField ofField) {
  r.add("float " + name + "(float " + parameter + ")", text, "print(" + name + "(0.5));", ofNumber);
  r.add("scalarfield " + name + "(scalarfield " + parameter + ")", text,
        "scalarfield f = " + name + "(identity().x);", ofField);
}

void addOfOne(Registry& r) {
  r.add("int abs(int a)", "The size without its sign.", "print(abs(-2));",
        [](std::int64_t a) { return a < 0 ? difference(0, a) : a; });
  addPair(
      r, "abs", "a", "The size without its sign.", [](double a) { return std::abs(a); },
      [](const S& a) { return abs(a); });
  addPair(
      r, "square", "a", "a times a.", [](double a) { return a * a; }, [](const S& a) { return square(a); });
  addPair(
      r, "sqrt", "a", "Square root; of fields no number where `a` is negative.",
      [](double a) { return std::sqrt(inDomain("the square root", a, a >= 0, "there is none below 0")); },
      [](const S& a) { return sqrt(a); });
  addPair(
      r, "exp", "a", "e to the power `a`.", [](double a) { return std::exp(a); },
      [](const S& a) { return exp(a); });
  addPair(
      r, "log", "a", "Natural logarithm; of fields no number where `a` is negative.",
      [](double a) { return std::log(inDomain("the logarithm", a, a > 0, "it is there above 0")); },
      [](const S& a) { return log(a); });
  addPair(
      r, "sin", "a", "Sine of an angle in radians.", [](double a) { return std::sin(a); },
      [](const S& a) { return sin(a); });
  addPair(
      r, "cos", "a", "Cosine of an angle in radians.", [](double a) { return std::cos(a); },
      [](const S& a) { return cos(a); });
  addPair(
      r, "tan", "a", "Tangent of an angle in radians.", [](double a) { return std::tan(a); },
      [](const S& a) { return tan(a); });
  addPair(
      r, "asin", "a", "Angle in radians whose sine is `a`.",
      [](double a) { return std::asin(inDomain("the angle", a, std::abs(a) <= 1, "from -1 to 1")); },
      [](const S& a) { return asin(a); });
  addPair(
      r, "acos", "a", "Angle in radians whose cosine is `a`.",
      [](double a) { return std::acos(inDomain("the angle", a, std::abs(a) <= 1, "from -1 to 1")); },
      [](const S& a) { return acos(a); });
  addPair(
      r, "atan", "a", "Angle in radians whose tangent is `a`.", [](double a) { return std::atan(a); },
      [](const S& a) { return atan(a); });
  addPair(
      r, "floor", "a", "Largest whole number that is not above `a`.", [](double a) { return std::floor(a); },
      [](const S& a) { return floor(a); });
  addPair(
      r, "ceil", "a", "Smallest whole number that is not below `a`.", [](double a) { return std::ceil(a); },
      [](const S& a) { return -floor(-a); });
  addPair(
      r, "radians", "degrees", "An angle in radians.", [](double a) { return a * (kPi / 180); },
      [](const S& a) { return a * S(kPi / 180.0f); });
}

void addOfSeveral(Registry& r) {
  r.add("float atan2(float y, float x)", "Angle of the point (x, y), from -pi to pi.", "print(atan2(1, 0));",
        [](double y, double x) { return std::atan2(y, x); });
  r.add("scalarfield atan2(scalarfield y, scalarfield x)", "Angle of the point (x, y), from -pi to pi.",
        "scalarfield azimuth = atan2(identity().x, identity().z);",
        [](const S& y, const S& x) { return atan2(y, x); });
  r.add("float pow(float a, float b)", "`a` to the power `b`.", "print(pow(2, 0.5));",
        [](double a, double b) { return power(a, b); });
  r.add("scalarfield pow(scalarfield a, scalarfield b)", "`a` to the power `b`; 0 to the power 0 is 1.",
        "scalarfield f = pow(abs(identity().x), 1.5);", [](const S& a, const S& b) { return pow(a, b); });
  r.add("int min(int a, int b)", "The smaller one.", "print(min(1, 2));",
        [](std::int64_t a, std::int64_t b) { return std::min(a, b); });
  r.add("int max(int a, int b)", "The larger one.", "print(max(1, 2));",
        [](std::int64_t a, std::int64_t b) { return std::max(a, b); });
  r.add("float min(float a, float b)", "The smaller one.", "print(min(1, 0.5));",
        [](double a, double b) { return std::fmin(a, b); });
  r.add("float max(float a, float b)", "The larger one.", "print(max(1, 0.5));",
        [](double a, double b) { return std::fmax(a, b); });
  r.add("scalarfield min(scalarfield a, scalarfield b)",
        "The smaller value; where one is no number the other.",
        "scalarfield both = min(sphere((0,0,0), 1), plane((0,0,0), (0,1,0)));",
        [](const S& a, const S& b) { return min(a, b); });
  r.add("scalarfield max(scalarfield a, scalarfield b)",
        "The larger value; where one is no number the other.",
        "scalarfield either = max(sphere((0,0,0), 1), sphere((1,0,0), 1));",
        [](const S& a, const S& b) { return max(a, b); });
  r.add("float clamp(float a, float low, float high)", "`a` kept from `low` to `high`.",
        "print(clamp(3, 0, 1));", [](double a, double low, double high) {
          inDomain("the lower limit", low, low <= high, "it must not be above the higher one");
          return std::clamp(a, low, high);
        });
  r.add("scalarfield clamp(scalarfield a, scalarfield low, scalarfield high)",
        "`a` kept from `low` to `high`, which may vary.", "scalarfield f = clamp(identity().y, 0, 1);",
        [](const S& a, const S& low, const S& high) { return clamp(a, low, high); });
  r.add("float lerp(float a, float b, float t)",
        "`a` where `t` is 0, `b` where it is 1, in proportion between and beyond.", "print(lerp(1, 3, 0.5));",
        [](double a, double b, double t) { return a + (b - a) * t; });
  r.add("scalarfield lerp(scalarfield a, scalarfield b, scalarfield t)",
        "`a` where `t` is 0, `b` where it is 1, in proportion between and beyond.",
        "scalarfield f = lerp(1, 3, clamp(identity().y, 0, 1));",
        [](const S& a, const S& b, const S& t) { return a + (b - a) * t; });
  r.add("vectorfield lerp(vectorfield a, vectorfield b, scalarfield t)",
        "`a` where `t` is 0, `b` where it is 1, in proportion between and beyond.",
        "vectorfield color = lerp((1,1,1), (1,0.5,0.2), clamp(identity().y, 0, 1));",
        [](const V& a, const V& b, const S& t) { return a + (b - a) * t; });
  r.add("vector lerp(vector a, vector b, float t)", "`a` where `t` is 0, `b` where it is 1.",
        "print(lerp((0,0,0), (1,2,3), 0.5));",
        [](const Vec3d& a, const Vec3d& b, double t) { return a + (b - a) * t; });
  r.add("float smoothstep(float low, float high, float a)", "0 below `low`, 1 above `high`, smooth between.",
        "print(smoothstep(0, 1, 0.3));", [](double low, double high, double a) {
          inDomain("the lower limit", low, low < high, "it must be below the higher one");
          const double t = std::clamp((a - low) / (high - low), 0.0, 1.0);
          return t * t * (3 - 2 * t);
        });
  r.add("scalarfield smoothstep(float low, float high, scalarfield a)",
        "0 below `low`, 1 above `high`, smooth between.", "scalarfield f = smoothstep(0, 1, identity().y);",
        [](double low, double high, const S& a) {
          return smoothstep(finite("low", low), finite("high", high), a);
        });
}

void addOfVectors(Registry& r) {
  r.add("float dot(vector a, vector b)", "Inner product, which `*` is, too.", "print(dot((1,2,3), (1,0,0)));",
        [](const Vec3d& a, const Vec3d& b) { return dot(a, b); });
  r.add("scalarfield dot(vectorfield a, vectorfield b)", "Inner product, which `*` is, too.",
        "scalarfield up = dot(normalize(identity()), (0,1,0));",
        [](const V& a, const V& b) { return dot(a, b); });
  r.add("vector cross(vector a, vector b)", "Outer product.", "print(cross((1,0,0), (0,1,0)));",
        [](const Vec3d& a, const Vec3d& b) { return cross(a, b); });
  r.add("vectorfield cross(vectorfield a, vectorfield b)", "Outer product: swirl about an axis.",
        "vectorfield swirl = cross((0,1,0), identity());",
        [](const V& a, const V& b) { return cross(a, b); });
  r.add("float length(vector a)", "Length.", "print(length((3,4,0)));",
        [](const Vec3d& a) { return length(a); });
  r.add("scalarfield length(vectorfield a)", "Length.", "scalarfield r = length(identity());",
        [](const V& a) { return length(a); });
  r.add("vector normalize(vector a)", "The same direction, of length 1; zero stays zero.",
        "print(normalize((3,4,0)));", [](const Vec3d& a) { return normalize(a); });
  r.add("vectorfield normalize(vectorfield a)", "The same direction, of length 1; zero stays zero.",
        "vectorfield out = normalize(identity());", [](const V& a) { return normalize(a); });
  r.add("float component(vector a, int index)", "A component, 0 to 2: `a[index]`.", "print((1,2,3)[1]);",
        [](const Vec3d& a, std::int64_t index) { return a[inRange("index", index, 0, 2)]; });
  r.add("scalarfield component(vectorfield a, int index)", "A component, 0 to 2: `a.x`, `a.y`, `a.z`.",
        "scalarfield height = identity().y;",
        [](const V& a, std::int64_t index) { return component(a, inRange("index", index, 0, 2)); });
  r.add("vector row(matrix a, int index)", "A row, 0 to 2: `a[index]`.", "",
        [](const Mat3f& a, std::int64_t index) {
          const int i = inRange("index", index, 0, 2);
          return Vec3d{a(i, 0), a(i, 1), a(i, 2)};
        });
  r.add("vectorfield row(matrixfield a, int index)", "A row, 0 to 2: `a[index]`.",
        "vectorfield gradientOfX = grad(identity())[0];",
        [](const M& a, std::int64_t index) { return row(a, inRange("index", index, 0, 2)); });
  r.add("matrix transpose(matrix a)", "Rows become columns.", "",
        [](const Mat3f& a) { return transpose(a); });
  r.add("matrixfield transpose(matrixfield a)", "Rows become columns.", "",
        [](const M& a) { return transpose(a); });
  r.add("float determinant(matrix a)", "Determinant.", "",
        [](const Mat3f& a) { return static_cast<double>(determinant(a)); });
  r.add("scalarfield determinant(matrixfield a)",
        "Determinant: of the gradient of a map, what volumes grow by.",
        "scalarfield growth = determinant(grad(identity() * 2));", [](const M& a) { return determinant(a); });
  r.add("matrix inverse(matrix a)", "The matrix that undoes `a`.", "",
        [](const Mat3f& a) { return inverse(a); });
  r.add("matrix rotation(vector axis, float degrees)", "Right-handed turn about an axis.",
        "print(rotation((0,1,0), 90) * (1,0,0));", [](const Vec3d& axis, double degrees) {
          if (!(length(axis) > 0)) throw CallError(Code::outOfRange, "the axis must not be zero");
          return Mat3f::rotation(toFloat(axis), radians(finite("degrees", degrees)));
        });
}

}  // namespace

void addNumberFunctions(Registry& r) {
  r.group("numbers and vectors");
  addOfOne(r);
  addOfSeveral(r);
  addOfVectors(r);
}

}  // namespace nephele::felt
