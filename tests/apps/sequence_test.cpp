// Sequences of frames, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/similarity.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

class Sequences : public testing::Test {
 protected:
  // A ball that grows from 0.5 to 1, in frames of another density each.
  void SetUp() override {
    for (int frame = 1; frame <= 3; ++frame) writeBall(frame, 0.25f + 0.25f * float(frame), float(frame));
  }
  void writeBall(int frame, float radius, float value, const std::string& grid = "density") const {
    writeVdbFile(path("ball", frame, "vdb"),
                 {toVdb(*ball(radius, 0.1f, value), {grid, VdbGridInfo::Class::fogVolume})}, {});
  }
  std::string path(const std::string& name, int frame, const std::string& extension) const {
    return folder.file(fmt::format("{}.{:04d}.{}", name, frame, extension));
  }
  std::string pattern(const std::string& name, const std::string& extension) const {
    return "'" + folder.file(name + ".####." + extension) + "'";
  }
  std::string rendering(const std::string& options) const {
    return fmt::format("render {} -o {} --size 48x32 --samples 1 --stats '{}' {}", pattern("ball", "vdb"),
                       pattern("f", "exr"), folder.file("s.json"), options);
  }
  nlohmann::json statistics() const { return nlohmann::json::parse(textOf(folder.file("s.json"))); }
  static ProgramResult succeeds(const std::string& arguments) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 0) << arguments << '\n' << result.errors;
    return result;
  }
  static void fails(const std::string& arguments, int exitCode, const std::string& message) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, exitCode) << arguments;
    EXPECT_NE(result.errors.find(message), std::string::npos) << arguments << '\n' << result.errors;
  }

  TemporaryFolder folder;
};

TEST_F(Sequences, HaveOneCameraAndOneExtinction) {
  succeeds(rendering("--frames 1-3"));
  const auto stats = statistics();
  ASSERT_EQ(stats["frames"].size(), 3u);
  // An optical depth of 150 across the longest side of the largest frame, at the largest density, which is 3
  // but for the soft edge. The ball is 2 wide, and its bounds reach one voxel beyond on either side.
  const double expected = 150 / (2.2 * 3);
  for (int frame = 1; frame <= 3; ++frame) {
    EXPECT_EQ(stats["frames"][frame - 1]["frame"], frame);
    EXPECT_EQ(stats["frames"][frame - 1]["extinction"], stats["frames"][0]["extinction"]);
    EXPECT_NEAR(double(stats["frames"][frame - 1]["extinction"]), expected, 0.1 * expected);
    EXPECT_EQ(readImageCamera(path("f", frame, "exr"))->worldToCamera,
              readImageCamera(path("f", 1, "exr"))->worldToCamera);
  }
  // Each frame by itself has others.
  succeeds(fmt::format("render '{}' -o '{}' --size 48x32 --samples 1 --stats '{}'", path("ball", 1, "vdb"),
                       folder.file("one.exr"), folder.file("s.json")));
  EXPECT_NE(readImageCamera(folder.file("one.exr"))->worldToCamera,
            readImageCamera(path("f", 1, "exr"))->worldToCamera);
  EXPECT_GT(double(statistics()["extinction"]), 1.5 * expected);
}

TEST_F(Sequences, OfOneFrameAreTheFrame) {
  succeeds(rendering("--frames 2 --projection orthographic"));
  succeeds(rendering("--frames 3"));
  succeeds(fmt::format("render '{}' -o '{}' --size 48x32 --samples 1", path("ball", 3, "vdb"),
                       folder.file("one.exr")));
  const Image one = readImage(folder.file("one.exr")), frame = readImage(path("f", 3, "exr"));
  for (const char* name : {"R", "G", "B", "A"})
    EXPECT_EQ(one.channel(name).values, frame.channel(name).values) << name;
}

TEST_F(Sequences, OfSharesAreTheSameAsTheWhole) {
  succeeds(rendering("--frames 1-3"));
  const Image second = readImage(path("f", 2, "exr"));
  for (int frame = 1; frame <= 3; ++frame) fs::remove(path("f", frame, "exr"));
  succeeds(rendering("--frames 1-3 --shard 2/3"));
  EXPECT_EQ(readImage(path("f", 2, "exr")).channel("G").values, second.channel("G").values);
  EXPECT_FALSE(fs::exists(path("f", 1, "exr")) || fs::exists(path("f", 3, "exr")));
  succeeds(rendering("--frames 1-3 --only 2-9 --skip-existing"));
  EXPECT_EQ(statistics()["frames"].size(), 2u);
  EXPECT_EQ(statistics()["frames"][0]["skipped"], true);
  EXPECT_EQ(readImage(path("f", 2, "exr")).channel("G").values, second.channel("G").values);
  EXPECT_TRUE(fs::exists(path("f", 3, "exr")));
}

