// The verb cut, through the program: the pieces, and the files that hold them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/render/image/exr_io.h"
#include "tests/apps/cut_verb.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const MeshAttribute& attributeOf(const Mesh& mesh, const std::string& name) {
  return *std::find_if(mesh.attributes.begin(), mesh.attributes.end(),
                       [&](const MeshAttribute& a) { return a.name == name; });
}

Vec3d vectorOf(const json& v) {
  return {v[0], v[1], v[2]};
}

TEST_F(CutVerb, WritesPiecesTheirListAndAllOfThemAsOneFile) {
  const ProgramResult result = cut(box() + " --plane 0,0.5,0,0,1,0 --explode 0.5");
  EXPECT_NE(result.output.find("2 pieces, volume 8 (of 8)"), std::string::npos) << result.output;
  const std::vector<std::string> expected{"exploded.obj", "piece_0001.obj", "piece_0002.obj",
                                          "pieces.json",  "pieces.mtl",     "pieces.obj"};
  EXPECT_EQ(namesIn("out"), expected);
  const json made = list();
  auto files = made["files"].get<std::vector<std::string>>();
  std::sort(files.begin(), files.end());
  EXPECT_EQ(files, expected);
  EXPECT_EQ(made["geometry"], "exact");
  EXPECT_EQ(made["knives"], json{"plane 0,0.5,0,0,1,0"});
  // The upper quarter of a cube of edge 2: 2 x 0.5 x 2.
  const json& upper = made["pieces"][1];
  EXPECT_EQ(upper["name"], "piece_0002");
  EXPECT_EQ(upper["file"], "piece_0002.obj");
  EXPECT_TRUE(upper["parent"].is_null());
  EXPECT_EQ(upper["code"], "+");
  EXPECT_NEAR(upper["volume"], 2, 1e-12);
  EXPECT_NEAR(upper["area"], 2 * 4 + 4 * 1, 1e-12);
  EXPECT_NEAR(length(vectorOf(upper["centroid"]) - Vec3d{0, 0.75, 0}), 0, 1e-12);
  EXPECT_NEAR(upper["inertia"][1][1], 2 * (4 + 4) / 12.0, 1e-12);
  EXPECT_NEAR(upper["inertia"][0][0], 2 * (0.25 + 4) / 12.0, 1e-12);
  EXPECT_EQ(vectorOf(upper["box"]["min"]), (Vec3d{-1, 0.5, -1}));
  EXPECT_EQ(vectorOf(upper["box"]["max"]), (Vec3d{1, 1, 1}));
  ASSERT_EQ(upper["neighbours"].size(), 1u);
  EXPECT_EQ(upper["neighbours"][0]["name"], "piece_0001");
  EXPECT_NEAR(upper["neighbours"][0]["area"], 4, 1e-12);

  const Mesh mesh = piece("piece_0002.obj");
  EXPECT_TRUE(topologyOf(mesh).isClosedManifold()) << topologyOf(mesh);
  EXPECT_NEAR(signedVolume(mesh), 2, 1e-12);
  ASSERT_NE(groupOf(mesh, "inside"), nullptr);
  EXPECT_EQ(groupOf(mesh, "inside")->firstFace + groupOf(mesh, "inside")->faceCount, mesh.faceCount());
  EXPECT_NE(textOf(file("out/piece_0002.obj")).find("usemtl inside"), std::string::npos);
  EXPECT_NE(textOf(file("out/pieces.mtl")).find("newmtl inside"), std::string::npos);

  // One file, a group for each, in place and moved apart by half the distance of centroids from the middle.
  for (const std::string name : {"pieces.obj", "exploded.obj"}) {
    const Mesh all = piece(name);
    EXPECT_TRUE(topologyOf(all).isClosedManifold());
    EXPECT_EQ(topologyOf(all).components, 2u);
    EXPECT_NEAR(signedVolume(all), 8, 1e-12);
    double top = -10;
    for (const Vec3d& p : all.positions) top = std::max(top, p.y);
    EXPECT_NEAR(top, name == "pieces.obj" ? 1 : 1 + 0.5 * 0.75, 1e-12);
    ASSERT_NE(groupOf(all, "piece_0001"), nullptr);
    ASSERT_NE(groupOf(all, "piece_0002"), nullptr);
  }
}

