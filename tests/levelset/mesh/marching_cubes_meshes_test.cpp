// Closed meshes made by others, through the level set and back: the same topology, within half a voxel.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <unordered_map>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/adaptive_mesh.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/test_data.h"

namespace nephele {
namespace {

using test::Topology;
using test::topologyOf;

Vec3d closestPoint(const Vec3d& p, const std::array<Vec3d, 3>& t) {
  const Vec3d u = t[1] - t[0], v = t[2] - t[0];
  const Vec3d n = cross(u, v);
  const double area = dot(n, n);
  if (area > 0) {
    const Vec3d w = p - t[0];
    const double b = dot(cross(w, v), n) / area;
    const double c = dot(cross(u, w), n) / area;
    if (b >= 0 && c >= 0 && b + c <= 1) return t[0] + u * b + v * c;
  }
  Vec3d best = t[0];
  for (int i = 0; i < 3; ++i) {
    const Vec3d a = t[i], e = t[(i + 1) % 3] - t[i];
    const double s = dot(e, e) > 0 ? std::clamp(dot(p - a, e) / dot(e, e), 0.0, 1.0) : 0.0;
    if (length(a + e * s - p) < length(best - p)) best = a + e * s;
  }
  return best;
}

// How many points are farther than `reach` from the triangles of `mesh`; triangles are kept in cells
// of the size of `reach`.
std::size_t countFartherThan(double reach, const std::vector<Vec3d>& points, const Mesh& mesh) {
  const auto cellOf = [&](double x) { return std::int64_t(std::floor(x / reach)); };
  const auto keyOf = [](std::int64_t x, std::int64_t y, std::int64_t z) {
    return (x * 2097593 + y) * 2097593 + z;
  };
  std::unordered_map<std::int64_t, std::vector<std::uint32_t>> pointsIn;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    pointsIn[keyOf(cellOf(points[i].x), cellOf(points[i].y), cellOf(points[i].z))].push_back(i);
  }
  std::vector<bool> isNear(points.size());
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    const std::array<Vec3d, 3> t{mesh.positions[face[0]], mesh.positions[face[1]], mesh.positions[face[2]]};
    const Vec3d margin{reach, reach, reach};
    const Vec3d low = min(t[0], min(t[1], t[2])) - margin;
    const Vec3d high = max(t[0], max(t[1], t[2])) + margin;
    for (std::int64_t z = cellOf(low.z); z <= cellOf(high.z); ++z) {
      for (std::int64_t y = cellOf(low.y); y <= cellOf(high.y); ++y) {
        for (std::int64_t x = cellOf(low.x); x <= cellOf(high.x); ++x) {
          const auto cell = pointsIn.find(keyOf(x, y, z));
          if (cell == pointsIn.end()) continue;
          for (const std::uint32_t i : cell->second) {
            if (!isNear[i] && length(closestPoint(points[i], t) - points[i]) <= reach) isNear[i] = true;
          }
        }
      }
    }
  }
  return std::size_t(std::count(isNear.begin(), isNear.end(), false));
}

// Where a solid thins out to a knife's edge, samples near the edge can be the only ones inside among their
// neighbours, at any voxel size. Such an island is a true part of the grid, but not of the shape: it encloses
// less than a voxel.
Mesh withoutIslands(const Mesh& mesh, double voxelVolume) {
  std::vector<std::uint32_t> part(mesh.positions.size());
  std::iota(part.begin(), part.end(), 0u);
  const auto root = [&](std::uint32_t v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  for (std::size_t c = 0; c < mesh.corners.size(); c += 3) {
    part[root(mesh.corners[c])] = root(mesh.corners[c + 1]);
    part[root(mesh.corners[c])] = root(mesh.corners[c + 2]);
  }
  std::vector<double> volume(mesh.positions.size());
  const auto corner = [&](std::size_t c) {
    return mesh.positions[mesh.corners[c]] - mesh.positions[mesh.corners[0]];
  };
  for (std::size_t c = 0; c < mesh.corners.size(); c += 3) {
    volume[root(mesh.corners[c])] += dot(corner(c), cross(corner(c + 1), corner(c + 2))) / 6;
  }
  Mesh kept;
  std::vector<std::uint32_t> newIndex(mesh.positions.size());
  for (std::uint32_t v = 0; v < mesh.positions.size(); ++v) {
    if (std::abs(volume[root(v)]) < voxelVolume) continue;
    newIndex[v] = std::uint32_t(kept.positions.size());
    kept.positions.push_back(mesh.positions[v]);
  }
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto t = mesh.face(f);
    if (std::abs(volume[root(t[0])]) < voxelVolume) continue;
    kept.addFace(std::array{newIndex[t[0]], newIndex[t[1]], newIndex[t[2]]});
  }
  return kept;
}

