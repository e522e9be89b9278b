// Polygons that no knife crosses.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/cut_parts.h"
#include "nephele/levelset/io/mesh_io.h"
#include "tests/support/mesh_attributes.h"
#include "tests/support/piece_checks.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

/// A cube of edge 2 around the origin: six quads, whose texture coordinates and number are those of the face.
Mesh quadCube() {
  Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0});
  const std::uint32_t faces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}},
      mass{"mass", MeshAttribute::Domain::vertex, 1, {}};
  for (int f = 0; f < 6; ++f) {
    mesh.addFace(faces[f]);
    for (int k = 0; k < 4; ++k) {
      uv.values.push_back(float(f) + (k == 1 || k == 2 ? 0.9f : 0.1f));
      uv.values.push_back(k > 1 ? 0.9f : 0.1f);
    }
  }
  for (int i = 0; i < 8; ++i) mass.values.push_back(float(i));
  mesh.attributes = {uv, mass};
  return mesh;
}

using Corners = std::vector<Vec3d>;

/// The places of a face, from the least on.
Corners cornersOf(const Mesh& mesh, std::size_t face) {
  Corners corners;
  for (const std::uint32_t v : mesh.face(face)) corners.push_back(mesh.positions[v]);
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

/// Every polygon of more than three corners in the pieces is a face of the source, and each face of the
/// source whose corners are strictly on one side of all planes is a face of one piece.
void expectPolygonsKept(const Mesh& source, const Pieces& cut, const std::vector<BladePlane>& planes) {
  std::set<Corners> all, found;
  for (std::size_t f = 0; f < source.faceCount(); ++f) all.insert(cornersOf(source, f));
  for (const Piece& piece : cut.pieces) {
    EXPECT_TRUE(piece.closed);
    for (std::size_t f = 0; f < piece.mesh.faceCount(); ++f) {
      const Corners corners = cornersOf(piece.mesh, f);
      if (all.count(corners))
        EXPECT_TRUE(found.insert(corners).second);
      else
        EXPECT_EQ(corners.size(), 3u);
    }
  }
  std::size_t untouched = 0;
  for (const Corners& corners : all) {
    const bool isUntouched = std::ranges::all_of(planes, [&](const BladePlane& plane) {
      const auto sideOf = [&](const Vec3d& p) {
        return dot(Vec3d(plane.normal), p - Vec3d(plane.point)) > 0;
      };
      return std::ranges::all_of(corners, [&](const Vec3d& p) { return sideOf(p) == sideOf(corners[0]); });
    });
    if (!isUntouched) continue;
    ++untouched;
    EXPECT_TRUE(found.count(corners));
  }
  EXPECT_GT(untouched, 0u);
}

TEST(CutPolygons, OfACubeAreKeptWithTheirAttributes) {
  const Mesh cube = quadCube();
  const std::vector<BladePlane> planes{{{0, 0.5f, 0}, {0, 1, 0}}};
  const Pieces cut = cutIntoMeshes(cube, {.planes = planes});
  ASSERT_EQ(cut.pieces.size(), 2u);
  expectSound(cube, cut);
  expectPolygonsKept(cube, cut, planes);
  const MeshAttribute& uv = attributeOf(cube, "uv");
  for (const std::size_t k : {0, 1}) {
    const Mesh& mesh = cut.pieces[k].mesh;
    std::size_t quads = 0;
    for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
      if (mesh.face(f).size() != 4) continue;
      ++quads;
      // Face 2 is below, 3 above.
      const std::size_t source = k == 0 ? 2 : 3;
      for (std::size_t c = 0; c < 4; ++c) {
        EXPECT_EQ(mesh.positions[mesh.face(f)[c]], cube.positions[cube.face(source)[c]]);
        EXPECT_EQ(attributeOf(mesh, "mass").values[mesh.face(f)[c]], float(cube.face(source)[c]));
        for (std::size_t i = 0; i < 2; ++i)
          EXPECT_EQ(attributeOf(mesh, "uv").values[2 * (mesh.faceStart[f] + c) + i],
                    uv.values[2 * (4 * source + c) + i]);
      }
    }
    EXPECT_EQ(quads, 1u);
    // The inner faces are the last group still.
    ASSERT_FALSE(mesh.groups.empty());
    const MeshGroup& inside = mesh.groups.back();
    EXPECT_EQ(inside.name, "inside");
    EXPECT_EQ(inside.firstFace + inside.faceCount, mesh.faceCount());
    EXPECT_NEAR(insideArea(mesh), 4, 1e-14);
    EXPECT_EQ(cut.pieces[k].neighbours.size(), 1u);
  }
}

