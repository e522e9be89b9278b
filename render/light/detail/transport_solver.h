#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/light/detail/light_sweep.h"
#include "nephele/render/light/detail/scattering_lattice.h"

namespace nephele::detail {

/// Finds the light x = K x + b in a lattice, K a LightSweep and b the light of a first source, as moments.
class TransportSolver {
 public:
  /// Cells away from density whose light is known, too.
  static constexpr int kReach = 1;

  struct Medium {
    /// Per density and cell of the finest lattice.
    float extinction = 1;
    /// Moments of the phase function times albedo, up to a degree.
    std::vector<float> phase;
    std::vector<Ordinate> ordinates;
    /// What comes in along each of the ordinates.
    std::vector<float> inflow;
  };
  /// Adds b to the moments of a lattice's cells.
  using AddFirst = std::function<void(const ScatteringLattice&, const CellRows&, Moments&)>;

  TransportSolver(ScatteringLattice finest, Medium medium);

  /// Ends where an estimate of the relative error is below `tolerance`, or after so many sweeps of the finest
  /// lattice.
  struct Limits {
    int sweeps;
    float tolerance;
  };
  /// `guess`: moments of the light to begin with, the same everywhere. Returns moments of the cells of
  /// finestRows(), see CellRows::momentsAt.
  Moments solve(const std::vector<float>& guess, const AddFirst& addFirst, const Limits& limits,
                const Progress& progress);

  ScatteringLattice& finest() { return levels_[0].lattice; }
  /// Cells with density, and those within reach of them.
  CellRows& finestRows() { return levels_[0].rows; }
  int sweeps() const { return sweeps_; }
  float residual() const { return residual_; }

 private:
  struct Level {
    ScatteringLattice lattice;
    CellRows rows;
    // Of the cells that are kept in `rows`, and what share of its light each takes itself.
    std::vector<float> density, taken;
    std::unique_ptr<LightSweep> sweep;
  };

  void iterate(std::size_t level, Moments& light, const std::function<void(Moments&)>& add, bool hasInflow,
               const Limits& limits, const Progress& progress);
  void addTaken(std::size_t level, const Moments& light, Moments& swept) const;
  void addCoarse(std::size_t level, const Moments& light, Moments& swept, const Progress& progress);

  void extrapolate(const Moments& coarser, Moments& light) const;

  Medium medium_;
  // Each stays where it is: its sweep refers to it.
  std::deque<Level> levels_;
  std::size_t moments_;
  int sweeps_ = 0;
  float residual_ = 0;
};

}  // namespace nephele::detail
