#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

/// How values at the vertices of a mesh become a field.
struct AttributeFieldOptions {
  enum class Spread {
    closest,  ///< The value at the closest surface point, linear over each triangle.
    spheres   ///< Vertices wear spheres of their value; where spheres overlap, their values blend.
  };
  Spread spread = Spread::closest;
  /// Of the spheres, world units, >= 0. 0: twice the longest edge at each vertex, so that the spheres cover
  /// the surface.
  float radius = 0.0f;
  /// 0: exact, about a microsecond per point. > 0: sampled once on sparse grids and interpolated, 10 to 20
  /// nanoseconds per point within `band` of the surface. World units; that of the grid within four voxels of
  /// the surface, and each next one is twice as coarse and reaches twice as far. Voxels of half the edges of
  /// the mesh lose nothing that is worth it.
  float voxelSize = 0.0f;
  /// World units on both sides of the surface in which the grids hold samples, >= 0. Farther out the field is
  /// the exact one. Ignored without grids.
  float band = 0.0f;
};

/// The names that `attributeField` takes: vertex attributes of one number by their name, the parts of wider
/// ones as "color.r", ".g", ".b", ".a" (colours) or "name.x", ".y", ".z", ".w", or "name.0", ".1" ... beyond
/// four. Attributes of corners, as texture coordinates, are not among them: a vertex may have several values
/// of these.
std::vector<std::string> attributeNames(const Mesh& mesh);

/// A number that vertices have: an attribute, by its place in the mesh's list, and which of its numbers.
struct AttributePart {
  std::size_t attribute = 0;
  int component = 0;
};

/// What such a name stands for; nothing if the mesh has no such name.
std::optional<AttributePart> attributePart(const Mesh& mesh, const std::string& name);

/// A vertex attribute spread into space.
///
/// closest: f(x) = the value at the point of the surface nearest to x, interpolated by barycentrics in its
/// triangle. Continuous but on the medial axis. spheres: f(x) = sum w_i(x) v_i / sum w_i(x) with
/// w_i = (1 - |x - p_i|^2 / r_i^2)^3 inside the sphere of vertex i and 0 outside; where the sum of the
/// weights falls below 1/20, the value at the closest surface point takes what is missing of it, so that the
/// field has values everywhere and is continuous. Either way the range is that of the values at vertices that
/// faces use, a constant attribute gives that constant exactly, and points that are not finite give NaN. The
/// gradient is that of differences. The result does not depend on the number of threads.
/// Cost to make: n log n in the number of triangles, and about a microsecond for each sample of the grids
/// where the attribute varies. @throws Error if the mesh has no such name (listing those it has), no faces,
/// or is not triangulated; if a value is not finite; for options outside their range; Cancelled. Source:
/// Tessendorf, Resolution Independent Volumes, 3.6 (spheres).
ScalarField attributeField(const Mesh& mesh, const std::string& name,
                           const AttributeFieldOptions& options = {}, const Progress& progress = silent());

/// Cosine between the surface's normal at the closest surface point and `direction`: 1 where the surface
/// faces that way, -1 where it faces away.
///
/// The normal is smooth: angle-weighted at vertices (those at equal positions share one) and interpolated
/// between them; 0 where the surface has none. With spheres, the cosines of the vertices are blended.
/// @throws Error if `direction` is zero or not finite, and as `attributeField`.
ScalarField facingField(const Mesh& mesh, const Vec3f& direction, const AttributeFieldOptions& options = {},
                        const Progress& progress = silent());

}  // namespace nephele
