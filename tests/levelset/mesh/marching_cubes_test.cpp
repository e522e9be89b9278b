// Marching cubes on fields whose surface is known, on every sign pattern of a cell, and on noise.
#include "nephele/levelset/mesh/marching_cubes.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "nephele/modeling/base/error.h"
#include "tests/support/mesh_topology.h"

namespace nephele {
namespace {

using test::Topology;
using test::topologyOf;

using Function = std::function<float(const Vec3i&)>;

// Bricks first .. first + count - 1 filled with `value`, and `background` around them. Constant bricks share
// a pool brick, as the readers of files make them.
BrickGrid makeGrid(const Vec3i& first, const Vec3i& count, float background, const Function& value,
                   double voxelSize = 1) {
  BrickGrid grid(Lattice::of({Mat3f::scaling(float(voxelSize)), {}}), {first, count}, background);
  std::map<float, std::int32_t> constants;
  const auto append = [&](const std::vector<float>& samples) {
    const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
    const std::int32_t pool = grid.append(1);
    std::copy(samples.begin(), samples.end(), grid.brick(pool));
    grid.setRange(pool, {*low, *high});
    return pool;
  };
  constants[background] = 0;

  const Vec3i begin = first * BrickGrid::kBrick;
  const Vec3i end = (first + count) * BrickGrid::kBrick;
  const auto sample = [&](const Vec3i& v) {
    const bool covered =
        v.x >= begin.x && v.y >= begin.y && v.z >= begin.z && v.x < end.x && v.y < end.y && v.z < end.z;
    return covered ? value(v) : background;
  };
  std::vector<std::int32_t> table;
  for (int bz = 0; bz < count.z; ++bz) {
    for (int by = 0; by < count.y; ++by) {
      for (int bx = 0; bx < count.x; ++bx) {
        const Vec3i origin = (first + Vec3i{bx, by, bz}) * BrickGrid::kBrick;
        std::vector<float> samples;
        std::vector<float> own;
        for (int z = -1; z < 10; ++z) {
          for (int y = -1; y < 10; ++y) {
            for (int x = -1; x < 10; ++x) {
              samples.push_back(sample(origin + Vec3i{x, y, z}));
              if (std::min({x, y, z}) >= 0 && std::max({x, y, z}) < 8) own.push_back(samples.back());
            }
          }
        }
        if (std::all_of(own.begin(), own.end(), [&](float v) { return v == own[0]; })) {
          if (!constants.contains(own[0]))
            constants[own[0]] = append(std::vector<float>(BrickGrid::kVolume, own[0]));
          table.push_back(constants[own[0]]);
        } else {
          table.push_back(append(samples));
        }
      }
    }
  }
  grid.setTable(std::move(table));
  return grid;
}

// A distance field cut off at three voxels, as level sets in files are.
BrickGrid makeLevelSet(double voxelSize, const Vec3i& first, const Vec3i& count,
                       const std::function<double(const Vec3d&)>& distance) {
  const double band = 3 * voxelSize;
  return makeGrid(
      first, count, float(-band),
      [&](const Vec3i& v) { return float(std::clamp(distance(Vec3d(v) * voxelSize), -band, band)); },
      voxelSize);
}

BrickGrid makeSphere(double radius, double voxelSize, const Vec3d& center = {}) {
  const int reach = int(std::ceil((radius + length(center)) / voxelSize / BrickGrid::kBrick)) + 1;
  return makeLevelSet(voxelSize, {-reach, -reach, -reach}, {2 * reach, 2 * reach, 2 * reach},
                      [&](const Vec3d& p) { return radius - length(p - center); });
}

double torusDistance(const Vec3d& p, double ring, double tube) {
  return tube - std::hypot(std::hypot(p.x, p.z) - ring, p.y);
}

double smallestArea(const Mesh& mesh) {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto t = mesh.face(f);
    const Vec3d a = mesh.positions[t[0]];
    smallest = std::min(smallest, length(cross(mesh.positions[t[1]] - a, mesh.positions[t[2]] - a)) / 2);
  }
  return smallest;
}

std::size_t duplicatePositions(const Mesh& mesh) {
  const std::set<Vec3d> distinct(mesh.positions.begin(), mesh.positions.end());
  return mesh.positions.size() - distinct.size();
}

Topology closedManifold(const Mesh& mesh) {
  const Topology topology = topologyOf(mesh);
  EXPECT_TRUE(topology.isClosedManifold()) << topology;
  EXPECT_TRUE(mesh.isTriangles());
  return topology;
}

TEST(MarchingCubes, MakesAClosedSphere) {
  const Mesh mesh = marchingCubes(makeSphere(1, 0.05));
  const Topology topology = closedManifold(mesh);
  EXPECT_EQ(topology.eulerCharacteristic, 2);
  EXPECT_EQ(topology.components, 1u);
  EXPECT_GT(signedVolume(mesh), 0);
}

// On an edge of length h the distance to the sphere bends by at most 1 / R, so its linear zero is off by at
// most h^2 / (8 R) (interpolation error h^2 / 8 max |f''| over the slope along the edge, for edges well
// crossed; the factor 4 covers edges that meet the surface at a slant).
TEST(MarchingCubes, VerticesLieOnTheSphereToSecondOrder) {
  for (const double h : {0.1, 0.05, 0.025}) {
    double worst = 0;
    for (const Vec3d& p : marchingCubes(makeSphere(1, h, {0.013, 0.027, -0.011})).positions) {
      worst = std::max(worst, std::abs(length(p - Vec3d{0.013, 0.027, -0.011}) - 1));
    }
    EXPECT_LT(worst, 4 * h * h / 8) << "h = " << h;
  }
}

// Chords of a sphere lose area and volume in proportion to h^2: each halving of h divides the error by four.
TEST(MarchingCubes, AreaAndVolumeOfASphereConvergeToSecondOrder) {
  const double pi = std::acos(-1.0);
  double areaError = 0;
  double volumeError = 0;
  for (const double h : {0.1, 0.05, 0.025}) {
    const Mesh mesh = marchingCubes(makeSphere(1, h, {0.013, 0.027, -0.011}));
    const double area = std::abs(surfaceArea(mesh) / (4 * pi) - 1);
    const double volume = std::abs(signedVolume(mesh) / (4 * pi / 3) - 1);
    EXPECT_LT(area, h * h);
    EXPECT_LT(volume, h * h);
    if (areaError > 0) {
      EXPECT_NEAR(areaError / area, 4, 0.8);
      EXPECT_NEAR(volumeError / volume, 4, 0.8);
    }
    areaError = area;
    volumeError = volume;
  }
}

TEST(MarchingCubes, PutsVerticesOnTheLinearZeroOfTheirEdge) {
  const double h = 0.05;
  const BrickGrid grid = makeSphere(1, h, {0.013, 0.027, -0.011});
  const auto value = [&](const Vec3i& v) {
    return double(float(std::clamp(1 - length(Vec3d(v) * h - Vec3d{0.013, 0.027, -0.011}), -3 * h, 3 * h)));
  };
  // The grid's map holds the voxel size in single precision.
  const double scale = grid.indexToWorld().linear(0, 0);
  for (const Vec3d& p : marchingCubes(grid).positions) {
    const Vec3d index = p / scale;
    Vec3i start;
    int axis = -1;
    for (int i = 0; i < 3; ++i) {
      const double nearest = std::round(index[i]);
      const bool onSample = std::abs(index[i] - nearest) < 1e-9;
      start[i] = int(onSample ? nearest : std::floor(index[i]));
      if (!onSample) axis = i;
    }
    ASSERT_GE(axis, 0);
    Vec3i stop = start;
    stop[axis] += 1;
    const double t = std::clamp(value(start) / (value(start) - value(stop)), 1.0 / 4096, 1 - 1.0 / 4096);
    ASSERT_NEAR(index[axis], start[axis] + t, 1e-9);
  }
}

TEST(MarchingCubes, MakesATorusWithEulerCharacteristicZero) {
  const Mesh mesh = marchingCubes(
      makeLevelSet(0.05, {-5, -2, -5}, {10, 4, 10}, [](const Vec3d& p) { return torusDistance(p, 1, 0.3); }));
  const Topology topology = closedManifold(mesh);
  EXPECT_EQ(topology.eulerCharacteristic, 0);
  EXPECT_EQ(topology.components, 1u);
  // 2 pi^2 R r^2; chords lose up to h^2 / r^2 of it.
  const double pi = std::acos(-1.0);
  EXPECT_NEAR(signedVolume(mesh) / (2 * pi * pi * 0.09), 1, 0.0278);
}

TEST(MarchingCubes, KeepsTwoLinkedToriApart) {
  const Mesh mesh = marchingCubes(makeLevelSet(0.05, {-5, -5, -5}, {13, 10, 10}, [](const Vec3d& p) {
    return std::max(torusDistance(p, 1, 0.25), torusDistance({p.x - 1, p.z, p.y}, 1, 0.25));
  }));
  const Topology topology = closedManifold(mesh);
  EXPECT_EQ(topology.eulerCharacteristic, 0);
  EXPECT_EQ(topology.components, 2u);
}

// A face of the table between two bricks, a brick's corner and its inner cells must all work alike.
TEST(MarchingCubes, ClosesEverySignPatternOfACell) {
  for (const Vec3i& cell : {Vec3i{3, 4, 5}, Vec3i{7, 7, 7}, Vec3i{7, 2, 15}, Vec3i{15, 15, 15}}) {
    for (int signs = 1; signs < 256; ++signs) {
      std::mt19937 random(static_cast<unsigned>(signs));
      const BrickGrid grid = makeGrid({0, 0, 0}, {3, 3, 3}, -1, [&](const Vec3i& v) {
        const Vec3i c = v - cell;
        if (std::min({c.x, c.y, c.z}) < 0 || std::max({c.x, c.y, c.z}) > 1) return -1.0f;
        return signs >> (c.x + 2 * c.y + 4 * c.z) & 1 ? 0.1f + 2e-10f * float(random()) : -0.6f;
      });
      const Mesh mesh = marchingCubes(grid);
      closedManifold(mesh);
      EXPECT_EQ(duplicatePositions(mesh), 0u) << signs;
      EXPECT_GT(signedVolume(mesh), 0) << signs;
      if (HasFailure()) FAIL() << "signs " << signs;
    }
  }
}

TEST(MarchingCubes, ClosesNoiseOfEverySeed) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    std::vector<float> noise(24 * 24 * 24);
    // Every fourth seed has few distinct values, so that saddles tie and samples equal the isovalue.
    for (float& v : noise) {
      v = seed % 4 == 3 ? float(int(random() % 5) - 2) : float(std::int32_t(random())) * 0x1p-31f;
    }
    const BrickGrid grid = makeGrid({-1, 0, 2}, {3, 3, 3}, -1, [&](const Vec3i& v) {
      const Vec3i at = v - Vec3i{-8, 0, 16};
      return noise[std::size_t((at.z * 24 + at.y) * 24 + at.x)];
    });
    const Mesh mesh = marchingCubes(grid, seed % 3 == 0 ? 0.25f : 0.0f);
    closedManifold(mesh);
    EXPECT_EQ(duplicatePositions(mesh), 0u);
    // Vertices about one sample are 1/4096 from it along different axes.
    EXPECT_GT(smallestArea(mesh), 0.5 / 4096 / 4096);
    EXPECT_GT(signedVolume(mesh), 0);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

// Smooth noise, thinned where bricks are constant: real and constant bricks of both signs meet in every way.
TEST(MarchingCubes, ClosesSurfacesBetweenConstantBricks) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::vector<int> kind(4 * 4 * 4);
    for (int& k : kind) k = int(random() % 3);
    const BrickGrid grid = makeGrid({0, 0, 0}, {4, 4, 4}, -1, [&](const Vec3i& v) {
      const int k = kind[std::size_t(((v.z / 8) * 4 + v.y / 8) * 4 + v.x / 8)];
      return k == 0   ? -1.0f
             : k == 1 ? 1.0f
                      : std::sin(1.3f * float(v.x)) + std::cos(1.7f * float(v.y) + 0.9f * float(v.z));
    });
    closedManifold(marchingCubes(grid));
    if (HasFailure()) FAIL() << "seed " << seed;
  }
}

