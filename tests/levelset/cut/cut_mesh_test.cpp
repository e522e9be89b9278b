#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/mass_properties.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/piece_checks.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

Mesh insideOut(const Mesh& mesh) {
  Mesh result = mesh;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f)
    std::reverse(result.corners.begin() + mesh.faceStart[f], result.corners.begin() + mesh.faceStart[f + 1]);
  return result;
}

TEST(MeshPieces, APlaneThroughTheCentreHalvesACube) {
  const Pieces cut = cutIntoMeshes(cube(), {.planes = {{{0, 0, 0}, {0, 2, 0}}}});
  expectSound(cube(), cut);
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (const std::size_t k : {0, 1}) {
    const Piece& piece = cut.pieces[k];
    EXPECT_EQ(piece.code.sides, std::vector<bool>{k == 1});
    EXPECT_NEAR(piece.mass.volume, 4, 1e-14);
    EXPECT_NEAR(piece.mass.area, 16, 1e-14);
    EXPECT_NEAR(piece.mass.centroid.y, k == 1 ? 0.5 : -0.5, 1e-14);
    EXPECT_EQ(piece.boxMin, (k == 1 ? Vec3d{-1, 0, -1} : Vec3d{-1, -1, -1}));
    EXPECT_EQ(piece.boxMax, (k == 1 ? Vec3d{1, 1, 1} : Vec3d{1, 0, 1}));
    EXPECT_NEAR(insideArea(piece.mesh), 4, 1e-14);
    ASSERT_EQ(piece.neighbours.size(), 1u);
    EXPECT_EQ(piece.neighbours[0].piece, 1 - k);
    EXPECT_NEAR(piece.neighbours[0].area, 4, 1e-14);
  }
}

TEST(MeshPieces, PlanesThroughTheCentreOfABallMakeNSquaredMinusNPlusTwo) {
  const Mesh ball = icosphere(1, 3);
  for (const int n : {1, 3, 5, 8}) {
    const Pieces cut = cutIntoMeshes(
        ball, {.planes = randomBlades({.count = n, .box = boundingBox(ball), .throughCentre = true})});
    expectSound(ball, cut);
    EXPECT_EQ(cut.pieces.size(), std::size_t(n * n - n + 2));
    for (const Piece& piece : cut.pieces) EXPECT_EQ(countSelfIntersections(piece.mesh), 0u);
  }
}

TEST(MeshPieces, CutsOfKnownMeshesSumToThem) {
  for (const char* name : {"bunny_7k.obj", "spot_uv.obj", "fertility_genus4.off", "fandisk_13k.obj"}) {
    const std::string path = sharedData(std::string("meshes/") + name);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    SCOPED_TRACE(name);
    const Mesh mesh = readMesh(path);
    for (const int n : {1, 5, 20}) {
      const Pieces cut =
          cutIntoMeshes(mesh, {.planes = randomBlades({.count = n, .box = boundingBox(mesh)})});
      EXPECT_GT(cut.pieces.size(), std::size_t(n));
      expectSound(mesh, cut);
    }
    const auto points = scatteredPoints(ScalarField(1), boundingBox(mesh), 12, 1);
    const Pieces cut = cutIntoMeshes(mesh, {.cells = points});
    EXPECT_GE(cut.pieces.size(), 10u);
    expectSound(mesh, cut);
  }
}

TEST(MeshPieces, TheBunnyInAHundredCellsIsWhole) {
  const std::string path = sharedData("meshes/bunny_60k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh bunny = readMesh(path);
  const auto points = scatteredPoints(ScalarField(1), boundingBox(bunny), 100, 1);
  const Pieces cut = cutIntoMeshes(bunny, {.cells = points});
  expectSound(bunny, cut);
  for (const Piece& piece : cut.pieces) {
    ASSERT_TRUE(piece.cell);
    // Every vertex is as near to its point as to any other.
    const Vec3d centre(points[*piece.cell]);
    for (std::size_t i = 0; i < piece.mesh.positions.size(); i += 29)
      for (const Vec3f& other : points)
        EXPECT_LE(length(piece.mesh.positions[i] - centre),
                  length(piece.mesh.positions[i] - Vec3d(other)) + 1e-9);
  }
}

TEST(MeshPieces, RimsAreSharp) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  const auto blades = randomBlades({.count = 4, .box = boundingBox(mesh), .seed = 2});
  for (const Piece& piece : cutIntoMeshes(mesh, {.planes = blades}).pieces)
    for (std::size_t f = firstInside(piece.mesh); f < piece.mesh.faceCount(); ++f) {
      double nearest = 1;
      for (const BladePlane& blade : blades) {
        double farthest = 0;
        for (const std::uint32_t v : piece.mesh.face(f))
          farthest = std::max(farthest, std::abs(dot(piece.mesh.positions[v] - Vec3d(blade.point),
                                                     normalize(Vec3d(blade.normal)))));
        nearest = std::min(nearest, farthest);
      }
      EXPECT_LT(nearest, 1e-10);
    }
}

