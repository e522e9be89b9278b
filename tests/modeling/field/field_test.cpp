#include "nephele/modeling/field/field.h"

#include <gtest/gtest.h>

#include <atomic>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/cloud/surface_point.h"
#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/allocation_count.h"
#include "tests/support/check_field.h"

namespace nephele {
namespace {

using test::Points;

const Box kBox{{-2, -2, -2}, {2, 2, 2}};

ScalarField cloudLike() {
  const ScalarField base = memo(sphere({0, 0, 0}, 1));
  return mask(base + 0.2f * abs(compose(perlin({.frequency = 3}), surfacePoint(base))), 0.1f) *
         smoothstep(-1, 1, component(position(), 1));
}

TEST(Field, RefusesANullNode) {
  EXPECT_THROW(ScalarField(NodePtr<float>{}), Error);
}

TEST(Field, RefusesSpansOfUnequalLength) {
  std::vector<float> three(3), two(2);
  const ScalarField f = 1.0f;
  EXPECT_THROW(f.eval({three, three, two}, three), Error);
  EXPECT_THROW(f.eval({three, three, three}, two), Error);
  EXPECT_THROW(f.evalGrad({three, three, three}, three, {{three, two, three}}), Error);
}

TEST(Field, EvaluatesAnyNumberOfPoints) {
  const ScalarField f = component(position(), 0) * 2;
  std::mt19937 random(1);
  for (const std::size_t n : {0u, 1u, 15u, 16u, 17u, 255u, 256u, 257u, 1000u}) {
    const Points points = test::randomPoints(kBox, n, random);
    const auto values = test::evaluate(f, points);
    for (std::size_t i = 0; i < n; ++i) ASSERT_EQ(values.data[0][i], 2 * points.x[i]);
  }
}

TEST(Field, ReadsUnalignedSpans) {
  std::mt19937 random(1);
  const Points points = test::randomPoints(kBox, 301, random);
  std::vector<float> out(300);
  const std::span<const float> x(points.x), y(points.y), z(points.z);
  const ScalarField f = length(position());
  f.eval({x.subspan(1), y.subspan(1), z.subspan(1)}, out);
  for (std::size_t i = 0; i < out.size(); ++i) ASSERT_EQ(out[i], length(points[i + 1]));
}

TEST(Field, ConstantsStandForFields) {
  const ScalarField s = 2;
  const VectorField v = Vec3f{1, 2, 3};
  const MatrixField m = Mat3f::identity();
  EXPECT_EQ(s({5, 5, 5}), 2);
  EXPECT_EQ(v({5, 5, 5}), (Vec3f{1, 2, 3}));
  EXPECT_EQ(m({5, 5, 5}).m, Mat3f::identity().m);
  EXPECT_EQ(s.range(Box::everywhere()), Interval::of(2));
}

TEST(Field, CompositesKeepWhatEveryFieldPromises) {
  test::checkField(cloudLike(), kBox, {.tolerance = 5e-2f, .smoothShare = 0.5});
}

TEST(Field, DefaultGradientIsCentralDifferencesAtTheNodesStep) {
  // A step so large that the difference of x^3 shows it: ((x + h)^3 - (x - h)^3) / 2 h = 3 x^2 + h^2.
  const ScalarField f =
      functionField([](const Vec3f& p) { return p.x * p.x * p.x; }, {.differenceStep = 0.5f});
  Points at(1);
  at.set(0, {1, 0, 0});
  test::Values<float> value(1);
  test::Gradients<float> g(1);
  f.evalGrad(at.spans(), value.spans(), g.spans());
  EXPECT_FLOAT_EQ(g.data[0][0], 3.25f);
  EXPECT_EQ(g.data[1][0], 0);
}

TEST(Field, DefaultGradientSurvivesFarFromTheOrigin) {
  // One float is 0.0078 there, more than the default step.
  const ScalarField f = functionField([](const Vec3f& p) { return p.x * 2; });
  EXPECT_NEAR(grad(f)({100000, 0, 0}).x, 2, 1e-3);
}

TEST(Field, StepOfACompoundIsTheSmallestOfItsParts) {
  const ScalarField coarse = functionField([](const Vec3f& p) { return p.x; }, {.differenceStep = 0.5f});
  const ScalarField fine = functionField([](const Vec3f& p) { return p.y; }, {.differenceStep = 0.25f});
  EXPECT_EQ((coarse + fine * 2).differenceStep(), 0.25f);
  EXPECT_EQ((coarse + 1).differenceStep(), 0.5f);
  EXPECT_EQ(scale(coarse, 4).differenceStep(), 2);
  EXPECT_EQ(component(position(), 0).differenceStep(), kDefaultStep);
}

TEST(Field, EvaluationAllocatesNothing) {
  const ScalarField f = cloudLike();
  const VectorField v = grad(f) * fractalSum() + curl(position() * memo(f));
  std::mt19937 random(2);
  const Points points = test::randomPoints(kBox, 1000, random);
  test::Values<float> values(1000);
  test::Gradients<float> grads(1000);
  test::Values<Vec3f> vectors(1000);
  const auto all = [&] {
    f.eval(points.spans(), values.spans());
    f.evalGrad(points.spans(), values.spans(), grads.spans());
    v.eval(points.spans(), vectors.spans());
    return f({1, 2, 3}) + f.range(kBox).max;
  };
  all();
  const long before = test::allocationCount();
  all();
  EXPECT_EQ(test::allocationCount() - before, 0);
}

TEST(Field, ThreadsGiveTheSameBits) {
  const ScalarField f = cloudLike();
  std::mt19937 random(3);
  const Points points = test::randomPoints(kBox, 20000, random);
  const auto alone = test::evaluate(f, points);
  std::vector<float> together(points.size());
  parallelFor(points.size(), 97, [&](std::size_t begin, std::size_t end) {
    const auto part = [&](const std::vector<float>& lane) {
      return std::span<const float>(lane).subspan(begin, end - begin);
    };
    f.eval({part(points.x), part(points.y), part(points.z)},
           std::span<float>(together).subspan(begin, end - begin));
  });
  for (std::size_t i = 0; i < points.size(); ++i)
    ASSERT_TRUE(test::sameBits(alone.data[0][i], together[i])) << i;
}

/// A field that counts the points it is asked for.
struct Counter {
  std::shared_ptr<std::atomic<long>> count = std::make_shared<std::atomic<long>>(0);
  ScalarField field = functionField(
      [c = count](const Vec3f& p) {
        ++*c;
        return p.x;
      },
      {.gradient = [](const Vec3f&) {
        return Vec3f{1, 0, 0};
      }});
};

TEST(Memo, EvaluatesASharedPartOnce) {
  const Counter counter;
  const ScalarField shared = memo(counter.field);
  const ScalarField f = shared * shared + sin(shared) + component(vectorField(shared, shared, shared), 1);
  std::mt19937 random(1);
  const Points points = test::randomPoints(kBox, 300, random);
  const auto values = test::evaluate(f, points);
  EXPECT_EQ(*counter.count, 300);
  for (std::size_t i = 0; i < points.size(); ++i)
    ASSERT_NEAR(values.data[0][i], points.x[i] * points.x[i] + std::sin(points.x[i]) + points.x[i], 1e-5);
}

TEST(Memo, ServesGradientsAndThenValues) {
  const Counter counter;
  const ScalarField shared = memo(counter.field);
  const ScalarField f = length(grad(shared)) + shared + shared * 2;
  EXPECT_EQ(f({3, 0, 0}), 10);
  EXPECT_EQ(*counter.count, 1);
}

TEST(Memo, StaysSharedInRestrictedCopies) {
  const Counter counter;
  // Restriction changes what is inside the memo, in every place in the same way.
  const ScalarField shared = memo(max(counter.field, sphere({100, 0, 0}, 1)));
  const ScalarField f = (shared * 2 + abs(shared)).restrictedTo(kBox);
  EXPECT_NE(f.node(), (shared * 2 + abs(shared)).node());
  EXPECT_EQ(f({1, 0, 0}), 3);
  EXPECT_EQ(*counter.count, 1);
}

TEST(Memo, IsNotFooledByOtherPoints) {
  const Counter counter;
  const ScalarField shared = memo(counter.field);
  const ScalarField f = shared + 10 * translate(shared, {1, 0, 0}) + 100 * shared;
  EXPECT_FLOAT_EQ(f({3, 0, 0}), 3 + 20 + 300);
}

TEST(Memo, ManyMemosShareTheirPlaces) {
  // More than there are places: results must not be mixed up.
  ScalarField sum = 0;
  for (int i = 0; i < 150; ++i) sum = sum + memo(component(position(), 0) * float(i));
  EXPECT_FLOAT_EQ(sum({2, 0, 0}), 2 * 149 * 150 / 2);
}

TEST(Field, FunctionsMayEvaluateFieldsThemselves) {
  const ScalarField inner = sphere({0, 0, 0}, 2);
  const ScalarField f = functionField([inner](const Vec3f& p) { return 2 * inner(p); }) + inner;
  EXPECT_FLOAT_EQ(f({1, 0, 0}), 3);
  test::checkField(f, kBox, {.gradient = false});
}

TEST(Field, DeepExpressionsGrowTheirScratch) {
  ScalarField f = component(position(), 0);
  for (int i = 0; i < 300; ++i) f = 1 + f * ScalarField(1.0f);
  ScalarField right = component(position(), 0);
  for (int i = 0; i < 300; ++i) right = max(ScalarField(-1.0f), right);
  EXPECT_EQ(f({1, 0, 0}), 301);
  EXPECT_EQ(right({1, 0, 0}), 1);
}

}  // namespace
}  // namespace nephele
