// Makes the meshes of this folder: nephele_generate_data FOLDER
//
// Shapes are signed distances (or nearly so), positive inside, in plain double arithmetic, so that every
// machine makes the same files. They are sampled, meshed by marching cubes, and the vertices are then spread
// evenly and put back on the exact surface.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/base/mesh.h"

namespace {

using namespace nephele;
using Shape = std::function<double(const Vec3d&)>;

constexpr double kFullTurn = 6.283185307179586;

Vec3d rounded(const Vec3d& p, double perUnit) {
  return {std::round(p.x * perUnit) / perUnit, std::round(p.y * perUnit) / perUnit,
          std::round(p.z * perUnit) / perUnit};
}

BrickGrid sampled(const Shape& shape, const Vec3d& low, const Vec3d& high, double voxelSize) {
  BrickGrid grid;
  grid.indexToWorld().linear = Mat3f::scaling(float(voxelSize));
  grid.voxelSize() = float(voxelSize);
  grid.background() = -1;
  const double brickSize = voxelSize * BrickGrid::kBrick;
  for (int axis = 0; axis < 3; ++axis) {
    grid.firstBrick()[axis] = int(std::floor(low[axis] / brickSize));
    grid.brickCount()[axis] = int(std::floor(high[axis] / brickSize)) + 1 - grid.firstBrick()[axis];
  }
  grid.values().assign(BrickGrid::kVolume, grid.background());
  grid.ranges().push_back({grid.background(), grid.background()});
  for (int z = 0; z < grid.brickCount().z; ++z) {
    for (int y = 0; y < grid.brickCount().y; ++y) {
      for (int x = 0; x < grid.brickCount().x; ++x) {
        const Vec3i origin = (grid.firstBrick() + Vec3i{x, y, z}) * BrickGrid::kBrick;
        grid.table().push_back(std::int32_t(grid.poolSize()));
        grid.ranges().push_back({-1e30f, 1e30f});
        for (int k = -1; k < 10; ++k) {
          for (int j = -1; j < 10; ++j) {
            for (int i = -1; i < 10; ++i) {
              grid.values().push_back(
                  float(shape(Vec3d(origin + Vec3i{i, j, k}) * double(float(voxelSize)))));
            }
          }
        }
      }
    }
  }
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
    for (std::size_t v = 0; v < sum.size(); ++v)
      mesh.positions[v] = onSurface(shape, sum[v] / double(count[v]));
  }
  for (Vec3d& p : mesh.positions) p = rounded(p, 1e4);
  return mesh;
}

// The larger of both, with a fillet of about `radius`.
double blended(double a, double b, double radius) {
  const double h = std::max(radius - std::abs(a - b), 0.0);
  return std::max(a, b) + h * h / (4 * radius);
}

struct Ball {
  Vec3d center;
  double radius;
};

// A cumulus congestus seen from +z: a tall tower left of the middle, a shoulder and a lower tower to its
// right, small towers in front and behind, and a skirt of low domes; then buds on the upper half of every
// ball.
std::vector<Ball> cloudBalls() {
  const std::vector<Ball> towers = {
      {{-0.16, 0.24, 0.00}, 0.42}, {{-0.20, 0.60, -0.02}, 0.35}, {{-0.13, 0.88, -0.04}, 0.30},
      {{-0.22, 1.12, 0.00}, 0.20}, {{-0.02, 1.06, -0.06}, 0.17}, {{0.42, 0.20, 0.04}, 0.36},
      {{0.44, 0.48, 0.02}, 0.27},  {{0.13, 0.56, 0.08}, 0.25},   {{0.53, 0.68, 0.04}, 0.18},
      {{0.14, 0.30, -0.32}, 0.36}, {{0.20, 0.58, -0.30}, 0.24},  {{-0.60, 0.16, 0.12}, 0.29},
      {{-0.64, 0.37, 0.10}, 0.20}, {{0.12, 0.12, 0.42}, 0.25},   {{0.10, 0.30, 0.40}, 0.16},
      {{-0.30, 0.10, 0.44}, 0.21}, {{0.62, 0.08, 0.30}, 0.20},   {{0.86, 0.10, -0.06}, 0.24},
      {{0.93, 0.22, -0.04}, 0.14}, {{1.12, 0.05, 0.02}, 0.14},   {{-0.90, 0.08, -0.04}, 0.20},
      {{-1.10, 0.04, 0.06}, 0.12}, {{-0.55, 0.12, -0.32}, 0.26}, {{0.56, 0.10, -0.34}, 0.24},
      {{-0.12, 0.10, -0.48}, 0.24}};
  constexpr int kBuds = 9;
  constexpr double kGoldenTurn = 0.381966011250105;
  std::vector<Ball> balls = towers;
  for (std::size_t t = 0; t < towers.size(); ++t) {
    for (int i = 0; i < kBuds; ++i) {
      const double height = 0.95 - 1.1 * (i + 0.5) / kBuds;
      const double turn = kFullTurn * (kGoldenTurn * i + 0.37 * double(t));
      const double side = std::sqrt(1 - height * height);
      const Vec3d direction{side * std::cos(turn), height, side * std::sin(turn)};
      const double share = 0.30 + 0.16 * double((7 * t + 5 * std::size_t(i)) % 11) / 10;
      balls.push_back({towers[t].center + direction * (0.86 * towers[t].radius), share * towers[t].radius});
    }
  }
  return balls;
}

