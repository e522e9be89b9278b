// OpenVDB's dual mesher: one vertex in each cell that the surface crosses, quads between the four cells round
// a crossed edge, and where the surface is flat to within the adaptivity, several cells share one vertex.
//
// OpenVDB takes level sets as negative inside, and winds polygons clockwise seen from outside: both are
// turned round here. All grids are given to it as level sets, so that samples equal to the isovalue count as
// outside, as in marching cubes.
//
// Limits: OpenVDB's merging can leave edges with more than two faces, and vertices are smoothed off the zero
// of the interpolant; where a closed manifold is needed, take marching cubes.
#include "nephele/levelset/mesh/adaptive_mesh.h"

#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "nephele/levelset/grid/openvdb_bridge.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

namespace {

/// Makes the largest value one to two: OpenVDB merges nothing where values are tiny. A power of two, so that
/// nothing is rounded.
float unitOfValues(const BrickGrid& grid) {
  float most = std::fabs(grid.background());
  for (const float value : grid.values()) most = std::max(most, std::fabs(value));
  return most > 0 && std::isfinite(most) ? std::ldexp(1.0f, -std::ilogb(most)) : 1.0f;
}

}  // namespace

Mesh adaptiveMesh(const BrickGrid& grid, double isovalue, double adaptivity) {
  require(std::isfinite(isovalue), "adaptiveMesh: isovalue must be finite, got " + numberText(isovalue));
  require(adaptivity >= 0 && adaptivity <= 1,
          "adaptiveMesh: adaptivity must be in [0, 1], got " + numberText(adaptivity));
  const float unit = unitOfValues(grid);
  detail::TreeValues negated = detail::TreeValues::negated(grid.background() * unit);
  negated.sign *= unit;
  const auto values = detail::toOpenVdb(grid, negated, "");
  values->setGridClass(openvdb::GRID_LEVEL_SET);
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  try {
    openvdb::tools::volumeToMesh(*values, points, triangles, quads, -isovalue * double(unit), adaptivity);
  } catch (const openvdb::Exception& problem) {
    throw Error("adaptiveMesh: " + std::string(problem.what()));
  }
  require(4 * std::uint64_t(quads.size()) + 3 * std::uint64_t(triangles.size()) <
              std::numeric_limits<std::uint32_t>::max(),
          "adaptiveMesh: the surface has more polygons than a mesh can number; use larger voxels");

  Mesh mesh;
  mesh.positions.reserve(points.size());
  for (const openvdb::Vec3s& p : points) mesh.positions.push_back({p.x(), p.y(), p.z()});
  mesh.corners.reserve(4 * quads.size() + 3 * triangles.size());
  mesh.faceStart.reserve(quads.size() + triangles.size() + 1);
  // OpenVDB winds faces in voxels, whatever the transform does to them.
  const bool isMirrored = determinant(grid.indexToWorld().linear) < 0;
  for (const openvdb::Vec4I& q : quads)
    mesh.addFace(isMirrored ? std::array{q[0], q[1], q[2], q[3]} : std::array{q[3], q[2], q[1], q[0]});
  for (const openvdb::Vec3I& t : triangles)
    mesh.addFace(isMirrored ? std::array{t[0], t[1], t[2]} : std::array{t[2], t[1], t[0]});
  return mesh;
}

}  // namespace nephele
