#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "nephele/levelset/cut/cut.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/piece_checks.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

TEST(MeshKnives, ABallTakesALensFromABall) {
  const Mesh ball = icosphere(1, 4), knife = icosphere(0.8, 4, {0.9, 0.2, 0.1});
  const Pieces cut = cutIntoMeshes(ball, {.solids = {knife}});
  expectSound(ball, cut);
  ASSERT_EQ(cut.pieces.size(), 2u);
  EXPECT_EQ(cut.pieces[0].code.sides, std::vector<bool>{false});
  EXPECT_EQ(cut.pieces[1].code.sides, std::vector<bool>{true});
  // The lens of two balls: pi (R + r - d)^2 (d^2 + 2 d (r + R) - 3 (r - R)^2) / (12 d). Polyhedra lose
  // O(h^2).
  const double d = length(Vec3d{0.9, 0.2, 0.1}), R = 1, r = 0.8;
  const double lens =
      M_PI * (R + r - d) * (R + r - d) * (d * d + 2 * d * (r + R) - 3 * (r - R) * (r - R)) / (12 * d);
  EXPECT_NEAR(cut.pieces[1].mass.volume, lens, 0.006 * lens);
  // What both share is the same, whichever is the knife: the same polyhedron by other faces.
  const Pieces other = cutIntoMeshes(knife, {.solids = {ball}});
  ASSERT_EQ(other.pieces.size(), 2u);
  EXPECT_NEAR(other.pieces[1].mass.volume, cut.pieces[1].mass.volume, 1e-13);
  EXPECT_NEAR(insideArea(other.pieces[1].mesh) + insideArea(cut.pieces[1].mesh), cut.pieces[1].mass.area,
              1e-12);
}

TEST(MeshKnives, AKnifeInsideLeavesACavity) {
  const Pieces cut = cutIntoMeshes(cube(), {.solids = {boxMesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})}});
  expectSound(cube(), cut);
  ASSERT_EQ(cut.pieces.size(), 2u);
  EXPECT_NEAR(cut.pieces[0].mass.volume, 7, 1e-14);
  EXPECT_NEAR(cut.pieces[1].mass.volume, 1, 1e-14);
  ASSERT_EQ(cut.pieces[0].neighbours.size(), 1u);
  EXPECT_NEAR(cut.pieces[0].neighbours[0].area, 6, 1e-13);
}

TEST(MeshKnives, BoxesOnALatticeCutAsTheirCellsSay) {
  // Faces, edges and corners of source, knives and planes coincide in all ways; the truth is counted by
  // cells.
  std::size_t pieces = 0;
  for (std::uint32_t seed = 0; seed < 120; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto draw = [&](int count) { return int(random() % std::uint32_t(count)); };
    struct Cells {
      std::array<int, 3> low, high;
    };
    const auto drawBox = [&] {
      Cells box{};
      for (std::size_t k = 0; k < 3; ++k) {
        while (box.low[k] == box.high[k]) box.low[k] = draw(4), box.high[k] = draw(4);
        if (box.low[k] > box.high[k]) std::swap(box.low[k], box.high[k]);
      }
      return box;
    };
    // Every third lattice is exact in floats, so that planes can lie in it; others have rounded places.
    const double scale = seed % 3 == 0 ? 0.5 : 0.37, shift = seed % 3 == 0 ? 0 : 0.1 * draw(10);
    const auto at = [&](const std::array<int, 3>& p) {
      return Vec3d{p[0] * scale + shift, p[1] * scale + shift, p[2] * scale + shift};
    };
    const Cells source = drawBox();
    std::vector<Cells> knives(1 + std::size_t(draw(3)));
    for (Cells& knife : knives) knife = drawBox();
    if (draw(3) == 0) knives.push_back(knives[0]);
    Knives cutters;
    for (const Cells& knife : knives) cutters.solids.push_back(boxMesh(at(knife.low), at(knife.high)));
    const int axis = draw(3), height = draw(4);
    if (seed % 3 == 0) {
      BladePlane plane{Vec3f(at({height, height, height})), {0, 0, 0}};
      plane.normal[axis] = 1;
      cutters.planes.push_back(plane);
    }
    std::map<std::vector<bool>, double> truth, found;
    for (int z = source.low[2]; z < source.high[2]; ++z)
      for (int y = source.low[1]; y < source.high[1]; ++y)
        for (int x = source.low[0]; x < source.high[0]; ++x) {
          const std::array<int, 3> cell{x, y, z};
          std::vector<bool> sides;
          if (!cutters.planes.empty()) sides.push_back(cell[std::size_t(axis)] >= height);
          for (const Cells& knife : knives) {
            bool inside = true;
            for (std::size_t k = 0; k < 3; ++k) inside &= cell[k] >= knife.low[k] && cell[k] < knife.high[k];
            sides.push_back(inside);
          }
          truth[sides] += scale * scale * scale;
        }
    const Mesh mesh = boxMesh(at(source.low), at(source.high));
    const Pieces cut = cutIntoMeshes(mesh, cutters);
    double inside = 0, contact = 0;
    for (const Piece& piece : cut.pieces) {
      found[piece.code.sides] += piece.mass.volume;
      EXPECT_EQ(topologyOf(piece.mesh).openEdges, 0u);
      inside += insideArea(piece.mesh);
      for (const PieceContact& neighbour : piece.neighbours) contact += neighbour.area;
    }
    pieces += cut.pieces.size();
    EXPECT_EQ(cut.slivers, 0u);
    EXPECT_NEAR(inside, contact, 1e-12);
    ASSERT_EQ(truth.size(), found.size());
    for (const auto& [sides, volume] : truth) EXPECT_NEAR(found[sides], volume, 1e-12);
  }
  EXPECT_GT(pieces, 150u);
}

TEST(MeshKnives, ASolidCutByItselfIsOnePiece) {
  const Mesh torus = torusMesh(1, 0.4, 30, 15);
  const Pieces cut = cutIntoMeshes(torus, {.solids = {torus}});
  ASSERT_EQ(cut.pieces.size(), 1u);
  EXPECT_EQ(cut.pieces[0].code.sides, std::vector<bool>{true});
  EXPECT_EQ(insideArea(cut.pieces[0].mesh), 0);
  EXPECT_NEAR(cut.pieces[0].mass.volume, signedVolume(torus), 1e-13);
}

TEST(MeshKnives, AKerfOfASolidMovesItsFaces) {
  const Pieces cut =
      cutIntoMeshes(cube(), {.solids = {boxMesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})}}, {.kerf = 0.25f});
  ASSERT_EQ(cut.pieces.size(), 2u);
  EXPECT_NEAR(cut.pieces[0].mass.volume, 8 - 1.25 * 1.25 * 1.25, 1e-13);
  EXPECT_NEAR(cut.pieces[1].mass.volume, 0.75 * 0.75 * 0.75, 1e-13);
  // Of a ball: faces move by half the kerf, so that its radius does.
  const Pieces round = cutIntoMeshes(cube(), {.solids = {icosphere(0.8, 4)}}, {.kerf = 0.1f});
  ASSERT_EQ(round.pieces.size(), 2u);
  const double shell = 4 * M_PI / 3 * (std::pow(0.85, 3) - std::pow(0.75, 3));
  EXPECT_NEAR(8 - volumeSum(round), shell, 0.01 * shell);
}

}  // namespace
}  // namespace nephele::test
