#pragma once

#include <algorithm>
#include <deque>

#include "nephele/levelset/grid/brick_samples.h"

/// How large the grid of a layer is, and how it is made in parts along z, since samples take more memory
/// until they are packed.
namespace nephele::detail {

/// A layer with no more positions of bricks than this is baked in one piece: some hundred megabytes.
inline constexpr double kWholePositions = 1 << 20;

/// Jumps are smoothed over at least this many voxels of a layer's grid to either side: fewer leave edges too
/// steep.
inline constexpr int kLeastDilation = 2;
/// A layer's band is this many of its voxels wider on either side than where its displacement matters.
inline constexpr float kMarginVoxels = 4;

/// Bricks begin <= z < end.
struct BrickSlab {
  int begin, end;

  bool contains(int z) const { return z >= begin && z < end; }
};

/// How a layer is cut into parts.
struct LayerParts {
  BrickSlab all;
  int thickness, halo;

  int count() const { return (all.end - all.begin + thickness - 1) / thickness; }
  BrickSlab operator[](int part) const {
    return {all.begin + part * thickness, std::min(all.begin + (part + 1) * thickness, all.end)};
  }
  /// A part with its neighbours as far as they can reach it through the smoothing.
  BrickSlab around(int part) const {
    const BrickSlab own = (*this)[part];
    return {std::max(own.begin - halo, all.begin), std::min(own.end + halo, all.end)};
  }
};

/// A slab of a layer as it was sampled, with samples beside it that are of no use.
struct LayerPart {
  BrickSlab slab;
  BrickSamples samples;
};

/// The layout of a layer's grid at the bricks of `slab` inside a box, without bricks.
BrickSamples noSamples(const Box& box, float voxelSize, const BrickSlab& slab);

/// How the layer inside `box` is cut: in one piece if it is small. `reach` is how far smoothing sees, in
/// voxels.
LayerParts partsOf(const Box& box, float voxelSize, int reach);

/// The bricks of `slab`, whose samples are those of neighbouring parts, which must outlive it.
BrickSamples windowOf(const std::deque<LayerPart>& parts, const BrickSlab& slab, const Box& box,
                      float voxelSize);

}  // namespace nephele::detail
