#include "nephele/levelset/cut/cut_parts.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "nephele/levelset/cut/piece_files.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/point_io.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

const BladePlane kAcrossX{{0, 0, 0}, {1, 0, 0}}, kAcrossY{{0, 0.1f, 0}, {0.2f, 1, 0.1f}};

double innerArea(const Mesh& mesh) {
  double area = 0;
  for (const MeshGroup& group : mesh.groups)
    for (std::size_t f = group.firstFace; group.name == "inside" && f < group.firstFace + group.faceCount;
         ++f) {
      const auto v = mesh.face(f);
      const Vec3d& a = mesh.positions[v[0]];
      area += length(cross(mesh.positions[v[1]] - a, mesh.positions[v[2]] - a)) / 2;
    }
  return area;
}

std::vector<CutPart> partsOf(const Pieces& set) {
  std::vector<CutPart> parts;
  for (const Piece& piece : set.pieces)
    parts.push_back({.name = piece.name, .parent = piece.parent, .mesh = piece.mesh});
  return parts;
}

TEST(CutParts, ContactsAreFoundAcrossAnEarlierCut) {
  const std::vector<CutPart> model{{.mesh = icosphere(1, 3)}};
  const Pieces first = cutIntoMeshes(model, {.planes = {kAcrossX}});
  ASSERT_EQ(first.pieces.size(), 2u);
  const Pieces again = cutIntoMeshes(partsOf(first), {.planes = {kAcrossY}});
  const Pieces atOnce = cutIntoMeshes(model, {.planes = {kAcrossX, kAcrossY}});
  ASSERT_EQ(again.pieces.size(), 4u);
  EXPECT_NEAR(again.volumeSum, atOnce.volumeSum, 1e-12);
  for (const Piece& piece : again.pieces) {
    EXPECT_TRUE(piece.closed);
    // Every inner face touches another piece: two neighbours, one across either plane.
    ASSERT_EQ(piece.neighbours.size(), 2u);
    EXPECT_NEAR(piece.neighbours[0].area + piece.neighbours[1].area, innerArea(piece.mesh), 1e-9);
  }
  EXPECT_EQ(again.pieces[0].name, "piece_0001_0001");
  EXPECT_EQ(again.pieces[3].name, "piece_0002_0002");
  EXPECT_EQ(again.pieces[3].parent, "piece_0002");
}

// As of pieces in .ply files.
TEST(CutParts, ContactsAcrossAnEarlierCutNeedNoGroups) {
  std::vector<CutPart> parts =
      partsOf(cutIntoMeshes(std::vector<CutPart>{{.mesh = icosphere(1, 3)}}, {.planes = {kAcrossX}}));
  double area = 0;
  for (CutPart& part : parts) {
    area = innerArea(part.mesh);
    part.mesh.groups.clear();
  }
  const BladePlane farAway{{0, 5, 0}, {0, 1, 0}};
  for (const BladePlane& plane : {farAway, kAcrossY}) {
    const Pieces again = cutIntoMeshes(parts, {.planes = {plane}});
    double across = 0;
    for (std::size_t p = 0; p < again.pieces.size() / 2; ++p)
      for (const PieceContact& contact : again.pieces[p].neighbours)
        if (contact.piece >= again.pieces.size() / 2) across += contact.area;
    EXPECT_NEAR(across, area, 1e-9);
  }
}

