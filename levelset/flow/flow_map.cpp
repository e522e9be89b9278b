// Semi-Lagrangian mapping: X_(n+1)(x) = X_n(x - u dt) on bricks. (Tessendorf, Resolution Independent Volumes,
// chapter 8, equation 8.8.) What is stored is D = X - x: smooth, small, and the same at any distance from the
// origin. A step asks for each voxel of a brick where it came from (midpoint rule), reads D there
// (Catmull-Rom) and adds the way back.
//
// Which bricks: those with a voxel whose X lies in a brick of the first matter. The first guess for the next
// step is where the flow takes 27 points of each such brick; from there the set grows over neighbours until
// it is closed. The test uses X itself, not the bricks of the step before, so the set does not swell from
// step to step. The neighbours around it give the interpolation what it reads; farther out the nearest kept
// sample is repeated, and nothing of it counts as matter: what comes from there was none before.
//
// Limits: matter thinner than a voxel may fall between the voxels, there as in the picture.
#include "nephele/levelset/flow/flow_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <climits>
#include <cmath>

#include "nephele/levelset/flow/detail/flow_seeds.h"
#include "nephele/levelset/flow/detail/kept_bricks.h"
#include "nephele/levelset/grid/brick_growth.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"

namespace nephele {

namespace {

using detail::BrickPoints;
using detail::BrickTable;

/// How far tricubic interpolation reads, in voxels.
constexpr int kReach = 2;

/// Voxels of one brick that differ from the background, as a box of offsets; empty if there are none.
bool ownBox(const BrickGrid& grid, std::int32_t pool, Vec3i& first, Vec3i& last) {
  first = {BrickGrid::kBrick, BrickGrid::kBrick, BrickGrid::kBrick};
  last = {-1, -1, -1};
  if (grid.ranges()[std::size_t(pool)].isPoint()) {
    if (grid.ranges()[std::size_t(pool)].min == grid.background()) return false;
    std::swap(first, last);
    first = {0, 0, 0};
    last = {BrickGrid::kBrick - 1, BrickGrid::kBrick - 1, BrickGrid::kBrick - 1};
    return true;
  }
  const float* samples = grid.brick(pool);
  for (int z = 0; z < BrickGrid::kBrick; ++z)
    for (int y = 0; y < BrickGrid::kBrick; ++y)
      for (int x = 0; x < BrickGrid::kBrick; ++x)
        if (samples[sampleOffset(x, y, z)] != grid.background()) {
          first = min(first, Vec3i{x, y, z});
          last = max(last, Vec3i{x, y, z});
        }
  return last.x >= 0;
}

[[noreturn]] void failNotFinite(const Vec3f& p) {
  throw Error(fmt::format("advection: the velocity at {:g},{:g},{:g} is not finite", p.x, p.y, p.z));
}

Spans<3> spansOf(BrickPoints& points) {
  Spans<3> spans;
  spans.lanes = {std::span<float>(points.x), std::span<float>(points.y), std::span<float>(points.z)};
  return spans;
}

/// Gives samples that are not known what the nearest known one of the brick has; false if none is known.
bool repeatKnown(const std::array<bool, kBrickSamples>& isKnown, BrickPoints& values) {
  constexpr int kEdge = BrickGrid::kBrick;
  const auto placeOf = [](int i) { return Vec3i{i % kEdge, i / kEdge % kEdge, i / (kEdge * kEdge)}; };
  for (int i = 0; i < kBrickSamples; ++i) {
    if (isKnown[std::size_t(i)]) continue;
    int best = INT_MAX, found = -1;
    for (int k = 0; k < kBrickSamples; ++k) {
      if (!isKnown[std::size_t(k)]) continue;
      const Vec3i way = placeOf(k) - placeOf(i);
      if (const int distance = way.x * way.x + way.y * way.y + way.z * way.z; distance < best)
        best = distance, found = k;
    }
    if (found < 0) return false;
    values.set(i, values[found]);
  }
  return true;
}

/// Takes out the bricks whose first sample is no number.
void dropUnknown(detail::GrownBricks& grown) {
  std::erase_if(grown.bricks, [&](const Vec3i& brick) {
    if (!std::isnan(*grown.samples.find(brick))) return false;
    grown.samples.table().set(brick, BrickTable::kNone);
    return true;
  });
}

}  // namespace

struct Matter::Table {
  BrickTable numbers{"advection"};
};

Matter::Matter(std::span<const std::shared_ptr<const BrickGrid>> grids, const Lattice& lattice)
    : lattice_(lattice), table_(std::make_unique<Table>()) {
  for (const auto& grid : grids) {
    require(grid != nullptr, "Matter: grids must be there");
    const Vec3i count = grid->brickCount();
    for (int z = 0; z < count.z; ++z)
      for (int y = 0; y < count.y; ++y)
        for (int x = 0; x < count.x; ++x) {
          const Vec3i brick = grid->firstBrick() + Vec3i{x, y, z};
          Vec3i first, last;
          if (!ownBox(*grid, grid->poolIndex(brick), first, last)) continue;
          const Vec3i reach{kReach, kReach, kReach};
          Box box;
          for (int corner = 0; corner < 8; ++corner) {
            const Vec3i low = brick * BrickGrid::kBrick + first - reach,
                        high = brick * BrickGrid::kBrick + last + reach;
            const Vec3i voxel{corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                              corner & 4 ? high.z : low.z};
            box = box.including(lattice.worldToIndex(grid->indexToWorld()(Vec3f(voxel))));
          }
          const Vec3i low = brickAround(box.min), high = brickAround(box.max);
          for (int k = low.z; k <= high.z; ++k)
            for (int j = low.y; j <= high.y; ++j)
              for (int i = low.x; i <= high.x; ++i)
                if (table_->numbers.at({i, j, k}) < 0) {
                  table_->numbers.set({i, j, k}, 0);
                  bricks_.push_back({i, j, k});
                }
        }
  }
  std::sort(bricks_.begin(), bricks_.end(), comesBefore);
}

Matter::~Matter() = default;

bool Matter::mayBeAt(const Vec3f& point) const {
  return table_->numbers.at(brickAt(lattice_, point)) >= 0;
}

std::size_t FlowMap::memoryBytes() const {
  std::size_t bytes = bricks.size() * sizeof(Vec3i);
  for (const auto& grid : displacement)
    if (grid) bytes += grid->memoryBytes();
  return bytes;
}

VectorField mapField(const FlowMap& map) {
  if (map.isIdentity()) return identity();
  return position() + gridField(map.displacement, Interpolation::tricubic);
}

FlowMap identityMap(const Matter& matter) {
  return {matter.lattice(), {}, {}};
}

std::vector<Vec3i> matterBricks(const FlowMap& map, const Matter& matter) {
  if (map.isIdentity()) return matter.bricks();
  std::vector<std::uint8_t> matters(map.bricks.size());
  parallelFor(map.bricks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const BrickPoints points(map.lattice, map.bricks[b]);
      const float* d[3];
      for (int c = 0; c < 3; ++c)
        d[c] = map.displacement[std::size_t(c)]->brick(
            map.displacement[std::size_t(c)]->poolIndex(map.bricks[b]));
      int i = 0;
      for (int z = 0; z < BrickGrid::kBrick && !matters[b]; ++z)
        for (int y = 0; y < BrickGrid::kBrick && !matters[b]; ++y)
          for (int x = 0; x < BrickGrid::kBrick && !matters[b]; ++x, ++i) {
            const int o = sampleOffset(x, y, z);
            matters[b] = matter.mayBeAt(points[i] + Vec3f{d[0][o], d[1][o], d[2][o]});
          }
    }
  });
  std::vector<Vec3i> result;
  for (std::size_t b = 0; b < matters.size(); ++b)
    if (matters[b]) result.push_back(map.bricks[b]);
  return result;
}