TEST_F(CutVerb, PiecesCutAgainTellTheirParents) {
  cut(box() + " --plane 0,0.5,0,0,1,0");
  fs::rename(file("out"), file("first"));
  // Through the upper piece only.
  cut(file("first") + " --plane 0,0.75,0,0,1,0");
  EXPECT_EQ(pieceNames(), (std::vector<std::string>{"piece_0001", "piece_0002_0001", "piece_0002_0002"}));
  const json again = list();
  EXPECT_TRUE(again["pieces"][0]["parent"].is_null());
  EXPECT_EQ(again["pieces"][1]["parent"], "piece_0002");
  EXPECT_NEAR(again["volume_sum"], 8, 1e-12);
  // What no knife touched is the same, to the letter.
  EXPECT_EQ(textOf(file("out/piece_0001.obj")), textOf(file("first/piece_0001.obj")));
  // Contacts across the old cut are found again.
  std::map<std::string, double> contacts;
  for (const json& n : again["pieces"][1]["neighbours"]) contacts[n["name"]] = n["area"];
  EXPECT_NEAR(contacts["piece_0001"], 4, 1e-9);
  EXPECT_NEAR(contacts["piece_0002_0002"], 4, 1e-9);
  EXPECT_EQ(contacts.size(), 2u);
  // And again: one piece of those, by its file.
  fs::rename(file("out"), file("second"));
  cut(file("second/piece_0002_0001.obj") + " --plane 0,0,0,1,0,0");
  EXPECT_EQ(pieceNames(), (std::vector<std::string>{"piece_0002_0001_0001", "piece_0002_0001_0002"}));
  EXPECT_EQ(list()["pieces"][0]["parent"], "piece_0002_0001");
  for (const json& p : listedPieces()) EXPECT_NEAR(p["volume"], 0.5, 1e-12);
}

TEST_F(CutVerb, PiecesMayBeCutAgainInTheirOwnFolder) {
  cut(box() + " --plane 0,0.5,0,0,1,0");
  cut(file("out") + " --plane 0,0.75,0,0,1,0");
  EXPECT_EQ(namesIn("out"),
            (std::vector<std::string>{"piece_0001.obj", "piece_0002_0001.obj", "piece_0002_0002.obj",
                                      "pieces.json", "pieces.mtl", "pieces.obj"}));
}

TEST_F(CutVerb, PlyPiecesCutAgainKeepTheContactsOfTheEarlierCut) {
  cut(box() + " --plane 0,0,0,0,1,0 --format ply");
  fs::rename(file("out"), file("first"));
  cut(file("first") + " --plane 0,3,0,0,1,0 --format ply");
  ASSERT_EQ(list()["pieces"][0]["neighbours"].size(), 1u);
  EXPECT_NEAR(list()["pieces"][0]["neighbours"][0]["area"], 4, 1e-9);
}

TEST_F(CutVerb, PiecesAreWrappedWhereThatIsAskedFor) {
  cut(box() + " --plane 0,0,0,0,1,0");
  fs::rename(file("out"), file("first"));
  const ProgramResult result = cut(file("first") + " --plane 0,3,0,0,1,0 --repair wrap");
  EXPECT_NE(result.errors.find("piece_0001: wrapped"), std::string::npos) << result.errors;
}

TEST_F(CutVerb, CutsTheMeshesOfAFolderWithoutAList) {
  fs::create_directory(file("models"));
  meshFile("models/left.ply", boxMesh({-2, 0, 0}, {-1, 1, 1}));
  meshFile("models/right.ply", boxMesh({1, 0, 0}, {2, 1, 1}));
  cut(file("models") + " --plane -1.5,0,0,1,0,0");
  EXPECT_EQ(pieceNames(), (std::vector<std::string>{"left_0001", "left_0002", "right"}));
}

double volumeOf(const VdbGrid& levelSet) {
  return signedVolume(marchingCubes(*toBricks(levelSet)));
}

