// Planes in vertices, edges and faces of the mesh, and in each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "nephele/levelset/cut/cut.h"
#include "tests/support/piece_checks.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

/// A tower of height 2 on the left half of a slab of height 1, one unit deep.
Mesh step() {
  const std::array<std::array<double, 2>, 6> outline{{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}};
  Mesh mesh;
  for (const double z : {0.0, 1.0})
    for (const auto& p : outline) mesh.positions.push_back({p[0], p[1], z});
  mesh.addFace(std::vector<std::uint32_t>{0, 5, 4, 3});
  mesh.addFace(std::vector<std::uint32_t>{0, 3, 2, 1});
  mesh.addFace(std::vector<std::uint32_t>{6, 9, 10, 11});
  mesh.addFace(std::vector<std::uint32_t>{6, 7, 8, 9});
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t j = (i + 1) % 6;
    mesh.addFace(std::vector<std::uint32_t>{i, j, j + 6, i + 6});
  }
  return mesh;
}

TEST(MeshPieces, APlaneInAFaceOfABoxCutsNothing) {
  for (const float y : {-1.0f, 1.0f})
    for (const float up : {-1.0f, 1.0f}) {
      const Pieces cut = cutIntoMeshes(cube(), {.planes = {{{0, y, 0}, {0, up, 0}}}});
      ASSERT_EQ(cut.pieces.size(), 1u);
      EXPECT_EQ(cut.slivers, 0u);
      EXPECT_EQ(cut.pieces[0].mesh.faceCount(), 12u);
      EXPECT_EQ(firstInside(cut.pieces[0].mesh), 12u);
      EXPECT_EQ(cut.pieces[0].code.sides, std::vector<bool>{y * up < 0});
    }
}

TEST(MeshPieces, APlaneInTheFaceOfAStepLeavesThatFaceOutside) {
  for (const float up : {-1.0f, 1.0f}) {
    const Pieces cut = cutIntoMeshes(step(), {.planes = {{{0, 1, 0}, {0, up, 0}}}});
    expectSound(step(), cut);
    ASSERT_EQ(cut.pieces.size(), 2u);
    EXPECT_EQ(cut.slivers, 0u);
    std::vector<double> volumes;
    for (const Piece& piece : cut.pieces) {
      volumes.push_back(piece.mass.volume);
      // Only what was under the tower is new.
      EXPECT_NEAR(insideArea(piece.mesh), 1, 1e-14);
    }
    std::sort(volumes.begin(), volumes.end());
    EXPECT_NEAR(volumes[0], 1, 1e-14);
    EXPECT_NEAR(volumes[1], 2, 1e-14);
  }
}

TEST(MeshPieces, PlanesThatMeetInTheEdgesOfATetrahedronLeaveAnOctahedron) {
  Mesh mesh;
  mesh.positions = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  for (const auto& face : {std::array<std::uint32_t, 3>{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}})
    mesh.addFace(face);
  Knives knives;
  // Halfway to each corner: all four planes pass through the middles of edges, two by two.
  for (const Vec3d& corner : mesh.positions) knives.planes.push_back({Vec3f(corner / 3.0), Vec3f(corner)});
  const Pieces cut = cutIntoMeshes(mesh, knives);
  expectSound(mesh, cut);
  ASSERT_EQ(cut.pieces.size(), 5u);
  std::vector<double> volumes;
  for (const Piece& piece : cut.pieces) volumes.push_back(piece.mass.volume * 3 / 8);
  std::sort(volumes.begin(), volumes.end());
  for (const std::size_t k : {0, 1, 2, 3}) EXPECT_NEAR(volumes[k], 1 / 8.0, 1e-7);
  EXPECT_NEAR(volumes[4], 1 / 2.0, 1e-7);
}

TEST(MeshPieces, VerticesInThePlaneAreNotDoubled) {
  // The icosahedron's edges are halved in the planes of its axes: many vertices lie in them exactly.
  const Mesh ball = icosphere(1, 3);
  const Pieces cut = cutIntoMeshes(
      ball, {.planes = {{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {0, 1, 0}}, {{0, 0, 0}, {0, 0, 1}}}});
  expectSound(ball, cut);
  ASSERT_EQ(cut.pieces.size(), 8u);
  for (const Piece& piece : cut.pieces) {
    EXPECT_NEAR(piece.mass.volume, signedVolume(ball) / 8, 1e-12);
    for (std::size_t f = 0; f < piece.mesh.faceCount(); ++f) EXPECT_GT(faceArea(piece.mesh, f), 1e-12);
    const auto same = firstEqualPosition(piece.mesh.positions);
    for (std::size_t i = 0; i < same.size(); ++i) EXPECT_EQ(same[i], i);
  }
}

TEST(MeshPieces, CoincidentPlanesCutOnce) {
  const Mesh mesh = icosphere(1, 3);
  const Vec3f n{1, 2, 3};
  // The third is the first, turned over and moved in itself; the fourth is off by less than rounding.
  const Pieces cut = cutIntoMeshes(
      mesh, {.planes = {{{0, 0, 0}, n}, {{0, 0, 0}, n}, {{2, -1, 0}, -n}, {{0, 0, 1e-13f}, n * 2.0f}}});
  expectSound(mesh, cut);
  ASSERT_EQ(cut.pieces.size(), 2u);
  EXPECT_EQ(cut.slivers, 0u);
  EXPECT_EQ(cut.pieces[0].code.sides, (std::vector<bool>{false, false, true, false}));
  EXPECT_EQ(cut.pieces[1].code.sides, (std::vector<bool>{true, true, false, true}));
}

TEST(MeshPieces, NearlyCoincidentPlanesStayClosed) {
  const Mesh mesh = torusMesh(1, 0.4, 40, 20);
  for (const float angle : {1e-4f, 1e-6f, 1e-8f}) {
    Knives knives;
    for (int k = 0; k < 6; ++k)
      knives.planes.push_back({{0.1f, 0, 0}, {1, angle * float(k), angle * float(k * k % 5)}});
    expectSound(mesh, cutIntoMeshes(mesh, knives));
  }
}

TEST(MeshPieces, VerticesThatOnlyCoincideAreJoined) {
  const Mesh mesh = unshared(torusMesh(1, 0.4, 20, 10));
  const Pieces cut = cutIntoMeshes(mesh, {.planes = randomBlades({.count = 3, .box = boundingBox(mesh)})});
  expectSound(mesh, cut);
}

}  // namespace
}  // namespace nephele::test
