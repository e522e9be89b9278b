#include "nephele/levelset/mesh/mesh_to_level_set.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/isosurface_volume.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_band.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/triangle_kernels.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

/// Calls visit(value, world position) for every own sample of every brick that is not constant.
template <class Visit>
void forEachSample(const BrickGrid& grid, const Visit& visit) {
  for (int bz = 0; bz < grid.brickCount().z; ++bz)
    for (int by = 0; by < grid.brickCount().y; ++by)
      for (int bx = 0; bx < grid.brickCount().x; ++bx) {
        const Vec3i b = grid.firstBrick() + Vec3i{bx, by, bz};
        const std::int32_t pool = grid.poolIndex(b);
        if (grid.ranges()[std::size_t(pool)].isPoint()) continue;
        for (int z = 0; z < 8; ++z)
          for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x)
              visit(grid.brick(pool)[((z + 1) * 11 + y + 1) * 11 + x + 1],
                    grid.indexToWorld()(Vec3f(Vec3i{b.x * 8 + x, b.y * 8 + y, b.z * 8 + z})));
      }
}

TEST(MeshToLevelSet, MatchesTheDistanceOfASphere) {
  // Closed form: r - |x|. A split-5 icosphere lies within 3e-4 r of it (sagitta of its edges).
  const Mesh mesh = icosphere(1.0, 5, {0.3, -0.2, 0.1});
  constexpr double kVoxel = 0.04;
  const auto bricks = toBricks(meshToLevelSet(mesh, {.voxelSize = kVoxel, .halfWidthVoxels = 3}));
  double worst = 0;
  std::size_t inBand = 0;
  forEachSample(*bricks, [&](float value, const Vec3f& p) {
    const double exact = 1.0 - length(Vec3d(p) - Vec3d(0.3, -0.2, 0.1));
    if (std::abs(exact) > 2.99 * kVoxel) return;
    ++inBand;
    worst = std::max(worst, std::abs(value - exact));
  });
  EXPECT_GT(inBand, 40000u);  // 4 pi r^2 * 6 h / h^3 = 47124
  EXPECT_LT(worst, 4e-4);
}

TEST(MeshToLevelSet, MatchesTheDistanceOfATorus) {
  const Mesh mesh = torusMesh(1.0, 0.4, 256, 128);
  constexpr double kVoxel = 0.03;
  const auto bricks = toBricks(meshToLevelSet(mesh, {.voxelSize = kVoxel}));
  double worst = 0;
  forEachSample(*bricks, [&](float value, const Vec3f& p) {
    const double exact = 0.4 - std::hypot(std::hypot(p.x, p.y) - 1.0, p.z);
    if (std::abs(exact) < 2.9 * kVoxel) worst = std::max(worst, std::abs(value - exact));
  });
  // Sagitta of the edges: (2 pi 1.4 / 256)^2 / (8 * 1.4) + (2 pi 0.4 / 128)^2 / (8 * 0.4) = 2.3e-4.
  EXPECT_LT(worst, 3e-4);
}

TEST(MeshToLevelSet, EnclosesTheVolumeOfTheMesh) {
  // 4/3 pi, and 2 pi^2 R r^2; the bar is 1 %. The inscribed meshes hold 0.1 % and 0.05 % less.
  const auto sphere = meshToLevelSet(icosphere(1.0, 5), {.voxelSize = 0.05});
  EXPECT_NEAR(enclosedVolume(sphere) / (4.0 / 3.0 * M_PI), 1.0, 2e-3);
  const auto torus = meshToLevelSet(torusMesh(1.0, 0.4, 256, 128), {.voxelSize = 0.03});
  EXPECT_NEAR(enclosedVolume(torus) / (2 * M_PI * M_PI * 0.16), 1.0, 3e-3);
}