TEST_F(CutVerb, CutsLevelSetsAndWritesThem) {
  ASSERT_EQ(runProgram("levelset " + ball() + " -o " + file("ball.vdb") + " --resolution 64").exitCode, 0);
  const double whole = volumeOf(readScalarGrid(file("ball.vdb")));
  for (const std::string geometry : {"exact", "levelset"}) {
    cut(file("ball.vdb") + " --plane 0,0,0,0,0,1 --vdb --resolution 64 --geometry " + geometry);
    const std::vector<VdbGrid> grids = readVdbFile(file("out/pieces.vdb"));
    ASSERT_EQ(grids.size(), 2u) << geometry;
    const json made = list();
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(describe(grids[i]).name, made["pieces"][i]["name"]);
      EXPECT_EQ(describe(grids[i]).gridClass, VdbGridInfo::Class::levelSet);
      // Rims are bevelled by a grid: less than 1 % at 32 voxels per radius (docs/knives.md: 0.04 % at 40).
      EXPECT_NEAR(volumeOf(grids[i]) / (whole / 2), 1, 0.01) << geometry;
      const Mesh mesh = piece(std::string(made["pieces"][i]["file"]));
      EXPECT_TRUE(topologyOf(mesh).isClosedManifold());
      EXPECT_NEAR(signedVolume(mesh) / (whole / 2), 1, 0.01);
      // Half the ball's inner face is a disc.
      const MeshGroup* inside = groupOf(mesh, "inside");
      ASSERT_NE(inside, nullptr);
      ASSERT_EQ(made["pieces"][i]["neighbours"].size(), 1u) << geometry;
      EXPECT_NEAR(made["pieces"][i]["neighbours"][0]["area"], M_PI, 0.15) << geometry;
    }
    if (geometry == "exact") {
      EXPECT_NEAR(double(made["volume_sum"]) / double(made["volume_original"]), 1, 1e-8);
    }
  }
}

TEST_F(CutVerb, OuterFacesOfSpotKeepTheirTextureCoordinates) {
  const std::string path = sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh spot = readMesh(path);
  const MeshAttribute& uv = attributeOf(spot, "uv");
  const NearestOnMesh nearest(spot);
  // Texture coordinates of the source at a place on its surface, and how far it is from an edge, where there
  // may be a seam.
  const auto sourceUv = [&](const Vec3d& p, double& margin) {
    const std::size_t t = nearest.nearest(Vec3f(p), 1e30f)->triangle;
    const auto v = spot.face(t);
    const Vec3d &a = spot.positions[v[0]], &b = spot.positions[v[1]], &c = spot.positions[v[2]];
    const Vec3d n = cross(b - a, c - a);
    const double wb = dot(n, cross(p - a, c - a)) / dot(n, n), wc = dot(n, cross(b - a, p - a)) / dot(n, n);
    const double w[] = {1 - wb - wc, wb, wc};
    margin = std::min({w[0], w[1], w[2]});
    Vec3d result{};
    for (std::size_t k = 0; k < 3; ++k)
      result += Vec3d(uv.values[6 * t + 2 * k], uv.values[6 * t + 2 * k + 1], 0) * w[k];
    return result;
  };
  struct Face {
    const Mesh* mesh;
    std::size_t face;
    double reached;
  };
  for (const std::string knives :
       {"--random-planes 5 --seed 2", "--voronoi 12", "--random-planes 2 --roughness 1%"}) {
    SCOPED_TRACE(knives);
    cut(path + " --min-volume 0 " + knives);
    std::vector<Mesh> meshes;
    for (const json& p : listedPieces()) meshes.push_back(piece(p["file"]));
    std::vector<Face> faces;
    double area = 0;
    for (const Mesh& mesh : meshes) {
      const MeshGroup* inside = groupOf(mesh, "inside");
      for (std::size_t f = 0; f < (inside ? inside->firstFace : mesh.faceCount()); ++f) {
        const auto v = mesh.face(f);
        const Vec3d& a = mesh.positions[v[0]];
        area += length(cross(mesh.positions[v[1]] - a, mesh.positions[v[2]] - a)) / 2;
        faces.push_back({&mesh, f, area});
      }
    }
    EXPECT_NEAR(area, surfaceArea(spot), 1e-9 * area);
    std::mt19937 random(1);
    const auto uniform = [&] { return double(random() >> 5) * 0x1p-27; };
    int tested = 0;
    for (int i = 0; i < 10000; ++i) {
      const double at = uniform() * area;
      const Face& face = *std::upper_bound(faces.begin(), faces.end(), at,
                                           [](double x, const Face& f) { return x < f.reached; });
      double b = uniform(), c = uniform();
      if (b + c > 1) b = 1 - b, c = 1 - c;
      const double w[] = {1 - b - c, b, c};
      const MeshAttribute& here = attributeOf(*face.mesh, "uv");
      Vec3d place{}, value{};
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t corner = 3 * face.face + k;
        place += face.mesh->positions[face.mesh->corners[corner]] * w[k];
        value += Vec3d(here.values[2 * corner], here.values[2 * corner + 1], 0) * w[k];
      }
      double margin = 0;
      const Vec3d expected = sourceUv(place, margin);
      if (margin < 1e-4) continue;  // which of two triangles was nearer is a matter of rounding
      ++tested;
      ASSERT_NEAR(value.x, expected.x, 1e-5) << place.x << " " << place.y << " " << place.z;
      ASSERT_NEAR(value.y, expected.y, 1e-5);
    }
    EXPECT_GT(tested, 9900);
  }
}