TEST(MarchingCubes, ClosesAConstantBrickThatStandsAlone) {
  const Mesh mesh = marchingCubes(makeGrid({2, -3, 0}, {1, 1, 1}, -1, [](const Vec3i&) { return 1.0f; }));
  EXPECT_EQ(closedManifold(mesh).eulerCharacteristic, 2);
  // Samples 0 .. 7 are inside and the zero is half way to the background: an 8-cube with bevelled edges and
  // corners. Each of the 12 edges loses 7 x 1/8, each of the 8 corners 1/8 - 1/48: 512 - 10.5 - 5/6.
  EXPECT_NEAR(signedVolume(mesh), 512 - 10.5 - 5.0 / 6, 1e-9);
}

TEST(MarchingCubes, ClosesAShapeThatReachesTheEndOfTheTable) {
  const BrickGrid grid =
      makeLevelSet(0.1, {0, 0, 0}, {2, 2, 2}, [](const Vec3d& p) { return 1 - length(p); });
  const Mesh mesh = marchingCubes(grid);
  EXPECT_EQ(closedManifold(mesh).eulerCharacteristic, 2);
  // The octant of the ball, and at most a voxel more across the three cut faces.
  const double pi = std::acos(-1.0);
  EXPECT_GT(signedVolume(mesh), pi / 6 * 0.99);
  EXPECT_LT(signedVolume(mesh), pi / 6 + 3 * 0.1 * pi / 4 * 1.2);
}

