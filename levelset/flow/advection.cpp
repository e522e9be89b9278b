// Advection of grids, three ways, all on bricks that are found as matter arrives
// (levelset/grid/brick_growth.h).
//
// Gridless: each voxel is traced back through all steps and reads the first grid there. SELMA: the map is
// carried (levelset/flow/flow_map.h) and each voxel reads the first grid through it. Grid: each step reads
// the grid of the step before; MacCormack and BFECC trace the result back to see what the step lost.
// (Tessendorf, Resolution Independent Volumes, chapters 7 and 8.)
//
// Reading the first grid is Catmull-Rom, cut off at the least and the largest of the eight samples around:
// nothing rings, constants stay, level sets do not leave their band. The gridded steps are trilinear, cut off
// likewise where they correct themselves.
//
// Limits: samples are points, so filaments thinner than a voxel come and go between voxels.
#include "nephele/levelset/flow/advection.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "nephele/levelset/flow/detail/flow_seeds.h"
#include "nephele/levelset/flow/detail/kept_bricks.h"
#include "nephele/levelset/grid/brick_growth.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

using detail::BrickPoints;
using GridHandle = std::shared_ptr<const BrickGrid>;
using Samples = std::array<float, kBrickSamples>;

/// Values of the gridded methods nearer to the background than this share of the grid's spread are the
/// background: blurred rims would spread by a voxel in every step.
constexpr float kNothing = 1e-6f;

void evaluate(const VectorField& field, const BrickPoints& at, BrickPoints& result) {
  Spans<3> spans;
  spans.lanes = {std::span<float>(result.x), std::span<float>(result.y), std::span<float>(result.z)};
  field.eval({at.x, at.y, at.z}, spans);
}

void evaluate(const ScalarField& field, const BrickPoints& at, float* values) {
  field.eval({at.x, at.y, at.z}, std::span<float>(values, kBrickSamples));
}

/// Cuts `value` off at the least and the largest of the eight samples around a point.
float withinCell(const BrickGrid& grid, const Vec3f& point, float value) {
  const Vec3f q = grid.worldToIndex()(point);
  constexpr float kFar = 1e9f;
  const bool isNear = q.x > -kFar && q.x < kFar && q.y > -kFar && q.y < kFar && q.z > -kFar && q.z < kFar;
  if (!isNear) return grid.background();
  const Vec3i cell{int(std::floor(q.x)), int(std::floor(q.y)), int(std::floor(q.z))};
  const std::int32_t pool = grid.poolIndex(brickOf(cell));
  if (pool == 0) return grid.background();
  const float* corner =
      grid.brick(pool) + sampleOffset(insideBrick(cell.x), insideBrick(cell.y), insideBrick(cell.z));
  float low = corner[0], high = corner[0];
  for (int k = 1; k < 8; ++k) {
    const float sample = corner[((k >> 2) * BrickGrid::kWidth + (k >> 1 & 1)) * BrickGrid::kWidth + (k & 1)];
    low = std::min(low, sample);
    high = std::max(high, sample);
  }
  return std::clamp(value, low, high);
}

/// A grid to read from.
struct Source {
  GridHandle grid;
  ScalarField field;

  Source(GridHandle handle, Interpolation interpolation)
      : grid(std::move(handle)), field(gridField(grid, interpolation)) {}

  void read(const BrickPoints& at, float* values) const {
    evaluate(field, at, values);
    for (int i = 0; i < kBrickSamples; ++i) values[i] = withinCell(*grid, at[i], values[i]);
  }
};

bool holdsOther(const float* samples, float background) {
  return !std::all_of(samples, samples + kBrickSamples, [&](float v) { return v == background; });
}

std::vector<Vec3i> overlapping(const std::vector<Vec3i>& bricks, const Lattice& from, const Lattice& to) {
  if (from.indexToWorld.linear == to.indexToWorld.linear &&
      from.indexToWorld.translation == to.indexToWorld.translation)
    return bricks;
  std::vector<Vec3i> result;
  for (const Vec3i& brick : bricks) {
    Box box;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3i voxel = (brick + Vec3i{corner & 1, corner >> 1 & 1, corner >> 2}) * BrickGrid::kBrick;
      box = box.including(to.worldToIndex(from.indexToWorld(Vec3f(voxel))));
    }
    const Vec3i low = brickAround(box.min), high = brickAround(box.max);
    for (int z = low.z; z <= high.z; ++z)
      for (int y = low.y; y <= high.y; ++y)
        for (int x = low.x; x <= high.x; ++x) result.push_back({x, y, z});
  }
  std::sort(result.begin(), result.end(), comesBefore);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