TEST(MeshPieces, PermutedPlanesMakeTheSamePieces) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  auto blades = randomBlades({.count = 6, .box = boundingBox(mesh), .seed = 3});
  const Pieces cut = cutIntoMeshes(mesh, {.planes = blades});
  std::reverse(blades.begin(), blades.end());
  const Pieces other = cutIntoMeshes(mesh, {.planes = blades});
  ASSERT_EQ(cut.pieces.size(), other.pieces.size());
  for (const Piece& piece : cut.pieces) {
    std::vector<bool> sides(piece.code.sides.rbegin(), piece.code.sides.rend());
    const auto same = std::count_if(other.pieces.begin(), other.pieces.end(), [&](const Piece& p) {
      return p.code.sides == sides && std::abs(p.mass.volume - piece.mass.volume) < 1e-12 &&
             std::abs(p.mass.area - piece.mass.area) < 1e-10 &&
             length(p.mass.centroid - piece.mass.centroid) < 1e-8;
    });
    EXPECT_EQ(same, 1);
  }
}

TEST(MeshPieces, OuterFacesKeepTheirTextureCoordinates) {
  const std::string path = sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh spot = triangulated(readMesh(path));
  const Pieces cut = cutIntoMeshes(spot, {.planes = randomBlades({.count = 5, .box = boundingBox(spot)})});
  std::size_t checked = 0;
  EXPECT_LT(worstTexture(spot, cut, 4, checked), 1e-5);
  EXPECT_GT(checked, 1000u);
}

TEST(MeshPieces, InnerFacesMeasureTheKnifeInWorldUnits) {
  const Pieces cut = cutIntoMeshes(cube(), {.planes = {{{0, 0.25f, 0}, {1, 2, 3}}}});
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (const Piece& piece : cut.pieces) {
    const MeshAttribute& uv = attributeOf(piece.mesh, "uv");
    for (std::size_t f = firstInside(piece.mesh); f < piece.mesh.faceCount(); ++f)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t i = 3 * f + k, j = 3 * f + (k + 1) % 3;
        const double du = double(uv.values[2 * i]) - double(uv.values[2 * j]);
        const double dv = double(uv.values[2 * i + 1]) - double(uv.values[2 * j + 1]);
        EXPECT_NEAR(
            std::hypot(du, dv),
            length(piece.mesh.positions[piece.mesh.corners[i]] - piece.mesh.positions[piece.mesh.corners[j]]),
            1e-6);
      }
  }
}

TEST(MeshPieces, GroupsAndVertexColoursContinue) {
  Mesh mesh = cube();
  mesh.groups = {{"bottom and top", 2, 4}, {"rest", 6, 6}};
  MeshAttribute colour{"color", MeshAttribute::Domain::vertex, 3, {}};
  for (const Vec3d& p : mesh.positions)
    for (const int k : {0, 1, 2}) colour.values.push_back(float(p[k]));
  mesh.attributes.push_back(colour);
  const Pieces cut = cutIntoMeshes(mesh, {.planes = {{{0.25f, 0, 0}, {1, 0.5f, 0.25f}}}});
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (const Piece& piece : cut.pieces) {
    ASSERT_EQ(piece.mesh.groups.size(), 3u);
    EXPECT_EQ(piece.mesh.groups[0].name, "bottom and top");
    EXPECT_EQ(piece.mesh.groups[1].name, "rest");
    EXPECT_EQ(piece.mesh.groups[2].name, "inside");
    EXPECT_EQ(piece.mesh.groups[2].firstFace + piece.mesh.groups[2].faceCount, piece.mesh.faceCount());
    // The colour of the source is its place, and places are linear on triangles.
    const MeshAttribute& value = attributeOf(piece.mesh, "color");
    ASSERT_EQ(value.domain, MeshAttribute::Domain::vertex);
    for (std::size_t i = 0; i < piece.mesh.positions.size(); ++i)
      for (const int k : {0, 1, 2})
        EXPECT_NEAR(value.values[3 * i + std::size_t(k)], piece.mesh.positions[i][k], 1e-6);
  }
}