TEST_F(CutVerb, GroupsMaterialsAndColoursGoOn) {
  // A box in two materials, coloured by its positions, which is linear.
  std::string text = "mtllib wood.mtl\n";
  for (int i = 0; i < 8; ++i) {
    const int x = i & 1, y = i >> 1 & 1, z = i >> 2;
    text += "v " + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + " " +
            std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + "\n";
  }
  text +=
      "g ends\nusemtl oak\nf 1 3 4 2\nf 5 6 8 7\ng sides\nusemtl pine\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 "
      "4 8 6\n";
  cut(textFile("box.obj", text) + " --plane 0.3,0,0,1,0.2,0");
  for (const std::string name : {"piece_0001.obj", "piece_0002.obj"}) {
    const Mesh mesh = piece(name);
    ASSERT_EQ(mesh.groups.size(), 3u);
    EXPECT_EQ(mesh.groups[0].name, "ends");
    EXPECT_EQ(mesh.groups[0].material, "oak");
    EXPECT_EQ(mesh.groups[1].name, "sides");
    EXPECT_EQ(mesh.groups[1].material, "pine");
    EXPECT_EQ(mesh.groups[2].name, "inside");
    EXPECT_EQ(mesh.groups[2].material, "inside");
    // Paths lead from the pieces to where the material is.
    EXPECT_NE(textOf(file("out/" + name)).find("mtllib ../wood.mtl\n"), std::string::npos);
    const MeshAttribute& colour = attributeOf(mesh, "color");
    for (std::uint32_t f = 0; f < mesh.groups[2].firstFace; ++f)
      for (const std::uint32_t v : mesh.face(f))
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(colour.values[3 * v + std::uint32_t(k)], mesh.positions[v][k], 1e-6);
  }
}

TEST_F(CutVerb, PlyPiecesKeepSeams) {
  cut(ownData("data/sphere_uv.obj") + " --plane 0,0,0,0,1,0.1 --format ply");
  EXPECT_EQ(namesIn("out"), (std::vector<std::string>{"piece_0001.ply", "piece_0002.ply", "pieces.json",
                                                      "pieces.mtl", "pieces.obj"}));
  const Mesh mesh = piece("piece_0001.ply");
  EXPECT_TRUE(topologyOf(mesh).isClosedManifold());
  EXPECT_EQ(attributeOf(mesh, "uv").values.size(), 2 * mesh.corners.size());
}

TEST_F(CutVerb, IsTheSameAtAnyThreadCount) {
  const std::string options = ball() + " --random-planes 6 --explode 1 --vdb --resolution 40 --threads ";
  cut(options + "1");
  fs::rename(file("out"), file("one"));
  cut(options + "4");
  ASSERT_EQ(namesIn("out"), namesIn("one"));
  for (const std::string& name : namesIn("out")) {
    if (name == "pieces.vdb" || name == "pieces.json") continue;  // hold the command line, the time
    EXPECT_EQ(textOf(file("out/" + name)), textOf(file("one/" + name))) << name;
  }
  EXPECT_EQ(list()["pieces"], list("one")["pieces"]);
}

TEST_F(CutVerb, ThePreviewShowsEveryPieceInAColourOfItsOwn) {
  cut(box() + " --plane 0,0,0,0,1,0 --preview " + file("p.png") + " --size 160x120 --view 0,10");
  const Image image = readImage(file("p.png"));
  ASSERT_EQ(image.width, 160);
  ASSERT_EQ(image.height, 120);
  const auto at = [&](int x, int y) {
    return Vec3f{image.at("R", x, y), image.at("G", x, y), image.at("B", x, y)};
  };
  // The camera looks at +z: one half above the other, backdrop at the corners.
  EXPECT_GT(length(at(80, 40) - at(80, 85)), 0.2f);
  EXPECT_GT(length(at(80, 40) - at(2, 2)), 0.2f);
  EXPECT_GT(length(at(80, 85) - at(2, 2)), 0.2f);
  EXPECT_LT(length(at(2, 2) - at(157, 2)), 0.02f);
}