Mesh cloudBase() {
  const std::vector<Ball> balls = cloudBalls();
  const Shape cloud = [&](const Vec3d& p) {
    double inside = -1;
    for (const Ball& ball : balls) inside = blended(inside, ball.radius - length(p - ball.center), 0.05);
    // The base is flat but for a broad swell.
    const double base = p.y - 0.03 * p.x * p.x + 0.015 * p.z;
    return -blended(-inside, -base, 0.06);
  };
  return meshOf(cloud, {-1.4, -0.1, -0.9}, {1.4, 1.5, 0.9}, 0.042, 8);
}

double torus(const Vec3d& p, double ring, double tube) {
  return tube - length(Vec3d{length(Vec3d{p.x, p.y, 0}) - ring, 0, p.z});
}

double distanceToSegment(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const double t = std::clamp(dot(p - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
  return length(p - (a + (b - a) * t));
}

// Upright on y = 0, grown by `rounding` so that rim and tip are round.
double cone(const Vec3d& p, double height, double baseRadius, double rounding) {
  const Vec3d section{length(Vec3d{p.x, 0, p.z}), p.y, 0};
  const Vec3d rim{baseRadius, 0, 0};
  const Vec3d tip{0, height, 0};
  const double distance =
      std::min(distanceToSegment(section, {-baseRadius, 0, 0}, rim), distanceToSegment(section, rim, tip));
  const bool inside = section.y > 0 && baseRadius * (height - section.y) > height * section.x;
  return rounding + (inside ? distance : -distance);
}

Mesh linkedToriAndCone() {
  const Shape shape = [](const Vec3d& p) {
    const double first = torus(p - Vec3d{-0.35, 0, 0}, 0.6, 0.16);
    const double second = torus({p.x - 0.35, p.z, p.y}, 0.6, 0.16);
    const double third = cone(p - Vec3d{-0.95, -0.25, 0}, 1.2, 0.3, 0.06);
    return blended(blended(first, second, 0.06), third, 0.1);
  };
  return meshOf(shape, {-1.5, -0.9, -0.9}, {1.3, 1.2, 0.9}, 0.05, 6);
}

// Longitudes and latitudes with texture coordinates over the unit square: u turns about y, v rises from the
// south pole. Corners at a pole take the u of the middle of their face.
Mesh uvSphere(int longitudes, int latitudes) {
  Mesh mesh;
  MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}};
  mesh.positions.push_back({0, -1, 0});
  for (int j = 1; j < latitudes; ++j) {
    const double up = kFullTurn / 2 * (double(j) / latitudes - 0.5);
    for (int i = 0; i < longitudes; ++i) {
      const double turn = kFullTurn * i / longitudes;
      mesh.positions.push_back(
          rounded({std::cos(up) * std::sin(turn), std::sin(up), std::cos(up) * std::cos(turn)}, 1e6));
    }
  }
  mesh.positions.push_back({0, 1, 0});
  const auto vertex = [&](int i, int j) {
    if (j == 0) return std::uint32_t(0);
    if (j == latitudes) return std::uint32_t(mesh.positions.size() - 1);
    return std::uint32_t(1 + (j - 1) * longitudes + i % longitudes);
  };
  for (int j = 0; j < latitudes; ++j) {
    for (int i = 0; i < longitudes; ++i) {
      std::vector<std::uint32_t> face;
      const auto add = [&](double u, int column, int row) {
        face.push_back(vertex(column, row));
        uv.values.insert(uv.values.end(), {float(u / longitudes), float(double(row) / latitudes)});
      };
      if (j == 0) add(i + 0.5, i, j);
      if (j > 0) add(i, i, j);
      if (j > 0) add(i + 1, i + 1, j);
      if (j + 1 < latitudes) add(i + 1, i + 1, j + 1);
      if (j + 1 < latitudes) add(i, i, j + 1);
      if (j + 1 == latitudes) add(i + 0.5, i, j + 1);
      mesh.addFace(face);
    }
  }
  mesh.attributes.push_back(uv);
  return mesh;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
    return 2;
  }
  try {
    const std::string folder = argv[1];
    writeMesh(folder + "/sphere_uv.obj", uvSphere(48, 24));
    writeMesh(folder + "/linked_tori_and_cone.obj", linkedToriAndCone());
    writeMesh(folder + "/cloud_base.obj", cloudBase());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
  return 0;
}