TEST_F(Sequences, AreTheSameAtAnyThreadCount) {
  succeeds(rendering("--frames 1-3 --threads 1"));
  std::vector<Image> alone;
  for (int frame = 1; frame <= 3; ++frame) alone.push_back(readImage(path("f", frame, "exr")));
  succeeds(rendering("--frames 1-3 --threads 3"));
  for (int frame = 1; frame <= 3; ++frame)
    EXPECT_EQ(readImage(path("f", frame, "exr")).channel("G").values,
              alone[std::size_t(frame - 1)].channel("G").values);
}

TEST_F(Sequences, NameWhatIsMissingBeforeAnyWork) {
  fs::remove(path("ball", 2, "vdb"));
  fails(rendering("--frames 1-6"), 1, "4 of 6 frames are missing: 2, 4-6");
  EXPECT_FALSE(fs::exists(path("f", 1, "exr")));
  succeeds(rendering("--frames 1-3x2"));
  EXPECT_TRUE(fs::exists(path("f", 3, "exr")));
}

TEST_F(Sequences, NameMasksThatAreMissing) {
  for (const std::string& density :
       {"mask:" + folder.file("ball.#.vdb") + ":0,1", "mask:" + folder.file("ball.$F.vdb") + ":density:0,1",
        "=mask(\"" + folder.file("ball.%d.vdb") + "\")"}) {
    fs::copy_file(path("ball", 1, "vdb"), folder.file("ball.1.vdb"), fs::copy_options::skip_existing);
    fails("cloud " + ownData("data/sphere_uv.obj") + " --resolution 24 --layers 1 -o " + pattern("c", "vdb") +
              " --frames 1-3 --density '" + density + "'",
          1, "vdb: 2 of 3 frames are missing: 2-3");
  }
  EXPECT_FALSE(fs::exists(path("c", 1, "vdb")));
}

// Of all calls: one that only a later one would write.
TEST_F(Sequences, RefuseOutputsThatAreTheSameFile) {
  const std::string cloud = "cloud " + ownData("data/sphere_uv.obj") + " --resolution 24 --layers 1 -o '";
  fails(cloud + folder.file("a.#.vdb") + "' --surface '" + folder.file("a.##.vdb") + "' --frames 8-11", 2,
        "--surface: got");
  fails(cloud + folder.file("a.#.vdb") + "' --surface '" + folder.file("a.1#.vdb") + "' --frames 1-11", 2,
        "no other of the calls");
  fails(rendering("--frames 1-3 --contact-sheet '" + path("f", 2, "png") + "'"), 2, "no other of the calls");
  EXPECT_FALSE(fs::exists(folder.file("a.8.vdb")) || fs::exists(path("f", 1, "exr")));
}