TEST(CutParts, LevelSetsHaveContactsAcrossAnEarlierCut) {
  constexpr float kVoxel = 2.0f / 64;
  std::vector<CutPart> parts = partsOf(
      cutIntoMeshes(std::vector<CutPart>{{.mesh = icosphere(1, 4)}}, {.planes = {{{0, 0, 0}, {0, 1, 0}}}}));
  for (CutPart& part : parts)
    part.level = toBricks(meshToLevelSet(triangulated(part.mesh), {.voxelSize = double(kVoxel)}));
  const auto areasOf = [&](const BladePlane& plane, float kerf) {
    std::map<std::pair<std::string, std::string>, double> areas;
    const Pieces cut = cutIntoLevelSets(parts, double(kVoxel), {.planes = {plane}}, {.kerf = kerf});
    for (const Piece& piece : cut.pieces)
      for (const PieceContact& contact : piece.neighbours)
        areas[{piece.name, cut.pieces[contact.piece].name}] = contact.area;
    return areas;
  };
  // Too small by about a voxel along the rim: of a half disc, and of a disc.
  const double half = (M_PI + 2) * double(kVoxel), whole = 2 * M_PI * double(kVoxel);
  const auto quarters = areasOf(kAcrossX, 0);
  EXPECT_EQ(quarters.size(), 8u);
  for (const auto& [names, area] : quarters) EXPECT_NEAR(area, M_PI / 2, half) << names.first << names.second;
  EXPECT_TRUE(quarters.contains({"piece_0001_0001", "piece_0002_0001"}));
  // A part that no knife touches has its own large triangles.
  const auto untouched = areasOf({{0, 0.5f, 0}, {0, 1, 0}}, 0);
  EXPECT_EQ(untouched.size(), 4u);
  EXPECT_NEAR(untouched.at({"piece_0001", "piece_0002_0001"}), M_PI, whole);
  EXPECT_NEAR(areasOf({{0, 5, 0}, {0, 1, 0}}, 0).at({"piece_0001", "piece_0002"}), M_PI, whole);
  // A kerf takes the contacts of its own cut alone.
  const auto apart = areasOf(kAcrossX, 0.01f);
  EXPECT_EQ(apart.size(), 4u);
  EXPECT_TRUE(apart.contains({"piece_0001_0001", "piece_0002_0001"}));
  EXPECT_THROW(cutIntoLevelSets(parts, double(kVoxel),
                                {.cells = {{-1, 0, 0}, {1, 0, 0}}, .cellRoughness = {.amplitude = 0.01f}}),
               Error);
}

TEST(CutParts, PartsThatNoKnifeTouchesStayAsTheyAre) {
  const std::vector<CutPart> model{{.mesh = boxMesh({-1, -1, -1}, {1, 1, 1})}};
  const Pieces first = cutIntoMeshes(model, {.planes = {kAcrossX}});
  const Pieces again = cutIntoMeshes(partsOf(first), {.planes = {{{0.5f, 0, 0}, {1, 0, 0}}}});
  ASSERT_EQ(again.pieces.size(), 3u);
  EXPECT_EQ(again.pieces[0].name, "piece_0001");
  EXPECT_EQ(again.pieces[0].parent, "");
  EXPECT_EQ(again.pieces[0].mesh.positions, first.pieces[0].mesh.positions);
  EXPECT_EQ(again.pieces[0].mesh.corners, first.pieces[0].mesh.corners);
  // The model itself becomes a piece even where nothing cuts it.
  const Pieces missed = cutIntoMeshes(model, {.planes = {{{5, 0, 0}, {1, 0, 0}}}});
  ASSERT_EQ(missed.pieces.size(), 1u);
  EXPECT_EQ(missed.pieces[0].name, "piece_0001");
}

TEST(CutParts, RefusesNamesThatWouldBeGivenTwice) {
  std::vector<CutPart> parts{{.name = "a", .parent = "", .mesh = boxMesh({-1, -1, -1}, {1, 1, 1})},
                             {.name = "a_0001", .parent = "", .mesh = boxMesh({5, -1, -1}, {7, 1, 1})}};
  EXPECT_THROW(cutIntoMeshes(parts, {.planes = {kAcrossX}}), Error);
  parts[1].name = "a";
  EXPECT_THROW(cutIntoMeshes(parts, {.planes = {kAcrossX}}), Error);
  EXPECT_THROW(cutIntoMeshes(std::vector<CutPart>{}, {}), Error);
}