FlowMap advanced(const FlowMap& map, const Matter& matter, const VectorField& velocity, float dt,
                 double mostBytes, const Progress& progress) {
  require(std::isfinite(dt), "advection: dt must be finite");
  const Lattice& lattice = map.lattice;
  const VectorField back = traceBack(velocity, {.dt = dt});
  const std::vector<Vec3i> before = matterBricks(map, matter);
  progress.check();
  detail::requireShortSteps(before, lattice, velocity, dt, kLongestStep);
  progress.check();
  const std::vector<Vec3i> seeds =
      detail::flowSeeds(before, lattice, lattice, traceBack(velocity, {.dt = -dt}), kLongestStep);
  const detail::KeptBricks kept(map);
  const VectorField displacement =
      map.isIdentity() ? VectorField(Vec3f{}) : gridField(map.displacement, Interpolation::tricubic);

  const auto evaluate = [&](const Vec3i& brick, float* samples) {
    const BrickPoints points(lattice, brick);
    BrickPoints source, moved;
    back.eval({points.x, points.y, points.z}, spansOf(source));
    BrickPoints read = source;
    std::array<bool, kBrickSamples> isInside, isKnown;
    for (int i = 0; i < kBrickSamples; ++i) {
      const auto k = std::size_t(i);
      isInside[k] = isKnown[k] = map.isIdentity() || kept.hold(source[i]);
      if (isInside[k]) continue;
      Vec3f nearest = source[i];
      isKnown[k] = kept.moveInside(nearest);
      read.set(i, nearest);
    }
    displacement.eval({read.x, read.y, read.z}, spansOf(moved));
    if (!repeatKnown(isKnown, moved)) {
      *samples = NAN;
      return false;
    }
    bool matters = false;
    for (int i = 0; i < kBrickSamples; ++i) {
      const Vec3f d = (source[i] - points[i]) + moved[i];
      if (!isFinite(d)) failNotFinite(points[i]);
      for (int c = 0; c < 3; ++c) samples[c * kBrickSamples + i] = d[c];
      matters = matters || (isInside[std::size_t(i)] && matter.mayBeAt(points[i] + d));
    }
    return matters;
  };
  detail::GrownBricks grown = detail::growBricks(
      seeds, {.components = 3, .withNeighbours = true, .mostBytes = mostBytes - double(map.memoryBytes())},
      evaluate, progress);
  dropUnknown(grown);
  progress.check();
  const float zero[3] = {};
  const auto grids = detail::assembleGrids(grown, lattice, zero, detail::Beyond::nearest);
  FlowMap result{lattice, {grids[0], grids[1], grids[2]}, grown.bricks};
  std::sort(result.bricks.begin(), result.bricks.end(), comesBefore);
  return result;
}