GridHandle assembled(const detail::GrownBricks& grown, const BrickGrid& like) {
  const float background = like.background();
  return detail::assembleGrids(grown, like.lattice(), std::span(&background, 1),
                               detail::Beyond::background)[0];
}

/// `grid` read at map(x), on bricks from `seeds` on.
GridHandle readThrough(const GridHandle& grid, const std::vector<Vec3i>& seeds, const VectorField& map,
                       const std::function<bool(const Vec3f&)>& isMapped, double mostBytes,
                       const Progress& progress) {
  const Source source(grid, Interpolation::tricubic);
  const Lattice lattice = grid->lattice();
  const auto fill = [&](const Vec3i& brick, float* samples) {
    const BrickPoints points(lattice, brick);
    BrickPoints there;
    evaluate(map, points, there);
    source.read(there, samples);
    for (int i = 0; i < kBrickSamples; ++i)
      if (!isMapped(points[i])) samples[i] = grid->background();
    return holdsOther(samples, grid->background());
  };
  return assembled(detail::growBricks(seeds, {.mostBytes = mostBytes}, fill, progress), *grid);
}

/// What is left beside all grids.
double bytesLeft(const std::vector<GridHandle>& grids, double mostBytes) {
  for (const GridHandle& grid : grids) mostBytes -= double(grid->memoryBytes());
  return mostBytes;
}

/// The bricks in which one grid holds anything.
std::vector<Vec3i> ownBricks(const GridHandle& grid) {
  return Matter(std::span(&grid, 1), grid->lattice()).bricks();
}

/// The bricks in which the matter of one grid arrives.
std::vector<Vec3i> arrivals(const GridHandle& grid, const VectorField& forward, float longest) {
  const Lattice lattice = grid->lattice();
  return detail::flowSeeds(ownBricks(grid), lattice, lattice, forward, longest);
}

/// One step of a gridded scheme.
class GridStep {
 public:
  GridStep(GridHandle grid, const VectorField& velocity, float dt, double mostBytes)
      : growth_{.mostBytes = mostBytes},
        source_(std::move(grid), Interpolation::trilinear),
        lattice_(source_.grid->lattice()),
        back_(traceBack(velocity, {.dt = dt})),
        forward_(traceBack(velocity, {.dt = -dt})) {
    float low = source_.grid->background(), high = low;
    for (const Interval& r : source_.grid->ranges()) {
      low = std::min(low, r.min);
      high = std::max(high, r.max);
    }
    nothing_ = kNothing * (high - low);
    detail::requireShortSteps(ownBricks(source_.grid), lattice_, velocity, dt, kLongestStep);
  }

  GridHandle plain(const Progress& progress) const { return moved(source_, source_, progress); }

  GridHandle macCormack(const Progress& progress) const {
    const SubProgress first(progress, 0, 0.4), second(progress, 0.4, 1);
    const Source ahead(plain(first), Interpolation::trilinear);
    const auto fill = [&](const Vec3i& brick, float* samples) {
      const BrickPoints points(lattice_, brick);
      BrickPoints before, after;
      Samples there, back;
      evaluate(back_, points, before);
      evaluate(forward_, points, after);
      evaluate(source_.field, before, samples);
      evaluate(ahead.field, after, back.data());
      evaluate(source_.field, points, there.data());
      for (int i = 0; i < kBrickSamples; ++i) {
        const float corrected = samples[i] + 0.5f * (there[std::size_t(i)] - back[std::size_t(i)]);
        samples[i] = cleared(withinCell(*source_.grid, before[i], corrected));
      }
      return holdsOther(samples, source_.grid->background());
    };
    return assembled(detail::growBricks(seeds(), growth_, fill, second), *source_.grid);
  }

  GridHandle bfecc(const Progress& progress) const {
    const SubProgress first(progress, 0, 0.3), second(progress, 0.3, 0.7), third(progress, 0.7, 1);
    const Source ahead(plain(first), Interpolation::trilinear);
    const auto fill = [&](const Vec3i& brick, float* samples) {
      const BrickPoints points(lattice_, brick);
      BrickPoints after;
      Samples back;
      evaluate(forward_, points, after);
      evaluate(ahead.field, after, back.data());
      evaluate(source_.field, points, samples);
      for (int i = 0; i < kBrickSamples; ++i)
        samples[i] = cleared(samples[i] + 0.5f * (samples[i] - back[std::size_t(i)]));
      return holdsOther(samples, source_.grid->background());
    };
    const Source corrected(
        assembled(detail::growBricks(ownBricks(source_.grid), growth_, fill, second), *source_.grid),
        Interpolation::trilinear);
    return moved(corrected, source_, third);
  }

