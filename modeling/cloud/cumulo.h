#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "nephele/modeling/cloud/layers.h"

/// cumulo: layers of pyroclastic displacement, small bumps on large ones, with smooth valleys between them.
///
///     l_0 = base,   l_i(x) = l_{i-1}(x) + d_i(x),   d_i(x) = a_i(y) |N_i(y)| w_i(y)
///
/// where y is the point of the zero surface of l_{i-1} that belongs to x (modeling/cloud/surface_point.h),
/// N_i a noise of unit rms, a_i its amplitude, and w_i clears the valleys of the layer before ("billow"):
///
///     w_1 = 1,   w_i(y) = clamp(d_{i-1}(y) / (q_i a_{i-1}(y)), 0, 1)^billow_i,   0^0 = 1.
///
/// Positive inside; d_i >= 0, so what is inside stays inside. Source: Tessendorf, Resolution Independent
/// Volumes, equations 3.3 - 3.8.
namespace nephele {

/// One layer, ready to be evaluated, as the bake hook sees it.
struct CumuloStep {
  std::size_t index = 0;
  const CumuloLayer* layer = nullptr;  ///< Never null in the hook.
  /// l_{i-1}, positive inside.
  ScalarField before{0.0f};
  /// l_{i-1} as this layer finds its surface points on.
  ScalarField surface{0.0f};
  /// l_{i-1} as this layer finds its band by.
  ScalarField level{0.0f};
  /// a_i(y) N_i(y) w_i(y): the displacement with the sign of its noise, which is smooth where the
  /// displacement has a crease. 0 outside  -reach - 3/4 margin <= l_{i-1} <= margin.
  ScalarField displacement{0.0f};
  float bound = 0.0f;   ///< Largest |displacement|.
  float reach = 0.0f;   ///< What this layer and those after it can add.
  float margin = 0.0f;  ///< Width kept on either side of the band.
};

/// What takes the place of a layer once it was sampled.
struct CumuloSampled {
  ScalarField displacement;  ///< Its absolute value is the layer's displacement.
  ScalarField sum;           ///< l_i, added up: what the result is read from.
  ScalarField surface;  ///< l_i as the next layer finds its surface points on: must be cheap, may be coarser.
  ScalarField
      level;  ///< l_i as the next layer finds its band by: may be off by a voxel or two of its margin.
};

struct CumuloOptions {
  /// The length h, world units, > 0, that tolerances and margins are stated in: the voxel size of the result.
  /// Surface points are found to 0.005 h; a layer is evaluated where -reach - 4 h <= l_{i-1} <= 4 h.
  float voxelSize = 0.0f;
  /// Newton steps towards the surface, 1 to 64.
  int newtonSteps = 5;
  /// Replaces each layer by a sampled one; see levelset/cloud/layers_on_grids.h. Empty: the pure procedural
  /// form, exact and slow: (1 + 7 k)^M evaluations of the base per value for k steps and M layers.
  std::function<CumuloSampled(const CumuloStep&)> bake{};
  /// The exact surface point of `base` near x, such as the closest point of a mesh: taken by the first layer
  /// where the gradient of `base` vanishes before its surface is found. Empty: the best point found. Given up
  /// once the first layer was sampled.
  std::optional<VectorField> closestPoint{};
  /// Margin of the band of a layer, by its index. Empty: 4 h. A bake at a coarser voxel size needs more.
  std::function<float(std::size_t layer)> margin{};
  /// How far a layer and those after it can reach, by the index of the layer: at least displacementBound.
  /// Empty: that.
  std::function<float(std::size_t layer)> reach{};
};

/// `base` with all `layers` grown on it: l_M.
///
/// `base` must be a distance (|grad| about 1) from displacementBound(layers) + 6 voxels outside to 4 voxels
/// inside; beyond the band the result is `base` itself, so that only the sign holds there. The result is not
/// a distance. Cost per value: procedural see CumuloOptions::bake; sampled, one look-up per layer.
/// @throws Error if voxelSize is not > 0, newtonSteps is outside 1 .. 64, or a layer has a billowScale or
/// frequency that is not > 0 or an amplitude or noise without finite range.
ScalarField cumulo(const ScalarField& base, const std::vector<CumuloLayer>& layers, CumuloOptions options);

namespace detail {

/// A layer's band needs less of its margin beyond its reach than inside, where the next sums still rise: 3
/// voxels to 4.
inline constexpr float kOuterShare = 0.75f;

/// How far from a point whose level is `level` from 0 a layer reads its amplitude at most, world units.
/// Levels rise at least as fast as distances, but where they were sampled.
inline float farthestSurfacePoint(float level, float voxel) {
  return 1.25f * level + 4 * voxel;
}

}  // namespace detail
}  // namespace nephele
