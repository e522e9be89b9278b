#pragma once

#include <cstdint>

#include "nephele/modeling/base/math.h"

/// Distances from the samples of one brick to triangles, in voxel units.
namespace nephele::detail {

/// What of a triangle does not depend on where it is. Corners are a, a + ab, a + ac.
struct TriangleShape {
  Vec3f ab, ac, bc;
  /// Unit normal, and normals of the sides within the plane, towards the inside; all zero if it has no area.
  Vec3f normal, insideAB, insideBC, insideCA;
  /// 1 / squared lengths of the sides; zero for a side without length.
  float perAB, perAC, perBC;
};

TriangleShape triangleShape(const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// A triangle near a brick: `corner` is a relative to the brick's first sample, `middle` its centroid,
/// `radius` the distance from there to its farthest corner, `order` the squared distance of `middle` from the
/// middle of the brick.
struct PlacedTriangle {
  std::uint32_t index;
  Vec3f corner, middle;
  float radius;
  float order;
};

PlacedTriangle placeTriangle(std::uint32_t index, const TriangleShape& shape, const Vec3f& corner);

/// The samples of a brick, x fastest: squared distance to the nearest triangle so far and its code (8 *
/// triangle + Feature).
struct NearestSamples {
  static constexpr int kSize = 8 * 8 * 8;
  alignas(64) float squared[kSize];
  alignas(64) std::int32_t code[kSize];
};

/// Lets `count` triangles compete, in order, for the samples that lie within `band` of them; the first of
/// equally near ones stays. `shapes` is indexed by PlacedTriangle::index.
void nearestTriangles(const TriangleShape* shapes, const PlacedTriangle* placed, std::size_t count,
                      float band, NearestSamples& samples);

/// The same as a plain loop: the truth that the vector code is tested against.
void nearestTrianglesScalar(const TriangleShape* shapes, const PlacedTriangle* placed, std::size_t count,
                            float band, NearestSamples& samples);

}  // namespace nephele::detail
