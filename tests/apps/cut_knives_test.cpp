// The knives of the verb cut, through the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/apps/cut_verb.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

TEST_F(CutVerb, PlanesThroughTheCentreOfABallMakeNSquaredMinusNPlusTwo) {
  const std::string input = ball();
  for (const int n : {3, 5, 8}) {
    cut(input + " --through-center --random-planes " + std::to_string(n));
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

TEST_F(CutVerb, CutsLevelSetsExactlyByLinearCells) {
  ASSERT_EQ(runProgram("levelset " + ball() + " -o " + file("ball.vdb") + " --resolution 48").exitCode, 0);
  const std::string input = file("ball.vdb"), tool = meshFile("tool.ply", icosphere(0.5, 2, {0, 1, 0}));
  struct Way {
    std::string knives;
    std::size_t pieces;
  };
  // A convex body: as many pieces as combinations of sides, or cells. Two tools that are one cut once.
  for (const Way& way : std::vector<Way>{{"--random-planes 5 --through-center", 22},
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

TEST_F(CutVerb, PointsAreScatteredInSlantedThinModels) {
  // A plate of 2 x 2 x 0.002 across (1, 1, 1), which fills 1/700 of its box and less of the samples in it.
  Mesh plate = boxMesh({-1, -1, -0.001}, {1, 1, 0.001});
  for (Vec3d& p : plate.positions)
    p = normalize(Vec3d{1, -1, 0}) * p.x + normalize(Vec3d{1, 1, -2}) * p.y + normalize(Vec3d{1, 1, 1}) * p.z;
  cut(meshFile("plate.ply", plate) + " --voronoi 5");
  EXPECT_EQ(list()["cells"].size(), 5u);
  EXPECT_NEAR(double(stats()["volume_sum"]), 0.008, 1e-9);
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

TEST_F(CutVerb, RoughCellsAreRoughAndKeepTheVolume) {
  cut(ball() + " --voronoi 6 --seed 2");
  const double flat = [&] {
    double area = 0;
    for (const auto& piece : statsOfPieces()) area += double(piece["area"]);
    return area;
  }();
  cut(ball() + " --voronoi 6 --seed 2 --roughness 2% --roughness-octaves 2");
  double area = 0;
  for (const auto& piece : statsOfPieces()) {
    EXPECT_TRUE(piece["closed"]);
    area += double(piece["area"]);
  }
  EXPECT_GT(area, 1.02 * flat);
  EXPECT_NEAR(double(stats()["volume_sum"]) / double(stats()["volume_original"]), 1, 1e-8);
  EXPECT_EQ(attempt(ball() + " --voronoi 6 --roughness 2% --kerf 1%").exitCode, 1);
}

TEST_F(CutVerb, AKerfTakesItsWidthTimesTheAreaAway) {
  for (const std::string geometry : {"exact", "levelset --resolution 100"}) {
    cut(box() + " --plane 0,0,0,1,0,0 --kerf 0.1 --geometry " + geometry);
    EXPECT_EQ(stats()["pieces"].size(), 2u);
    // 0.1 x 2 x 2, within the 1 % that kerfs must hold.
    EXPECT_NEAR(8 - double(stats()["volume_sum"]), 0.4, 0.004 + (geometry == "exact" ? 0 : 0.01)) << geometry;
    EXPECT_NEAR(list()["kerf"], 0.1, 1e-7);
  }
  // Half of a shell about the middle of a face, from 0.45 to 0.55.
  const std::string knife = meshFile("knife.ply", icosphere(0.5, 4, {1, 0, 0}));
  ASSERT_EQ(runProgram("levelset " + knife + " -o " + file("knife.vdb") + " --resolution 60").exitCode, 0);
  const double gone = 2.0 / 3 * std::numbers::pi * (std::pow(0.55, 3) - std::pow(0.45, 3));
  for (const std::string& with :
       {knife, file("knife.vdb"), std::string("\"=0.5 - length(P - (1,0,0))\" --resolution 64")}) {
    cut(box() + " --kerf 0.1 --knife " + with);
    ASSERT_EQ(stats()["pieces"].size(), 2u) << with;
    EXPECT_NEAR(8 - double(stats()["volume_sum"]), gone, 0.01 * gone) << with;
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

TEST_F(CutVerb, ExpressionsKnowTheFrameAndTheSeed) {
  // Half of the box, of 2 x 2 x 2, is cut where x is 0.1 times the frame plus the seed.
  const ProgramResult result = runProgram("cut " + box() + " -o " + file("k.####") +
                                          " --knife '=P.x - 0.1*time - 0.01*seed' --seed 5 " +
                                          "--frames 3 --resolution 64 --stats " + file("k.####.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  std::ifstream written(file("k.0003.json"));
  const json made = json::parse(written)["frames"][0]["pieces"];
  ASSERT_EQ(made.size(), 2u);
  for (const json& p : made) {
    const double wide = p["code"] == "+" ? 1 - 0.35 : 1 + 0.35;
    EXPECT_NEAR(p["volume"], 4 * wide, 1e-3);
  }
}

TEST_F(CutVerb, IntegersThatDivideToLessAreRefusedInExpressions) {
  const ProgramResult result = runProgram("cut " + box() + " -o " + file("pieces") + " --knife '=P.x - 1/2'");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.errors.find("1/2 of integers is 0"), std::string::npos) << result.errors;
}

TEST_F(CutVerb, SaysThatAPieceIsLeftOutAndNotThatAKnifeMissed) {
  const ProgramResult result = cut(box() + " --plane 0.8,0,0,1,0,0 --min-volume 30%");
  EXPECT_EQ(result.output.find("no knife parts"), std::string::npos) << result.output;
  EXPECT_NE(result.errors.find("parts nothing that is left"), std::string::npos) << result.errors;
  const ProgramResult all =
      runProgram("cut " + box() + " -o " + file("none") + " --plane 0,0,0,1,0,0 --kerf 300%");
  EXPECT_EQ(all.exitCode, 1);
  EXPECT_NE(all.errors.find("--kerf takes all of the model"), std::string::npos) << all.errors;
}

TEST_F(CutVerb, AKnifeThatMissesLeavesOnePieceAndIsNamed) {
  const ProgramResult result = cut(box() + " --plane 0,5,0,0,1,0");
  EXPECT_NE(result.output.find("1 piece: no knife parts the model"), std::string::npos) << result.output;
  EXPECT_NE(result.errors.find("plane 0,5,0,0,1,0: parts nothing"), std::string::npos) << result.errors;
  EXPECT_NEAR(stats()["volume_sum"], 8, 1e-12);
  // An expression that is negative, or positive, all over the model.
  for (const std::string geometry : {"exact", "exact --kerf 0.1", "levelset"})
    for (const auto& [expression, code] : {std::pair{"=-1 - length(P)", "-"}, {"=1 + length(P)", "+"}}) {
      const ProgramResult missed =
          cut(box() + " --resolution 32 --knife '" + expression + "' --geometry " + geometry);
      EXPECT_NE(missed.errors.find("parts nothing"), std::string::npos) << missed.errors;
      ASSERT_EQ(stats()["pieces"].size(), 1u) << geometry;
      EXPECT_EQ(stats()["pieces"][0]["code"], code) << geometry;
    }
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

}  // namespace
}  // namespace nephele::test