TEST(MarchingCubes, LeavesAHoleWhereTheBackgroundIsInside) {
  const Mesh mesh = marchingCubes(makeGrid({0, 0, 0}, {2, 2, 2}, 1, [](const Vec3i& v) {
    return float(length(Vec3d(v) - Vec3d{8, 8, 8}) - 5);
  }));
  EXPECT_EQ(closedManifold(mesh).eulerCharacteristic, 2);
  EXPECT_LT(signedVolume(mesh), 0);
}

TEST(MarchingCubes, PutsTheSurfaceWhereTheIsovalueIs) {
  for (const float isovalue : {-0.1f, 0.05f, 0.12f}) {
    double mean = 0;
    const Mesh mesh = marchingCubes(makeSphere(1, 0.05), isovalue);
    for (const Vec3d& p : mesh.positions) mean += length(p) / double(mesh.positions.size());
    // Linear zeros of a distance lie inside the sphere by at most h^2 / 8.
    EXPECT_NEAR(mean, 1 - isovalue, 0.05 * 0.05 / 8) << isovalue;
  }
}

// All samples of a plane at integer height equal the isovalue: they count as outside, so the slab ends just
// within it.
TEST(MarchingCubes, TakesSamplesAtTheIsovalueAsOutside) {
  const Mesh mesh = marchingCubes(makeGrid({0, 0, 0}, {2, 2, 2}, -1, [](const Vec3i& v) {
    return float(4 - std::max({std::abs(v.x - 8), std::abs(v.y - 8), std::abs(v.z - 8)}));
  }));
  EXPECT_EQ(closedManifold(mesh).eulerCharacteristic, 2);
  EXPECT_EQ(duplicatePositions(mesh), 0u);
  EXPECT_GT(smallestArea(mesh), 0);
  double reach = 0;
  for (const Vec3d& p : mesh.positions) {
    reach = std::max({reach, std::abs(p.x - 8), std::abs(p.y - 8), std::abs(p.z - 8)});
  }
  EXPECT_DOUBLE_EQ(reach, 4 - 1.0 / 4096);
}