TEST(MeshToLevelSet, ActiveVoxelsAreTheBand) {
  // A slab of 2 w voxels about the sphere: volume of the shell over h^3.
  for (const double width : {1.0, 3.0, 6.5}) {
    const VdbGridInfo info =
        describe(toVdb(meshToLevelSet(icosphere(1.0, 5), {.voxelSize = 0.05, .halfWidthVoxels = width}),
                       {"surface", VdbGridInfo::Class::levelSet}));
    const double half = width * 0.05;
    const double shell = 4.0 / 3.0 * M_PI * (std::pow(1 + half, 3) - std::pow(1 - half, 3));
    EXPECT_NEAR(double(info.activeVoxels) / (shell / std::pow(0.05, 3)), 1.0, 0.01) << width;
    EXPECT_FLOAT_EQ(info.background, float(half));
    EXPECT_EQ(info.gridClass, VdbGridInfo::Class::levelSet);
    EXPECT_EQ(info.name, "surface");
    EXPECT_FLOAT_EQ(info.voxelSize.x, 0.05f);
    EXPECT_TRUE(info.uniform);
  }
}

TEST(MeshToLevelSet, LargeFlatTrianglesGiveExactDistances) {
  // Inside and outside a box of 12 triangles, 64 voxels a side: the distance to a box in closed form.
  const auto bricks = toBricks(meshToLevelSet(boxMesh({-1, -1, -1}, {1, 1, 1}), {.voxelSize = 1.0 / 32}));
  double worst = 0;
  forEachSample(*bricks, [&](float value, const Vec3f& p) {
    const Vec3d q{std::abs(p.x) - 1.0, std::abs(p.y) - 1.0, std::abs(p.z) - 1.0};
    const double exact = -length(max(q, Vec3d{})) - std::min(std::max({q.x, q.y, q.z}), 0.0);
    if (std::abs(exact) < 2.9 / 32) worst = std::max(worst, std::abs(value - exact));
  });
  EXPECT_LT(worst, 1e-6);
}

TEST(MeshToLevelSet, CavitiesAreOutside) {
  Mesh inner = icosphere(0.5, 4);
  for (std::size_t f = 0; f < inner.faceCount(); ++f)
    std::swap(inner.corners[3 * f], inner.corners[3 * f + 1]);
  const auto grid = meshToLevelSet(joined(icosphere(1.0, 4), inner), {.voxelSize = 0.04});
  EXPECT_NEAR(enclosedVolume(grid), 4.0 / 3.0 * M_PI * (1 - 0.125), 0.02);
  EXPECT_LT(toBricks(grid)->at({0, 0, 0}), 0.0f);
}

TEST(MeshToLevelSet, VerticesNeedNotBeShared) {
  const Mesh mesh = icosphere(1.0, 4);
  const auto shared = toBricks(meshToLevelSet(mesh, {.voxelSize = 0.05}));
  const auto soup = toBricks(meshToLevelSet(unshared(mesh), {.voxelSize = 0.05}));
  EXPECT_EQ(shared->table(), soup->table());
  EXPECT_EQ(shared->values(), soup->values());
}

/// Two spheres, one inside the other: a wall.
Mesh shellMesh(double radius, double wall) {
  Mesh inner = icosphere(radius - wall, 5);
  for (std::size_t f = 0; f < inner.faceCount(); ++f)
    std::swap(inner.corners[3 * f], inner.corners[3 * f + 1]);
  return joined(icosphere(radius, 5), inner);
}

// Between 0.43 and 0.46 of a voxel the sum of shares is the wall's volume by chance, and marching cubes leave
// a tenth of it.
TEST(MeshToLevelSet, WallsThatMarchingCubesWouldLoseAreRefused) {
  const double wall = 0.007;
  for (const double voxels : {0.43, 0.445, 0.46}) try {
      meshToLevelSet(shellMesh(1.0, wall), {.voxelSize = wall / voxels});
      ADD_FAILURE() << voxels;
    } catch (const Error& error) {
      const std::string message = error.what();
      EXPECT_NE(message.find("too thin"), std::string::npos) << message;
      double x = 0, y = 0, z = 0;
      const std::size_t at = message.find("near (");
      ASSERT_NE(at, std::string::npos) << message;
      ASSERT_EQ(std::sscanf(message.c_str() + at, "near (%lf, %lf, %lf)", &x, &y, &z), 3);
      // The middle of a brick that the sphere goes through: half its diagonal away at most.
      EXPECT_NEAR(std::hypot(x, y, z), 1.0, 4 * std::sqrt(3.0) * wall / voxels) << message;
      // The resolution that it names holds the wall.
      int resolution = 0;
      ASSERT_EQ(
          std::sscanf(message.c_str() + message.find("try resolution"), "try resolution %d", &resolution), 1);
      EXPECT_NO_THROW(meshToLevelSet(shellMesh(1.0, wall), {.voxelSize = 2.0 / resolution})) << resolution;
    }
}