 private:
  std::vector<Vec3i> seeds() const { return arrivals(source_.grid, forward_, kLongestStep); }

  float cleared(float value) const {
    return std::abs(value - source_.grid->background()) <= nothing_ ? source_.grid->background() : value;
  }

  /// `what` a step later, within the samples of `limits`.
  GridHandle moved(const Source& what, const Source& limits, const Progress& progress) const {
    const auto fill = [&](const Vec3i& brick, float* samples) {
      BrickPoints before;
      evaluate(back_, BrickPoints(lattice_, brick), before);
      evaluate(what.field, before, samples);
      for (int i = 0; i < kBrickSamples; ++i)
        samples[i] = cleared(withinCell(*limits.grid, before[i], samples[i]));
      return holdsOther(samples, source_.grid->background());
    };
    return assembled(detail::growBricks(seeds(), growth_, fill, progress), *source_.grid);
  }

  detail::GrowthOptions growth_;
  Source source_;
  Lattice lattice_;
  VectorField back_, forward_;
  float nothing_ = 0;
};

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The finest lattice among the grids that hold anything.
Lattice finestLattice(const std::vector<GridHandle>& grids) {
  const BrickGrid* finest = nullptr;
  for (const GridHandle& grid : grids) {
    if (ownBricks(grid).empty()) continue;
    if (!finest || grid->voxelSize() < finest->voxelSize()) finest = grid.get();
  }
  require(finest != nullptr, "advection: no grid holds anything");
  return finest->lattice();
}

void advectBySelma(AdvectedGrids& result, const VelocityOfStep& velocity, const AdvectionOptions& options,
                   const Progress& progress) {
  const Lattice lattice = options.startMap ? options.startMap->lattice
                                           : coarser(finestLattice(result.grids), options.mapCoarseness);
  auto matter = std::make_unique<Matter>(result.grids, lattice);
  FlowMap map =
      options.startMap && !options.startMap->isIdentity() ? *options.startMap : identityMap(*matter);
  const auto bake = [&](const Progress& part) {
    if (map.isIdentity()) return;
    for (GridHandle& grid : result.grids)
      grid = throughMap(grid, map, *matter,
                        bytesLeft(result.grids, options.mostBytes) - double(map.memoryBytes()), part);
  };
  for (int step = 0; step < options.steps; ++step) {
    const auto start = std::chrono::steady_clock::now();
    const SubProgress part(progress, double(step) / (options.steps + 1),
                           double(step + 1) / (options.steps + 1));
    map =
        advanced(map, *matter, velocity(step), options.dt, bytesLeft(result.grids, options.mostBytes), part);
    progress.check();
    AdvectionStep report{.bricks = map.bricks.size(), .memoryBytes = map.memoryBytes()};
    report.foldedShare = foldedShare(map, *matter);
    progress.check();
    if (options.rebakeShare && report.foldedShare > *options.rebakeShare && step + 1 < options.steps) {
      bake(part);
      matter = std::make_unique<Matter>(result.grids, lattice);
      map = identityMap(*matter);
      report.rebaked = true;
    }
    report.seconds = secondsSince(start);
    result.steps.push_back(report);
  }
  bake(SubProgress(progress, double(options.steps) / (options.steps + 1), 1));
  result.map = std::move(map);
}

void advectGridless(AdvectedGrids& result, const VelocityOfStep& velocity, const AdvectionOptions& options,
                    const Progress& progress) {
  std::vector<VectorField> velocities;
  for (int step = 0; step < options.steps; ++step) velocities.push_back(velocity(step));
  const VectorField map = traceBack(velocities, {.dt = options.dt});
  std::reverse(velocities.begin(), velocities.end());
  const VectorField forward = traceBack(velocities, {.dt = -options.dt});
  const float longest = kLongestStep * float(std::max(options.steps, 1));
  for (std::size_t i = 0; i < result.grids.size(); ++i) {
    const SubProgress part(progress, double(i) / double(result.grids.size()),
                           double(i + 1) / double(result.grids.size()));
    const VectorField* before = nullptr;
    for (const VectorField& u : velocities) {
      if (!before || before->node() != u.node())
        detail::requireShortSteps(ownBricks(result.grids[i]), result.grids[i]->lattice(), u, options.dt,
                                  kLongestStep);
      before = &u;
    }
    result.grids[i] = readThrough(
        result.grids[i], arrivals(result.grids[i], forward, longest), map, [](const Vec3f&) { return true; },
        bytesLeft(result.grids, options.mostBytes), part);
  }
}

