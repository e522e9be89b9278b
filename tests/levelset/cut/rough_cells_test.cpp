// Voronoi cells with rough walls.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/piece_checks.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

std::vector<Vec3f> scattered(int count, float size) {
  const Box box{{-size, -size, -size}, {size, size, size}};
  return scatteredPoints(ScalarField(1.0f), box, count, 5);
}

TEST(RoughCells, ArePartsOfTheWholeThatShareTheirWalls) {
  const Mesh ball = icosphere(1, 4);
  for (const float amplitude : {0.01f, 0.05f, 0.15f}) {
    // The last is steeper than 1 by far: hills of a third of their length.
    const Pieces cut = cutIntoMeshes(
        ball, {.cells = scattered(9, 0.7f),
               .cellRoughness = {.amplitude = amplitude, .noise = {.frequency = 1.5f}, .octaves = 2}});
    EXPECT_GE(cut.pieces.size(), 9u) << amplitude;
    expectSound(ball, cut);
    for (const Piece& piece : cut.pieces) EXPECT_TRUE(piece.cell && *piece.cell < 9);
  }
}

TEST(RoughCells, WallsAreAsHighAsAsked) {
  // Two cells, whose wall is the plane x = 0: the root mean square of x over it is the amplitude, but for
  // some 30 waves of which it is the mean, and for the rims of the ball.
  const float amplitude = 0.02f;
  const Pieces cut = cutIntoMeshes(
      icosphere(1, 4), {.cells = {{-0.5f, 0, 0}, {0.5f, 0, 0}},
                        .cellRoughness = {.amplitude = amplitude, .noise = {.frequency = 3}, .octaves = 2}});
  ASSERT_EQ(cut.pieces.size(), 2u);
  const Mesh& mesh = cut.pieces[0].mesh;
  double squares = 0, area = 0;
  for (std::size_t f = firstInside(mesh); f < mesh.faceCount(); ++f) {
    Vec3d middle;
    for (const std::uint32_t v : mesh.face(f)) middle += mesh.positions[v] / 3;
    squares += middle.x * middle.x * faceArea(mesh, f);
    area += faceArea(mesh, f);
  }
  EXPECT_NEAR(std::sqrt(squares / area) / double(amplitude), 1, 0.3);
  // Rough, so larger than the disc.
  EXPECT_GT(area, 1.02 * M_PI);
}

TEST(RoughCells, AreCutByOtherKnivesAtOnce) {
  const Mesh ball = icosphere(1, 3);
  const RoughnessOptions rough{.amplitude = 0.03f, .noise = {.frequency = 2}, .octaves = 2};
  const Pieces cut = cutIntoMeshes(ball, {.planes = {{{0, 0.1f, 0}, {0, 1, 0}}},
                                          .cells = scattered(4, 0.6f),
                                          .cellRoughness = rough,
                                          .rough = {{{{0, 0, 0.05f}, {0, 0, 1}}, rough}}});
  expectSound(ball, cut);
  for (const Piece& piece : cut.pieces) {
    ASSERT_EQ(piece.code.sides.size(), 2u);
    EXPECT_EQ(piece.code.sides[0], piece.mass.centroid.y > 0.1);
  }
}

TEST(RoughCells, DoNotDependOnTheNumberOfThreads) {
  std::vector<Pieces> cuts;
  for (const std::size_t threads : {1, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    cuts.push_back(cutIntoMeshes(
        icosphere(1, 3), {.cells = scattered(5, 0.7f),
                          .cellRoughness = {.amplitude = 0.04f, .noise = {.frequency = 2}, .octaves = 2}}));
  }
  ASSERT_EQ(cuts[0].pieces.size(), cuts[1].pieces.size());
  for (std::size_t i = 0; i < cuts[0].pieces.size(); ++i) {
    EXPECT_EQ(cuts[0].pieces[i].mesh.positions, cuts[1].pieces[i].mesh.positions);
    EXPECT_EQ(cuts[0].pieces[i].mesh.corners, cuts[1].pieces[i].mesh.corners);
  }
}

TEST(RoughCells, OfKnownMeshesSumToThemselves) {
  const std::string path = sharedData("meshes/bunny_7k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh bunny = triangulated(readMesh(path));
  const Box box = boundingBox(bunny);
  const std::vector<Vec3f> cells = scatteredPoints(ScalarField(1.0f), box, 8, 3);
  const float side = box.longestSide();
  const Pieces cut = cutIntoMeshes(
      bunny, {.cells = cells,
              .cellRoughness = {.amplitude = 0.01f * side, .noise = {.frequency = 3 / side}, .octaves = 2}});
  expectSound(bunny, cut);
}

TEST(RoughCells, RefuseKerfsAndLevelSets) {
  Knives knives{.cells = scattered(3, 0.5f), .cellRoughness = {.amplitude = 0.01f}};
  const auto errorOf = [](const auto& cut) -> std::string {
    try {
      cut();
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(errorOf([&] { cutIntoMeshes(icosphere(1, 2), knives, {.kerf = 0.1f}); }).find("no kerf"),
            std::string::npos);
  const auto level = toBricks(meshToLevelSet(icosphere(1, 3), {.voxelSize = 0.1}));
  EXPECT_NE(errorOf([&] { cutIntoMeshes(*level, knives); }).find("meshes only"), std::string::npos);
  knives.cellRoughness.amplitude = -1;
  EXPECT_NE(errorOf([&] { cutIntoMeshes(icosphere(1, 2), knives); }).find(">= 0"), std::string::npos);
}

}  // namespace
}  // namespace nephele::test
