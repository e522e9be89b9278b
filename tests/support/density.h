#pragma once

#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"

namespace nephele::test {

/// Bricks of density(world position) at the voxels first .. last of a grid with the map `indexToWorld`; 0
/// elsewhere.
inline std::shared_ptr<BrickGrid> densityGrid(const Affine& indexToWorld, const Vec3i& first,
                                              const Vec3i& last,
                                              const std::function<float(const Vec3f&)>& density) {
  // A brick more on every side, as room for the empty voxels that end the volume.
  const Vec3i firstBrick = brickOf(first) - Vec3i{1, 1, 1};
  auto grid = std::make_shared<BrickGrid>(Lattice::of(indexToWorld),
                                          BrickBox{firstBrick, brickOf(last) + Vec3i{2, 2, 2} - firstBrick});
  std::vector<std::int32_t> table(grid->places().size());
  std::iota(table.begin(), table.end(), grid->append(table.size()));
  grid->setTable(std::move(table));
  for (int z = first.z; z <= last.z; ++z)
    for (int y = first.y; y <= last.y; ++y)
      for (int x = first.x; x <= last.x; ++x) {
        const Vec3i voxel{x, y, z};
        grid->brick(
            grid->poolIndex(brickOf(voxel)))[sampleOffset(insideBrick(x), insideBrick(y), insideBrick(z))] =
            density(indexToWorld(Vec3f(voxel)));
      }
  fillBorders(*grid);
  return grid;
}

/// A uniform scale and nothing else.
inline Affine voxels(float size) {
  return {Mat3f::scaling(size), {}};
}

/// A ball of constant density about the origin, its edge softened over one voxel so that its volume is right.
inline std::shared_ptr<BrickGrid> ball(float radius, float voxelSize, float value = 1.0f) {
  const int n = int(std::ceil(radius / voxelSize)) + 2;
  return densityGrid(voxels(voxelSize), {-n, -n, -n}, {n, n, n}, [=](const Vec3f& p) {
    const float inside = (radius - length(p)) / voxelSize + 0.5f;
    return value * (inside < 0 ? 0.0f : inside > 1 ? 1.0f : inside);
  });
}

/// A slab of constant density, |z| <= thickness / 2, wide in x and y: its faces lie half way between voxels,
/// where interpolation ramps.
inline std::shared_ptr<BrickGrid> slab(float thickness, float halfWidth, float voxelSize,
                                       float value = 1.0f) {
  const int n = int(std::ceil(halfWidth / voxelSize)), m = int(std::ceil(thickness / voxelSize)) + 1;
  return densityGrid(voxels(voxelSize), {-n, -n, -m}, {n, n, m},
                     [=](const Vec3f& p) { return std::fabs(p.z) < thickness / 2 ? value : 0.0f; });
}

/// Distance along a ray to a ball, infinite where it misses or starts behind it.
inline double distanceToBall(const Vec3d& origin, const Vec3d& direction, const Vec3d& centre,
                             double radius) {
  const Vec3d way = origin - centre;
  const double b = dot(way, direction), inside = b * b + radius * radius - dot(way, way);
  const double distance = inside < 0 ? -1 : -b - std::sqrt(inside);
  return distance >= 0 ? distance : INFINITY;
}

}  // namespace nephele::test
