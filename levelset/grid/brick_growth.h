#pragma once

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/levelset/grid/sparse_bricks.h"
#include "nephele/modeling/base/progress.h"

/// Sparse grids whose extent is found while they are computed. For the implementation of advection.
namespace nephele::detail {

/// World positions of the own samples of `brick`, x fastest.
struct BrickPoints {
  std::array<float, kBrickSamples> x, y, z;
  BrickPoints() = default;
  BrickPoints(const Lattice& lattice, const Vec3i& brick);
  Vec3f operator[](int i) const { return {x[std::size_t(i)], y[std::size_t(i)], z[std::size_t(i)]}; }
  void set(int i, const Vec3f& p) {
    x[std::size_t(i)] = p.x, y[std::size_t(i)] = p.y, z[std::size_t(i)] = p.z;
  }
};

/// Bricks and `components` times kBrickSamples samples of each, one component after the other.
struct GrownBricks {
  explicit GrownBricks(int componentCount)
      : components(componentCount), samples("advection", std::size_t(componentCount) * kBrickSamples) {}

  int components;
  /// Those of `bricks`.
  SparseBricks<float> samples;
  /// First those that were found to matter, then those that stand beside them.
  std::vector<Vec3i> bricks;
};

struct GrowthOptions {
  int components = 1;
  /// Keep the 26 neighbours of the bricks that matter, too.
  bool withNeighbours = false;
  /// Memory that the samples and the grids made of them may take.
  double mostBytes = std::numeric_limits<double>::infinity();
};

/// Fills the samples of a brick and says whether the brick matters. Called from several threads.
using EvaluateBrick = std::function<bool(const Vec3i& brick, float* samples)>;

/// Evaluates `seeds`, then the neighbours of bricks that matter, until none that matters is left outside: all
/// of a connected region is found from any brick in it. The result does not depend on the threads.
/// @throws Error if that takes more than `mostBytes`; Cancelled.
GrownBricks growBricks(const std::vector<Vec3i>& seeds, const GrowthOptions& options,
                       const EvaluateBrick& evaluate, const Progress& progress);

/// What interpolation reads where no brick stands.
enum class Beyond {
  background,  ///< The background.
  nearest,     ///< The nearest sample of the brick that is read.
};

/// One grid for each component. Every brick gets a place of its own in the pool, in the order of the table,
/// unless it and all that its borders read is one background.
std::vector<std::shared_ptr<BrickGrid>> assembleGrids(const GrownBricks& grown, const Lattice& lattice,
                                                      std::span<const float> backgrounds, Beyond beyond);

}  // namespace nephele::detail
