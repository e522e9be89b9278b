#include "nephele/levelset/cloud/detail/layer_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

/// The parts of others have at least this thickness, in bricks, and about this many positions. Of thicker
/// parts less is smoothed once more beside its neighbours; thinner ones take less memory.
constexpr int kPartBricks = 4;
constexpr double kPartPositions = 1 << 15;

/// The bricks that a box needs. @throws Error where their voxels could not be numbered.
BrickSlab bricksAlong(const Box& box, int axis, float voxelSize) {
  constexpr float kFarthest = 1 << 27;
  const float brick = voxelSize * BrickGrid::kBrick;
  const float first = std::floor(box.min[axis] / brick), last = std::floor(box.max[axis] / brick);
  if (!(first >= -kFarthest && last <= kFarthest))
    throw Error(
        fmt::format("layers: they would reach {:.3g} voxels from the origin, and {:.3g} can be numbered; use "
                    "larger voxels, lower bumps or a shape that is nearer to it",
                    std::max(-first, last) * BrickGrid::kBrick, kFarthest * BrickGrid::kBrick));
  return {int(first) - 1, int(last) + 2};
}

}  // namespace

BrickSamples noSamples(const Box& box, float voxelSize, const BrickSlab& slab) {
  BrickSamples samples;
  samples.voxelSize = voxelSize;
  BrickBox places;
  for (int axis = 0; axis < 3; ++axis) {
    const BrickSlab bricks = bricksAlong(box, axis, voxelSize);
    places.first[axis] = bricks.begin;
    places.count[axis] = bricks.end - bricks.begin;
  }
  places.first.z = slab.begin;
  places.count.z = slab.end - slab.begin;
  samples.table = FlatBrickTable(places);
  SampleStore background(BrickSamples::kCount);
  samples.pool.push_back(background.data());
  samples.ranges.push_back(Interval::of(0));
  samples.stores.push_back({std::move(background), std::numeric_limits<int>::max()});
  return samples;
}

LayerParts partsOf(const Box& box, float voxelSize, int reach) {
  const auto bricks = [&](int axis) { return bricksAlong(box, axis, voxelSize); };
  const auto size = [&](int axis) { return bricks(axis).end - bricks(axis).begin; };
  const double across = double(size(0)) * size(1);
  LayerParts parts{bricks(2), size(2), 1 + (reach + 1 + BrickGrid::kAfter) / BrickGrid::kBrick};
  if (across * size(2) > kWholePositions)
    parts.thickness = std::max({kPartBricks, parts.halo, int(kPartPositions / across)});
  return parts;
}

BrickSamples windowOf(const std::deque<LayerPart>& parts, const BrickSlab& slab, const Box& box,
                      float voxelSize) {
  BrickSamples window = noSamples(box, voxelSize, slab);
  for (const LayerPart& part : parts) {
    const Vec3i first = max(window.places().first, part.samples.places().first);
    const Vec3i end = min(window.places().first + window.places().count,
                          part.samples.places().first + part.samples.places().count);
    const int lastZ = std::min(end.z, part.slab.end);
    Vec3i b;
    for (b.z = std::max(first.z, part.slab.begin); b.z < lastZ; ++b.z)
      for (b.y = first.y; b.y < end.y; ++b.y)
        for (b.x = first.x; b.x < end.x; ++b.x) {
          const auto pool = std::size_t(part.samples.table.at(b));
          if (pool != 0) window.appendShared(b, part.samples.pool[pool], part.samples.ranges[pool]);
        }
  }
  return window;
}

}  // namespace nephele::detail
