// Lattices from fine to coarse. The light begins on the coarsest, and goes on where the coarser one ended. On
// every lattice a sweep leaves a remainder f, and what is missing, e = K e + f, is smooth: it is found on the
// next coarser lattice, in the same way, and added. Anderson's acceleration mends what the coarse lattices
// get wrong. (Full multigrid, Brandt 1977, with sweeps in place of relaxation.)
#include "nephele/render/light/detail/transport_solver.h"

#include <algorithm>
#include <utility>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/anderson.h"

namespace nephele::detail {

namespace {

constexpr int kCoarsest = 24;
// What is missing need not be known well.
constexpr int kSweepsOfError = 2, kSweepsOfCoarsest = 40;
constexpr float kToleranceOfError = 0.1f;

// Means over the cells that a coarse one holds, weighed by their density.
void restrict(const float* values, const ScatteringLattice& fine, const ScatteringLattice& coarse,
              float* out) {
  const Vec3i n = fine.size;
  parallelFor(std::size_t(coarse.size.z), 16, [&](std::size_t begin, std::size_t end) {
    const std::size_t plane = std::size_t(coarse.size.x) * std::size_t(coarse.size.y);
    std::fill(out + begin * plane, out + end * plane, 0.0f);
    for (int z = 2 * int(begin); z < std::min(2 * int(end), n.z); ++z)
      for (int y = 0; y != n.y; ++y)
        for (int x = 0; x != n.x; ++x) {
          const std::size_t i = fine.index(x, y, z);
          out[coarse.index(x / 2, y / 2, z / 2)] += fine.density[i] * values[i];
        }
    for (std::size_t i = begin * plane; i != end * plane; ++i)
      out[i] = coarse.density[i] > 0 ? out[i] / (8 * coarse.density[i]) : 0.0f;
  });
}

// Elements of long vectors, on all cores.
template <class Each>
void forEach(std::size_t count, Each&& each) {
  parallelFor(count, 1 << 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) each(i);
  });
}

}  // namespace

TransportSolver::TransportSolver(ScatteringLattice finest, Medium medium)
    : medium_(std::move(medium)), moments_(medium_.phase.size() * medium_.phase.size()) {
  levels_.push_back({std::move(finest), nullptr});
  // Without scattering one sweep tells all.
  if (medium_.phase[0] > 0)
    while (levels_.back().lattice.longest() > kCoarsest)
      levels_.push_back({halved(levels_.back().lattice), nullptr});
  float extinction = medium_.extinction;
  for (Level& level : levels_) {
    level.sweep = std::make_unique<LightSweep>(level.lattice, extinction, medium_.phase, medium_.ordinates,
                                               medium_.inflow, surroundings(level.lattice, 2));
    extinction *= 2;
  }
}

std::vector<float> TransportSolver::solve(const std::vector<float>& guess, const AddFirst& addFirst,
                                          const Limits& limits, const Progress& progress) {
  std::vector<float> light;
  for (std::size_t level = levels_.size(); level-- != 0;) {
    const ScatteringLattice& lattice = levels_[level].lattice;
    const std::size_t cells = lattice.density.size();
    std::vector<float> begun(moments_ * cells);
    for (std::size_t m = 0; m != moments_; ++m)
      if (level + 1 == levels_.size())
        std::fill_n(begun.begin() + std::ptrdiff_t(m * cells), cells, guess[m]);
      else
        refine(light.data() + m * levels_[level + 1].lattice.density.size(), levels_[level + 1].lattice,
               lattice, begun.data() + m * cells);
    light = std::move(begun);
    const float wider = float(lattice.factor) / float(finest().factor);
    iterate(
        level, light, [&](std::vector<float>& moments) { addFirst(lattice, wider, moments); }, true,
        {level == 0 ? limits.sweeps : kSweepsOfCoarsest, limits.tolerance}, progress);
  }
  return light;
}

void TransportSolver::iterate(std::size_t level, std::vector<float>& light,
                              const std::function<void(std::vector<float>&)>& add, bool hasInflow,
                              const Limits& limits, const Progress& progress) {
  Anderson anderson(levels_[level].lattice.density);
  std::vector<float> swept(light.size());
  for (int sweep = 1;; ++sweep) {
    progress.check();
    levels_[level].sweep->sweep(light, swept, hasInflow);
    add(swept);
    if (!(medium_.phase[0] > 0)) {
      light = std::move(swept);
      return;
    }
    if (level + 1 != levels_.size()) addCoarse(level, light, swept, progress);
    const float change = anderson.step(light, swept);
    if (level == 0) {
      sweeps_ = sweep;
      residual_ = change;
      progress.advance(double(sweep) / limits.sweeps);
    }
    if (sweep == limits.sweeps || change < limits.tolerance) return;
  }
}

// Adds to what was swept what is still missing of it.
void TransportSolver::addCoarse(std::size_t level, const std::vector<float>& light, std::vector<float>& swept,
                                const Progress& progress) {
  const ScatteringLattice &fine = levels_[level].lattice, &coarse = levels_[level + 1].lattice;
  const std::size_t cells = fine.density.size(), coarseCells = coarse.density.size();
  std::vector<float> rest(moments_ * coarseCells), buffer(cells);
  for (std::size_t m = 0; m != moments_; ++m) {
    const float *before = light.data() + m * cells, *after = swept.data() + m * cells;
    forEach(cells, [&](std::size_t i) { buffer[i] = after[i] - before[i]; });
    restrict(buffer.data(), fine, coarse, rest.data() + m * coarseCells);
  }
  std::vector<float> missing = rest;
  iterate(
      level + 1, missing,
      [&](std::vector<float>& moments) {
        forEach(moments.size(), [&](std::size_t i) { moments[i] += rest[i]; });
      },
      false, {level + 2 == levels_.size() ? kSweepsOfCoarsest : kSweepsOfError, kToleranceOfError}, progress);
  forEach(missing.size(), [&](std::size_t i) { missing[i] -= rest[i]; });
  for (std::size_t m = 0; m != moments_; ++m) {
    refine(missing.data() + m * coarseCells, coarse, fine, buffer.data());
    float* after = swept.data() + m * cells;
    forEach(cells, [&](std::size_t i) { after[i] += buffer[i]; });
  }
}

}  // namespace nephele::detail
