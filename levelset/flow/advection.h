#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "nephele/levelset/flow/flow_map.h"

/// Carrying grids along with a velocity. docs/advect.md compares the methods.
namespace nephele {

enum class AdvectionMethod {
  /// Every voxel is traced back through all steps and reads the first grid: full detail, time per step grows
  /// with the steps before.
  gridless,
  /// The map is carried, the first grid read through it once: nearly the same detail, constant time per step.
  selma,
  /// The grid itself is carried and interpolated in every step: it blurs.
  grid,
};

/// How AdvectionMethod::grid makes a step.
enum class GridScheme {
  /// rho(x - u dt), trilinear.
  plain,
  /// Adds half of what a step there and back again loses; limited to the samples that the plain step reads.
  macCormack,
  /// Takes half of that loss off beforehand, then makes a plain step; limited likewise.
  bfecc,
};

/// The velocity of step 0, 1, ..., world units per unit of time. Called in this order, once per step.
using VelocityOfStep = std::function<VectorField(int step)>;

struct AdvectionOptions {
  AdvectionMethod method = AdvectionMethod::selma;
  GridScheme scheme = GridScheme::macCormack;
  /// 0 or more.
  int steps = 1;
  /// Time of one step; negative runs backwards. Must be finite.
  float dt = 1.0f;
  /// Edge of the map's voxels in those of the finest grid, 1 to 64; selma only.
  float mapCoarseness = 1.0f;
  /// selma: bake the grids and start a new map as soon as more than this share of the map has folded; 0 to 1.
  /// Not given: never.
  std::optional<double> rebakeShare = 0.05;
  /// Memory that grids and maps may take. How far matter spreads is seen on the way only.
  double mostBytes = std::numeric_limits<double>::infinity();
  /// selma: the map to go on from; the grids are those that it started with.
  std::optional<FlowMap> startMap{};
};

/// What one step of selma or grid did.
struct AdvectionStep {
  double seconds = 0;
  /// Bricks that were kept, of the map or of all grids.
  std::size_t bricks = 0;
  std::size_t memoryBytes = 0;
  /// Share of the map that has folded; selma only.
  double foldedShare = 0;
  bool rebaked = false;
};

struct AdvectedGrids {
  /// In the order of those given, on the same voxels.
  std::vector<std::shared_ptr<const BrickGrid>> grids;
  /// The map from now to the start, or to the last rebake; selma only.
  std::optional<FlowMap> map;
  std::vector<AdvectionStep> steps;
};

/// Carries all `grids` along. They may stand on voxels of their own, turned ones too.
///
/// Results are sparse: bricks exist where something arrives. Values are interpolated (gridless, selma:
/// Catmull-Rom within the eight samples around) and never leave what a grid held; level sets keep their zero
/// surface but are no distances afterwards. Vectors are carried component by component, without being turned.
/// All cores; the same bits at any thread count.
/// @throws Error if no grid holds anything, an option is outside its range, the velocity is not finite or
/// moves matter by more than kLongestStep voxels in a step, or matter spreads over more than `mostBytes`
/// hold; Cancelled.
///
/// Source: Tessendorf, Resolution Independent Volumes, chapters 7 and 8; A. Selle and others, An
/// Unconditionally Stable MacCormack Method (2008); T. Dupont and Y. Liu, Back and Forth Error Compensation
/// and Correction Methods (2003).
AdvectedGrids advectGrids(std::vector<std::shared_ptr<const BrickGrid>> grids, const VelocityOfStep& velocity,
                          const AdvectionOptions& options, const Progress& progress = silent());
/// The same with a velocity that stays.
AdvectedGrids advectGrids(std::vector<std::shared_ptr<const BrickGrid>> grids, const VectorField& velocity,
                          const AdvectionOptions& options, const Progress& progress = silent());

/// `grid` read through `map`, on its own voxels: what advectGrids does last with selma.
/// @throws Error if the result takes more than `mostBytes`; Cancelled.
std::shared_ptr<const BrickGrid> throughMap(const std::shared_ptr<const BrickGrid>& grid, const FlowMap& map,
                                            const Matter& matter,
                                            double mostBytes = std::numeric_limits<double>::infinity(),
                                            const Progress& progress = silent());

/// Memory that `advectGrids` needs, bytes, if matter spreads to about twice the bricks that it fills now.
/// @throws Error if no grid holds anything, as advectGrids does.
double estimatedAdvectionBytes(const std::vector<std::shared_ptr<const BrickGrid>>& grids,
                               const AdvectionOptions& options);

}  // namespace nephele
