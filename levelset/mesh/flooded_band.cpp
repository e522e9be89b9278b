// OpenVDB's meshToVolume measures distances to all triangles, floods from the outside and keeps the outer
// sheets of a mesh whose sheets overlap. It takes points in single precision: they are given from a brick in
// the middle of the mesh, so that a mesh far from the origin loses nothing.
#include <fmt/format.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>
#include <vector>

#include "nephele/levelset/grid/openvdb_bridge.h"
#include "nephele/levelset/mesh/mesh_band.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {

VoxelGrid<float> floodedBand(const Mesh& mesh, const BandOptions& options, const Progress& progress) {
  initializeOpenVdb();
  const double h = options.voxelSize;
  const Vec3f middle = boundingBox(mesh).center();
  Vec3i brick;
  for (int axis = 0; axis < 3; ++axis)
    brick[axis] = int(std::floor(double(middle[axis]) / (h * BrickGrid::kBrick)));
  const Vec3d origin = Vec3d(brick) * (h * BrickGrid::kBrick);

  // Tiny models are enlarged by a power of two, which changes no digit: OpenVDB has absolute tolerances.
  constexpr double kLeast = 1e-4;
  const double enlarged = h < kLeast ? std::exp2(std::ceil(-std::log2(h))) : 1.0;
  std::vector<openvdb::Vec3s> points;
  points.reserve(mesh.positions.size());
  for (const Vec3d& p : mesh.positions) {
    const Vec3d q = (p - origin) * enlarged;
    points.emplace_back(float(q.x), float(q.y), float(q.z));
  }
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(mesh.faceCount());
  for (std::size_t t = 0; t < mesh.faceCount(); ++t)
    triangles.emplace_back(mesh.corners[3 * t], mesh.corners[3 * t + 1], mesh.corners[3 * t + 2]);
  try {
    Interrupter interrupter(progress);
    const auto transform = openvdb::math::Transform::createLinearTransform(h * enlarged);
    // What this function and this kind of interrupter need is compiled into OpenVDB's library.
    const auto grid = openvdb::tools::meshToSignedDistanceField<openvdb::FloatGrid>(
        static_cast<openvdb::util::NullInterrupter&>(interrupter), *transform, points, triangles, {},
        float(options.exteriorVoxels), float(options.interiorVoxels));
    progress.check();
    return voxelsOf(*grid, h, brick, float(-1 / enlarged));
  } catch (const openvdb::Exception& e) {
    throw Error(fmt::format("level set: OpenVDB: {}", e.what()));
  }
}

}  // namespace nephele::detail