TEST(MeshPieces, CellsOfALatticeAreItsBoxes) {
  std::vector<Vec3f> points;
  for (int i = 0; i < 8; ++i)
    points.push_back({i & 1 ? 0.5f : -0.5f, i & 2 ? 0.5f : -0.5f, i & 4 ? 0.5f : -0.5f});
  const Pieces cut = cutIntoMeshes(cube(), {.cells = points});
  ASSERT_EQ(cut.pieces.size(), 8u);
  expectSound(cube(), cut);
  for (std::uint32_t k = 0; k < 8; ++k) {
    EXPECT_EQ(cut.pieces[k].cell, k);
    EXPECT_NEAR(cut.pieces[k].mass.volume, 1, 1e-12);
    EXPECT_EQ(cut.pieces[k].neighbours.size(), 3u);
  }
}

TEST(MeshPieces, CellsAndPlanesCutTogether) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  const auto points = scatteredPoints(ScalarField(1), boundingBox(mesh), 10, 4);
  const Pieces cut =
      cutIntoMeshes(mesh, {.planes = randomBlades({.count = 3, .box = boundingBox(mesh)}), .cells = points});
  EXPECT_GT(cut.pieces.size(), 20u);
  expectSound(mesh, cut);
}

TEST(MeshPieces, APlaneThatMissesLeavesTheMeshAsItIs) {
  const Mesh mesh = icosphere(1, 2);
  const Pieces cut = cutIntoMeshes(mesh, {.planes = {{{0, 2, 0}, {0, 1, 0}}}});
  ASSERT_EQ(cut.pieces.size(), 1u);
  EXPECT_EQ(cut.pieces[0].code.sides, std::vector<bool>{false});
  EXPECT_EQ(cut.pieces[0].mesh.faceCount(), mesh.faceCount());
  EXPECT_EQ(cut.pieces[0].mass.volume, massProperties(mesh).volume);
}

TEST(MeshPieces, CavitiesStayWithTheSolidAroundThem) {
  const Mesh mesh = joined(cube(), insideOut(boxMesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})));
  const Pieces beside = cutIntoMeshes(mesh, {.planes = {{{0, 0.75f, 0}, {0, 1, 0}}}});
  ASSERT_EQ(beside.pieces.size(), 2u);
  EXPECT_NEAR(beside.pieces[0].mass.volume, 4 * 1.75 - 1, 1e-12);
  EXPECT_NEAR(beside.pieces[1].mass.volume, 4 * 0.25, 1e-12);
  const Pieces through = cutIntoMeshes(mesh, {.planes = {{{0, 0, 0}, {0, 1, 0}}}});
  expectSound(mesh, through);
  ASSERT_EQ(through.pieces.size(), 2u);
  for (const Piece& piece : through.pieces) {
    EXPECT_NEAR(piece.mass.volume, 3.5, 1e-12);
    EXPECT_NEAR(insideArea(piece.mesh), 3, 1e-12);
    EXPECT_EQ(topologyOf(piece.mesh).eulerCharacteristic, 2);
  }
}

TEST(MeshPieces, PartsOfOneSideThatDoNotHangTogetherAreSeveralPieces) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  const Pieces cut = cutIntoMeshes(mesh, {.planes = {{{0.2f, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {1, 0, 0}}}});
  EXPECT_EQ(cut.pieces.size(), 4u);
  const Pieces slab =
      cutIntoMeshes(mesh, {.planes = {{{0, 0.1f, 0}, {0, 1, 0}}, {{0, -0.1f, 0}, {0, 1, 0}}}});
  // Above, below, and the two ends of the slab between, left and right of the hole.
  EXPECT_EQ(slab.pieces.size(), 4u);
  expectSound(mesh, slab);
}

TEST(MeshPieces, SliversAreLeftOutAndCounted) {
  const Pieces cut = cutIntoMeshes(cube(), {.planes = {{{0, 0.75f, 0}, {0, 1, 0}}}}, {.minVolume = 1.5});
  ASSERT_EQ(cut.pieces.size(), 1u);
  EXPECT_EQ(cut.slivers, 1u);
  EXPECT_NEAR(cut.sliverVolume, 1, 1e-14);
  EXPECT_NEAR(volumeSum(cut), 8, 1e-14);
  EXPECT_TRUE(cut.pieces[0].neighbours.empty());
}

