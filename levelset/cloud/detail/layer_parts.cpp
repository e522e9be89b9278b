#include "nephele/levelset/cloud/detail/layer_parts.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

/// The parts of others have at least this thickness, in bricks, and about this many positions. Thicker parts
/// copy less from their neighbours.
constexpr int kPartBricks = 6;
constexpr double kPartPositions = 1 << 15;

}  // namespace

BrickSamples noSamples(const Box& box, float voxelSize, const BrickSlab& slab) {
  BrickSamples samples;
  samples.voxelSize = voxelSize;
  BrickBox places;
  for (int axis = 0; axis < 3; ++axis) {
    places.first[axis] = int(std::floor(box.min[axis] / voxelSize / BrickGrid::kBrick)) - 1;
    places.count[axis] =
        int(std::floor(box.max[axis] / voxelSize / BrickGrid::kBrick)) + 2 - places.first[axis];
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
  const auto bricks = [&](int axis) {
    return BrickSlab{int(std::floor(box.min[axis] / voxelSize / BrickGrid::kBrick)) - 1,
                     int(std::floor(box.max[axis] / voxelSize / BrickGrid::kBrick)) + 2};
  };
  const auto size = [&](int axis) { return bricks(axis).end - bricks(axis).begin; };
  const double across = double(size(0)) * size(1);
  LayerParts parts{bricks(2), size(2), 1 + (reach + 1 + BrickGrid::kAfter) / BrickGrid::kBrick};
  if (across * size(2) > kWholePositions)
    parts.thickness = std::max({kPartBricks, parts.halo, int(kPartPositions / across)});
  return parts;
}

BrickSamples windowOf(const std::deque<LayerPart>& parts, const BrickSlab& slab, const Box& box,
                      float voxelSize) {
  /// Bricks along z that are given back together.
  constexpr int kStoreBricks = 8;
  BrickSamples window = noSamples(box, voxelSize, slab);
  for (int z = slab.begin; z < slab.end; z += kStoreBricks) {
    std::vector<Vec3i> bricks;
    std::vector<const float*> sources;
    for (const LayerPart& part : parts) {
      const Vec3i first = max(window.places().first, part.samples.places().first);
      const Vec3i end = min(window.places().first + window.places().count,
                            part.samples.places().first + part.samples.places().count);
      const int lastZ = std::min({z + kStoreBricks, end.z, part.slab.end});
      Vec3i b;
      for (b.z = std::max({z, first.z, part.slab.begin}); b.z < lastZ; ++b.z)
        for (b.y = first.y; b.y < end.y; ++b.y)
          for (b.x = first.x; b.x < end.x; ++b.x) {
            const std::int32_t pool = part.samples.table.at(b);
            if (pool == 0) continue;
            bricks.push_back(b);
            sources.push_back(part.samples.pool[std::size_t(pool)]);
          }
    }
    const std::size_t before = window.pool.size();
    window.append(bricks);
    parallelFor(bricks.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        float* copy = window.pool[before + i];
        std::copy_n(sources[i], BrickSamples::kCount, copy);
        window.ranges[before + i] = rangeOfSamples({copy, std::size_t(BrickSamples::kCount)});
      }
    });
  }
  return window;
}

}  // namespace nephele::detail
