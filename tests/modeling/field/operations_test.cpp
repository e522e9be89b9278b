#include "nephele/modeling/field/operations.h"

#include <gtest/gtest.h>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/check_field.h"

namespace nephele {
namespace {

const Box kBox{{-2, -2, -2}, {2, 2, 2}};
const ScalarField kX = component(position(), 0), kY = component(position(), 1), kZ = component(position(), 2);
constexpr float kInf = std::numeric_limits<float>::infinity();

/// A smooth vector field without symmetries.
VectorField someVector() {
  return vectorField(kX * kY + 0.5f, kY - kZ * kZ, sin(kX) + kZ);
}
MatrixField someMatrix() {
  return matrixField(someVector(), position() * kX, cross(position(), someVector()));
}

struct Named {
  const char* name;
  ScalarField field;
};

TEST(FieldOps, EveryScalarOperationKeepsWhatFieldsPromise) {
  const ScalarField f = kX * 0.7f + kY * kZ, positive = square(kX) + abs(kY) + 0.1f;
  const ScalarField a = sphere({0, 0, 0}, 1), b = box(Box{{-1, -0.3f, -1}, {0.5f, 1.5f, 0.7f}});
  const Named all[] = {{"add", kX + kY},
                       {"subtract", kX - kY},
                       {"multiply", kX * kY},
                       {"divide", kX / positive},
                       {"negate", -f},
                       {"abs", abs(f)},
                       {"square", square(f)},
                       {"sqrt", sqrt(positive)},
                       {"exp", exp(f)},
                       {"log", log(positive)},
                       {"sin", sin(3 * f)},
                       {"cos", cos(3 * f)},
                       {"tan", tan(0.2f * f)},
                       {"asin", asin(0.1f * f)},
                       {"acos", acos(0.1f * f)},
                       {"atan", atan(f)},
                       {"atan2", atan2(f, positive)},
                       {"floor", floor(5 * f)},
                       {"pow", pow(positive, 0.7f)},
                       {"pow with a varying exponent", pow(positive, kZ)},
                       {"cube", pow(f, 3)},
                       {"square as power", pow(f, 2)},
                       {"inverse as power", pow(positive, -1)},
                       {"min", min(f, kX)},
                       {"max", max(f, kX)},
                       {"clamp", clamp(f, -0.5f, 0.8f)},
                       {"clamp by fields", clamp(f, -positive, kX + 1)},
                       {"mask", mask(f)},
                       {"soft mask", mask(f, 0.7f)},
                       {"smoothstep", smoothstep(-0.5f, 0.25f, f)},
                       {"dot", dot(someVector(), position())},
                       {"squared length", dot(position(), position())},
                       {"length", length(someVector())},
                       {"component", component(someVector(), 2)},
                       {"determinant", determinant(someMatrix())},
                       {"union", unionOf(a, b)},
                       {"intersection", intersection(a, b)},
                       {"cutout", cutout(a, b)},
                       {"blend", blend(a, b, 0.6f)},
                       {"shell", shell(a, 0.2f)},
                       {"dilate", dilate(b, 0.3f)},
                       {"memo", memo(f) * memo(f)},
                       {"constant", ScalarField(3.0f)}};
  for (const Named& c : all) {
    SCOPED_TRACE(c.name);
    test::checkField(c.field, kBox);
  }
}

TEST(FieldOps, EveryVectorAndMatrixOperationKeepsWhatFieldsPromise) {
  const VectorField v = someVector(), w = vectorField(kZ, kX * kX, 1.0f);
  const std::pair<const char*, VectorField> vectors[] = {{"add", v + w},
                                                         {"subtract", v - w},
                                                         {"negate", -v},
                                                         {"scale", kX * v},
                                                         {"divide", v / (square(kX) + 1)},
                                                         {"cross", cross(v, w)},
                                                         {"normalize", normalize(v)},
                                                         {"row", row(someMatrix(), 1)},
                                                         {"transform", someMatrix() * v},
                                                         {"memo", memo(v) + memo(v)}};
  for (const auto& [name, field] : vectors) {
    SCOPED_TRACE(name);
    test::checkField(field, kBox);
  }
  const MatrixField m = someMatrix(), n = matrixField(w, v, position());
  const std::pair<const char*, MatrixField> matrices[] = {{"add", m + n},
                                                          {"subtract", m - n},
                                                          {"negate", -m},
                                                          {"scale", m * kX},
                                                          {"divide", m / 3.0f},
                                                          {"product", m * n},
                                                          {"transpose", transpose(m)},
                                                          {"memo", memo(m)}};
  test::CheckOptions options;
  options.tolerance = 2e-2f;
  for (const auto& [name, field] : matrices) {
    SCOPED_TRACE(name);
    test::checkField(field, kBox, options);
  }
}

TEST(FieldOps, EverySpaceOperationKeepsWhatFieldsPromise) {
  const ScalarField f = sphere({0.2f, 0, 0}, 1) * kX;
  const VectorField v = someVector();
  const MatrixField m = someMatrix();
  test::checkField(position(), kBox);
  test::checkField(compose(f, v), kBox);
  test::checkField(compose(v, v), kBox, {.tolerance = 2e-2f});
  test::checkField(compose(m, 0.3f * v), kBox, {.tolerance = 2e-2f});
  test::checkField(translate(f, {1, 2, 3}), kBox);
  test::checkField(rotate(f, {1, 2, 3}, 1), kBox);
  test::checkField(rotate(v, {1, 2, 3}, 1), kBox);
  test::checkField(rotate(m, {1, 2, 3}, 1), kBox, {.tolerance = 2e-2f});
  test::checkField(scale(f, 0.7f), kBox);
  test::checkField(scale(v, 2), kBox);
  test::checkField(scale(translate(m, {1, 0, 0}), 2), kBox);
  test::checkField(transformed(f, {{{1, 0.2f, 0, 0, 2, 0, 0.1f, 0, 0.5f}}, {1, 1, 0}}), kBox);
}

TEST(FieldOps, DerivativesKeepWhatFieldsPromise) {
  const ScalarField f = sin(kX * 1.3f) * kY + square(kZ);
  // Second derivatives are differences of float gradients: 1e-7 over the step.
  test::CheckOptions options;
  options.step = 1e-2f;
  options.tolerance = 2e-2f;
  test::checkField(grad(f), kBox, options);
  test::checkField(grad(someVector()), kBox, options);
  test::checkField(div(someVector()), kBox, options);
  test::checkField(curl(someVector()), kBox, options);
  test::checkField(
      grad(functionField([](const Vec3f& p) { return p.x * p.y + p.z; }, {.differenceStep = 0.05f})), kBox,
      options);
}

TEST(FieldOps, FunctionsKeepWhatFieldsPromise) {
  test::CheckOptions options;
  options.tolerance = 1e-2f;
  const auto f = [](const Vec3f& p) { return std::sin(p.x) * p.y - p.z; };
  test::checkField(functionField(f, {.differenceStep = 1e-2f}), kBox, options);
  const auto range = [](const Box& b) {
    const float reach =
        std::max(std::abs(b.min.y), std::abs(b.max.y)) + std::max(std::abs(b.min.z), std::abs(b.max.z));
    return Interval{-1.001f * reach, 1.001f * reach};
  };
  const auto gradient = [](const Vec3f& p) { return Vec3f{std::cos(p.x) * p.y, std::sin(p.x), -1}; };
  test::checkField(functionField(f, {.range = range, .gradient = gradient}), kBox, options);
  test::checkField(functionField(
                       [](const Vec3f& p) {
                         return cross(p, Vec3f{1, 2, 3});
                       },
                       {.differenceStep = 1e-2f}),
                   kBox, options);
  test::checkField(
      functionField([](const Vec3f& p) { return Mat3f::scaling(p.x); }, {.differenceStep = 1e-2f}), kBox,
      options);
  EXPECT_THROW(functionField(f, {.differenceStep = 0}), Error);
}

TEST(FieldOps, ReadAsTheMathematics) {
  const Vec3f p{1, 2, 3};
  EXPECT_FLOAT_EQ((2 * kX + kY / 4 - kZ * kZ)(p), 2 + 0.5f - 9);
  EXPECT_FLOAT_EQ(dot(position(), VectorField(Vec3f{1, 0, -1}))(p), -2);
  EXPECT_EQ(cross(position(), VectorField(Vec3f{1, 0, 0}))(p), (Vec3f{0, 3, -2}));
  EXPECT_FLOAT_EQ(length(position())(p), std::sqrt(14.0f));
  EXPECT_EQ(normalize(position())({0, 0, 0}), Vec3f{});
  EXPECT_EQ(normalize(position())({0, 3, 4}), (Vec3f{0, 0.6f, 0.8f}));
  const Mat3f m{{1, 2, 3, 4, 5, 6, 7, 8, 10}};
  EXPECT_EQ((MatrixField(m) * position())(p), m * p);
  const MatrixField varying = MatrixField(m) * kX;
  EXPECT_FLOAT_EQ(determinant(varying)({1, 0, 0}), -3);  // of m, by the rule of Sarrus
  EXPECT_EQ((varying * varying)({2, 0, 0}).m, (Mat3f::scaling(4) * (m * m)).m);
  EXPECT_EQ(transpose(varying)({1, 0, 0}).m, transpose(m).m);
  EXPECT_EQ(row(varying, 2)({1, 0, 0}), (Vec3f{7, 8, 10}));
}

TEST(FieldOps, PowerOfZeroToTheZeroIsOne) {
  EXPECT_EQ(pow(kX, kY)({0, 0, 0}), 1);
  EXPECT_EQ(pow(kX, 0)({0, 5, 0}), 1);
}

TEST(FieldOps, MaskIsOneInsideOnly) {
  const ScalarField m = mask(sphere({0, 0, 0}, 1));
  EXPECT_EQ(m({0.5f, 0, 0}), 1);
  EXPECT_EQ(m({1, 0, 0}), 0);  // equation 3.1: 0 where l <= 0
  EXPECT_EQ(m({2, 0, 0}), 0);
  const ScalarField soft = mask(kX, 0.2f);
  EXPECT_EQ(soft({-0.11f, 0, 0}), 0);
  EXPECT_FLOAT_EQ(soft({0, 0, 0}), 0.5f);
  EXPECT_EQ(soft({0.11f, 0, 0}), 1);
  EXPECT_FLOAT_EQ(soft({0.05f, 0, 0}), 0.75f * 0.75f * 1.5f);
}

TEST(FieldOps, BlendAddsAQuarterOfTheRadiusAtMost) {
  const ScalarField b = blend(kX, kY, 0.8f);
  EXPECT_FLOAT_EQ(b({1, 1, 0}), 1.2f);
  EXPECT_FLOAT_EQ(b({1, 0.2f, 0}), 1);
  EXPECT_FLOAT_EQ(b({0, 5, 0}), 5);
}

TEST(FieldOps, ShellIsThickOnBothSides) {
  const ScalarField s = shell(sphere({0, 0, 0}, 1), 0.2f);
  EXPECT_NEAR(s({1, 0, 0}), 0.1f, 1e-7);
  EXPECT_NEAR(s({1.1f, 0, 0}), 0, 1e-6);
  EXPECT_NEAR(s({0.9f, 0, 0}), 0, 1e-6);
}

TEST(FieldOps, DivergenceAndCurlAreThoseOfClosedForms) {
  // A turn about z has curl (0, 0, 2) and no divergence; the position has divergence 3 and no curl.
  const VectorField turn = vectorField(-kY, kX, 0);
  EXPECT_EQ(curl(turn)({1, 2, 3}), (Vec3f{0, 0, 2}));
  EXPECT_EQ(div(turn)({1, 2, 3}), 0);
  EXPECT_EQ(div(position())({1, 2, 3}), 3);
  EXPECT_EQ(curl(position())({1, 2, 3}), Vec3f{});
  EXPECT_EQ(grad(kX * kY)({2, 5, 0}), (Vec3f{5, 2, 0}));
  EXPECT_EQ(grad(vectorField(kX, 2 * kX + 3 * kZ, kY))({1, 1, 1}).m, (Mat3f{{1, 0, 0, 2, 0, 3, 0, 1, 0}}.m));
  // div grad of |x|^2 is 6; differences of an exact gradient.
  EXPECT_NEAR(div(grad(dot(position(), position())))({1, 2, 3}), 6, 1e-2);
}

TEST(FieldOps, RotatedVectorsTurnWithTheirField) {
  // The field (1, 0, 0) where x > 0, turned by 90 degrees about z, is (0, 1, 0) where y > 0.
  const VectorField v = vectorField(mask(kX), 0, 0);
  const VectorField turned = rotate(v, {0, 0, 1}, kPi / 2);
  EXPECT_NEAR(turned({0, 1, 0}).y, 1, 1e-6);
  EXPECT_NEAR(turned({0, 1, 0}).x, 0, 1e-6);
  EXPECT_NEAR(turned({0, -1, 0}).y, 0, 1e-6);
  // A matrix field that reads off the x direction follows it.
  const MatrixField m = rotate(MatrixField(Mat3f{{1, 0, 0, 0, 0, 0, 0, 0, 0}}), {0, 0, 1}, kPi / 2);
  EXPECT_NEAR(m({1, 2, 3})(1, 1), 1, 1e-6);
  EXPECT_NEAR(m({1, 2, 3})(0, 0), 0, 1e-6);
}

TEST(FieldOps, MovedShapesAreWhereTheyShouldBe) {
  const ScalarField s = sphere({0, 0, 0}, 1);
  EXPECT_FLOAT_EQ(translate(s, {3, 0, 0})({3, 0, 0}), 1);
  EXPECT_FLOAT_EQ((2 * scale(s, 2))({0, 3, 0}), -1);  // a sphere of radius 2
  EXPECT_NEAR(rotate(translate(s, {3, 0, 0}), {0, 0, 1}, kPi / 2)({0, 3, 0}), 1, 1e-6);
}

TEST(FieldOps, RestrictionDropsWhatCannotMatter) {
  const ScalarField a = sphere({-3, 0, 0}, 1), b = sphere({3, 0, 0}, 1);
  const Box left{{-4, -1, -1}, {-2, 1, 1}};
  EXPECT_EQ(unionOf(a, b).restrictedTo(left).node(), a.node());
  EXPECT_EQ(blend(a, b, 0.5f).restrictedTo(left).node(), a.node());
  EXPECT_EQ(cutout(a, b).restrictedTo(left).node(), a.node());
  const ScalarField noise = perlin();
  // Away from the shape, density is zero and the noise is not asked.
  EXPECT_TRUE(detail::constantOf((mask(b) * abs(noise)).restrictedTo(left).node()));
  EXPECT_EQ(clamp(a, -9, 9).restrictedTo(left).node(), a.node());
  const ScalarField positive = a + 20;
  EXPECT_EQ(abs(positive).restrictedTo(left).node(), positive.node());
}

TEST(FieldOps, RestrictionKeepsManyPartsManageable) {
  std::vector<ScalarField> parts;
  for (int i = 0; i < 200; ++i) parts.push_back(sphere({float(i) * 3, 0, 0}, 1));
  const ScalarField all = unionOf(parts);
  const Box one{{29, -1, -1}, {31, 1, 1}};
  EXPECT_EQ(all.restrictedTo(one).node(), parts[10].node());
}

TEST(FieldOps, FoldsConstants) {
  const ScalarField c = (ScalarField(2) + 3) * sqrt(ScalarField(16)) - 1;
  ASSERT_TRUE(detail::constantOf(c.node()));
  EXPECT_EQ(*detail::constantOf(c.node()), 19);
  EXPECT_EQ((kX * 1).node(), kX.node());
  EXPECT_EQ((kX + 0).node(), kX.node());
  EXPECT_EQ(compose(kX, identity()).node(), kX.node());
  EXPECT_TRUE(detail::constantOf(grad(ScalarField(2)).node()));
  EXPECT_EQ(component(vectorField(kX, kY, kZ), 1).node(), kY.node());
}

TEST(FieldOps, CarriesNonFiniteValuesThrough) {
  const ScalarField inf = 1 / kX;
  EXPECT_EQ(inf({0, 0, 0}), kInf);
  EXPECT_TRUE(std::isnan(sqrt(kX)({-1, 0, 0})));
  EXPECT_EQ(clamp(sqrt(kX), 2, 3)({-1, 0, 0}), 2);
  EXPECT_EQ(sqrt(kX).range(kBox), Interval::everything());
  EXPECT_EQ(min(sqrt(kX), 5)({-1, 0, 0}), 5);
  for (const ScalarField& held : {clamp(sqrt(kX), 2, 3), min(sqrt(kX), 5), mask(sqrt(kX)),
                                  mask(sqrt(kX), 0.1f), smoothstep(0, 1, sqrt(kX))})
    EXPECT_EQ(grad(held)({-1, 0, 0}), Vec3f(0, 0, 0)) << "where the value is no longer that of the root";
}

TEST(FieldOps, RootsOfWhatStaysAtZeroHaveNoGradient) {
  const ScalarField x = max(kX, 0), varying = max(kX, 0) + 0.5f;
  for (const ScalarField& f : {sqrt(x), pow(x, 0.6f), pow(x, 1.5f), pow(x, varying)})
    EXPECT_EQ(grad(f)({-1, 0, 0}), Vec3f(0, 0, 0));
  EXPECT_FLOAT_EQ(grad(sqrt(x))({4, 0, 0}).x, 0.25f);
  EXPECT_EQ(log(x).range(Box{{-2, 0, 0}, {-1, 1, 1}}), (Interval{-kInf, -kInf}));
}

TEST(FieldOps, RefusesArgumentsOutsideTheirRange) {
  EXPECT_THROW(clamp(kX, 2, 1), Error);
  EXPECT_THROW(clamp(kX, std::nanf(""), 1), Error);
  EXPECT_THROW(mask(kX, 0), Error);
  EXPECT_THROW(smoothstep(1, 1, kX), Error);
  EXPECT_THROW(smoothstep(-kInf, 1, kX), Error);
  EXPECT_THROW(component(position(), 3), Error);
  EXPECT_THROW(row(someMatrix(), -1), Error);
  EXPECT_THROW(blend(kX, kY, 0), Error);
  EXPECT_THROW(shell(kX, -1), Error);
  EXPECT_THROW(scale(kX, 0), Error);
  EXPECT_THROW(rotate(kX, {0, 0, 0}, 1), Error);
  EXPECT_THROW(transformed(kX, {Mat3f{}, {}}), Error);
  EXPECT_THROW(unionOf(std::span<const ScalarField>{}), Error);
}

}  // namespace
}  // namespace nephele