// The volumes of thin tori, as marching cubes give them, decide between silence, a note and an error.
TEST(MeshToLevelSet, SaysByHowMuchItIsOffAndFailsWhereThatIsTooMuch) {
  struct Notes final : Progress {
    void note(std::string_view text) const override { notes.emplace_back(text); }
    mutable std::vector<std::string> notes;
  };
  int silent = 0, noted = 0, refused = 0;
  for (const double radius : {0.02, 0.04, 0.06, 0.08, 0.12, 0.25}) {
    const Mesh mesh = torusMesh(1.0, radius, 256, 64);
    const double volume = signedVolume(mesh);
    const auto errorOf = [&](const VoxelGrid<float>& grid) {
      return std::max(std::abs(enclosedVolume(grid) / volume - 1),
                      std::abs(signedVolume(marchingCubes(*toBricks(grid))) / volume - 1));
    };
    const double error =
        errorOf(meshToLevelSet(mesh, {.voxelSize = 0.04, .mostVolumeError = 100}, nephele::silent()));
    const Notes progress;
    try {
      meshToLevelSet(mesh, {.voxelSize = 0.04}, progress);
      EXPECT_LT(error, 0.1) << radius;
      EXPECT_TRUE(error > 0.01 || progress.notes.empty()) << radius;
      if (error > 0.02) {
        ASSERT_EQ(progress.notes.size(), 1u) << radius;
        EXPECT_NE(progress.notes[0].find("% apart"), std::string::npos) << progress.notes[0];
        EXPECT_NE(progress.notes[0].find("try resolution"), std::string::npos) << progress.notes[0];
      }
      ++(progress.notes.empty() ? silent : noted);
    } catch (const Error&) {
      EXPECT_GE(error, 0.1) << radius;
      ++refused;
    }
    // A limit just above and just below what it is.
    EXPECT_NO_THROW(meshToLevelSet(mesh, {.voxelSize = 0.04, .mostVolumeError = 1.01 * error}));
    EXPECT_THROW(meshToLevelSet(mesh, {.voxelSize = 0.04, .mostVolumeError = 0.99 * error}), Error);
  }
  EXPECT_GT(silent, 0);
  EXPECT_GT(noted, 0);
  EXPECT_GT(refused, 0);
}

TEST(MeshToLevelSet, TheSurfaceEnclosesWhatMarchingCubesGive) {
  const auto grid = meshToLevelSet(torusMesh(1.0, 0.4, 96, 48), {.voxelSize = 0.05});
  const double mesh = signedVolume(marchingCubes(*toBricks(grid)));
  EXPECT_NEAR(detail::isosurfaceVolume(grid) / mesh, 1, 1e-6);
}

// A factor of 2^-17 changes no digit of the mesh, and so none of the level set.
TEST(MeshToLevelSet, TinyModelsAreLikeLargeOnes) {
  const double tiny = std::ldexp(1.0, -17);
  for (const bool crossing : {false, true}) {
    Mesh large = crossing ? joined(icosphere(1, 3), icosphere(1, 3, {0.5, 0, 0})) : icosphere(1, 3),
         small = large;
    for (Vec3d& p : small.positions) p = p * tiny;
    const auto of = toBricks(meshToLevelSet(large, {.voxelSize = 0.0625}));
    const auto small0 = meshToLevelSet(small, {.voxelSize = 0.0625 * tiny});
    const VdbGridInfo info = describe(toVdb(meshToLevelSet(small, {.voxelSize = 0.0625 * tiny}),
                                            {"surface", VdbGridInfo::Class::levelSet}));
    EXPECT_FLOAT_EQ(info.voxelSize.x, float(0.0625 * tiny));
    const auto to = toBricks(small0);
    ASSERT_EQ(of->values().size(), to->values().size());
    double worst = 0;
    for (std::size_t i = 0; i != of->values().size(); ++i)
      worst = std::max(worst, std::abs(double(of->values()[i]) - double(to->values()[i]) / tiny));
    EXPECT_LT(worst, crossing ? 1e-6 : 1e-7);
  }
}