struct ClosedMesh {
  const char* name;
  /// V - E + F, from the table of the shared data (counted there on the merged polygon mesh).
  long eulerCharacteristic;
  /// Voxels along the longest side: 128, or what its thinnest part needs.
  int resolution = 128;
  /// In voxels. Where a mesh passes through itself, samples beside the crease are as near to its inner
  /// sheets, which the level set leaves out, and their zero moves by up to a voxel.
  double tolerance = 0.5;
};

void PrintTo(const ClosedMesh& mesh, std::ostream* out) {
  *out << mesh.name;
}

class MarchingCubesOnMeshes : public testing::TestWithParam<ClosedMesh> {};

TEST_P(MarchingCubesOnMeshes, KeepTopologyAndPlace) {
  const std::string path = test::sharedData(std::string("meshes/") + GetParam().name);
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh source = triangulated(readMesh(path));
  const double voxelSize = double(boundingBox(source).longestSide()) / GetParam().resolution;
  const Mesh mesh = marchingCubes(*toBricks(meshToLevelSet(source, {.voxelSize = voxelSize})));

  EXPECT_TRUE(topologyOf(mesh).isClosedManifold()) << topologyOf(mesh);
  const Topology topology = topologyOf(withoutIslands(mesh, std::pow(voxelSize, 3)));
  EXPECT_TRUE(topology.isClosedManifold()) << topology;
  EXPECT_EQ(topology.eulerCharacteristic, GetParam().eulerCharacteristic) << topology;
  EXPECT_GT(signedVolume(mesh), 0);
  EXPECT_EQ(countFartherThan(GetParam().tolerance * voxelSize, mesh.positions, source), 0u)
      << "of " << mesh.positions.size();
}

INSTANTIATE_TEST_SUITE_P(
    SharedMeshes, MarchingCubesOnMeshes,
    testing::Values(ClosedMesh{"adis16480_cad_ascii.stl", -46, 160}, ClosedMesh{"armadillo_29k.obj", 2},
                    ClosedMesh{"boat_uv.obj", 2}, ClosedMesh{"bob_uv_genus1.obj", 0},
                    ClosedMesh{"box_ascii.stl", 2}, ClosedMesh{"box_binary.stl", 2},
                    ClosedMesh{"box_textured.glb", 2}, ClosedMesh{"bunny_28k_uv.ply", 2},
                    ClosedMesh{"bunny_60k.obj", 2}, ClosedMesh{"bunny_7k.obj", 2},
                    ClosedMesh{"cube_binary_crlf_header.ply", 2}, ClosedMesh{"cube_quads_ascii.ply", 2},
                    ClosedMesh{"cube_uv.obj", 2}, ClosedMesh{"dodecahedron_ngons.obj", 2},
                    ClosedMesh{"double_torus_genus2.obj", -2}, ClosedMesh{"drop_uv.obj", 2},
                    ClosedMesh{"duck.glb", 2, 128, 1.0}, ClosedMesh{"fandisk_13k.obj", 2},
                    ClosedMesh{"fertility_genus4.off", -6}, ClosedMesh{"fox_binary.ply", 2},
                    ClosedMesh{"hexa_sphere_ngons.obj", 2}, ClosedMesh{"knot_quads.obj", 0},
                    ClosedMesh{"knot_tiled_uv.obj", 0}, ClosedMesh{"koala_100k.obj", 2},
                    ClosedMesh{"multi_uv_box.glb", 2}, ClosedMesh{"negative_indices_uv.obj", 2},
                    ClosedMesh{"rocker_arm_genus1.obj", 0}, ClosedMesh{"scorpion_13k.obj", 2},
                    ClosedMesh{"sphere_1k.obj", 2}, ClosedMesh{"sphere_ico_mirrored_uv.obj", 2},
                    ClosedMesh{"sphere_uv.obj", 2}, ClosedMesh{"spot_control_quads_uv.obj", 2, 128, 1.0},
                    ClosedMesh{"spot_quads_uv.obj", 2}, ClosedMesh{"spot_remesh_23k.obj", 2},
                    ClosedMesh{"spot_uv.obj", 2}, ClosedMesh{"torus_genus1.obj", 0},
                    ClosedMesh{"torus_quads_uv.obj", 0}, ClosedMesh{"vase_binary.stl", 2}),
    [](const auto& test) {
      std::string name = test.param.name;
      std::replace(name.begin(), name.end(), '.', '_');
      return name;
    });