void advectOnGrids(AdvectedGrids& result, const VelocityOfStep& velocity, const AdvectionOptions& options,
                   const Progress& progress) {
  const double parts = double(options.steps) * double(result.grids.size());
  double done = 0;
  for (int step = 0; step < options.steps; ++step) {
    const auto start = std::chrono::steady_clock::now();
    const VectorField u = velocity(step);
    AdvectionStep report;
    for (GridHandle& grid : result.grids) {
      const SubProgress part(progress, done / parts, (done + 1) / parts);
      const GridStep one(grid, u, options.dt, bytesLeft(result.grids, options.mostBytes));
      grid = options.scheme == GridScheme::plain        ? one.plain(part)
             : options.scheme == GridScheme::macCormack ? one.macCormack(part)
                                                        : one.bfecc(part);
      report.bricks += grid->poolSize() - 1;
      report.memoryBytes += grid->memoryBytes();
      ++done;
    }
    report.seconds = secondsSince(start);
    result.steps.push_back(report);
  }
}

void requireSane(const std::vector<GridHandle>& grids, const AdvectionOptions& options) {
  require(std::isfinite(options.dt), "advection: dt must be finite");
  require(options.steps >= 0, fmt::format("advection: steps must be >= 0, got {}", options.steps));
  require(options.mapCoarseness >= 1 && options.mapCoarseness <= 64,
          fmt::format("advection: mapCoarseness must be 1 to 64, got {:g}", options.mapCoarseness));
  require(!options.rebakeShare || (*options.rebakeShare >= 0 && *options.rebakeShare <= 1),
          "advection: rebakeShare must be 0 to 1");
  require(!options.startMap || options.method == AdvectionMethod::selma,
          "advection: only selma goes on from a map");
  require(!grids.empty(), "advection: no grid holds anything");
  for (const GridHandle& grid : grids) require(grid != nullptr, "advection: grids must be there");
}

}  // namespace

GridHandle throughMap(const GridHandle& grid, const FlowMap& map, const Matter& matter, double mostBytes,
                      const Progress& progress) {
  if (map.isIdentity()) return grid;
  const detail::KeptBricks kept(map);
  const std::vector<Vec3i> seeds = overlapping(matterBricks(map, matter), map.lattice, grid->lattice());
  return readThrough(
      grid, seeds, mapField(map), [&](const Vec3f& p) { return kept.hold(p); }, mostBytes, progress);
}

AdvectedGrids advectGrids(std::vector<GridHandle> grids, const VelocityOfStep& velocity,
                          const AdvectionOptions& options, const Progress& progress) {
  requireSane(grids, options);
  static_cast<void>(finestLattice(grids));
  AdvectedGrids result;
  result.grids = std::move(grids);
  switch (options.method) {
    case AdvectionMethod::gridless:
      advectGridless(result, velocity, options, progress);
      break;
    case AdvectionMethod::selma:
      advectBySelma(result, velocity, options, progress);
      break;
    case AdvectionMethod::grid:
      advectOnGrids(result, velocity, options, progress);
      break;
  }
  return result;
}

AdvectedGrids advectGrids(std::vector<GridHandle> grids, const VectorField& velocity,
                          const AdvectionOptions& options, const Progress& progress) {
  return advectGrids(
      std::move(grids), [&](int) { return velocity; }, options, progress);
}

double estimatedAdvectionBytes(const std::vector<GridHandle>& grids, const AdvectionOptions& options) {
  constexpr double kSpread = 2, kBrickBytes = BrickGrid::kVolume * sizeof(float);
  static_cast<void>(finestLattice(grids));
  double bricks = 0, held = 0, finest = 0;
  float voxel = 0;
  for (const GridHandle& grid : grids) {
    const double own = double(ownBricks(grid).size());
    bricks += own;
    held += double(grid->memoryBytes());
    if (own > 0 && (voxel == 0 || grid->voxelSize() < voxel)) {
      voxel = grid->voxelSize();
      finest = own;
    }
  }
  // A grid while it grows: its own samples twice, and the finished bricks; two maps of three components.
  const double result = bricks * kSpread * kBrickBytes * 1.8;
  const double map = options.method == AdvectionMethod::selma
                         ? finest * kSpread * 3 * kBrickBytes * 2.8 / std::pow(options.mapCoarseness, 3)
                         : 0;
  return held + result + map;
}

}  // namespace nephele