TEST(MeshToLevelSet, OverlappingPartsBecomeTheirUnion) {
  // Two unit spheres, centres 1 apart: 2 * 4/3 pi - lens, lens = pi (4 + d) (2 - d)^2 / 12 = 5 pi / 12.
  const Mesh mesh = joined(icosphere(1.0, 4), icosphere(1.0, 4, {1.0, 0.013, 0.007}));
  EXPECT_FALSE(detail::signedBand(detail::surfaceGeometry(mesh), {.voxelSize = 0.05}, silent()).has_value());
  const auto grid = meshToLevelSet(mesh, {.voxelSize = 0.05});
  EXPECT_NEAR(enclosedVolume(grid), 8.0 / 3.0 * M_PI - 5.0 * M_PI / 12.0, 0.05);
}

// Two crossing plates a tenth of a voxel thick: that they overlap is no excuse for a volume that is not
// theirs.
TEST(MeshToLevelSet, OverlappingPartsTooThinForTheVoxelsAreRefused) {
  const Mesh plates = joined(boxMesh({-1, -1, -0.01}, {1, 1, 0.01}), boxMesh({-1, -0.01, -1}, {1, 0.01, 1}));
  try {
    meshToLevelSet(plates, {.voxelSize = 0.2});
    FAIL() << "a wrong volume was accepted";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("too thin"), std::string::npos) << error.what();
  }
}

TEST(MeshToLevelSet, SignAgreesWithOpenVdbAwayFromTheSurface) {
  const std::string path = sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = triangulated(readMesh(path));
  const detail::BandOptions options{.voxelSize = boundingBox(mesh).longestSide() / 128.0};
  const auto band = detail::signedBand(detail::surfaceGeometry(mesh), options, silent());
  ASSERT_TRUE(band.has_value());
  const auto ours = toBricks(*band, Beside::constant);
  const auto theirs = toBricks(detail::floodedBand(mesh, options, silent()));
  std::size_t compared = 0, different = 0;
  for (int z = -8; z < 8 * ours->brickCount().z; ++z)
    for (int y = 0; y < 8 * ours->brickCount().y; y += 3)
      for (int x = 0; x < 8 * ours->brickCount().x; x += 3) {
        const Vec3i v{ours->firstBrick().x * 8 + x, ours->firstBrick().y * 8 + y,
                      ours->firstBrick().z * 8 + z};
        const float a = ours->at(v), b = theirs->at(v);
        if (std::abs(a) < 0.9 * options.voxelSize) continue;
        ++compared;
        different += (a > 0) != (b > 0);
      }
  EXPECT_GT(compared, 100000u);
  EXPECT_EQ(different, 0u);
}

