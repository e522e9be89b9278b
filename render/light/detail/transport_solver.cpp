// Lattices from fine to coarse. The light begins on the coarsest, and goes on where the coarser one ended. On
// every lattice a sweep leaves a remainder f, and what is missing, e = K e + f, is smooth: it is found on the
// next coarser lattice, in the same way, and added. What is not smooth stays in deep cells for several
// sweeps: a cell that takes a share k of its own light makes r / (1 - k) of what a sweep adds, r, and that is
// added at once (Olson, Auer and Buchler, "A rapidly convergent iterative solution of the non-LTE line
// radiation transfer problem", 1986). Anderson's acceleration mends what both get wrong. (Full multigrid,
// Brandt 1977.)
#include "nephele/render/light/detail/transport_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/anderson.h"
#include "nephele/render/light/exp_of_minus.h"

namespace nephele::detail {

namespace {

constexpr int kCoarsest = 24;
// What is missing need not be known well.
constexpr int kSweepsOfError = 2, kSweepsOfCoarsest = 40;
constexpr float kToleranceOfError = 0.2f;
// Sweeps of coarser lattices cost little, and what they leave would have to be mended on finer ones.
constexpr float kTightened = 0.5f;
// What cells half as wide change is this many times what the error that is left is: 1 / (2^p - 1) times for
// one that falls with their width to the power p, which measures between 1 and 2.
constexpr float kExtrapolated = 0.5f;

// Means over the cells that a coarse one holds, weighed by their density, of what `values` have more than
// `before`.
void restrict(const float* values, const float* before, const CellRows& fine,
              const std::vector<float>& fineDensity, const CellRows& coarse,
              const std::vector<float>& coarseDensity, std::size_t moments, float* out) {
  constexpr int vector = CellRows::kVector;
  const Vec3i n = fine.size();
  coarse.forEachRow([&](int y, int z, const CellRows::Row& row) {
    const std::size_t begin = CellRows::momentsAt(std::size_t(row.first + row.begin), moments),
                      end = CellRows::momentsAt(std::size_t(row.first + row.end), moments);
    std::fill(out + begin, out + end, 0.0f);
    for (int k = 2 * z; k < std::min(2 * z + 2, n.z); ++k)
      for (int j = 2 * y; j < std::min(2 * y + 2, n.y); ++j) {
        const CellRows::Row& from = fine.row(j, k);
        for (int x = std::max<int>(from.begin, 2 * row.begin); x < std::min<int>(from.end, 2 * row.end);
             ++x) {
          const std::size_t cell = std::size_t(from.first + x);
          const float density = fineDensity[cell];
          if (!(density > 0)) continue;
          const std::size_t at = CellRows::momentsAt(cell, moments);
          float* to = out + CellRows::momentsAt(std::size_t(row.first + x / 2), moments);
          if (before)
            for (std::size_t i = 0; i != moments * vector; i += vector)
              to[i] += density * (values[at + i] - before[at + i]);
          else
            for (std::size_t i = 0; i != moments * vector; i += vector) to[i] += density * values[at + i];
        }
      }
    for (int x = row.begin; x != row.end; ++x) {
      const std::size_t cell = std::size_t(row.first + x);
      const float density = coarseDensity[cell];
      float* to = out + CellRows::momentsAt(cell, moments);
      for (std::size_t i = 0; i != moments * vector; i += vector)
        to[i] = density > 0 ? to[i] / (8 * density) : 0.0f;
    }
  });
}

// What share of the light that comes from all over a cell it takes itself, see light_sweep.cpp.
float takenShare(float depth) {
  return depth < 0.03f ? depth * (0.5f - depth / 6) : 1 - (1 - expOfMinus(depth)) / depth;
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
  levels_.push_back({std::move(finest), {}, {}, {}, nullptr});
  // Without scattering one sweep tells all.
  if (medium_.phase[0] > 0)
    while (levels_.back().lattice.longest() > kCoarsest)
      levels_.push_back({halved(levels_.back().lattice), {}, {}, {}, nullptr});
  float extinction = medium_.extinction;
  for (Level& level : levels_) {
    level.rows = CellRows(level.lattice.size, surroundings(level.lattice, kReach));
    level.density = level.rows.kept(level.lattice.density);
    level.sweep = std::make_unique<LightSweep>(level.rows, level.density, extinction, medium_.phase,
                                               medium_.ordinates, medium_.inflow);
    level.taken.resize(level.density.size());
    forEach(level.taken.size(), [&](std::size_t i) {
      // The eight mirror images of a direction follow each other.
      for (std::size_t n = 0; n != medium_.ordinates.size(); n += 8) {
        const auto& [way, weight] = medium_.ordinates[n];
        const float along = std::max({std::fabs(way.x), std::fabs(way.y), std::fabs(way.z)});
        level.taken[i] += 8 * weight * takenShare(std::min(extinction * level.density[i] / along, 80.0f));
      }
    });
    extinction *= 2;
  }
}

Moments TransportSolver::solve(const std::vector<float>& guess, const AddFirst& addFirst,
                               const Limits& limits, const Progress& progress) {
  Moments light, coarser;
  for (std::size_t level = levels_.size(); level-- != 0;) {
    const Level& here = levels_[level];
    const std::size_t cells = here.rows.count();
    Moments begun;
    resizeLarge(begun, moments_ * cells);
    if (level + 1 == levels_.size())
      forEach(begun.size(), [&](std::size_t i) { begun[i] = guess[i / CellRows::kVector % moments_]; });
    else
      refine(light.data(), levels_[level + 1].rows, here.rows, moments_, begun.data());
    coarser = std::move(light);
    light = std::move(begun);
    iterate(
        level, light, [&](Moments& moments) { addFirst(here.lattice, here.rows, moments); }, true,
        level == 0 ? limits : Limits{kSweepsOfCoarsest, kTightened * limits.tolerance}, progress);
  }
  if (levels_.size() > 1) extrapolate(coarser, light);
  return light;
}

void TransportSolver::extrapolate(const Moments& coarser, Moments& light) const {
  const Level &fine = levels_[0], &coarse = levels_[1];
  const std::size_t cells = fine.rows.count(), coarseCells = coarse.rows.count();
  std::vector<float> holds(coarseCells), near(cells);
  Moments change(coarser.size()), grown;
  resizeLarge(grown, light.size());
  forEach(coarseCells, [&](std::size_t i) { holds[i] = coarse.density[i] > 0; });
  refine(holds.data(), coarse.rows, fine.rows, 1, near.data());
  restrict(light.data(), nullptr, fine.rows, fine.density, coarse.rows, coarse.density, moments_,
           change.data());
  forEach(coarseCells, [&](std::size_t i) {
    for (std::size_t m = 0, at = CellRows::momentsAt(i, moments_); m != moments_;
         ++m, at += CellRows::kVector)
      change[at] = holds[i] > 0 ? change[at] - coarser[at] : 0.0f;
  });
  refine(change.data(), coarse.rows, fine.rows, moments_, grown.data());
  const std::vector<float> beam = fine.rows.kept(fine.lattice.beam);
  forEach(cells, [&](std::size_t i) {
    if (!(near[i] > 0)) return;
    const std::size_t at = CellRows::momentsAt(i, moments_);
    const float share = kExtrapolated / near[i], most = 0.5f * std::max(light[at] - beam[i], 0.0f),
                by = share * std::fabs(grown[at]), limited = by > most ? share * most / by : share;
    for (std::size_t m = 0; m != moments_ * CellRows::kVector; m += CellRows::kVector)
      light[at + m] += limited * grown[at + m];
  });
}

void TransportSolver::iterate(std::size_t level, Moments& light, const std::function<void(Moments&)>& add,
                              bool hasInflow, const Limits& limits, const Progress& progress) {
  Anderson anderson(levels_[level].density, moments_);
  Moments swept;
  resizeLarge(swept, light.size());
  for (int sweep = 1;; ++sweep) {
    progress.check();
    levels_[level].sweep->sweep(light, swept, hasInflow);
    add(swept);
    if (!(medium_.phase[0] > 0)) {
      light = std::move(swept);
      return;
    }
    if (level + 1 != levels_.size())
      addCoarse(level, light, swept, progress);
    else
      addTaken(level, light, swept);
    const float change = anderson.step(light, swept);
    if (level == 0) {
      sweeps_ = sweep;
      residual_ = change;
      progress.advance(double(sweep) / limits.sweeps);
    }
    if (sweep == limits.sweeps || change < limits.tolerance) return;
  }
}

// Adds to what was swept what becomes of it in its own cell.
void TransportSolver::addTaken(std::size_t level, const Moments& light, Moments& swept) const {
  const std::vector<float>& taken = levels_[level].taken;
  forEach(taken.size(), [&](std::size_t i) {
    std::size_t at = CellRows::momentsAt(i, moments_);
    for (std::size_t m = 0; m != moments_; ++m, at += CellRows::kVector)
      swept[at] =
          light[at] + (swept[at] - light[at]) / (1 - taken[i] * medium_.phase[std::size_t(degreeOf(int(m)))]);
  });
}

// Adds to what was swept what is still missing of it.
void TransportSolver::addCoarse(std::size_t level, const Moments& light, Moments& swept,
                                const Progress& progress) {
  const Level &fine = levels_[level], &coarse = levels_[level + 1];
  Moments rest(moments_ * coarse.rows.count());
  restrict(swept.data(), light.data(), fine.rows, fine.density, coarse.rows, coarse.density, moments_,
           rest.data());
  Moments missing = rest, known(rest.size());
  addTaken(level, light, swept);
  restrict(swept.data(), light.data(), fine.rows, fine.density, coarse.rows, coarse.density, moments_,
           known.data());
  iterate(
      level + 1, missing,
      [&](Moments& moments) { forEach(moments.size(), [&](std::size_t i) { moments[i] += rest[i]; }); },
      false, {level + 2 == levels_.size() ? kSweepsOfCoarsest : kSweepsOfError, kToleranceOfError}, progress);
  forEach(missing.size(), [&](std::size_t i) { missing[i] -= known[i]; });
  refine(missing.data(), coarse.rows, fine.rows, moments_, swept.data(), true);
}

}  // namespace nephele::detail
