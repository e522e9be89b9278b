#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "nephele/levelset/cloud/detail/dot_splats.h"
#include "nephele/levelset/cloud/dot_volume.h"
#include "nephele/levelset/grid/sparse_bricks.h"
#include "nephele/modeling/base/parallel.h"

/// Batches of dots, as entries of bricks.
namespace nephele {

struct DotVolume::Impl {
  /// Points of a smeared dot that are sorted as one, two per voxel.
  static constexpr std::size_t kRun = 8;
  /// Samples of a brick, per channel.
  static constexpr std::size_t kVoxels = kBrickSamples;

  DotVolumeOptions options;
  double perIndex = 1;  ///< 1 / edge of a voxel.
  float perVoxel = 1;   ///< 1 / volume of a voxel.
  float ownRadius = 0;  ///< Of dots that bring none, voxels.
  int ownReach = 0;
  std::uint64_t dotCount = 0;
  double mass = 0;

  detail::SparseBricks<float> bricks;
  std::vector<std::uint32_t> counters;  ///< Per place of the bricks' table: all 0 between batches.

  // Working memory of a batch.
  std::vector<std::size_t> firstSplat;    ///< Of each dot, and after the last.
  std::vector<std::uint32_t> dotOfSplat;  ///< Where dots are smeared; else each is one splat.
  std::size_t splatCount = 0;
  std::vector<detail::Splat> entries;

  explicit Impl(const DotVolumeOptions& o)
      : options(o), perIndex(1.0 / double(o.voxelSize)), bricks("dots", (o.withColor ? 4 : 1) * kVoxels) {}

  std::size_t channels() const { return options.withColor ? 4 : 1; }

  float radiusVoxels(const DotSpans& dots, std::size_t i) const {
    return dots.radii.empty() ? ownRadius : dots.radii[i] / options.voxelSize;
  }
  int reach(const DotSpans& dots, std::size_t i) const {
    return dots.radii.empty() ? ownReach : detail::reachOf(dots.radii[i] / options.voxelSize);
  }
  bool smears(const DotSpans& dots) const {
    return !dots.velocities.empty() && (options.shutterOpen != 0 || options.shutterClose != 0);
  }
  /// Way of a dot while the shutter is open, voxels.
  float smearVoxels(const DotSpans& dots, std::size_t i) const {
    return length(dots.velocities[i]) * (options.shutterClose - options.shutterOpen) / options.voxelSize;
  }
  /// Points that a smeared dot is the sum of: two Gauss-Legendre points in each of some equal pieces.
  std::size_t pointsOf(const DotSpans& dots, std::size_t i) const {
    if (!smears(dots)) return 1;
    const float way = smearVoxels(dots, i);
    return way > 0 ? 2 * std::size_t(std::ceil(way)) : 1;
  }
  /// Where those points are, index space.
  struct Way {
    Vec3d start, step;
    std::size_t count;

    Vec3d point(std::size_t k) const {
      constexpr double kSide = 0.5 * std::numbers::inv_sqrt3;
      const double place = double(k / 2) + 0.5 + (count == 1 ? 0 : k % 2 ? kSide : -kSide);
      return start + step * place;
    }
  };
  Way wayOf(const DotSpans& dots, std::size_t i) const {
    Way way{Vec3d(dots.positions[i]) * perIndex, {}, pointsOf(dots, i)};
    if (!smears(dots)) return way;
    const Vec3d v = Vec3d(dots.velocities[i]) * perIndex;
    const double open = double(options.shutterOpen), close = double(options.shutterClose);
    way.start += v * open;
    way.step = v * ((close - open) / (way.count == 1 ? 1.0 : double(way.count / 2)));
    return way;
  }
  /// The points [begin, end) of a dot, which a splat stands for.
  struct Run {
    std::size_t begin, end;
  };
  Run runOf(std::size_t splat, std::size_t dot, const Way& way) const {
    const std::size_t begin = (splat - firstSplat[dot]) * kRun;
    return {begin, std::min(begin + kRun, way.count)};
  }
  /// The bricks that a splat touches, and some more if it is smeared aslant.
  detail::BrickSpan bricksAt(const DotSpans& dots, std::size_t dot, const Way& way, const Run& run) const {
    const int extent = reach(dots, dot);
    const detail::BrickSpan span = detail::bricksOf(way.point(run.begin), extent);
    if (run.end - run.begin < 2) return span;
    const detail::BrickSpan last = detail::bricksOf(way.point(run.end - 1), extent);
    return {min(span.first, last.first), max(span.last, last.last)};
  }
  /// visit(brick, q, splat, dot, points) for every brick that each of some splats touches, q being where it
  /// begins.
  template <class Visit>
  void forEntries(const DotSpans& dots, std::size_t begin, std::size_t end, const Visit& visit) const {
    const bool smeared = smears(dots);
    for (std::size_t s = begin; s < end; ++s) {
      if (!smeared) {
        const Vec3d q = Vec3d(dots.positions[s]) * perIndex;
        detail::bricksOf(q, reach(dots, s)).forEach([&](const Vec3i& brick) { visit(brick, q, s, s, 1); });
        continue;
      }
      const std::size_t dot = dotOfSplat[s];
      const Way way = wayOf(dots, dot);
      const Run run = runOf(s, dot, way);
      bricksAt(dots, dot, way, run).forEach([&](const Vec3i& brick) {
        visit(brick, way.point(run.begin), s, dot, way.count);
      });
    }
  }

  /// visit(brick, number), in the order of the numbers.
  template <class Visit>
  void forEachNumber(const Visit& visit) const {
    const detail::BrickTable& table = bricks.table();
    std::vector<Vec3i> positions(bricks.count());
    for (std::size_t place = detail::BrickTable::kPlaces; place < table.placeCount(); ++place)
      if (table[place] >= 0) positions[std::size_t(table[place])] = table.brickAt(place);
    for (std::size_t i = 0; i < positions.size(); ++i) visit(positions[i], std::int32_t(i));
  }
  const float* sampleAt(const Vec3i& voxel) const;
  void requireSound(const DotSpans& dots) const;
  void addBatch(const DotSpans& dots, const Progress& progress);
  void makeSplats(const DotSpans& dots);
  std::vector<std::size_t> countEntries(const DotSpans& dots);
  template <bool hasColor>
  void sumBrick(const DotSpans& dots, std::size_t place, detail::Splat* first, detail::Splat* last) const;
};

}  // namespace nephele
