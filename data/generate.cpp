// Makes the meshes of this folder, or the models that the documentation works with: nephele_generate_data
// data|examples FOLDER
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "data/models/animals.h"
#include "data/models/implicit_mesh.h"
#include "data/models/sphere_grid.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/render/image/png_io.h"

namespace {

using namespace nephele;

constexpr double kFullTurn = 6.283185307179586;

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

Mesh uvSphere(int longitudes, int latitudes) {
  return sphereGrid(longitudes, latitudes, [](double u, double v) {
    const double turn = kFullTurn * u;
    const double up = kFullTurn / 2 * (v - 0.5);
    return rounded({std::cos(up) * std::sin(turn), std::sin(up), std::cos(up) * std::cos(turn)}, 1e6);
  });
}

void makeData(const std::string& folder) {
  writeMesh(folder + "/sphere_uv.obj", uvSphere(48, 24));
  writeMesh(folder + "/linked_tori_and_cone.obj", linkedToriAndCone());
  writeMesh(folder + "/cloud_base.obj", cloudBase());
}

void makeExamples(const std::string& folder) {
  writeMesh(folder + "/hare.obj", hareMesh());
  writeMesh(folder + "/whale.obj", whaleMesh());
  writeMesh(folder + "/clownfish.obj", clownfishMesh());
  writePng(folder + "/clownfish.png", clownfishTexture(1024, 1024), {});
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc == 3 ? argv[1] : "";
  if (what != "data" && what != "examples") {
    std::fprintf(stderr, "usage: %s data|examples FOLDER\n", argv[0]);
    return 2;
  }
  try {
    std::filesystem::create_directories(argv[2]);
    what == "data" ? makeData(argv[2]) : makeExamples(argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
  return 0;
}
