// The same expression of 16 cheap nodes as a tree of virtual calls per point and as a field in blocks of 256.
// Both give the same values; items per second are points. The ratio of the first two rows is the gain of
// blocks.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

constexpr std::size_t kPoints = 1 << 14;

/// What block evaluation is measured against: one virtual call per node and point.
struct PointNode {
  virtual ~PointNode() = default;
  virtual float at(const Vec3f& p) const = 0;
};
using PointTree = std::unique_ptr<const PointNode>;

template <class F>
struct Leaf final : PointNode {
  explicit Leaf(F f) : f_(std::move(f)) {}
  float at(const Vec3f& p) const override { return f_(p); }
  F f_;
};
template <class F>
struct One final : PointNode {
  One(F f, PointTree a) : f_(std::move(f)), a_(std::move(a)) {}
  float at(const Vec3f& p) const override { return f_(a_->at(p)); }
  F f_;
  PointTree a_;
};
template <class F>
struct Two final : PointNode {
  Two(F f, PointTree a, PointTree b) : f_(std::move(f)), a_(std::move(a)), b_(std::move(b)) {}
  float at(const Vec3f& p) const override { return f_(a_->at(p), b_->at(p)); }
  F f_;
  PointTree a_, b_;
};
template <class F>
PointTree leaf(F f) {
  return std::make_unique<Leaf<F>>(std::move(f));
}
template <class F>
PointTree one(F f, PointTree a) {
  return std::make_unique<One<F>>(std::move(f), std::move(a));
}
template <class F>
PointTree two(F f, PointTree a, PointTree b) {
  return std::make_unique<Two<F>>(std::move(f), std::move(a), std::move(b));
}

PointTree pointSphere(const Vec3f& c, float r) {
  return leaf([=](const Vec3f& p) { return r - length(p - c); });
}
PointTree pointConstant(float v) {
  return leaf([=](const Vec3f&) { return v; });
}

// 16 nodes: 3 spheres, a box, a plane, 2 constants, max, max, min, abs, subtract, multiply, abs, sqrt, add.
PointTree pointTree() {
  const auto larger = [](float a, float b) { return a > b ? a : b; };
  const auto smaller = [](float a, float b) { return a < b ? a : b; };
  PointTree cube = leaf([](const Vec3f& p) {
    const Vec3f q{std::fabs(p.x) - 0.8f, std::fabs(p.y) - 0.8f, std::fabs(p.z) - 0.8f};
    const float inside = std::fmin(std::fmax(std::fmax(q.x, q.y), q.z), 0.0f);
    return -(length(max(q, Vec3f{})) + inside);
  });
  PointTree half = leaf([](const Vec3f& p) { return p.y + 0.2f; });
  PointTree shapes = two(larger, two(larger, pointSphere({0, 0, 0}, 1), pointSphere({1, 0, 0}, 0.7f)),
                         pointSphere({0, 1, 0}, 0.5f));
  PointTree cut = two(smaller, std::move(shapes), std::move(cube));
  PointTree distance = one([](float a) { return std::fabs(a); }, std::move(cut));
  PointTree thick = two([](float a, float b) { return a - b; }, pointConstant(3), std::move(distance));
  PointTree scaled = two([](float a, float b) { return a * b; }, std::move(thick), pointConstant(0.5f));
  PointTree root =
      one([](float a) { return std::sqrt(a); }, one([](float a) { return std::fabs(a); }, std::move(scaled)));
  return two([](float a, float b) { return a + b; }, std::move(root), std::move(half));
}

ScalarField fieldTree() {
  const ScalarField shapes = max(max(sphere({0, 0, 0}, 1), sphere({1, 0, 0}, 0.7f)), sphere({0, 1, 0}, 0.5f));
  const ScalarField cut = min(shapes, box(Box{{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}));
  const ScalarField half = plane({0, -0.2f, 0}, {0, 1, 0});
  return sqrt(abs((3 - abs(cut)) * 0.5f)) + half;
}

struct Data {
  std::vector<float> x, y, z, values, gx, gy, gz;
  Data() {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> coordinate(-2, 2);
    for (auto* lane : {&x, &y, &z, &values, &gx, &gy, &gz}) lane->resize(kPoints);
    for (auto* lane : {&x, &y, &z})
      for (float& v : *lane) v = coordinate(random);
  }
  PointSpans points() const { return {x, y, z}; }
};

void VirtualCallPerPoint(benchmark::State& state) {
  Data data;
  const PointTree tree = pointTree();
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPoints; ++i) data.values[i] = tree->at({data.x[i], data.y[i], data.z[i]});
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}
BENCHMARK(VirtualCallPerPoint);

void FieldInBlocks(benchmark::State& state) {
  Data data;
  const ScalarField field = fieldTree();
  for (auto _ : state) {
    field.eval(data.points(), data.values);
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
  const PointTree tree = pointTree();
  for (std::size_t i = 0; i < kPoints; ++i)
    if (!(std::fabs(data.values[i] - tree->at({data.x[i], data.y[i], data.z[i]})) < 1e-5f))
      state.SkipWithError("the two forms of the expression differ");
}
BENCHMARK(FieldInBlocks);

void FieldWithGradient(benchmark::State& state) {
  Data data;
  const ScalarField field = fieldTree();
  for (auto _ : state) {
    field.evalGrad(data.points(), data.values, {{data.gx, data.gy, data.gz}});
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}
BENCHMARK(FieldWithGradient);

void FieldPointByPoint(benchmark::State& state) {
  Data data;
  const ScalarField field = fieldTree();
  for (auto _ : state)
    for (std::size_t i = 0; i < 256; ++i) benchmark::DoNotOptimize(field({data.x[i], data.y[i], data.z[i]}));
  state.SetItemsProcessed(state.iterations() * 256);
}
BENCHMARK(FieldPointByPoint);

template <class Operation>
void function(benchmark::State& state, Operation operation) {
  Data data;
  const ScalarField field = operation(component(position(), 0));
  for (auto _ : state) {
    field.eval(data.points(), data.values);
    benchmark::DoNotOptimize(data.values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}
BENCHMARK_CAPTURE(function, position, [](const ScalarField& f) { return f; });
BENCHMARK_CAPTURE(function, sqrt, [](const ScalarField& f) { return sqrt(f); });
BENCHMARK_CAPTURE(function, floor, [](const ScalarField& f) { return floor(f); });
BENCHMARK_CAPTURE(function, exp, [](const ScalarField& f) { return exp(f); });
BENCHMARK_CAPTURE(function, log, [](const ScalarField& f) { return log(f); });
BENCHMARK_CAPTURE(function, sin, [](const ScalarField& f) { return sin(f); });
BENCHMARK_CAPTURE(function, pow, [](const ScalarField& f) { return pow(f, 0.67f); });

void Range(benchmark::State& state) {
  const ScalarField field = fieldTree();
  const Box box{{0.1f, 0.2f, 0.3f}, {0.2f, 0.3f, 0.4f}};
  for (auto _ : state) benchmark::DoNotOptimize(field.range(box));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(Range);

void Restriction(benchmark::State& state) {
  const ScalarField field = fieldTree();
  const Box box{{0.1f, 0.2f, 0.3f}, {0.2f, 0.3f, 0.4f}};
  for (auto _ : state) benchmark::DoNotOptimize(field.restrictedTo(box));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(Restriction);

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();
