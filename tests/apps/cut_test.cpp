// The verb cut, through the program.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class CutVerb : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return folder_.file(name); }
  std::string meshFile(const std::string& name, const Mesh& mesh) const {
    writeMesh(file(name), mesh);
    return file(name);
  }
  std::string textFile(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
    return file(name);
  }
  std::string ball() const { return meshFile("ball.ply", icosphere(1, 3)); }
  std::string box() const { return meshFile("box.ply", boxMesh({-1, -1, -1}, {1, 1, 1})); }

  /// Cuts into the folder `out`, and expects success.
  ProgramResult cut(const std::string& arguments) const {
    const ProgramResult result = attempt(arguments);
    EXPECT_EQ(result.exitCode, 0) << arguments << "\n" << result.errors;
    return result;
  }
  ProgramResult attempt(const std::string& arguments) const {
    return runProgram("cut -o " + file("out") + " --stats " + file("stats.json") + " " + arguments);
  }
  json stats() const { return json::parse(textOf(file("stats.json"))); }
  /// What statistics or the list say of the pieces.
  std::vector<json> statsOfPieces() const { return stats()["pieces"].get<std::vector<json>>(); }
  std::vector<json> listedPieces() const { return list()["pieces"].get<std::vector<json>>(); }
  json list(const std::string& folder = "out") const {
    return json::parse(textOf(file(folder + "/pieces.json")));
  }
  Mesh piece(const std::string& name) const { return readMesh(file("out/" + name)); }
  std::vector<std::string> namesIn(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(file(folder)))
      names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
  }
  std::vector<std::string> pieceNames(const std::string& folder = "out") const {
    std::vector<std::string> names;
    const json made = list(folder);
    for (const json& piece : made["pieces"]) names.push_back(piece["name"]);
    return names;
  }

  TemporaryFolder folder_;
};

const MeshGroup* groupOf(const Mesh& mesh, const std::string& name) {
  const auto found = std::find_if(mesh.groups.begin(), mesh.groups.end(),
                                  [&](const MeshGroup& group) { return group.name == name; });
  return found == mesh.groups.end() ? nullptr : &*found;
}

const MeshAttribute& attributeOf(const Mesh& mesh, const std::string& name) {
  return *std::find_if(mesh.attributes.begin(), mesh.attributes.end(),
                       [&](const MeshAttribute& a) { return a.name == name; });
}

Vec3d vectorOf(const json& v) {
  return {v[0], v[1], v[2]};
}