TEST_F(Sequences, OfWhichOneFailsAreNotDoneForFarms) {
  writeBall(2, 1, 1, "other");
  const ProgramResult result = runProgram(rendering("--frames 1-3 --progress alf"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_EQ(result.output.find("100%"), std::string::npos) << result.output;
}

TEST_F(Sequences, RefuseFramesOfOtherGrids) {
  writeBall(2, 0.5f, 1, "smoke");
  fails(rendering("--frames 1-3"), 1, "its grids are 'smoke'");
  EXPECT_FALSE(fs::exists(path("f", 1, "exr")));
  writeVdbFile(path("ball", 2, "vdb"),
               {toVdb(*ball(0.5f, 0.05f), {"density", VdbGridInfo::Class::fogVolume})}, {});
  EXPECT_NE(succeeds(rendering("--frames 1-3")).errors.find("its voxels are 0.05 wide"), std::string::npos);
}

TEST_F(Sequences, KeepWhatIsWholeWhereAFrameFails) {
  std::ofstream(folder.file("a.0003.obj")) << "v 0 0 0\n";
  for (int frame = 1; frame <= 2; ++frame)
    fs::copy_file(ownData("data/sphere_uv.obj"), path("a", frame, "obj"));
  const std::string call = "mesh " + pattern("a", "obj") + " -o " + pattern("b", "obj") + " --frames 1-3";
  // Found while all are measured.
  fails(call, 1, "a.0003.obj");
  const std::string levels = "levelset " + pattern("a", "obj") + " -o " + pattern("l", "vdb") +
                             " --resolution 16 --repair off --frames 1-3";
  std::ofstream(folder.file("a.0003.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  fails(levels, 1, "ended at frame 3: 2 of 3 frames are whole");
  EXPECT_EQ(readVdbFile(path("l", 2, "vdb")).size(), 1u);
  EXPECT_FALSE(fs::exists(path("l", 3, "vdb")));
}

TEST_F(Sequences, SkipWhatIsThereWholeAndMadeWithTheSameOptions) {
  const auto skipped = [&](const std::string& options) {
    succeeds(rendering("--frames 1-3 --skip-existing " + options));
    std::string result;
    const auto stats = statistics();
    for (const auto& frame : stats["frames"]) result += frame["skipped"] == true ? 's' : 'm';
    return result;
  };
  EXPECT_EQ(skipped(""), "mmm");
  EXPECT_EQ(skipped("--threads 1 --quiet"), "sss");
  fs::resize_file(path("f", 2, "exr"), fs::file_size(path("f", 2, "exr")) - 40);
  fs::remove(path("f", 3, "exr"));
  EXPECT_EQ(skipped(""), "smm");
  EXPECT_EQ(skipped("--sun 10,20"), "mmm");
  EXPECT_EQ(skipped("--sun 10,20 --preview " + pattern("p", "png")), "mmm");
  EXPECT_EQ(skipped("--sun 10,20 --preview " + pattern("p", "png")), "sss");
  // Another frame of the range changes what is chosen for all.
  writeBall(3, 1.2f, 1);
  EXPECT_EQ(skipped("--sun 10,20"), "mmm");
}

TEST_F(Sequences, StopAndGoOn) {
  std::ofstream(folder.file("script"))
      << "'" << programPath() << "' cloud '" << ownData("data/sphere_uv.obj") << "' -o "
      << pattern("c", "vdb") << " --resolution 64 --noise-time 0 --frames 1-2000 2>'" << folder.file("err")
      << "' >/dev/null &\nid=$!\nwhile [ ! -e '" << path("c", 2, "vdb")
      << "' ] && kill -0 $id; do sleep 0.02; done\nkill -INT $id\nwait $id\n";
  const int status = std::system(("sh '" + folder.file("script") + "' 2>/dev/null").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 130);
  EXPECT_NE(textOf(folder.file("err")).find("--skip-existing makes the rest"), std::string::npos);
  int count = 0;
  for (const auto& entry : fs::directory_iterator(folder.file("")))
    if (entry.path().filename().string().starts_with("c.")) count += !readVdbFile(entry.path()).empty();
  EXPECT_GE(count, 2);
  const ProgramResult rest =
      succeeds(fmt::format("cloud '{}' -o {} --resolution 64 --noise-time 0 --frames 1-{} --skip-existing",
                           ownData("data/sphere_uv.obj"), pattern("c", "vdb"), count + 1));
  EXPECT_NE(rest.errors.find(fmt::format("{} of {} frames were there", count, count + 1)), std::string::npos)
      << rest.errors;
}

// A shape that changes its size keeps bumps and voxels.
TEST_F(Sequences, OfCloudsHaveOneScale) {
  const Mesh sphere = readMesh(ownData("data/sphere_uv.obj"));
  for (int frame = 1; frame <= 2; ++frame) {
    Similarity larger;
    larger.scale = 1 + 0.25 * frame;
    writeMesh(path("a", frame, "obj"), moved(sphere, larger));
  }
  succeeds(fmt::format("cloud {} -o {} --resolution 40 --layers 2 --frames 1-2 --stats '{}'",
                       pattern("a", "obj"), pattern("c", "vdb"), folder.file("s.json")));
  const auto frames = statistics()["frames"];
  EXPECT_EQ(frames[0]["grid"]["voxel_size"], frames[1]["grid"]["voxel_size"]);
  EXPECT_EQ(frames[0]["layers"][1]["amplitude"], frames[1]["layers"][1]["amplitude"]);
  EXPECT_EQ(frames[0]["layers"][1]["frequency"], frames[1]["layers"][1]["frequency"]);
  // The largest frame is 1.5 times the sphere, which is 2 wide.
  const double side = 1.5 * double(boundingBox(sphere).longestSide());
  EXPECT_NEAR(double(frames[0]["grid"]["voxel_size"]), side / 40, 1e-6);
}

TEST_F(Sequences, OfCloudsGoOnInNoiseTime) {
  const std::string sphere = ownData("data/sphere_uv.obj");
  const std::string usual = " --resolution 32 --layers 1 ";
  succeeds("cloud " + sphere + usual + "-o " + pattern("c", "vdb") +
           " --frames 11-13x2 --noise-time 0.5 --noise-speed 0.125");
  succeeds("cloud " + sphere + usual + "-o " + folder.file("late.vdb") + " --noise-time 0.75");
  succeeds("cloud " + sphere + usual + "-o " + folder.file("early.vdb") + " --noise-time 0.5");
  const auto values = [](const std::string& file) { return toBricks(readScalarGrid(file))->values(); };
  EXPECT_EQ(values(path("c", 11, "vdb")), values(folder.file("early.vdb")));
  EXPECT_EQ(values(path("c", 13, "vdb")), values(folder.file("late.vdb")));
  EXPECT_NE(values(path("c", 13, "vdb")), values(path("c", 11, "vdb")));
  const VdbGridInfo info = describe(readScalarGrid(path("c", 13, "vdb")));
  EXPECT_EQ(info.metadata.at("frame"), "13");
}

TEST_F(Sequences, AreThereForAllVerbs) {
  for (int frame = 1; frame <= 2; ++frame)
    fs::copy_file(ownData("data/sphere_uv.obj"), path("a", frame, "obj"));
  const std::string meshes = pattern("a", "obj"), balls = pattern("ball", "vdb"), two = " --frames 1-2 ";
  succeeds("levelset " + meshes + " -o " + pattern("l", "vdb") + two + "--resolution 24");
  succeeds("mesh " + balls + " -o " + pattern("m", "obj") + two + "--faces 200");
  succeeds("advect " + balls + " -o " + pattern("new/folder/v", "vdb") + two +
           "--velocity 0,0.1,0 --steps 1");
  succeeds("transfer --from " + ownData("data/sphere_uv.obj") + " --to " + meshes + " -o " +
           pattern("t", "obj") + two + "--resolution 24");
  succeeds("transform " + meshes + " -o " + pattern("g", "ply") + two + "--place ground");
  succeeds("cut " + meshes + " -o '" + folder.file("pieces.##") + "'" + two + "--plane 0,0,0,1,0,0");
  succeeds("wisps " + meshes + " -o " + pattern("w", "vdb") + two + "--guides 3 --dots 100 --resolution 24");
  succeeds("render " + meshes + " -o " + pattern("s", "exr") + two + "--size 32x18");
  succeeds("info " + balls + two);
  for (const char* file : {"l.0002.vdb", "m.0002.obj", "new/folder/v.0002.vdb", "t.0002.obj", "g.0002.ply",
                           "pieces.02/pieces.json", "w.0002.vdb", "s.0002.exr"})
    EXPECT_TRUE(fs::exists(folder.file(file))) << file;
  EXPECT_EQ(readImageCamera(path("s", 1, "exr"))->worldToCamera,
            readImageCamera(path("s", 2, "exr"))->worldToCamera);
}

TEST_F(Sequences, TakeTheFrameOfACameraFile) {
  std::ofstream(folder.file("move.chan")) << "1 0 0 6 0 0 0 35\n3 1 0 6 0 0 0 35\n";
  succeeds(rendering("--frames 1-3 --camera '" + folder.file("move.chan") + "'"));
  // Row vectors: the last row moves the world by the camera's place, the other way.
  for (int frame = 1; frame <= 3; ++frame)
    EXPECT_NEAR(double(readImageCamera(path("f", frame, "exr"))->worldToCamera[12]), -0.5 * (frame - 1),
                1e-5);
}

// Light is made for the first frame alone, and every picture is that of a call of its own, to the last bit.
TEST_F(Sequences, OfAStillVolumeAreLitOnce) {
  std::ofstream(folder.file("move.chan")) << "1 0 0 6 0 0 0 35\n3 1 0.5 6 0 5 0 35\n";
  writeMesh(folder.file("o.1.obj"), boxMesh({-1, -1, -1}, {-0.5f, -0.5f, -0.5f}));
  writeMesh(folder.file("o.2.obj"), boxMesh({-1, -1, -1}, {-0.5f, -0.5f, 0.5f}));
  fs::copy_file(folder.file("o.2.obj"), folder.file("o.3.obj"));
  const std::string call = fmt::format(
      "render '{}' -o {} --size 32x24 --quality draft --samples 1 --camera '{}' --stats '{}' ",
      path("ball", 3, "vdb"), pattern("s", "exr"), folder.file("move.chan"), folder.file("s.json"));
  const struct {
    std::string options, lit;
  } cases[] = {
      {"--deep " + pattern("d", "exr"), "100"},
      // Two lights of which one needs samples, and layers that do.
      {"--point 0,0,4,20 --sun 90,38 --aov normal,Z --ground --preview " + pattern("p", "png"), "100"},
      {"--shutter -0.25,0.25", "100"},
      // The second object is another; the third is the same under another name.
      {"--object '" + folder.file("o.#.obj") + "'", "110"},
      // The frame is the time.
      {"--color '=(time / 3, 1, 0.5)'", "111"}};
  for (const auto& c : cases) {
    succeeds(call + "--frames 1-3 " + c.options);
    std::string lit;
    const auto stats = statistics();
    for (const auto& frame : stats["frames"]) lit += double(frame["light_seconds"]) > 0 ? '1' : '0';
    EXPECT_EQ(lit, c.lit) << c.options;
    std::vector<Image> together;
    for (int frame = 1; frame <= 3; ++frame) together.push_back(readImage(path("s", frame, "exr")));
    EXPECT_NE(together[0].channel("G").values, together[1].channel("G").values) << c.options;
    // What is chosen from objects that vary is chosen from the range.
    const bool varies = c.options.starts_with("--object");
    for (int frame = 1; frame <= 3; ++frame) {
      succeeds(call + (varies ? "--frames 1-3 --only " : "--frames ") + std::to_string(frame) + " " +
               c.options);
      const Image alone = readImage(path("s", frame, "exr"));
      ASSERT_EQ(alone.channels.size(), together[std::size_t(frame - 1)].channels.size());
      for (const Image::Channel& channel : alone.channels) {
        const auto& other = together[std::size_t(frame - 1)].channel(channel.name).values;
        EXPECT_EQ(std::memcmp(channel.values.data(), other.data(), other.size() * sizeof(float)), 0)
            << c.options << ' ' << frame << ' ' << channel.name;
      }
    }
  }
}

TEST_F(Sequences, AreRefusedInWords) {
  const std::string balls = pattern("ball", "vdb"), one = "'" + path("ball", 1, "vdb") + "'";
  fails("render " + balls + " -o " + folder.file("f.exr") + " --frames 1-3", 2,
        "a name with a place for the frame number");
  fails(rendering("--frames 1-3 --preview '" + folder.file("p.png") + "'"), 2, "--preview");
  fails("render " + one + " -o " + folder.file("f.exr") + " --frames 1-3", 2, "--frames");
  fails("render " + one + " -o " + pattern("f", "exr"), 2, "names frames");
  fails("render " + balls + " -o " + folder.file("f.exr"), 2, "names frames");
  fails(rendering("--frames 3-1"), 2, "runs backwards");
  fails(rendering("--frames 1-3 --shard 4/3"), 2, "--shard");
  fails("render " + one + " -o " + folder.file("f.exr") + " --only 1", 2, "--only");
  fails(rendering(""), 2, "names frames");
  fails("render " + one + " -o " + folder.file("f.exr") + " --skip-existing", 2, "--frames");
  fails("render " + balls + " -o '" + folder.file("f.#.##.exr") + "' --frames 1", 2, "2 places");
  fails(rendering("--frames 1-3 --projection orthographic --camera '" + ownData("data/none.chan") + "'"), 1,
        "none.chan");
  fails(rendering("--frames 1-3 --aov none,Z"), 2, "--aov: got 'none'");
  fails(rendering("--frames 1-3 --contact-sheet '" + folder.file("c.jpg") + "'"), 2, ".png");
  // A name may hold such a sign where there are no frames.
  fs::copy_file(path("ball", 1, "vdb"), folder.file("ball#1.vdb"));
  succeeds("info '" + folder.file("ball#1.vdb") + "'");
}

}  // namespace
}  // namespace nephele::test