TEST_F(CutVerb, SliversAreLeftOutAndCounted) {
  // A corner of volume 0.1^3 / 6.
  const std::string corner = " --plane 0.9,1,1,1,1,1";
  const ProgramResult result = cut(box() + corner + " --min-volume 0.01");
  EXPECT_EQ(stats()["pieces"].size(), 1u);
  EXPECT_EQ(stats()["slivers"]["count"], 1);
  EXPECT_NEAR(stats()["slivers"]["volume"], 0.001 / 6, 1e-8);
  EXPECT_NE(result.errors.find("1 part left out"), std::string::npos) << result.errors;
  cut(box() + corner);
  EXPECT_EQ(stats()["pieces"].size(), 2u);
  cut(box() + corner + " --min-volume 0.01%");
  EXPECT_EQ(stats()["pieces"].size(), 1u);
}

// Of a cube of 8, a corner of 0.02^3 / 6: 1.7e-7 of it.
TEST_F(CutVerb, SplintersAreLeftOutUnlessTheyAreAskedFor) {
  const std::string corner = " --plane 0.98,1,1,1,1,1 --plane 0,0,0,1,0,0";
  const ProgramResult result = cut(box() + corner);
  EXPECT_EQ(stats()["pieces"].size(), 2u);
  EXPECT_EQ(stats()["slivers"]["count"], 1);
  EXPECT_NEAR(stats()["slivers"]["share"], 1e-6 / 6, 1e-12);
  EXPECT_EQ(list()["slivers"]["count"], 1);
  EXPECT_NE(
      result.errors.find("1 part left out, too small, 1.7e-05 % of the volume together; --min-volume 0"),
      std::string::npos)
      << result.errors;
  const ProgramResult all = cut(box() + corner + " --min-volume 0");
  EXPECT_EQ(stats()["pieces"].size(), 3u);
  EXPECT_EQ(all.errors.find("left out"), std::string::npos) << all.errors;
  // A level set has no piece smaller than a voxel, unless it is asked to.
  const std::string levels = " --geometry levelset --resolution 60 --plane 0.95,1,1,1,1,1 ";
  cut(box() + levels);
  const std::size_t few = stats()["pieces"].size();
  cut(box() + levels + "--min-volume 0");
  EXPECT_GE(stats()["pieces"].size(), few);
  EXPECT_EQ(stats()["slivers"]["count"], 0);
}

TEST_F(CutVerb, QuadsAreKeptInFilesAndWhenPiecesAreCutAgain) {
  textFile("quads.obj",
           "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n"
           "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 3/2 4/3 2/4\nf 5/1 6/2 8/3 7/4\nf 1/1 2/2 6/3 5/4\n"
           "f 3/1 7/2 8/3 4/4\nf 1/1 5/2 7/3 3/4\nf 2/1 4/2 8/3 6/4\n");
  const auto quadsOf = [](const Mesh& mesh) {
    std::size_t quads = 0;
    for (std::size_t f = 0; f < mesh.faceCount(); ++f) quads += mesh.face(f).size() == 4;
    return quads;
  };
  cut(file("quads.obj") + " --plane 0,0.5,0,0,1,0 --vdb --resolution 20");
  for (const char* name : {"piece_0001.obj", "piece_0002.obj"}) {
    const Mesh mesh = piece(name);
    EXPECT_EQ(quadsOf(mesh), 1u) << name;
    EXPECT_TRUE(topologyOf(mesh).isClosedManifold()) << name;
    EXPECT_EQ(attributeOf(mesh, "uv").values.size(), 2 * mesh.corners.size());
  }
  EXPECT_EQ(quadsOf(piece("pieces.obj")), 2u);
  cut(file("out") + " --plane 0,0,0,0,1,0 --format ply");
  EXPECT_EQ(quadsOf(piece("piece_0001_0001.ply")), 1u);
  EXPECT_EQ(quadsOf(piece("piece_0002.ply")), 1u);
  cut(file("out") + " --plane 0.1,0,0,1,0,0 --geometry levelset --resolution 20");
  EXPECT_GT(stats()["pieces"].size(), 3u);
}

}  // namespace
}  // namespace nephele::test