TEST(MeshToLevelSet, IsTheSameAtAnyThreadCount) {
  const Mesh mesh = torusMesh(1.0, 0.4, 96, 48);
  std::vector<detail::UnsetVector<float>> results;
  for (const std::size_t threads : {1u, 4u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(toBricks(meshToLevelSet(mesh, {.voxelSize = 0.03}))->values());
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(MeshToLevelSet, RefusesWhatIsTooThinNamingBothVolumes) {
  // A plate a tenth of a voxel thick, between samples: the grid encloses next to nothing of its volume.
  const Mesh plate = boxMesh({0.01, 0.01, 0.031}, {1.01, 1.01, 0.036});
  try {
    meshToLevelSet(plate, {.voxelSize = 0.05});
    FAIL() << "accepted";
  } catch (const Error& e) {
    const std::string message = e.what();
    EXPECT_NE(message.find("0.005"), std::string::npos) << message;
    EXPECT_NE(message.find("resolution"), std::string::npos) << message;
  }
}

TEST(MeshToLevelSet, RefusesAnOpenMesh) {
  Mesh mesh = icosphere(1.0, 3);
  mesh.corners.resize(mesh.corners.size() - 3 * 8);
  mesh.faceStart.resize(mesh.faceStart.size() - 8);
  EXPECT_THROW(meshToLevelSet(mesh, {.voxelSize = 0.05}), Error);
}

TEST(MeshToLevelSet, SolidsThatShareAnEdgeAreConverted) {
  // Two boxes that touch along an edge: four faces meet there, and the mesh still bounds a solid.
  Mesh mesh = joined(boxMesh({0, 0, 0}, {1, 1, 1}), boxMesh({1, 1, 0}, {2, 2, 1}));
  EXPECT_NEAR(enclosedVolume(meshToLevelSet(mesh, {.voxelSize = 0.04})), 2.0, 0.01);
}

TEST(MeshToLevelSet, RefusesWrongArguments) {
  const Mesh mesh = icosphere(1.0, 1);
  EXPECT_THROW(meshToLevelSet(mesh, {.voxelSize = 0.0}), Error);
  EXPECT_THROW(meshToLevelSet(mesh, {.voxelSize = NAN}), Error);
  EXPECT_THROW(meshToLevelSet(mesh, {.voxelSize = 0.1, .halfWidthVoxels = 0.5}), Error);
  EXPECT_THROW(meshToLevelSet(Mesh{}, {.voxelSize = 0.1}), Error);
  EXPECT_THROW(meshToLevelSet(mesh, {.voxelSize = 1e-9}), Error);
  Mesh bad = mesh;
  bad.positions[0].x = NAN;
  EXPECT_THROW(meshToLevelSet(bad, {.voxelSize = 0.1}), Error);
}

TEST(MeshToLevelSet, StopsWhenCancelled) {
  struct Stop final : Progress {
    bool cancelled() const override { return true; }
  };
  EXPECT_THROW(meshToLevelSet(icosphere(1.0, 4), {.voxelSize = 0.02}, Stop()), Cancelled);
}

TEST(MeshToLevelSet, EstimatesItsMemoryWithinAFactorOfThree) {
  // The band itself, and as much beside it while it is made.
  const Mesh mesh = icosphere(1.0, 5);
  const MeshToLevelSetOptions options{.voxelSize = 0.01};
  const auto band = detail::signedBand(detail::surfaceGeometry(mesh), {.voxelSize = 0.01}, silent());
  const double held = 2 * double(band->memoryBytes());
  const double estimate = estimateLevelSetBytes(mesh, options);
  EXPECT_GT(estimate, held);
  EXPECT_LT(estimate, 3 * held);
}

TEST(MeshToLevelSet, RealMeshesKeepTheirVolume) {
  // ALGORITHMS: within 1 %; volumes of the closed meshes from their own triangles.
  for (const char* name : {"meshes/bunny_7k.obj", "meshes/spot_uv.obj", "meshes/fertility_genus4.off"}) {
    const std::string path = sharedData(name);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const RepairedMesh repaired = repairMesh(readMesh(path));
    const double h = repaired.after.box.longestSide() / 128;
    EXPECT_NEAR(enclosedVolume(meshToLevelSet(repaired.mesh, {.voxelSize = h})) / repaired.after.volume, 1.0,
                0.01)
        << name;
  }
}

TEST(TriangleKernels, VectorFormEqualsThePlainLoop) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-6.0, 14.0), small(-1.5, 1.5);
  std::vector<detail::TriangleShape> shapes;
  std::vector<detail::PlacedTriangle> placed;
  for (std::uint32_t i = 0; i < 200; ++i) {
    const Vec3d a(uniform(random), uniform(random), uniform(random));
    const Vec3d b = a + Vec3d(small(random), small(random), small(random));
    // Every tenth has no area.
    const Vec3d c = i % 10 == 0 ? a + (b - a) * 0.3 : a + Vec3d(small(random), small(random), small(random));
    shapes.push_back(detail::triangleShape(a, b, c));
    placed.push_back(detail::placeTriangle(i, shapes.back(), Vec3f(a)));
  }
  constexpr float kBand = 5.0f;
  detail::NearestSamples vector, plain;
  for (auto* samples : {&vector, &plain}) {
    std::fill_n(samples->squared, detail::NearestSamples::kSize, kBand * kBand);
    std::fill_n(samples->code, detail::NearestSamples::kSize, -1);
  }
  detail::nearestTriangles(shapes.data(), placed.data(), placed.size(), kBand, vector);
  detail::nearestTrianglesScalar(shapes.data(), placed.data(), placed.size(), kBand, plain);
  int sameCode = 0;
  for (int i = 0; i < detail::NearestSamples::kSize; ++i) {
    EXPECT_NEAR(vector.squared[i], plain.squared[i], 2e-5f * plain.squared[i] + 1e-6f) << i;
    sameCode += vector.code[i] == plain.code[i];
  }
  EXPECT_GT(sameCode, 505);  // Ties within rounding may fall either way.
}

}  // namespace
}  // namespace nephele::test
