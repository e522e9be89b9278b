#pragma once

#include "nephele/modeling/field/field.h"

/// Solid shapes: positive inside, negative outside, world units. The value is the exact distance to the
/// surface unless a shape says otherwise, so |gradient| = 1 away from the points where the nearest surface
/// point jumps; there the gradient is that of one branch, or 0.
namespace nephele {

/// @throws Error unless radius > 0; all numbers of shapes must be finite.
ScalarField sphere(const Vec3f& center, float radius);

/// A box with sharp edges. @throws Error if the box is empty or unbounded.
ScalarField box(const Box& box);

/// The half space on the side that `normal` points to: (x - point) . normal / |normal|. @throws Error if
/// normal is 0.
ScalarField plane(const Vec3f& point, const Vec3f& normal);

struct TorusOptions {
  Vec3f center{};
  /// Direction of the axis of symmetry; any length but 0.
  Vec3f axis{0, 1, 0};
  /// From the centre to the middle of the tube.
  float majorRadius = 1.0f;
  /// Of the tube.
  float minorRadius = 0.25f;
};
/// @throws Error if a radius is not > 0 or the axis is zero.
ScalarField torus(const TorusOptions& options = {});

/// A solid cone with a flat base.
struct ConeOptions {
  Vec3f apex{0, 1, 0};
  Vec3f baseCenter{};
  float baseRadius = 0.5f;
};
/// @throws Error unless baseRadius > 0 and apex differs from baseCenter.
ScalarField cone(const ConeOptions& options = {});

/// All points within `radius` of the segment from a to b. @throws Error unless radius > 0.
ScalarField capsule(const Vec3f& a, const Vec3f& b, float radius);

/// The ellipsoid |(x - center) / radii| = 1. No closed form of the distance exists: the value is
/// (1 - k) k / |(x - center) / radii^2| with k = |(x - center) / radii|, which has the right sign and zero
/// surface and |gradient| = 1 on it, and is the distance for a sphere. @throws Error unless all radii are >
/// 0.
ScalarField ellipsoid(const Vec3f& center, const Vec3f& radii);

}  // namespace nephele