// On a face with values 2, -1, 2, -1 round it the bilinear saddle is 1/2, inside: the inside corners are
// joined, and two boxes that touch along this diagonal are one. With 1, -2, 1, -2 the saddle is -1/2 and they
// are two.
TEST(MarchingCubes, JoinsDiagonalCornersWhereTheSaddleIsInside) {
  const auto components = [](float inside, float outside) {
    return closedManifold(marchingCubes(makeGrid({0, 0, 0}, {1, 1, 1}, outside,
                                                 [=](const Vec3i& v) {
                                                   const bool isInside =
                                                       v.z == 3 &&
                                                       ((v.x == 3 && v.y == 3) || (v.x == 4 && v.y == 4));
                                                   return isInside ? inside : outside;
                                                 })))
        .components;
  };
  EXPECT_EQ(components(2, -1), 1u);
  EXPECT_EQ(components(1, -2), 2u);
}

TEST(MarchingCubes, MakesTheSameMeshWithAnyNumberOfThreads) {
  const BrickGrid grid = makeSphere(1, 0.03);
  const Mesh reference = marchingCubes(grid);
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const Mesh mesh = marchingCubes(grid);
    EXPECT_EQ(mesh.positions, reference.positions);
    EXPECT_EQ(mesh.corners, reference.corners);
    EXPECT_EQ(mesh.faceStart, reference.faceStart);
  }
}

