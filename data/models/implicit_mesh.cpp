#include "data/models/implicit_mesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

BrickGrid sampled(const Shape& shape, const Vec3d& low, const Vec3d& high, double voxelSize) {
  const double brickSize = voxelSize * BrickGrid::kBrick;
  BrickBox places;
  for (int axis = 0; axis < 3; ++axis) {
    places.first[axis] = int(std::floor(low[axis] / brickSize));
    places.count[axis] = int(std::floor(high[axis] / brickSize)) + 1 - places.first[axis];
  }
  BrickGrid grid(Lattice::uniform(float(voxelSize)), places, -1);
  const std::int32_t first = grid.append(places.size());
  parallelFor(places.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const std::int32_t pool = first + std::int32_t(b);
      const Vec3i brick = places.at(b);
      float* sample = grid.brick(pool);
      for (int k = -BrickGrid::kBefore; k < BrickGrid::kBrick + BrickGrid::kAfter; ++k) {
        for (int j = -BrickGrid::kBefore; j < BrickGrid::kBrick + BrickGrid::kAfter; ++j) {
          for (int i = -BrickGrid::kBefore; i < BrickGrid::kBrick + BrickGrid::kAfter; ++i) {
            *sample++ =
                float(shape(Vec3d(brick * BrickGrid::kBrick + Vec3i{i, j, k}) * double(float(voxelSize))));
          }
        }
      }
      grid.setRange(pool, {-1e30f, 1e30f});
      grid.place(brick, pool);
    }
  });
  return grid;
}

Vec3d gradient(const Shape& shape, const Vec3d& p) {
  constexpr double kStep = 1e-5;
  Vec3d g;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d step;
    step[axis] = kStep;
    g[axis] = (shape(p + step) - shape(p - step)) / (2 * kStep);
  }
  return g;
}

// Steps of Newton's method along the gradient; where the shape has a kink the vertex stays near where it was.
Vec3d onSurface(const Shape& shape, Vec3d p) {
  for (int i = 0; i < 4; ++i) {
    const Vec3d g = gradient(shape, p);
    p += g * (-shape(p) / std::max(dot(g, g), 0.25));
  }
  return p;
}

}  // namespace

Vec3d rounded(const Vec3d& p, double perUnit) {
  return {std::round(p.x * perUnit) / perUnit, std::round(p.y * perUnit) / perUnit,
          std::round(p.z * perUnit) / perUnit};
}

Mesh meshOf(const Shape& shape, const Vec3d& low, const Vec3d& high, double voxelSize, int smoothingSteps) {
  Mesh mesh = marchingCubes(sampled(shape, low, high, voxelSize));
  for (int step = 0; step < smoothingSteps; ++step) {
    std::vector<Vec3d> sum(mesh.positions.size());
    std::vector<int> count(mesh.positions.size());
    for (std::size_t c = 0; c < mesh.corners.size(); c += 3) {
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t v = mesh.corners[c + i];
        sum[v] += mesh.positions[mesh.corners[c + (i + 1) % 3]];
        ++count[v];
      }
    }
    parallelFor(sum.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v)
        mesh.positions[v] = onSurface(shape, sum[v] / double(count[v]));
    });
  }
  for (Vec3d& p : mesh.positions) p = rounded(p, 1e4);
  return mesh;
}

double blended(double a, double b, double radius) {
  const double h = std::max(radius - std::abs(a - b), 0.0);
  return std::max(a, b) + h * h / (4 * radius);
}

}  // namespace nephele
