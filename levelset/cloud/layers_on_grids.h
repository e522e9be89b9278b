#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/cloud/cumulo.h"

namespace nephele {

class KeptLayers;

/// How `griddedCumulo` samples the layers.
struct CumuloGridOptions {
  enum class Renormalise {
    off,     ///< Layers add up as they are: the reference look.
    sweep,   ///< l_i becomes a distance by sweeping outward from its zero surface, on its grid.
    rebuild  ///< l_i becomes the exact distance to the mesh of its zero surface.
  };

  /// Voxel size h of the result, world units, > 0.
  float voxelSize = 0.0f;
  /// Box of the base shape, world units: where its level set is positive.
  Box box{};
  /// Newton steps towards the surface.
  int newtonSteps = 5;
  /// Half width of the edge, world units: as far as this from the surface, on either side, the result is the
  /// full sum. It always is within 3 voxels.
  float edge = 0.0f;
  /// See CumuloOptions::closestPoint: moved here it is freed before the second layer.
  std::optional<VectorField> closestPoint{};
  /// Voxels by which the places where displacement jumps over the medial axis grow before they are smoothed,
  /// at least two voxels of the layer's own grid; 0 leaves the jumps.
  int medialSmoothing = 4;
  /// Turning l_i into a distance between layers changes the shape: later bumps then grow along the true
  /// normal.
  Renormalise renormalise = Renormalise::off;
  /// Layers to begin with, and where those that are made stay; null: none.
  KeptLayers* kept = nullptr;
};

/// What a layer came to.
struct CumuloLayerReport {
  double amplitude = 0;  ///< Rms, world units: largest where it varies.
  double frequency = 0;  ///< Cycles per world unit.
  double voxelSize = 0;  ///< Of the layer's grid.
  std::uint64_t activeVoxels = 0;
  double unconvergedFraction =
      0;                        ///< Of the sampled voxels, those whose surface point is off by > 0.1 voxel.
  double meanDisplacement = 0;  ///< World units, over the surface that the layer grows on.
  double seconds = 0;
};

/// A cumulo with one grid per layer.
struct GriddedCumulo {
  /// l_M: the base plus each layer's interpolated displacement. Positive inside, not a distance.
  ScalarField surface{0.0f};
  /// l_M to be sampled at voxels of size `estimateVoxelSize` and interpolated from there: cheaper than
  /// `surface`, and then within `estimateError` of it but for rare creases.
  ScalarField estimate{0.0f};
  float estimateVoxelSize = 0.0f;
  float estimateError = 0.0f;
  /// Where `surface` can be positive.
  Box box{};
  std::vector<CumuloLayerReport> layers;
};

inline constexpr int kMaxMedialSmoothing = 16;

/// Voxel size at which `layers[index]` is sampled for a result of voxel size `resultVoxelSize`: 1/12 of a
/// wave for the last layer, on which no other builds; for the others 1/16, or down to 1/9, one and a half
/// times the samples that the result has voxels to a period of the last layer, so that they add less to its
/// error. Or the result's voxel where that is coarser, but never over 1/6 of a wave. A wave is 1 / (frequency
/// times detail) long: a frequency that varies counts with its greatest value.
float cumuloVoxelSize(const std::vector<CumuloLayer>& layers, std::size_t index, float resultVoxelSize);

/// Exterior band (world units) in which the base must be a distance for `layers`; the interior one is
/// `cumuloInteriorBand`. They cover the displacement, the coarsest grid's interpolation and the Newton steps.
/// Layers of which so many are kept reach farther, see KeptLayers.
float cumuloExteriorBand(const std::vector<CumuloLayer>& layers, float voxelSize, float edge = 0.0f,
                         std::size_t keptCount = 0);
float cumuloInteriorBand(const std::vector<CumuloLayer>& layers, float voxelSize, float edge = 0.0f);

/// Memory of the grids of `griddedCumulo`, bytes.
struct CumuloBytes {
  double peak = 0;  ///< The most at any time.
  double kept = 0;  ///< By the result.
};

/// What `griddedCumulo` needs for a base of this surface area (world units squared) and box; for refusing
/// early. Within -10 to +50 % of what was measured on scanned shapes at 256 to 2048 voxels; too much where
/// amplitudes are small in most places.
CumuloBytes estimatedCumuloBytes(const std::vector<CumuloLayer>& layers, float voxelSize, double area,
                                 const Box& box);

/// `cumulo(base, layers)` with each layer baked to a grid of its own voxel size, all cores.
///
/// A layer's grid holds the displacement with the sign of its noise and is interpolated before the absolute
/// value is taken, so that creases stay sharp at any voxel size. Where the medial axis makes it jump by more
/// than noise of its frequency can, the grid's own displacement is diffused (16 Jacobi steps). A layer costs
/// nothing where its amplitude is 0 all around. The same bits at any thread count. Against the procedural
/// form, three layers of slope 0.5: median difference <= 0.01 h, 99 % <= 0.25 h.
/// @throws Error as `cumulo`, and if the box is empty or medialSmoothing is outside
/// 0 .. kMaxMedialSmoothing; Cancelled.
GriddedCumulo griddedCumulo(const ScalarField& base, const std::vector<CumuloLayer>& layers,
                            CumuloGridOptions options, const Progress& progress = silent());

}  // namespace nephele
