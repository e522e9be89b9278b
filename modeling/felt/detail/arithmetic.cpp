#include <limits>

#include "nephele/modeling/felt/detail/functions.h"

namespace nephele::felt {

namespace {

using Integer = std::int64_t;

[[noreturn]] void overflow() {
  throw CallError(Code::overflow, "the result is no integer of 64 bits", "float(...) has a wider range");
}

Integer sum(Integer a, Integer b) {
  Integer result;
  if (__builtin_add_overflow(a, b, &result)) overflow();
  return result;
}
Integer product(Integer a, Integer b) {
  Integer result;
  if (__builtin_mul_overflow(a, b, &result)) overflow();
  return result;
}

void requireDivisor(bool isZero) {
  if (isZero) throw CallError(Code::divisionByZero, "division by zero");
}

Integer quotient(Integer a, Integer b) {
  requireDivisor(b == 0);
  if (a == std::numeric_limits<Integer>::min() && b == -1) overflow();
  return a / b;
}
Integer remainder(Integer a, Integer b) {
  requireDivisor(b == 0);
  return b == -1 ? 0 : a % b;
}

Mat3f entryByEntry(const Mat3f& a, const Mat3f& b, float sign) {
  Mat3f result;
  for (std::size_t i = 0; i < 9; ++i) result.m[i] = a.m[i] + sign * b.m[i];
  return result;
}

Mat3f scaled(const Mat3f& a, double s) {
  Mat3f result;
  for (std::size_t i = 0; i < 9; ++i) result.m[i] = static_cast<float>(a.m[i] * s);
  return result;
}

std::string joined(Context& context, const std::string& a, const std::string& b) {
  if (static_cast<Integer>(a.size() + b.size()) > context.limits.elements)
    throw CallError(Code::limit,
                    "a string of more than " + std::to_string(context.limits.elements) + " characters",
                    "the limit max-elements allows more");
  return a + b;
}

void addNumbers(Registry& r) {
  r.add("int operator+(int a, int b)", "Sum.", "print(1 + 2);",
        [](Integer a, Integer b) { return sum(a, b); });
  r.add("int operator-(int a, int b)", "Difference.", "print(1 - 2);",
        [](Integer a, Integer b) { return difference(a, b); });
  r.add("int operator*(int a, int b)", "Product.", "print(2 * 3);",
        [](Integer a, Integer b) { return product(a, b); });
  r.add("int operator/(int a, int b)", "Quotient, without what is after the point: 7/2 is 3.",
        "print(7 / 2);", [](Integer a, Integer b) { return quotient(a, b); });
  r.add("int operator%(int a, int b)", "What is left by the division, with the sign of `a`.", "print(7 % 2);",
        [](Integer a, Integer b) { return remainder(a, b); });
  r.add("int operator-(int a)", "The opposite.", "print(-(2));", [](Integer a) { return difference(0, a); });

  r.add("float operator+(float a, float b)", "Sum.", "print(1.5 + 2);",
        [](double a, double b) { return a + b; });
  r.add("float operator-(float a, float b)", "Difference.", "print(1.5 - 2);",
        [](double a, double b) { return a - b; });
  r.add("float operator*(float a, float b)", "Product.", "print(1.5 * 2);",
        [](double a, double b) { return a * b; });
  r.add("float operator/(float a, float b)", "Quotient.", "print(7.0 / 2);", [](double a, double b) {
    requireDivisor(b == 0);
    return a / b;
  });
  r.add("float operator%(float a, float b)", "What is left by the division, with the sign of `a`.",
        "print(7.5 % 2.0);", [](double a, double b) {
          requireDivisor(b == 0);
          return std::fmod(a, b);
        });
  r.add("float operator^(float a, float b)",
        "`a` to the power `b`, which binds tighter than a sign: -2^2 is -4.", "print(2 ^ 0.5);",
        [](double a, double b) { return power(a, b); });
  r.add("float operator-(float a)", "The opposite.", "print(-1.5);", [](double a) { return -a; });
}

template <class T>
void addComparisons(Registry& r, const std::string& type) {
  const auto header = [&](const char* mark) {
    return "bool operator" + std::string(mark) + "(" + type + " a, " + type + " b)";
  };
  r.add(header("<"), "Whether `a` is below `b`.", "", [](const T& a, const T& b) { return a < b; });
  r.add(header("<="), "Whether `a` is not above `b`.", "", [](const T& a, const T& b) { return a <= b; });
  r.add(header(">"), "Whether `a` is above `b`.", "", [](const T& a, const T& b) { return a > b; });
  r.add(header(">="), "Whether `a` is not below `b`.", "", [](const T& a, const T& b) { return a >= b; });
}

template <class T>
void addEquality(Registry& r, const std::string& type) {
  r.add("bool operator==(" + type + " a, " + type + " b)", "Whether both are the same.", "",
        [](const T& a, const T& b) { return a == b; });
  r.add("bool operator!=(" + type + " a, " + type + " b)", "Whether they differ.", "",
        [](const T& a, const T& b) { return !(a == b); });
}

void addVectors(Registry& r) {
  r.add("vector operator+(vector a, vector b)", "Sum.", "print((1,2,3) + (1,0,0));",
        [](const Vec3d& a, const Vec3d& b) { return a + b; });
  r.add("vector operator-(vector a, vector b)", "Difference.", "print((1,2,3) - (1,0,0));",
        [](const Vec3d& a, const Vec3d& b) { return a - b; });
  r.add("vector operator-(vector a)", "The opposite.", "print(-(1,2,3));", [](const Vec3d& a) { return -a; });
  r.add("float operator*(vector a, vector b)", "Inner product, as in the notes.", "print((1,2,3) * (1,0,0));",
        [](const Vec3d& a, const Vec3d& b) { return dot(a, b); });
  r.add("vector operator*(vector a, float b)", "Multiple.", "print((1,2,3) * 2);",
        [](const Vec3d& a, double b) { return a * b; });
  r.add("vector operator*(float a, vector b)", "Multiple.", "print(2 * (1,2,3));",
        [](double a, const Vec3d& b) { return a * b; });
  r.add("vector operator/(vector a, float b)", "Part.", "print((1,2,3) / 2);", [](const Vec3d& a, double b) {
    requireDivisor(b == 0);
    return a / b;
  });
}

void addMatrices(Registry& r) {
  r.add("matrix operator+(matrix a, matrix b)", "Sum, entry by entry.", "",
        [](const Mat3f& a, const Mat3f& b) { return entryByEntry(a, b, 1); });
  r.add("matrix operator-(matrix a, matrix b)", "Difference, entry by entry.", "",
        [](const Mat3f& a, const Mat3f& b) { return entryByEntry(a, b, -1); });
  r.add("matrix operator-(matrix a)", "The opposite.", "", [](const Mat3f& a) { return scaled(a, -1); });
  r.add("matrix operator*(matrix a, matrix b)", "Matrix product.", "",
        [](const Mat3f& a, const Mat3f& b) { return a * b; });
  r.add("vector operator*(matrix a, vector b)", "Matrix times column.",
        "print(rotation((0,1,0), 90) * (1,0,0));",
        [](const Mat3f& a, const Vec3d& b) { return toDouble(a * toFloat(b)); });
  r.add("vector operator*(vector a, matrix b)", "Row times matrix.", "",
        [](const Vec3d& a, const Mat3f& b) { return toDouble(transpose(b) * toFloat(a)); });
  r.add("matrix operator*(matrix a, float b)", "Multiple.", "",
        [](const Mat3f& a, double b) { return scaled(a, b); });
  r.add("matrix operator*(float a, matrix b)", "Multiple.", "",
        [](double a, const Mat3f& b) { return scaled(b, a); });
  r.add("matrix operator/(matrix a, float b)", "Part.", "", [](const Mat3f& a, double b) {
    requireDivisor(b == 0);
    return scaled(a, 1 / b);
  });
}

}  // namespace

std::int64_t difference(std::int64_t a, std::int64_t b) {
  Integer result;
  if (__builtin_sub_overflow(a, b, &result)) overflow();
  return result;
}

double power(double a, double b) {
  requireDivisor(a == 0 && b < 0);
  const double result = std::pow(a, b);
  if (std::isnan(result) && !std::isnan(a) && !std::isnan(b))
    throw CallError(Code::outOfRange,
                    shown(a, {Kind::number}) + " to the power " + shown(b, {Kind::number}) + " is no number",
                    "of what is negative there are whole powers only");
  return result;
}

void addArithmetic(Registry& r) {
  r.group("operators");
  addNumbers(r);
  addVectors(r);
  addMatrices(r);
  r.add("string operator+(string a, string b)", "One after the other.", "print(\"a\" + \"b\");",
        [](Context& context, const std::string& a, const std::string& b) { return joined(context, a, b); });
  addComparisons<Integer>(r, "int");
  addComparisons<double>(r, "float");
  addEquality<Integer>(r, "int");
  addEquality<double>(r, "float");
  addEquality<bool>(r, "bool");
  addEquality<std::string>(r, "string");
  addEquality<Vec3d>(r, "vector");
  r.add("bool operator!(bool a)", "Whether `a` is false.", "print(!true);", [](bool a) { return !a; });
}

}  // namespace nephele::felt
