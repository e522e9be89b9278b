// A script only builds expressions, so that its fields cost what the same expressions cost in C++: the first
// two rows, whose items are points, belong together. Then what it takes to read a script of 1000 lines, and
// to know all functions.
#include <benchmark/benchmark.h>

#include <random>
#include <string>
#include <vector>

#include "nephele/modeling/cloud/surface_point.h"
#include "nephele/modeling/felt/program.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

constexpr std::size_t kPoints = 1 << 14;

const felt::Registry& functions() {
  static const felt::Registry* const registry = [] {
    auto* made = new felt::Registry;
    felt::addModelingFunctions(*made);
    return made;
  }();
  return *registry;
}

ScalarField fromScript() {
  const felt::Program program(
      "bench.felt",
      "scalarfield base = sphere((0,0,0), 1);\n"
      "scalarfield bumps = 0.1 * abs(perlin(4, seed = 7));\n"
      "scalarfield cloud = base + compose(bumps, levelsetsurface(base, 5));\n"
      "scalarfield density = mask(cloud, 0.02) * lerp(0.5, 1, clamp(identity().y, 0, 1));\n",
      functions());
  felt::Context context;
  return program.run(context).back().value.as<ScalarField>();
}

ScalarField fromCode() {
  // As in the script, what is read twice is remembered.
  const ScalarField base = memo(sphere({0, 0, 0}, 1));
  const ScalarField bumps = 0.1f * abs(perlin({.frequency = 4, .seed = 7}));
  const ScalarField cloud = base + compose(bumps, surfacePoint(base));
  const ScalarField a(0.5f), b(1.0f);
  return mask(cloud, 0.02f) *
         (a + (b - a) * clamp(component(identity(), 1), ScalarField(0.0f), ScalarField(1.0f)));
}

void evaluate(benchmark::State& state, const ScalarField& field) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> coordinate(-1.2f, 1.2f);
  std::vector<float> x(kPoints), y(kPoints), z(kPoints), values(kPoints);
  for (std::size_t i = 0; i < kPoints; ++i)
    x[i] = coordinate(random), y[i] = coordinate(random), z[i] = coordinate(random);
  for (auto _ : state) {
    field.eval({x, y, z}, values);
    benchmark::DoNotOptimize(values.data());
  }
  state.SetItemsProcessed(state.iterations() * std::int64_t(kPoints));
}

void fieldOfScript(benchmark::State& state) {
  evaluate(state, fromScript());
}
BENCHMARK(fieldOfScript);

void fieldOfCode(benchmark::State& state) {
  evaluate(state, fromCode());
}
BENCHMARK(fieldOfCode);

void check1000Lines(benchmark::State& state) {
  std::string script;
  for (int i = 0; i < 250; ++i) {
    const std::string n = std::to_string(i);
    script += "func scalarfield layer" + n + "(scalarfield l, float a = 0.1) {\n";
    script += "  return l + a * abs(perlin(frequency = " + n + ".5, seed = " + n + "));\n}\n";
    script += "scalarfield f" + n + " = layer" + n + "(sphere((0, 0, " + n + "), 1), 0.2);\n";
  }
  for (auto _ : state) {
    const felt::Program program("bench.felt", script, functions());
    benchmark::DoNotOptimize(&program);
  }
  state.SetItemsProcessed(state.iterations() * 1000);
}
BENCHMARK(check1000Lines)->Unit(benchmark::kMillisecond);

void registerFunctions(benchmark::State& state) {
  for (auto _ : state) {
    felt::Registry registry;
    felt::addModelingFunctions(registry);
    benchmark::DoNotOptimize(&registry);
  }
}
BENCHMARK(registerFunctions)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();
