#pragma once

#include <memory>
#include <optional>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/surface_geometry.h"

namespace nephele::detail {

/// Where a signed distance is wanted: up to these distances from the surface, in voxels, >= 1.
struct BandOptions {
  double voxelSize = 0.0;
  double exteriorVoxels = 3.0;
  double interiorVoxels = 3.0;
};

/// Signed distance in a band: bricks of 8^3 samples near the surface, constants elsewhere.
struct BandBlocks {
  static constexpr std::int32_t kOutside = -1;
  static constexpr std::int32_t kInside = -2;
  static constexpr std::size_t kSamples = 512;

  BandOptions options;
  BrickBox bricks;
  /// Per brick of these: index of a block, kOutside or kInside.
  std::vector<std::int32_t> table;
  /// kSamples per block, x fastest: world units, positive inside, clamped to the band.
  std::vector<float> samples;

  float outsideValue() const { return -float(options.exteriorVoxels * options.voxelSize); }
  float insideValue() const { return float(options.interiorVoxels * options.voxelSize); }
};

/// Exact signed distance to `surface` in a band, or nothing if the surface is not closed or its sheets
/// overlap, so that the nearest one does not tell inside from outside.
/// @throws Error if the grid would be too large to index; Cancelled.
std::optional<BandBlocks> signedBand(const SurfaceGeometry& surface, const BandOptions& options,
                                     const Progress& progress);

/// Level-set grid of a band, negative inside. Bands of unequal width are cut to the narrower one.
VdbGrid bandToVdb(const BandBlocks& band);

/// Bricks of a band.
std::shared_ptr<BrickGrid> bandToBricks(const BandBlocks& band);

/// Signed distance by OpenVDB's meshToVolume, negative inside. Slow, and robust where sheets of the mesh
/// overlap.
VdbGrid meshToVdb(const Mesh& mesh, const BandOptions& options, const Progress& progress);

}  // namespace nephele::detail