TEST(AdaptiveMesh, ShowsTheSurfaceOfMarchingCubes) {
  const std::string path = test::sharedData("meshes/torus_genus1.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const double voxelSize = 0.03;
  const auto levelSet = toBricks(meshToLevelSet(triangulated(readMesh(path)), {.voxelSize = voxelSize}));
  for (const double isovalue : {-0.04, 0.0, 0.04}) {
    const Mesh cubes = marchingCubes(*levelSet, float(isovalue));
    const Mesh dual = adaptiveMesh(*levelSet, isovalue, 0);
    EXPECT_TRUE(topologyOf(dual).isClosedManifold()) << topologyOf(dual);
    EXPECT_EQ(topologyOf(dual).eulerCharacteristic, 0);
    EXPECT_GT(signedVolume(dual), 0);
    EXPECT_EQ(countFartherThan(0.5 * voxelSize, dual.positions, cubes), 0u) << isovalue;
  }
}

TEST(AdaptiveMesh, HasFewerFacesWithMoreAdaptivity) {
  const std::string path = test::sharedData("meshes/rocker_arm_genus1.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const auto levelSet = toBricks(meshToLevelSet(triangulated(readMesh(path)), {.voxelSize = 0.005}));
  const Mesh fine = adaptiveMesh(*levelSet, 0, 0);
  const Mesh coarse = adaptiveMesh(*levelSet, 0, 0.5);
  EXPECT_LT(2 * coarse.faceCount(), fine.faceCount());
  EXPECT_NEAR(signedVolume(coarse) / signedVolume(fine), 1, 0.01);
}

// Powers of two round nothing, so that all is the same but for the unit.
TEST(AdaptiveMesh, HasTheSameFacesInAnyUnits) {
  const auto meshOf = [](int power) {
    const float radius = std::ldexp(1.0f, power), side = 1.25f * radius, voxel = radius / 16;
    return adaptiveMesh(
        *bakeGrid(sphere({0, 0, 0}, radius), {.voxelSize = voxel,
                                              .box = {{-side, -side, -side}, {side, side, side}},
                                              .band = {-3 * voxel, 3 * voxel}}),
        0, 0.5);
  };
  const Mesh mesh = meshOf(0);
  for (const int power : {-30, 30}) {
    const Mesh other = meshOf(power);
    EXPECT_EQ(other.corners, mesh.corners) << power;
    ASSERT_EQ(other.positions.size(), mesh.positions.size()) << power;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
      EXPECT_EQ(other.positions[i], mesh.positions[i] * std::ldexp(1.0, power));
  }
}

TEST(AdaptiveMesh, TakesDensitiesAsInsideWhereTheyAreHigh) {
  const std::string path = test::sharedData("volumes/dragon_small_fog.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const auto fog = toBricks(readScalarGrid(path));
  const Mesh dual = adaptiveMesh(*fog, 0.5, 0);
  const Mesh cubes = marchingCubes(*fog, 0.5f);
  EXPECT_TRUE(topologyOf(cubes).isClosedManifold()) << topologyOf(cubes);
  EXPECT_GT(signedVolume(dual), 0);
  EXPECT_GT(signedVolume(cubes), 0);
  // Both enclose the density above 0.5; thin parts of a voxel's width make the difference.
  EXPECT_NEAR(signedVolume(dual) / signedVolume(cubes), 1, 0.05);
}

TEST(AdaptiveMesh, RefusesBadArguments) {
  const std::string path = test::sharedData("volumes/dragon_small_fog.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const auto fog = toBricks(readScalarGrid(path));
  for (const double adaptivity : {-0.1, 1.1, std::nan("")})
    EXPECT_THROW(adaptiveMesh(*fog, 0.5, adaptivity), Error);
  EXPECT_THROW(adaptiveMesh(*fog, std::nan(""), 0), Error);
}

// A mirrored lattice turns faces inside out unless they are wound the other way.
TEST(AdaptiveMesh, IsOutwardInMirroredLattices) {
  const double radius = 8;
  Affine mirrored{Mat3f::scaling(0.5f), {}};
  mirrored.linear(0, 0) = -0.5f;
  const auto ball = [&](const Affine& toWorld) {
    VoxelGrid<float> grid("ball", Lattice{toWorld, inverse(toWorld), 0.5f}, -1.5f);
    for (int bz = -2; bz != 2; ++bz)
      for (int by = -2; by != 2; ++by)
        for (int bx = -2; bx != 2; ++bx) {
          float* samples = grid.add({bx, by, bz});
          for (int z = 0; z != 8; ++z)
            for (int y = 0; y != 8; ++y)
              for (int x = 0; x != 8; ++x)
                *samples++ = float(
                    std::clamp(0.5 * (radius - std::hypot(8 * bx + x, 8 * by + y, 8 * bz + z)), -1.5, 1.5));
        }
    return toBricks(grid);
  };
  for (const double adaptivity : {0.0, 0.3})
    EXPECT_NEAR(signedVolume(adaptiveMesh(*ball(mirrored), 0, adaptivity)),
                signedVolume(adaptiveMesh(*ball({Mat3f::scaling(0.5f), {}}), 0, adaptivity)), 1e-3);
  EXPECT_GT(signedVolume(adaptiveMesh(*ball(mirrored), 0, 0)), 0);
}

}  // namespace
}  // namespace nephele
