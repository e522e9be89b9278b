#pragma once

#include <cstdint>
#include <memory>

#include "nephele/levelset/grid/voxel_grid.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/cloud/dots.h"

namespace nephele {

struct DotVolumeOptions {
  /// Edge of a voxel, world units, see DotVolume::kLeastVoxel. Voxel centres lie at integer multiples of it.
  float voxelSize = 0.0f;
  /// Radius of dots that bring none of their own, world units, >= 0.
  float radius = 0.0f;
  /// While the shutter is open, a dot is smeared from x + open v to x + close v. Finite, open <= close.
  float shutterOpen = 0.0f, shutterClose = 0.0f;
  /// Keep the colours of dots, too, in four times the memory.
  bool withColor = false;
};

/// Antialiased dots added up on a sparse grid.
///
/// A dot of mass m adds m w / voxelSize^3 to the voxels around it. Up to a radius of one voxel, w is the
/// trilinear weight of the 8 nearest ones, however small the dot is; above, that is blurred with a cubic
/// B-spline of the dot's radius, one factor per axis. Either way the weights sum up to 1 and have their
/// centroid at the dot: mass and place are kept to rounding at any voxel size. A smeared dot is the integral
/// of such dots along its way, two of them per voxel (Gauss-Legendre): mass, middle and length are kept.
///
/// Every voxel adds up its dots one after the other, in single precision, in the order in which they were
/// given: the result is the same bit for bit at any thread count, and however the dots are divided into calls
/// of `add`. Uses all cores. Memory follows the bricks of 8^3 voxels that dots touch, and working memory is
/// bounded, whatever the number of dots. Cost: some 50 ns per small dot and core; 8 n^3 voxels for dots of n
/// voxels' radius.
/// Source: Tessendorf, Production Volume Rendering (2008), baking antialiased dots.
class DotVolume {
 public:
  /// Largest radius of a dot and largest length of a smear, voxels.
  static constexpr float kLargestRadius = 64.0f;
  /// Edges of voxels, world units: masses are divided by cubes of these, in single precision.
  static constexpr float kLeastVoxel = 1e-12f, kLargestVoxel = 1e12f;
  static constexpr float kLongestSmear = 16384.0f;

  /// @throws Error for options outside their range.
  explicit DotVolume(const DotVolumeOptions& options);
  ~DotVolume();
  DotVolume(DotVolume&&) noexcept;
  DotVolume& operator=(DotVolume&&) noexcept;

  /// Adds dots. @throws Error, naming the dot, if a number is not finite, a mass or radius is negative, or a
  /// dot or smear is too large; then nothing was added. Error if the dots are spread over more bricks than a
  /// table can hold, Cancelled: then a part was added.
  void add(const DotSpans& dots, const Progress& progress = silent());

  /// Density at a voxel. Slow; for tests.
  float density(const Vec3i& voxel) const;
  /// Colour at a voxel: the mean of the dots', weighted by what each adds; black where there is none. Slow.
  Vec3f color(const Vec3i& voxel) const;

  std::uint64_t dotCount() const;
  /// Sum of all masses.
  double mass() const;
  std::size_t brickCount() const;
  /// Bytes held, and those that its grids will hold.
  std::size_t memoryBytes() const;

  /// Densities, 0 where there is none.
  VoxelGrid<float> densityGrid() const;
  /// Colours, black beyond the bricks that hold some. Voxels without density in such a brick have its mean
  /// colour, so that interpolation does not darken edges. @throws Error if no colours are kept.
  VoxelGrid<Vec3f> colorGrid() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Memory for `dotCount` dots that lie within `box` and touch at most `brickCount` bricks, with their grids,
/// bytes.
double estimatedDotVolumeBytes(const Box& box, double brickCount, double dotCount,
                               const DotVolumeOptions& options);

}  // namespace nephele