TEST(CutPolygons, OfRealMeshesAreKept) {
  for (const char* name : {"spot_quads_uv.obj", "dodecahedron_ngons.obj", "hexa_sphere_ngons.obj",
                           "torus_quads_uv.obj", "knot_quads.obj"}) {
    const std::string path = sharedData(std::string("meshes/") + name);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const Mesh mesh = readMesh(path);
    const auto planes = randomBlades({.count = 3, .box = boundingBox(mesh), .seed = 4});
    const Pieces cut = cutIntoMeshes(mesh, {.planes = planes}, {.minVolume = 0.0});
    EXPECT_GT(cut.pieces.size(), 1u) << name;
    EXPECT_NEAR(cut.volumeSum, signedVolume(mesh), 1e-12 * signedVolume(mesh)) << name;
    expectPolygonsKept(mesh, cut, planes);
  }
}

TEST(CutPolygons, AreKeptByCellsRoughBladesAndSolids) {
  const std::string path = sharedData("meshes/hexa_sphere_ngons.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = readMesh(path);
  const auto polygonsIn = [](const Pieces& cut) {
    std::size_t count = 0;
    for (const Piece& piece : cut.pieces) {
      EXPECT_TRUE(piece.closed);
      for (std::size_t f = 0; f < piece.mesh.faceCount(); ++f) count += piece.mesh.face(f).size() > 4;
    }
    return count;
  };
  const std::size_t all = polygonsIn(cutIntoMeshes(mesh, {}));
  EXPECT_GT(all, 800u);
  RoughBlade rough;
  rough.plane = {{0, 0.1f, 0}, {0, 1, 0}};
  rough.roughness.amplitude = 0.02f;
  Knives knives[3];
  knives[0].cells = {{-0.4f, 0, 0}, {0.5f, 0.1f, 0}, {0, 0.6f, 0.2f}};
  knives[1].rough = {rough};
  knives[2].solids = {icosphere(0.5, 2, {1, 0, 0})};
  for (const Knives& knife : knives) {
    const Pieces cut = cutIntoMeshes(mesh, knife);
    EXPECT_GT(cut.pieces.size(), 1u);
    EXPECT_GT(polygonsIn(cut), all / 2);
    EXPECT_LT(polygonsIn(cut), all);
  }
}

// A plane through corners only, along the diagonal of two faces.
TEST(CutPolygons, AreCutWhereAPlanePassesTheirCorners) {
  const Pieces cut = cutIntoMeshes(quadCube(), {.planes = {{{0, 0, 0}, {1, 1, 0}}}});
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (const Piece& piece : cut.pieces) {
    EXPECT_TRUE(piece.closed);
    EXPECT_NEAR(piece.mass.volume, 4, 1e-14);
    std::size_t quads = 0;
    for (std::size_t f = 0; f < piece.mesh.faceCount(); ++f) quads += piece.mesh.face(f).size() == 4;
    EXPECT_EQ(quads, 2u);
  }
}

TEST(CutPolygons, OfPiecesAreKeptWhenTheyAreCutAgain) {
  const std::string path = sharedData("meshes/spot_quads_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = readMesh(path);
  const std::vector<BladePlane> first{{{0, 0.2f, 0}, {0, 1, 0}}};
  const Pieces halves = cutIntoMeshes(mesh, {.planes = first});
  std::vector<CutPart> parts;
  for (const Piece& piece : halves.pieces)
    parts.push_back({.name = "part" + std::to_string(parts.size()), .parent = "", .mesh = piece.mesh});
  const std::vector<BladePlane> second{{{0.1f, 0, 0}, {1, 0, 0}}};
  const Pieces cut = cutIntoMeshes(parts, {.planes = second});
  EXPECT_GT(cut.pieces.size(), halves.pieces.size());
  expectPolygonsKept(mesh, cut, {first[0], second[0]});
  // The first cut is between pieces of both parts.
  std::size_t across = 0;
  for (const Piece& piece : cut.pieces)
    for (const PieceContact& contact : piece.neighbours)
      across += cut.pieces[contact.piece].parent != piece.parent;
  EXPECT_GT(across, 0u);
}

// Of a cube of 8, a corner of 0.02^3 / 6.
TEST(CutSplinters, AreLeftOutUnlessTheyAreAskedFor) {
  const Knives knives{.planes = {{{0.98f, 1, 1}, {1, 1, 1}}, {{0, 0, 0}, {1, 0, 0}}}};
  const Pieces kept = cutIntoMeshes(quadCube(), knives, {.minVolume = 0.0});
  ASSERT_EQ(kept.pieces.size(), 3u);
  EXPECT_EQ(kept.slivers, 0u);
  const Pieces cut = cutIntoMeshes(quadCube(), knives);
  ASSERT_EQ(cut.pieces.size(), 2u);
  EXPECT_EQ(cut.slivers, 1u);
  EXPECT_NEAR(cut.sliverVolume, 8e-6 / 6, 1e-11);
  EXPECT_NEAR(cut.volumeSum + cut.sliverVolume, 8, 1e-13);
  for (const Piece& piece : cut.pieces)
    for (const PieceContact& contact : piece.neighbours) EXPECT_LT(contact.piece, 2u);
  // All as small: none is a splinter.
  EXPECT_EQ(cutIntoMeshes(quadCube(), {.planes = {{{0, 0, 0}, {1, 0, 0}}}}).slivers, 0u);
}

}  // namespace
}  // namespace nephele::test