double foldedShare(const FlowMap& map, const Matter& matter) {
  if (map.isIdentity()) return 0;
  const std::vector<Vec3i> bricks = matterBricks(map, matter);
  if (bricks.empty()) return 0;
  std::atomic<std::size_t> folded{0};
  const Mat3f toIndex = map.lattice.worldToIndex.linear;
  parallelFor(bricks.size(), 16, [&](std::size_t begin, std::size_t end) {
    std::size_t count = 0;
    for (std::size_t b = begin; b < end; ++b)
      for (int z = 0; z < BrickGrid::kBrick; ++z)
        for (int y = 0; y < BrickGrid::kBrick; ++y)
          for (int x = 0; x < BrickGrid::kBrick; ++x) {
            Mat3f byIndex;
            for (int c = 0; c < 3; ++c) {
              const BrickGrid& grid = *map.displacement[std::size_t(c)];
              const float* d = grid.brick(grid.poolIndex(bricks[b]));
              byIndex(c, 0) = 0.5f * (d[sampleOffset(x + 1, y, z)] - d[sampleOffset(x - 1, y, z)]);
              byIndex(c, 1) = 0.5f * (d[sampleOffset(x, y + 1, z)] - d[sampleOffset(x, y - 1, z)]);
              byIndex(c, 2) = 0.5f * (d[sampleOffset(x, y, z + 1)] - d[sampleOffset(x, y, z - 1)]);
            }
            Mat3f jacobian = byIndex * toIndex;
            for (int c = 0; c < 3; ++c) jacobian(c, c) += 1.0f;
            count += determinant(jacobian) <= 0.0f;
          }
    folded += count;
  });
  return double(folded) / (double(bricks.size()) * kBrickSamples);
}

}  // namespace nephele
