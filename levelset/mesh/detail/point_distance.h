#pragma once

#include <OpenMesh/Core/Geometry/VectorT.hh>
#include <algorithm>

// Squared distances of points. Not for other folders.
namespace nephele::detail {

/// From the line between a and b.
inline double squaredDistance(const OpenMesh::Vec3d& p, const OpenMesh::Vec3d& a, const OpenMesh::Vec3d& b) {
  const OpenMesh::Vec3d side = b - a;
  const double length = side.sqrnorm();
  const double t = length > 0 ? std::clamp(((p - a) | side) / length, 0.0, 1.0) : 0.0;
  return (p - a - side * t).sqrnorm();
}

/// From a triangle, by the region of its plane that the point lies above (Ericson, Real-Time Collision
/// Detection, 5.1.5).
inline double squaredDistance(const OpenMesh::Vec3d& p, const OpenMesh::Vec3d& a, const OpenMesh::Vec3d& b,
                              const OpenMesh::Vec3d& c) {
  const OpenMesh::Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab | ap, d2 = ac | ap;
  if (d1 <= 0 && d2 <= 0) return ap.sqrnorm();
  const OpenMesh::Vec3d bp = p - b;
  const double d3 = ab | bp, d4 = ac | bp;
  if (d3 >= 0 && d4 <= d3) return bp.sqrnorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - ab * (d1 / (d1 - d3))).sqrnorm();
  const OpenMesh::Vec3d cp = p - c;
  const double d5 = ab | cp, d6 = ac | cp;
  if (d6 >= 0 && d5 <= d6) return cp.sqrnorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - ac * (d2 / (d2 - d6))).sqrnorm();
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 >= d3 && d5 >= d6)
    return (bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).sqrnorm();
  return (ap - ab * (vb / (va + vb + vc)) - ac * (vc / (va + vb + vc))).sqrnorm();
}

}  // namespace nephele::detail