TEST(MarchingCubes, StaysOutwardUnderAMirroredMap) {
  BrickGrid grid = makeSphere(1, 0.1);
  grid.setLattice(Lattice::of({Mat3f{{-0.1f, 0, 0, 0, 0.1f, 0, 0, 0, 0.1f}}, {}}));
  const Mesh mesh = marchingCubes(grid);
  closedManifold(mesh);
  EXPECT_GT(signedVolume(mesh), 0);
}

TEST(MarchingCubes, StaysClosedAndFiniteWithInfiniteSamples) {
  const float infinity = std::numeric_limits<float>::infinity();
  const Mesh mesh = marchingCubes(makeGrid({0, 0, 0}, {2, 2, 2}, -infinity, [&](const Vec3i& v) {
    const double d = 5 - length(Vec3d(v) - Vec3d{8, 8, 8});
    return d > 1 ? infinity : d < -1 ? -infinity : float(d);
  }));
  EXPECT_EQ(closedManifold(mesh).eulerCharacteristic, 2);
  EXPECT_TRUE(
      std::all_of(mesh.positions.begin(), mesh.positions.end(), [](const Vec3d& p) { return isFinite(p); }));
}

TEST(MarchingCubes, MakesNothingWhereTheIsovalueIsNotCrossed) {
  const Mesh mesh = marchingCubes(makeSphere(1, 0.1), 10.0f);
  EXPECT_EQ(mesh.faceCount(), 0u);
  EXPECT_EQ(mesh.positions.size(), 0u);
}

TEST(MarchingCubes, RefusesBadArguments) {
  const BrickGrid grid = makeSphere(1, 0.2);
  EXPECT_THROW(marchingCubes(grid, std::numeric_limits<float>::quiet_NaN()), Error);
  EXPECT_THROW(marchingCubes(grid, std::numeric_limits<float>::infinity()), Error);
}

TEST(MarchingCubes, RefusesNaNNearTheSurface) {
  BrickGrid grid = makeSphere(1, 0.1);
  for (std::size_t i = BrickGrid::kVolume; i < grid.values().size(); i += 97) {
    grid.brick(0)[i] = std::numeric_limits<float>::quiet_NaN();
  }
  EXPECT_THROW(marchingCubes(grid), Error);
}

TEST(MarchingCubes, StopsWhenCancelled) {
  class Cancel : public Progress {
   public:
    bool cancelled() const override { return true; }
  };
  EXPECT_THROW(marchingCubes(makeSphere(1, 0.1), 0, Cancel()), Cancelled);
}

}  // namespace
}  // namespace nephele