TEST_F(CutVerb, PlanesThroughTheCentreOfABallMakeNSquaredMinusNPlusTwo) {
  const std::string input = ball();
  for (const int n : {3, 5, 8}) {
    cut(input + " --through-centre --random-planes " + std::to_string(n));
    const json made = stats();
    const auto expected = std::size_t(n * n - n + 2);
    ASSERT_EQ(made["pieces"].size(), expected);
    // A convex body has one piece for each combination of sides.
    EXPECT_EQ(made["levelsets_nonempty"], expected);
    double sum = 0;
    for (const json& piece : made["pieces"]) {
      EXPECT_TRUE(piece["closed"]);
      EXPECT_EQ(std::string(piece["code"]).size(), std::size_t(n));
      sum += double(piece["volume"]);
    }
    EXPECT_NEAR(sum / signedVolume(icosphere(1, 3)), 1, 1e-7);  // PLY holds the ball as doubles
    EXPECT_DOUBLE_EQ(made["volume_sum"], sum);
    EXPECT_NEAR(double(made["volume_original"]), sum, 1e-9);
  }
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

TEST_F(CutVerb, CutsLevelSetsExactlyByLinearCells) {
  ASSERT_EQ(runProgram("levelset " + ball() + " -o " + file("ball.vdb") + " --resolution 48").exitCode, 0);
  const std::string input = file("ball.vdb"), tool = meshFile("tool.ply", icosphere(0.5, 2, {0, 1, 0}));
  struct Way {
    std::string knives;
    std::size_t pieces;
  };
  // A convex body: as many pieces as combinations of sides, or cells. Two tools that are one cut once.
  for (const Way& way : std::vector<Way>{{"--random-planes 5 --through-centre", 22},
                                         {"--voronoi 6", 6},
                                         {"--plane 0,0,0,1,0,0 --roughness 2%", 2},
                                         {"--plane 0,0,0,1,0,0 --knife " + tool + " --knife " + tool, 4}}) {
    cut(input + " " + way.knives + " --explode 0.5 --preview " + file("p.png") + " --size 64x48");
    const json made = list();
    EXPECT_EQ(made["geometry"], "exact");
    EXPECT_EQ(made["pieces"].size(), way.pieces) << way.knives;
    EXPECT_NEAR(double(made["volume_sum"]) / double(made["volume_original"]), 1, 1e-8) << way.knives;
    for (const json& p : listedPieces()) {
      const Mesh mesh = piece(p["file"]);
      EXPECT_TRUE(topologyOf(mesh).isClosedManifold()) << topologyOf(mesh);
      // Coordinates that are floats are written with the digits of floats.
      EXPECT_NEAR(signedVolume(mesh), p["volume"], 1e-8);
      EXPECT_NE(groupOf(mesh, "inside"), nullptr);
      EXPECT_FALSE(p["neighbours"].empty());
    }
    EXPECT_TRUE(fs::exists(file("out/exploded.obj")));
  }
  // A kerf, and the pieces again, which are meshes now.
  cut(input + " --plane 0,0,0,1,0,0 --kerf 0.04");
  const double taken = double(list()["volume_original"]) - double(list()["volume_sum"]);
  EXPECT_NEAR(taken / (M_PI * 0.04), 1, 0.01);  // kerf x area of the disc
  fs::rename(file("out"), file("first"));
  cut(file("first") + " --plane 0,0,0,0,1,0");
  EXPECT_EQ(pieceNames(), (std::vector<std::string>{"piece_0001_0001", "piece_0001_0002", "piece_0002_0001",
                                                    "piece_0002_0002"}));
  EXPECT_EQ(attempt(input + " --plane 5,0,0,1,0,0").exitCode, 0);
  EXPECT_EQ(list()["pieces"].size(), 1u);
}

TEST_F(CutVerb, VoronoiCellsComeFromPointsOrAreScattered) {
  const std::string input = ball();
  cut(input + " --voronoi 12 --seed 3");
  EXPECT_EQ(stats()["pieces"].size(), 12u);  // of a convex body, around points inside
  EXPECT_EQ(list()["cells"].size(), 12u);
  EXPECT_EQ(list()["pieces"][4]["cell"], 4);

  // Eight corners of a cube: octants.
  std::string txt = "# corners\n", csv = "x,y,z,name\n", obj;
  Mesh points;
  for (int i = 0; i < 8; ++i) {
    const int x = i & 1 ? 1 : -1, y = i & 2 ? 1 : -1, z = i & 4 ? 1 : -1;
    const std::string s[] = {std::to_string(x), std::to_string(y), std::to_string(z)};
    txt += s[0] + " " + s[1] + "\t" + s[2] + "\n";
    csv += s[0] + "," + s[1] + ";" + s[2] + ",corner\r\n";
    obj += "v " + s[0] + " " + s[1] + " " + s[2] + "\n";
    points.positions.push_back({double(x), double(y), double(z)});
  }
  meshFile("points.ply", points);
  textFile("points.txt", txt);
  textFile("points.csv", csv);
  textFile("points.obj", obj);
  for (const char* extension : {"ply", "txt", "csv", "obj"}) {
    cut(input + " --points " + file(std::string("points.") + extension));
    ASSERT_EQ(stats()["pieces"].size(), 8u) << extension;
    for (const json& p : statsOfPieces())
      EXPECT_NEAR(p["volume"], signedVolume(icosphere(1, 3)) / 8, 1e-6) << extension;
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
    cut(path + " " + knives);
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

TEST_F(CutVerb, RoughPlanesAreWavyAndKeepTheVolume) {
  const std::string arguments = ball() + " --plane 0,0,0,0,0,1 --roughness 2% --roughness-octaves 2";
  cut(arguments);
  const json made = stats();
  ASSERT_GE(made["pieces"].size(), 2u);
  for (const json& p : made["pieces"]) EXPECT_TRUE(p["closed"]);
  EXPECT_NEAR(double(made["volume_sum"]) / double(made["volume_original"]), 1, 1e-8);
  const Mesh mesh = piece("piece_0001.obj");
  const MeshGroup& inside = *groupOf(mesh, "inside");
  double low = 1, high = -1, squares = 0, count = 0;
  for (std::uint32_t f = inside.firstFace; f < inside.firstFace + inside.faceCount; ++f)
    for (const std::uint32_t v : mesh.face(f)) {
      low = std::min(low, mesh.positions[v].z);
      high = std::max(high, mesh.positions[v].z);
      squares += mesh.positions[v].z * mesh.positions[v].z;
      ++count;
    }
  // Root mean square 2 % of 2, over some ten hills: within a third of it, and to both sides.
  EXPECT_NEAR(std::sqrt(squares / count), 0.04, 0.015);
  EXPECT_LT(low, -0.04);
  EXPECT_GT(high, 0.04);
  cut(arguments + " --geometry levelset --resolution 100");
  EXPECT_NEAR(double(stats()["volume_sum"]) / double(stats()["volume_original"]), 1, 2e-3);
}

TEST_F(CutVerb, AKerfTakesItsWidthTimesTheAreaAway) {
  for (const std::string geometry : {"exact", "levelset --resolution 100"}) {
    cut(box() + " --plane 0,0,0,1,0,0 --kerf 0.1 --geometry " + geometry);
    EXPECT_EQ(stats()["pieces"].size(), 2u);
    // 0.1 x 2 x 2, within the 1 % that kerfs must hold.
    EXPECT_NEAR(8 - double(stats()["volume_sum"]), 0.4, 0.004 + (geometry == "exact" ? 0 : 0.01)) << geometry;
    EXPECT_NEAR(list()["kerf"], 0.1, 1e-7);
  }
}

TEST_F(CutVerb, AMeshOrALevelSetIsAKnife) {
  const std::string knife = meshFile("knife.ply", icosphere(0.5, 3, {1, 0, 0}));
  ASSERT_EQ(runProgram("levelset " + knife + " -o " + file("knife.vdb") + " --resolution 60").exitCode, 0);
  // Half of a ball of radius 0.5 leaves the box's face; a mesh of 1280 triangles lies 1 % below.
  const double half = signedVolume(icosphere(0.5, 3)) / 2;
  for (const std::string with : {"knife.ply", "knife.vdb"})
    for (const std::string geometry : {"exact", "levelset --resolution 100"}) {
      cut(box() + " --knife " + file(with) + " --geometry " + geometry);
      const json made = stats();
      ASSERT_EQ(made["pieces"].size(), 2u) << with << " " << geometry;
      for (const json& p : made["pieces"]) {
        EXPECT_TRUE(p["closed"]);
        EXPECT_NEAR(p["volume"], p["code"] == "+" ? half : 8 - half, 0.02 * half) << with << " " << geometry;
      }
    }
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

TEST_F(CutVerb, AKnifeThatMissesLeavesOnePieceAndIsNamed) {
  const ProgramResult result = cut(box() + " --plane 0,5,0,0,1,0");
  EXPECT_NE(result.output.find("1 piece: no knife parts the model"), std::string::npos) << result.output;
  EXPECT_NE(result.errors.find("plane 0,5,0,0,1,0: parts nothing"), std::string::npos) << result.errors;
  EXPECT_NEAR(stats()["volume_sum"], 8, 1e-12);
  // Exactly on a face is a miss, too, from either side.
  for (const std::string plane : {"0,1,0,0,1,0", "0,1,0,0,-1,0", "-1,0,0,1,0,0"}) {
    cut(box() + " --plane " + plane);
    EXPECT_EQ(stats()["pieces"].size(), 1u);
    EXPECT_EQ(piece("piece_0001.obj").faceCount(), 12u);
  }
}

TEST_F(CutVerb, CoincidentKnivesCutOnce) {
  cut(box() + " --plane 0,0,0,0,1,0 --plane 0,0,0,0,1,0 --plane 1,0,1,0,-2,0");
  EXPECT_EQ(stats()["pieces"].size(), 2u);
  EXPECT_EQ(stats()["pieces"][0]["code"], "--+");
  EXPECT_EQ(stats()["pieces"][1]["code"], "++-");
}

TEST_F(CutVerb, TakesMoreKnivesThanABitFieldHolds) {
  std::string planes;
  for (int i = 0; i < 70; ++i) planes += " --plane " + std::to_string(-0.9 + 1.8 * i / 69) + ",0,0,1,0,0";
  cut(box() + planes);
  EXPECT_EQ(stats()["pieces"].size(), 71u);
  EXPECT_EQ(std::string(stats()["pieces"][0]["code"]).size(), 70u);
  EXPECT_NEAR(stats()["volume_sum"], 8, 1e-9);
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

TEST_F(CutVerb, NoPieceLeftIsAnErrorThatWritesNothing) {
  const ProgramResult result = attempt(box() + " --plane 0,0,0,1,0,0 --min-volume 60%");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("no piece is left"), std::string::npos) << result.errors;
  EXPECT_FALSE(fs::exists(file("out")));
}

TEST_F(CutVerb, OlderPiecesMakeRoomAndOtherFilesStay) {
  cut(ball() + " --random-planes 3 --explode 1");
  textFile("out/notes.txt", "mine");
  cut(ball() + " --random-planes 1");
  EXPECT_EQ(namesIn("out"), (std::vector<std::string>{"notes.txt", "piece_0001.obj", "piece_0002.obj",
                                                      "pieces.json", "pieces.mtl", "pieces.obj"}));
  // A run that fails leaves them as they are.
  const std::string before = textOf(file("out/pieces.json"));
  EXPECT_EQ(attempt(ball() + " --random-planes 1 --min-volume 99%").exitCode, 1);
  EXPECT_EQ(textOf(file("out/pieces.json")), before);
}

TEST_F(CutVerb, FilesThatNoListNamesAreNeverReplaced) {
  fs::create_directory(file("out"));
  for (const std::string name : {"piece_0001.obj", "piece_0077.ply", "pieces.obj", "pieces.mtl"}) {
    textFile("out/" + name, "mine");
    const ProgramResult result = attempt(box() + " --random-planes 1");
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_NE(result.errors.find(name + " is in the way"), std::string::npos) << result.errors;
    EXPECT_EQ(namesIn("out"), std::vector<std::string>{name});
    EXPECT_EQ(textOf(file("out/" + name)), "mine");
    fs::remove(file("out/" + name));
  }
  textFile("out/pieces.json", "{\"files\": [\"../box.ply\"]}");
  EXPECT_EQ(attempt(box() + " --random-planes 1").exitCode, 1);
  // A list that names files elsewhere has no say over them.
  textFile("out/pieces.json", "{\"creator\": \"nephele\", \"files\": [\"../box.ply\", \"..\", \"\"]}");
  cut(box() + " --random-planes 1");
  EXPECT_TRUE(fs::exists(file("box.ply")));
}

TEST_F(CutVerb, AFullDiskLeavesNothing) {
  const ProgramResult result =
      runProgram("cut " + meshFile("fine.ply", icosphere(1, 5)) + " --random-planes 2 -o " + file("deep/out"),
                 "ulimit -f 200;");
  EXPECT_EQ(result.exitCode, 1) << result.errors;
  EXPECT_FALSE(fs::exists(file("deep")));
}

TEST_F(CutVerb, AnInterruptLeavesAllOrNothing) {
  const std::string input = meshFile("fine.ply", icosphere(1, 5));
  // Sent once the folder is there, while its files are made.
  std::ofstream(file("script")) << "'" << programPath() << "' cut '" << input << "' --random-planes 30 -o '"
                                << file("out") << "' >/dev/null 2>&1 &\nid=$!\nwhile [ ! -d '" << file("out")
                                << "' ] && kill -0 $id; do :; done\nkill -INT $id\nwait $id\n";
  const int status = WEXITSTATUS(std::system(("sh '" + file("script") + "' 2>/dev/null").c_str()));
  ASSERT_TRUE(status == 130 || status == 0) << status;
  ASSERT_EQ(fs::exists(file("out")), status == 0);
  if (status == 0) {
    std::vector<std::string> files = list()["files"];
    std::sort(files.begin(), files.end());
    EXPECT_EQ(namesIn("out"), files);
  }
}

TEST_F(CutVerb, MeshesThatAreNotSolidAreRepairedOrRefused) {
  Mesh open = boxMesh({-1, -1, -1}, {1, 1, 1});
  open.corners.resize(30);
  open.faceStart.resize(11);
  const std::string path = meshFile("open.ply", open);
  const std::string plane = " --plane 0,0,0,1,0,0";
  const ProgramResult repaired = cut(path + plane);
  EXPECT_NE(repaired.errors.find("filled 1 hole"), std::string::npos) << repaired.errors;
  EXPECT_NEAR(stats()["volume_sum"], 8, 1e-9);
  const ProgramResult refused = attempt(path + plane + " --repair off");
  EXPECT_EQ(refused.exitCode, 1);
  EXPECT_NE(refused.errors.find("not closed"), std::string::npos) << refused.errors;

  Mesh inward = boxMesh({-1, -1, -1}, {1, 1, 1});
  std::reverse(inward.corners.begin(), inward.corners.end());
  const ProgramResult turned = cut(meshFile("inward.ply", inward) + plane);
  EXPECT_NE(turned.errors.find("outward"), std::string::npos) << turned.errors;
  EXPECT_NEAR(stats()["volume_sum"], 8, 1e-9);
}

TEST_F(CutVerb, AMeshThatCrossesItselfIsCutWithAWarning) {
  const Mesh crossing = joined(icosphere(1, 2), icosphere(1, 2, {0.7, 0.1, 0}));
  const ProgramResult result = cut(meshFile("two.ply", crossing) + " --plane 0,0,0,0,0,1");
  EXPECT_NE(result.errors.find("crosses itself"), std::string::npos) << result.errors;
  EXPECT_GT(stats()["self_intersections"], 0);
  EXPECT_NEAR(double(stats()["volume_sum"]), 2 * signedVolume(icosphere(1, 2)), 1e-6);
  EXPECT_EQ(cut(ball() + " --random-planes 1").errors.find("crosses"), std::string::npos);
}

TEST_F(CutVerb, RefusesBadFiles) {
  const std::string model = box();
  fs::create_directory(file("empty"));
  fs::create_directory(file("gone"));
  textFile("gone/pieces.json",
           R"({"creator": "nephele", "files": [], "pieces": [{"name": "a", "file": "a.obj"}]})");
  fs::create_directory(file("odd"));
  textFile("odd/pieces.json", R"({"pieces": [{"name": "a"}]})");
  textFile("none.txt", "# nothing\n");
  textFile("bad.csv", "x,y,z\n1,2,3\n1,two,3\n");
  textFile("same.txt", "0 0 0\n0 0 0\n");
  const std::string flat = meshFile("flat.ply", [] {
    Mesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.addFace(std::array<std::uint32_t, 3>{0, 1, 2});
    return mesh;
  }());
  const std::vector<std::pair<std::string, std::string>> cases{
      {file("nowhere.obj") + " --voronoi 2", "nowhere.obj"},
      {file("empty") + " --voronoi 2", "holds no pieces"},
      {file("gone") + " --voronoi 2", "a.obj"},
      {file("odd") + " --voronoi 2", "no name or no file"},
      {model + " --points " + file("nowhere.txt"), "nowhere.txt"},
      {model + " --points " + file("none.txt"), "has no points"},
      {model + " --points " + file("bad.csv"), "line 3"},
      {model + " --points " + file("same.txt"), "same point"},
      {model + " --knife " + file("nowhere.vdb"), "nowhere.vdb"},
      {model + " --knife " + flat, "flat"},
      {flat + " --voronoi 2", "mesh"},
      {model + " --voronoi 2 --geometry levelset --voxel-size 1e-6", "larger voxels"},
      {model + " --voronoi 2 -o " + model, "it is no folder"}};
  for (const auto& [arguments, said] : cases) {
    const ProgramResult result =
        runProgram("cut " + arguments +
                   (arguments.find(" -o ") == std::string::npos ? " -o " + file("out") : std::string()));
    EXPECT_EQ(result.exitCode, 1) << arguments << "\n" << result.errors;
    EXPECT_NE(result.errors.find(said), std::string::npos) << arguments << "\n" << result.errors;
    EXPECT_FALSE(fs::exists(file("out"))) << arguments;
  }
}

TEST_F(CutVerb, BadOptionsAreUsageErrorsThatNameThem) {
  const std::string model = box();
  for (const std::string bad : {"--plane 1,2,3",
                                "--plane 0,0,0,0,0,0",
                                "--plane 0,0,0,0,nan,1",
                                "--random-planes 0",
                                "--random-planes -3",
                                "--voronoi 0",
                                "--voronoi -4",
                                "--voronoi many",
                                "--kerf -1",
                                "--kerf 1,2",
                                "--explode -1",
                                "--seed -1",
                                "--geometry about",
                                "--min-volume -1",
                                "--min-volume x",
                                "--format stl",
                                "--preview p.jpg",
                                "--resolution 0",
                                "--voxel-size 0",
                                "--roughness -1",
                                "--roughness-octaves 0",
                                "--roughness-frequency 0"}) {
    const ProgramResult result = attempt(model + " --random-planes 1 " + bad);
    EXPECT_EQ(result.exitCode, 2) << bad << ": " << result.errors;
    EXPECT_NE(result.errors.find(bad.substr(0, bad.find(' '))), std::string::npos) << result.errors;
  }
  const ProgramResult none = attempt(model);
  EXPECT_EQ(none.exitCode, 2);
  EXPECT_NE(none.errors.find("no knife"), std::string::npos) << none.errors;
  EXPECT_EQ(attempt(model + " --through-centre --voronoi 3").exitCode, 2);
  EXPECT_EQ(attempt(model + " --voronoi 3 --points p.txt").exitCode, 2);
  EXPECT_EQ(attempt(model + " --random-planes 1 --size 10x10").exitCode, 2);
  EXPECT_FALSE(fs::exists(file("out")));
}

}  // namespace
}  // namespace nephele::test