TEST(CutParts, MovesPiecesApartFromTheMiddleOfAll) {
  const std::vector<CutPart> model{{.mesh = boxMesh({-1, 0, 0}, {3, 1, 1})}};
  const Pieces set = cutIntoMeshes(model, {.planes = {kAcrossX}});
  // Centroids at x = -0.5 and 1.5, of all at 1.
  const std::vector<Vec3d> offsets = explodedOffsets(set, 0.5);
  EXPECT_NEAR(length(offsets[0] - Vec3d{-0.75, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(length(offsets[1] - Vec3d{0.25, 0, 0}), 0, 1e-12);
}

TEST(PieceFiles, KnowTheNamesOfPieces) {
  for (const char* name : {"piece_0001", "piece_12345", "piece_0001_0002", "piece_0001_0002_0003"})
    EXPECT_TRUE(isPieceName(name)) << name;
  for (const char* name : {"piece", "piece_", "piece_001", "piece_0001_", "piece_0001_a", "apiece_0001",
                           "piece0001", "piece_0001 ", ""})
    EXPECT_FALSE(isPieceName(name)) << name;
}

TEST(ObjMaterials, AreReadWithTheirGroups) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("m.obj"))
      << "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n"
         "f 1 3 2\ng back\nf 2 3 1\nusemtl dark blue\nf 3 2 1\n";
  const Mesh mesh = readMesh(folder.file("m.obj"));
  ASSERT_EQ(mesh.groups.size(), 3u);
  EXPECT_EQ(mesh.groups[0].name, "red");
  EXPECT_EQ(mesh.groups[0].faceCount, 2u);
  EXPECT_EQ(mesh.groups[1].name, "back");
  EXPECT_EQ(mesh.groups[1].material, "red");
  EXPECT_EQ(mesh.groups[2].name, "back");
  EXPECT_EQ(mesh.groups[2].material, "dark blue");
  ASSERT_EQ(mesh.materialFiles.size(), 1u);
  EXPECT_EQ(mesh.materialFiles[0], folder.file("colours.mtl"));
  EXPECT_EQ(triangulated(mesh).groups[2].material, "dark blue");
}

TEST(Points, AreReadFromText) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("p.csv"))
      << "x;y;z\r\n1;2;3\r\n\r\n# a comment\r\n +4, -5e-1 ,6,extra\r\n7\t8\t9";
  const Mesh points = readPoints(folder.file("p.csv"));
  EXPECT_EQ(points.positions, (std::vector<Vec3d>{{1, 2, 3}, {4, -0.5, 6}, {7, 8, 9}}));
  const std::vector<Vec3d> two{{1, 2, 3}, {4, 5, 6}};
  for (const char* text : {"id,P.x,P.y,P.z\n7,1,2,3\n8,4,5,6\n", "z,mass,y,x\n3,9,2,1\n6,9,5,4\n",
                           "\xef\xbb\xbf\"name\";\"pos_x\";\"pos_y\";\"pos_z\"\n\"a; b\";\"1\";2;3\n;4;5;6\n",
                           "\"Points:0\",\"Points:1\",\"Points:2\",\"v:0\"\n1,2,3,0\n4,5,6,0\n",
                           "//X Y Z R\n1 2 3 0\n4 5 6 0\n", "a,b,c\n1,2,3\n4,5,6\n"}) {
    std::ofstream(folder.file("named.csv")) << text;
    EXPECT_EQ(readPoints(folder.file("named.csv")).positions, two) << text;
  }
  std::ofstream(folder.file("titled.csv"))
      << "id,P.x,P.y,P.z,pscale,v.x,Cd.r,Cd.g,Cd.b\nfirst,1,2,3,0.5,7,1,0,0\nlast,4,5,6,0.25,8,0,1,0\n";
  const Mesh titled = readPoints(folder.file("titled.csv"));
  EXPECT_EQ(titled.positions, two);
  ASSERT_EQ(titled.attributes.size(), 3u);
  EXPECT_EQ(titled.attributes[0].name, "color");
  EXPECT_EQ(titled.attributes[0].values, (std::vector<float>{1, 0, 0, 0, 1, 0}));
  EXPECT_EQ(titled.attributes[1].name, "pscale");
  EXPECT_EQ(titled.attributes[1].values, (std::vector<float>{0.5f, 0.25f}));
  EXPECT_EQ(titled.attributes[2].name, "vx");
  std::ofstream(folder.file("gaps.csv")) << "x,y,z,mass,name,none,size\n1,2,3,5,7,,1\n4,5,6,,wall,,inf\n";
  const Mesh gaps = readPoints(folder.file("gaps.csv"));
  EXPECT_EQ(gaps.positions, two);
  ASSERT_EQ(gaps.attributes.size(), 2u) << "neither words nor nothing";
  EXPECT_EQ(gaps.attributes[0].values[0], 5);
  EXPECT_TRUE(std::isnan(gaps.attributes[0].values[1]));
  EXPECT_TRUE(std::isnan(gaps.attributes[1].values[1]));
  for (const char* bad : {"1 2\n3 4\n", "1 2 3\n1 2 x\n", "1 2 3\n1 2 nan\n", "1 2 3\n1 2 3x\n", "title\n",
                          "", "1,,2,3\n", "1 2 nan\n1 2 3\n", "nan 0 0\n1 1 1\n", "-inf,0,0\n1,1,1\n",
                          "x 1e999 z\n1 1 1\n", "x,y,z,w\n1,2\n"}) {
    std::ofstream(folder.file("bad.txt")) << bad;
    EXPECT_THROW(readPoints(folder.file("bad.txt")), Error) << bad;
  }
}

}  // namespace
}  // namespace nephele::test
