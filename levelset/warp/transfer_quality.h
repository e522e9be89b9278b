#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

/// The largest of the connected regions of a surface that something is wrong with.
struct SurfaceRegion {
  /// Of its area.
  Vec3d middle{};
  /// Of the area of the surface; 0 where there is no such region.
  double share = 0.0;
};

/// How well a map from the surface of an object to that of a reference keeps shapes: the same measures
/// whatever made the map.
///
/// The map is linear on every triangle of the object (polygons are fans): it takes the triangle to the one
/// between the images of its corners. s1 >= s2 >= 0 are its singular values, by which lengths grow in the
/// direction that grows most and least; s1 s2 is the area of the image triangle over that of the triangle.
/// Triangles of the object without area are left out of everything.
struct TransferQuality {
  /// Of the object, with area.
  std::size_t triangleCount = 0;
  /// Share of these whose image has collapsed: s1 > 100 s2, or s1 s2 < 1e-3 times the area of the reference
  /// over that of the object.
  double degenerateFraction = 0.0;
  /// Share of these whose image has not collapsed but is turned over: its normal points against the
  /// reference's normal at the point nearest to its middle. Normals are smooth ones, see ReferenceSurface. A
  /// mesh whose signed volume is negative counts as turned inside out, and is taken the right way round.
  double flippedFraction = 0.0;
  /// Of s1 / s2, 1 where angles are kept; over all triangles, those that have collapsed too, at most 1e6.
  double stretchMedian = 1.0, stretchP95 = 1.0;
  /// Share of the reference's area that images lie on. Of 16384 points evenly spread over the reference by
  /// area: such a point counts if the image triangle nearest to it is closer than its own longest side, lies
  /// where the reference faces the same half space, and is met within 45 degrees of the normal, or closer
  /// than 1e-4 of the reference's longest side. Image triangles that have collapsed cover nothing.
  double coverage = 0.0;

  /// From this stretch on a triangle is bad; so are those that have collapsed or are turned over.
  static constexpr float kBadStretch = 4.0f;
  /// Share of the object's area in bad triangles, and the largest connected region of them.
  double badFraction = 0.0;
  SurfaceRegion worst{};
  /// The largest connected region of the reference whose triangles have middles that no image lies on.
  SurfaceRegion uncovered{};
  /// For each triangle of `triangulated(object)`: its stretch, infinite where it has collapsed or is turned
  /// over, 1 where it has no area.
  std::vector<float> stretch{};
  /// For each triangle of `triangulated(reference)`: whether an image lies on its middle.
  std::vector<std::uint8_t> isCovered{};
};

/// Measures the map that takes every position of `object` (images.size() == object.positions.size()) or every
/// corner (object.corners.size()) to `images`, points on the surface of `reference`, or near it. Where both
/// counts are equal, positions are meant. Cost: about a microsecond per triangle of the object, and 30
/// milliseconds. The same at any number of threads.
/// @throws Error if there are neither as many images as positions nor as corners, if one is not finite, if a
/// mesh has no faces or positions that are not finite; Cancelled.
TransferQuality transferQuality(const Mesh& reference, const Mesh& object, std::span<const Vec3d> images,
                                const Progress& progress = silent());

}  // namespace nephele