TEST(MeshPieces, OfOverlappingSolidsHaveNoOpenEdgeAndTheSignedVolume) {
  const Mesh mesh = joined(icosphere(1, 2), icosphere(1, 2, {0.7, 0.1, 0}));
  const Pieces cut = cutIntoMeshes(mesh, {.planes = randomBlades({.count = 5, .box = boundingBox(mesh)})});
  EXPECT_NEAR(volumeSum(cut), signedVolume(mesh), 1e-12);
  for (const Piece& piece : cut.pieces)
    EXPECT_TRUE(topologyOf(piece.mesh).isClosedManifold()) << topologyOf(piece.mesh);
}

TEST(MeshPieces, OfManyPlanesAreAllThere) {
  const Mesh ball = icosphere(1, 3);
  const Pieces cut = cutIntoMeshes(
      ball, {.planes = randomBlades({.count = 70, .box = boundingBox(ball), .throughCentre = true})});
  EXPECT_EQ(cut.pieces.size() + cut.slivers, 70u * 70u - 70u + 2u);
  EXPECT_NEAR(volumeSum(cut), signedVolume(ball), 1e-12);
}

TEST(MeshPieces, DoNotDependOnTheNumberOfThreads) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  const Knives knives{.planes = randomBlades({.count = 2, .box = boundingBox(mesh)}),
                      .cells = scatteredPoints(ScalarField(1), boundingBox(mesh), 20, 4)};
  const Pieces cut = cutIntoMeshes(mesh, knives);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Pieces again = cutIntoMeshes(mesh, knives);
  ASSERT_EQ(cut.pieces.size(), again.pieces.size());
  for (std::size_t i = 0; i < cut.pieces.size(); ++i) {
    EXPECT_EQ(cut.pieces[i].mesh.positions, again.pieces[i].mesh.positions);
    EXPECT_EQ(cut.pieces[i].mesh.corners, again.pieces[i].mesh.corners);
    EXPECT_EQ(cut.pieces[i].mass.volume, again.pieces[i].mass.volume);
  }
}

TEST(MeshPieces, OfPlanesAloneDoNotDependOnTheNumberOfThreads) {
  // Large enough that parts of it go to several threads.
  const Mesh ball = icosphere(1, 6);
  const Knives knives{.planes = randomBlades({.count = 12, .box = boundingBox(ball), .seed = 2})};
  const Pieces cut = cutIntoMeshes(ball, knives);
  expectSound(ball, cut);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Pieces again = cutIntoMeshes(ball, knives);
  ASSERT_EQ(cut.pieces.size(), again.pieces.size());
  for (std::size_t i = 0; i < cut.pieces.size(); ++i) {
    EXPECT_EQ(cut.pieces[i].code, again.pieces[i].code);
    EXPECT_EQ(cut.pieces[i].mesh.positions, again.pieces[i].mesh.positions);
    EXPECT_EQ(cut.pieces[i].mesh.corners, again.pieces[i].mesh.corners);
    // By code, the negative side first.
    if (i > 0) {
      EXPECT_LE(cut.pieces[i - 1].code.sides, cut.pieces[i].code.sides);
    }
  }
}

TEST(MeshPieces, RefuseWhatCannotBeCut) {
  Mesh open = cube();
  open.corners.resize(33);
  open.faceStart.pop_back();
  try {
    cutIntoMeshes(open, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("open: 3 edges"), std::string::npos) << error.what();
  }
  EXPECT_THROW(cutIntoMeshes(Mesh{}, {}), Error);
  EXPECT_THROW(cutIntoMeshes(cube(), {.fields = {Knife(ScalarField(1))}}), Error);
  EXPECT_THROW(cutIntoMeshes(insideOut(cube()), {}), Error);
  Mesh notFinite = cube();
  notFinite.positions[3].x = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(cutIntoMeshes(notFinite, {}), Error);
  EXPECT_THROW(cutIntoMeshes(cube(), {.planes = {{{0, 0, 0}, {0, 0, 0}}}}), Error);
  EXPECT_THROW(cutIntoMeshes(cube(), {.planes = {{{0, NAN, 0}, {0, 1, 0}}}}), Error);
  EXPECT_THROW(cutIntoMeshes(cube(), {.cells = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}}), Error);
  EXPECT_THROW(cutIntoMeshes(cube(), {.cells = {{0, 0, INFINITY}}}), Error);
  EXPECT_THROW(cutIntoMeshes(cube(), {}, {.minVolume = -1}), Error);
}

}  // namespace
}  // namespace nephele::test
