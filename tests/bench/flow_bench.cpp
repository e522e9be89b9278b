// Flows on a box: the projection against the bare transforms that it consists of, and whole scripts, whose
// steps must cost the same however many came before them.
#include <benchmark/benchmark.h>
#include <fftw3.h>

#include <chrono>
#include <string>
#include <vector>

#include "nephele/levelset/felt/grid_functions.h"
#include "nephele/levelset/flow/projection.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/system.h"
#include "nephele/modeling/felt/program.h"

namespace nephele {
namespace {

ProjectionBox cube(int n, Walls walls) {
  return {Lattice::uniform(1.0f / float(n)), {n, n, n}, walls};
}

/// Of a velocity that costs next to nothing.
void projection(benchmark::State& state, Walls walls) {
  const int n = int(state.range(0));
  const VectorField velocity(Vec3f{1, 2, 3});
  for (auto _ : state) benchmark::DoNotOptimize(withoutDivergence(velocity, cube(n, walls)));
  state.SetItemsProcessed(state.iterations() * n * n * n);
}
BENCHMARK_CAPTURE(projection, periodic, Walls::periodic)
    ->Arg(50)
    ->Arg(128)
    ->Arg(256)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(projection, closed, Walls::closed)
    ->Arg(50)
    ->Arg(128)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

/// FFTW's transforms of three fields there and back again, planned and run by itself, on one thread.
void bareTransforms(benchmark::State& state) {
  const int n = int(state.range(0));
  const std::size_t row = std::size_t(n / 2 + 1) * 2, size = row * std::size_t(n) * std::size_t(n);
  std::vector<float*> fields;
  for (int i = 0; i < 3; ++i) fields.push_back(fftwf_alloc_real(size));
  const auto complexAt = [](float* values) { return reinterpret_cast<fftwf_complex*>(values); };
  const fftwf_plan there = fftwf_plan_dft_r2c_3d(n, n, n, fields[0], complexAt(fields[0]), FFTW_ESTIMATE);
  const fftwf_plan back = fftwf_plan_dft_c2r_3d(n, n, n, complexAt(fields[0]), fields[0], FFTW_ESTIMATE);
  for (float* field : fields) std::fill_n(field, size, 0.0f);
  for (auto _ : state)
    parallelFor(3, 1, [&](std::size_t begin, std::size_t) {
      fftwf_execute_dft_r2c(there, fields[begin], complexAt(fields[begin]));
      fftwf_execute_dft_c2r(back, complexAt(fields[begin]), fields[begin]);
    });
  state.SetItemsProcessed(state.iterations() * n * n * n);
  for (float* field : fields) fftwf_free(field);
  fftwf_destroy_plan(there);
  fftwf_destroy_plan(back);
}
BENCHMARK(bareTransforms)->Arg(50)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond)->UseRealTime();

const std::string kSetup =
    "domain region = domain((0,0,0), (10,10,10), 0.2);\nfloat dt = 0.1;\nvector gravity = (0,-1,0);\n"
    "func scalarfield source(vector center) {\n  return mask(1 - (identity() - center) * (identity() - "
    "center));\n}\n"
    "vectorfield velocity = (0,0,0);\n";

/// Hot and cold gas at 50^3, every density sampled in every step (chapter 6 of the notes).
const std::string kHotAndCold =
    kSetup +
    "scalarfield hot = 0.0;\nscalarfield cold = 0.0;\nfor (int step = 0; step < STEPS; step = step + 1) {\n"
    "  hot = bake(advect(hot, velocity, dt) + dt * source((5,2,5)), region);\n"
    "  cold = bake(advect(cold, velocity, dt) + dt * source((5,8,5)), region);\n"
    "  velocity = advect(velocity, velocity, dt) + dt * gravity * (cold - hot);\n"
    "  velocity = tdivfree(velocity, region);\n}\n";

/// A ball of gas whose density is read through a map that is sampled in every step (chapter 8).
const std::string kSelma =
    kSetup +
    "scalarfield initial = source((5,2,5));\nscalarfield density = initial;\nvectorfield map = identity();\n"
    "for (int step = 0; step < STEPS; step = step + 1) {\n"
    "  map = bake(advect(map, velocity, dt), region);\n  density = compose(initial, map);\n"
    "  velocity = advect(velocity, velocity, dt) - dt * gravity * density;\n"
    "  velocity = tdivfree(velocity, region);\n}\n";

void script(benchmark::State& state, std::string text) {
  static const felt::Registry* const functions = [] {
    auto* made = new felt::Registry;
    felt::addModelingFunctions(*made);
    felt::addLevelsetFunctions(*made);
    return made;
  }();
  text.replace(text.find("STEPS"), 5, std::to_string(state.range(0)));
  const felt::Program program("bench.felt", text, *functions);
  felt::Context context;
  for (auto _ : state) benchmark::DoNotOptimize(program.run(context));
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.counters["peak_MB"] = double(peakMemory()) / 1e6;
}
void inSteps(benchmark::internal::Benchmark* benchmark) {
  for (const int steps : {50, 100, 200}) benchmark->Arg(steps);
  benchmark->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
}
BENCHMARK_CAPTURE(script, hot_and_cold, kHotAndCold)->Apply(inSteps);
BENCHMARK_CAPTURE(script, selma, kSelma)->Apply(inSteps);

}  // namespace
}  // namespace nephele

BENCHMARK_MAIN();
