// The verb cut where something is wrong, through the program: bad input, full disks, files in the way.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <utility>

#include "tests/apps/cut_verb.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

TEST_F(CutVerb, NoPieceLeftIsAnErrorThatWritesNothing) {
  const ProgramResult result = attempt(box() + " --plane 0,0,0,1,0,0 --min-volume 60%");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("no piece is left"), std::string::npos) << result.errors;
  EXPECT_FALSE(fs::exists(file("out")));
}

// A .ply may hold texture coordinates that are no numbers; an .obj, that of all pieces too, may not.
TEST_F(CutVerb, TextureCoordinatesThatAreNoNumbersAreRefusedByTheNameOfTheirFile) {
  textFile("nan.ply",
           "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "property float s\nproperty float t\nelement face 4\nproperty list uchar int vertex_indices\n"
           "end_header\n0 0 0 0 0\n1 0 0 nan 0\n0 1 0 0 1\n0 0 1 1 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
  for (const std::string format : {"obj", "ply"}) {
    const ProgramResult result = attempt(file("nan.ply") + " --plane 0.2,0,0,1,0,0 --format " + format);
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_NE(result.errors.find(format == "obj" ? "error: piece_000" : "error: pieces.obj"),
              std::string::npos);
    EXPECT_NE(result.errors.find("a texture coordinate of corner"), std::string::npos) << result.errors;
    EXPECT_FALSE(fs::exists(file("out")));
  }
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

// Their place would be made for the new ones.
TEST_F(CutVerb, PiecesAreNotReadFromTheFolderThatIsWritten) {
  cut(box() + " --plane 0,0.5,0,0,1,0");
  const std::vector<std::string> before = namesIn("out");
  for (const std::string& arguments : {file("out/piece_0002.obj") + " --plane 0,0.75,0,0,1,0",
                                       file("out/pieces.obj") + " --plane 0,0.75,0,0,1,0",
                                       box() + " --knife " + file("out/piece_0001.obj")}) {
    const ProgramResult result = attempt(arguments);
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_NE(result.errors.find("give the folder"), std::string::npos) << result.errors;
    EXPECT_EQ(namesIn("out"), before);
  }
  // What no cut has made stays where it is.
  cut(meshFile("out/own.ply", boxMesh({-1, -1, -1}, {1, 1, 1})) + " --plane 0,0.5,0,0,1,0");
  EXPECT_TRUE(fs::exists(file("out/own.ply")));
}

TEST_F(CutVerb, APieceThatIsTooThinForItsVoxelsIsNamed) {
  fs::create_directory(file("models"));
  meshFile("models/thick.ply", boxMesh({-2, 0, 0}, {-1, 1, 1}));
  meshFile("models/thin.ply", boxMesh({1, 0, 0}, {2, 1, 0.01}));
  const ProgramResult result =
      attempt(file("models") + " --plane 1.5,0,0,1,0,0 --geometry levelset --resolution 64");
  EXPECT_EQ(result.exitCode, 1);
  for (const char* said : {"models: thin: level set", "along its longest side"})
    EXPECT_NE(result.errors.find(said), std::string::npos) << result.errors;
}

TEST_F(CutVerb, TwoCutsIntoOneFolderLeaveOneWholeFolder) {
  const std::string model = ball();
  for (const bool isThere : {false, true}) {
    if (isThere) cut(model + " --voronoi 3");
    const auto start = [&](const char* cells) {
      return programPath() + " cut " + model + " -o " + file("out") + " --quiet --voronoi " + cells;
    };
    const std::string both = start("30") + " 2>/dev/null & " + start("12") + " 2>/dev/null; wait";
    ASSERT_EQ(std::system(both.c_str()), 0);
    const std::vector<std::string> names = pieceNames();
    EXPECT_TRUE(names.size() == 30 || names.size() == 12) << names.size();
    // The pieces, all of them in one file, the materials and the list.
    EXPECT_EQ(namesIn("out").size(), names.size() + 3);
    fs::remove_all(file("out"));
  }
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
  for (const std::string bad :
       {"--plane 1,2,3",      "--plane 0,0,0,0,0,0", "--plane 0,0,0,0,nan,1", "--random-planes 0",
        "--random-planes -3", "--voronoi 0",         "--voronoi -4",          "--voronoi many",
        "--kerf -1",          "--kerf 1,2",          "--explode -1",          "--seed -1",
        "--geometry about",   "--min-volume -1",     "--min-volume x",        "--min-volume 1e6",
        "--format stl",       "--preview p.jpg",     "--resolution 0",        "--voxel-size 0",
        "--roughness -1",     "--roughness 101%",    "--roughness-octaves 0", "--roughness-frequency 0"}) {
    const ProgramResult result = attempt(model + " --random-planes 1 " + bad);
    EXPECT_EQ(result.exitCode, 2) << bad << ": " << result.errors;
    EXPECT_NE(result.errors.find(bad.substr(0, bad.find(' '))), std::string::npos) << result.errors;
  }
  const ProgramResult none = attempt(model);
  EXPECT_EQ(none.exitCode, 2);
  EXPECT_NE(none.errors.find("no knife"), std::string::npos) << none.errors;
  const ProgramResult rough = attempt(model + " --voronoi 3 --roughness 1% --geometry levelset");
  EXPECT_EQ(rough.exitCode, 2);
  EXPECT_NE(rough.errors.find("--roughness"), std::string::npos) << rough.errors;
  EXPECT_EQ(attempt(model + " --through-center --voronoi 3").exitCode, 2);
  EXPECT_EQ(attempt(model + " --voronoi 3 --points p.txt").exitCode, 2);
  EXPECT_EQ(attempt(model + " --random-planes 1 --size 10x10").exitCode, 2);
  EXPECT_FALSE(fs::exists(file("out")));
}

}  // namespace
}  // namespace nephele::test
