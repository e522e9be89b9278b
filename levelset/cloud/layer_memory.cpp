// What the layers of a cloud take, before they are made.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "nephele/levelset/cloud/detail/layer_parts.h"
#include "nephele/levelset/cloud/layers_on_grids.h"
#include "nephele/levelset/cloud/medial_smoothing.h"

namespace nephele {

using detail::BrickSamples;
using detail::kLeastDilation;
using detail::kMarginVoxels;
using detail::LayerParts;

CumuloBytes estimatedCumuloBytes(const std::vector<CumuloLayer>& layers, float voxelSize, double area,
                                 const Box& box) {
  // Measured. Displaced surfaces are larger than their base, of which the outside of a band is larger still;
  // bricks that no later layer can bring to the surface are dropped, and sums need no bricks far inside.
  constexpr double kGrowth = 1.8, kKept = 0.68, kSum = 0.78;
  constexpr double kPacked = sizeof(std::uint16_t) * double(BrickSamples::kCount);
  constexpr double kUnpacked = sizeof(float) * double(BrickSamples::kCount);
  // What bakes and smoothing hold beside the samples, or the codes of the bricks that are packed first.
  constexpr double kWork = 1.4;
  CumuloBytes bytes;
  double sum = 0;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const float voxel = cumuloVoxelSize(layers, i, voxelSize);
    const float reach = displacementBound(layers, i), margin = kMarginVoxels * voxel;
    // The band, and bricks that it only touches.
    const double width =
        double(reach) + (1 + double(detail::kOuterShare)) * margin + double(BrickGrid::kBrick) * voxel;
    // Where layers reach farther than the shape is large, by Steiner's formula.
    const double steiner =
        area * width + std::numbers::pi * width * width * (double(box.longestSide()) + 4.0 / 3.0 * width);
    const double bricks =
        std::max(kGrowth * area * width, steiner) / std::pow(double(BrickGrid::kBrick) * voxel, 3);
    const LayerParts cut = detail::partsOf(box.expanded(displacementBound(layers) + margin), voxel,
                                           kLeastDilation + MedialSmoothingOptions{}.steps);
    // Of a layer in parts: three.
    const double share = std::min(1.0, 3.0 * cut.thickness / double(cut.all.end - cut.all.begin));
    const double packed = cut.count() > 1 ? kKept * bricks * kPacked : 0.0;
    bytes.peak = std::max(bytes.peak, bytes.kept + sum + kWork * share * bricks * kUnpacked + packed);
    bytes.kept += kKept * bricks * kPacked;
    if (i + 1 == layers.size()) break;
    bytes.peak = std::max(bytes.peak, bytes.kept + sum + kWork * kSum * bricks * kUnpacked);
    sum = kSum * bricks * kPacked;
  }
  return bytes;
}

}  // namespace nephele
