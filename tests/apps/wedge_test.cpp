// Wedges: one call for each value of an option, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

class Wedges : public testing::Test {
 protected:
  void SetUp() override {
    writeVdbFile(folder.file("ball.vdb"), {toVdb(*ball(1, 0.1f), {"density", VdbGridInfo::Class::fogVolume})},
                 {});
  }
  std::string file(const std::string& name) const { return folder.file(name); }
  std::string cloud(const std::string& options) const {
    return fmt::format("cloud {} -o '{}' --resolution 24 --layers 1 --stats '{}' {}",
                       ownData("data/sphere_uv.obj"), file("c.vdb"), file("s.json"), options);
  }
  std::string rendering(const std::string& options) const {
    return fmt::format("render '{}' -o '{}' --size 48x32 --samples 1 --stats '{}' {}", file("ball.vdb"),
                       file("r.exr"), file("s.json"), options);
  }
  nlohmann::json wedge() const { return nlohmann::json::parse(textOf(file("s.json")))["wedge"]; }
  static ProgramResult succeeds(const std::string& arguments) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 0) << arguments << '\n' << result.errors;
    return result;
  }
  void refuses(const std::string& arguments, const std::string& message) const {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments;
    EXPECT_NE(result.errors.find(message), std::string::npos) << arguments << '\n' << result.errors;
    EXPECT_EQ(folder.entryCount(), 1u) << arguments;
  }

  TemporaryFolder folder;
};

// Of the light before, or of the volume that it was made in, nothing may be gone that the next one needs.
TEST_F(Wedges, LightOneVolumeAgainAsOthersDo) {
  const std::pair<std::string, std::string> cases[] = {
      {"--point 1,1,2,3", "extinction 2,5"},
      {"--spot 1,1,3,0,0,0,30,5,9", "sky 0.1,0.2,0.3;0.3,0.1,0.2"},
      {"--shadow-detail 2", "sun 10,10;60,40"},
      {"--temperature-grid density", "sun 10,10;60,40"},
      {"--ground", "sun 10,10;60,40"},
      {"--object " + ownData("data/sphere_uv.obj"), "sun 10,10;60,40"},
  };
  for (const auto& [options, varied] : cases) {
    const std::string option = varied.substr(0, varied.find(' ')), values = varied.substr(option.size() + 1);
    const char between = values.find(';') != values.npos ? ';' : ',';
    succeeds(rendering(fmt::format("{} --wedge '{}={}'", options, option, values)));
    const std::string last = values.substr(values.find(between) + 1);
    std::string label = last;
    std::ranges::replace(label, ',', '_');
    succeeds(rendering(fmt::format("{} --{} {}", options, option, last)));
    const Image alone = readImage(file("r.exr")),
                one = readImage(file(fmt::format("r.{}_{}.exr", option, label)));
    for (const Image::Channel& channel : alone.channels)
      EXPECT_EQ(channel.values, one.channel(channel.name).values) << options << ' ' << channel.name;
  }
}

TEST_F(Wedges, MakeOneOutputForEachValue) {
  succeeds(cloud("--wedge seed=1-3"));
  ASSERT_EQ(wedge().size(), 3u);
  const auto values = [&](const std::string& name) { return toBricks(readScalarGrid(file(name)))->values(); };
  EXPECT_NE(values("c.seed_1.vdb"), values("c.seed_2.vdb"));
  // A call of its own makes the same.
  succeeds(cloud("--seed 2"));
  EXPECT_EQ(values("c.vdb"), values("c.seed_2.vdb"));
  EXPECT_EQ(describe(readScalarGrid(file("c.seed_3.vdb"))).metadata.at("seed"), "3");
}

TEST_F(Wedges, TakeRangesListsVectorsWordsAndFlags) {
  const auto names = [&](const std::string& values) {
    succeeds(rendering("--quality draft --wedge '" + values + "'"));
    std::vector<std::string> result;
    for (const auto& call : wedge()) result.push_back(call["name"]);
    return result;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names("albedo=1,1,1;0.5,0.6,0.7"), (Names{"albedo 1,1,1", "albedo 0.5,0.6,0.7"}));
  EXPECT_EQ(names("fov=20-40x10"), (Names{"fov 20", "fov 30", "fov 40"}));
  EXPECT_EQ(names("emission-scale=0-1x0.25,8"),
            (Names{"emission-scale 0", "emission-scale 0.25", "emission-scale 0.5", "emission-scale 0.75",
                   "emission-scale 1", "emission-scale 8"}));
  EXPECT_EQ(names("view-transform=agx,filmic"), (Names{"view-transform agx", "view-transform filmic"}));
  EXPECT_EQ(names("backdrop=false,true"), (Names{"backdrop false", "backdrop true"}));
  EXPECT_FALSE(readImage(file("r.backdrop_false.exr")).find("backdrop.R"));
  EXPECT_TRUE(readImage(file("r.backdrop_true.exr")).find("backdrop.R"));
  EXPECT_EQ(names("exposure=-1,0,1-2"), (Names{"exposure -1", "exposure 0", "exposure 1", "exposure 2"}));
  EXPECT_EQ(names("step=5%,10%"), (Names{"step 5%", "step 10%"}));
  EXPECT_TRUE(fs::exists(file("r.step_5.exr")));
  EXPECT_EQ(names("look=sunset,storm"), (Names{"look sunset", "look storm"}));
}

TEST_F(Wedges, AreTakenFromFiles) {
  const std::string config = " --config '" + file("c.toml") + "' ";
  std::ofstream(file("c.toml")) << "wedge = \"seed=1-3\"\nhalf = true\n[render]\nwedge = \"fov=20,30\"\n";
  succeeds(cloud(config));
  EXPECT_EQ(wedge().size(), 3u);
  // What is typed wins, and what is kept is the same wherever the wedge stands.
  const ProgramResult typed = succeeds(cloud(config + "--wedge seed=2-4 --skip-existing"));
  EXPECT_NE(typed.errors.find("2 of 3 calls were there"), std::string::npos) << typed.errors;
  EXPECT_TRUE(fs::exists(file("c.seed_4.vdb")));
}

TEST_F(Wedges, SwitchFlagsOffThatAFileSets) {
  std::ofstream(file("c.toml")) << "half = true\n";
  succeeds(cloud("--wedge half=true,false --config '" + file("c.toml") + "'"));
  EXPECT_TRUE(describe(readScalarGrid(file("c.half_true.vdb"))).halfFloat);
  EXPECT_FALSE(describe(readScalarGrid(file("c.half_false.vdb"))).halfFloat);
}

TEST_F(Wedges, OfValuesThatDifferOnlyInSignsHaveNamesOfTheirOwn) {
  std::string values;
  for (const char* name : {"a b.toml", "a,b.toml", "a_b.toml"}) {
    std::ofstream(file(name)) << "[[layer]]\n";
    values += (values.empty() ? "" : ";") + file(name);
  }
  succeeds(cloud("--wedge 'recipe=" + values + "'"));
  int count = 0;
  for (const auto& entry : fs::directory_iterator(fs::path(file("c.vdb")).parent_path()))
    count += entry.path().filename().string().starts_with("c.recipe_");
  EXPECT_EQ(count, 3);
}

TEST_F(Wedges, OfTwoOptionsMakeATable) {
  succeeds(rendering("--wedge fov=20,30 --wedge extinction=5,10,20 --contact-sheet '" + file("t.png") + "'"));
  const auto calls = wedge();
  ASSERT_EQ(calls.size(), 6u);
  EXPECT_EQ(calls[4]["name"], "fov 30, extinction 10");
  EXPECT_EQ(calls[4]["values"], (nlohmann::json{{"fov", "30"}, {"extinction", "10"}}));
  EXPECT_EQ(calls[4]["extinction"], 10);
  EXPECT_TRUE(fs::exists(file("r.fov_30.extinction_10.exr")));
  // Three columns of 48 pixels, gaps of 4, and two rows of 32 with a band of 14.
  const Image sheet = readImage(file("t.png"));
  EXPECT_EQ(sheet.width, 3 * 48 + 4 * 4);
  EXPECT_EQ(sheet.height, 2 * (32 + 14) + 3 * 4);
}

TEST_F(Wedges, AreSeenByOneCameraWithOneExtinction) {
  succeeds(rendering("--wedge density-scale=1,4 --contact-sheet '" + file("t.png") + "'"));
  const auto calls = wedge();
  EXPECT_EQ(calls[0]["extinction"], calls[1]["extinction"]);
  EXPECT_EQ(readImageCamera(file("r.density-scale_1.exr"))->worldToCamera,
            readImageCamera(file("r.density-scale_4.exr"))->worldToCamera);
  // Previews stand beside the pictures, since the sheet is made of them.
  EXPECT_TRUE(fs::exists(file("r.density-scale_4.png")));
}

// The verb makes no pictures: the sheet's are those of `render`, and only the sheet stays.
TEST_F(Wedges, OfVolumesHaveASheetToo) {
  const ProgramResult result =
      succeeds(cloud("--wedge amplitude=1%,10% --contact-sheet '" + file("t.png") + "'"));
  EXPECT_NE(result.output.find("t.png: 2 pictures in 2 columns"), std::string::npos) << result.output;
  EXPECT_EQ(result.output.find(".exr"), std::string::npos) << result.output;
  const Image sheet = readImage(file("t.png"));
  EXPECT_EQ(sheet.width, 2 * 640 + 3 * 4);
  // The ball, two clouds, the sheet and the statistics.
  EXPECT_EQ(folder.entryCount(), 5u);
  EXPECT_EQ(wedge().size(), 2u);
}

TEST_F(Wedges, AreNumberedWhereThereIsAPlace) {
  succeeds(fmt::format("render '{}' -o '{}' --size 16x12 --samples 1 --wedge fov=20,30", file("ball.vdb"),
                       file("n.##.exr")));
  EXPECT_TRUE(fs::exists(file("n.01.exr")) && fs::exists(file("n.02.exr")));
}

TEST_F(Wedges, KeepWhatIsWhole) {
  succeeds(cloud("--wedge seed=1-3"));
  fs::remove(file("c.seed_2.vdb"));
  succeeds(cloud("--wedge seed=1-4 --skip-existing"));
  std::string skipped;
  const auto calls = wedge();
  for (const auto& call : calls) skipped += call["skipped"] == true ? 's' : 'm';
  EXPECT_EQ(skipped, "smsm");
  // A value that cannot be made ends the work, and what was made stays.
  const ProgramResult result =
      runProgram(fmt::format("render '{}' -o '{}' --size 16x12 --samples 1 --wedge grid=density,smoke",
                             file("ball.vdb"), file("g.exr")));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("smoke"), std::string::npos) << result.errors;
}

// A sequence for each value, each as a call of its own makes it.
TEST_F(Wedges, OfSequencesMakeEveryFrameOfEveryValue) {
  const auto moving = [&](const std::string& output, const std::string& options) {
    succeeds(fmt::format(
        "cloud {} -o '{}' --resolution 24 --layers 1 --noise-time 0 --noise-speed 0.3 --frames 1-3 "
        "--stats '{}' {}",
        ownData("data/sphere_uv.obj"), file(output), file("s.json"), options));
  };
  moving("c.####.vdb", "--wedge seed=1,2 --contact-sheet '" + file("t.png") + "'");
  const auto calls = wedge();
  ASSERT_EQ(calls.size(), 6u);
  // Value times frames, plus frame.
  EXPECT_EQ(calls[4]["name"], "seed 2, frame 2");
  EXPECT_EQ(calls[4]["frame"], 2);
  EXPECT_EQ(calls[4]["values"], (nlohmann::json{{"seed", "2"}}));
  // One picture for each value.
  EXPECT_EQ(readImage(file("t.png")).width, 2 * 640 + 3 * 4);
  const auto values = [&](const std::string& name) { return toBricks(readScalarGrid(file(name)))->values(); };
  EXPECT_NE(values("c.seed_1.0002.vdb"), values("c.seed_2.0002.vdb"));
  EXPECT_NE(values("c.seed_2.0001.vdb"), values("c.seed_2.0002.vdb"));
  moving("own.####.vdb", "--seed 2");
  for (const char* frame : {"0001.vdb", "0002.vdb", "0003.vdb"})
    EXPECT_EQ(values(std::string("own.") + frame), values(std::string("c.seed_2.") + frame)) << frame;
  // The ball, six clouds, the sheet, the statistics and three more clouds.
  EXPECT_EQ(folder.entryCount(), 12u);
  // What is there stays; parts are parts of every sequence.
  fs::remove(file("c.seed_1.0003.vdb"));
  moving("c.####.vdb", "--wedge seed=1,2 --skip-existing --only 2-3");
  std::string skipped;
  const auto rest = wedge();
  for (const auto& call : rest) skipped += call["skipped"] == true ? 's' : 'm';
  EXPECT_EQ(skipped, "smss");
  moving("d.####.vdb", "--wedge seed=1,2 --shard 2/2");
  EXPECT_TRUE(fs::exists(file("d.seed_1.0002.vdb")) && fs::exists(file("d.seed_2.0002.vdb")));
  EXPECT_EQ(folder.entryCount(), 14u);
}

// Camera and extinction of a value are those of all its frames.
TEST_F(Wedges, OfRenderedSequencesChooseOnceForEveryValue) {
  for (int frame = 1; frame <= 3; ++frame)
    writeVdbFile(file(fmt::format("b.{:04d}.vdb", frame)),
                 {toVdb(*ball(0.25f + 0.25f * float(frame), 0.1f, float(frame)),
                        {"density", VdbGridInfo::Class::fogVolume})},
                 {});
  const auto render = [&](const std::string& output, const std::string& options) {
    succeeds(fmt::format(
        "render '{}' -o '{}' --frames 1-3 --size 48x32 --samples 1 --quality draft --stats '{}' {}",
        file("b.####.vdb"), file(output), file("s.json"), options));
  };
  const std::string sheet = " --contact-sheet '" + file("t.png") + "'";
  render("r.####.exr", "--wedge density-scale=1,4 --wedge 'view=25,0;100,10;0,80'" + sheet);
  const auto calls = wedge();
  ASSERT_EQ(calls.size(), 18u);
  EXPECT_EQ(calls[0]["extinction"], calls[2]["extinction"]);
  EXPECT_NE(calls[0]["extinction"], calls[9]["extinction"]);
  // Three columns of views, of the middle frames.
  const Image table = readImage(file("t.png"));
  EXPECT_EQ(table.width, 3 * 48 + 4 * 4);
  EXPECT_EQ(table.height, 2 * (32 + 14) + 3 * 4);
  EXPECT_TRUE(fs::exists(file("r.density-scale_4.view_100_10.0003.png")));
  render("own.####.exr", "--density-scale 4 --view 100,10");
  for (const char* frame : {"1", "2", "3"}) {
    const Image own = readImage(file(fmt::format("own.000{}.exr", frame))),
                one = readImage(file(fmt::format("r.density-scale_4.view_100_10.000{}.exr", frame)));
    for (const char* name : {"R", "G", "B", "A", "Z"})
      EXPECT_EQ(own.channel(name).values, one.channel(name).values) << frame << name;
  }
  // An input is missing where only the last value has it.
  const ProgramResult result =
      runProgram(fmt::format("render '{}' -o '{}' --frames 1-3 --wedge 'object={};{}'", file("b.####.vdb"),
                             file("o.####.exr"), ownData("data/sphere_uv.obj"), file("none.#.obj")));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("none.#.obj: 3 of 3 frames are missing"), std::string::npos) << result.errors;
}

TEST_F(Wedges, AreRefusedInWordsBeforeAnyWork) {
  refuses(cloud("--wedge seed=1-10000"), "10000 calls are more than 1000");
  refuses(cloud("--wedge seed=1-100 --wedge billow=1-100"), "10000 calls are more than 1000");
  refuses(cloud("--wedge seed=0-1e300"), "more than 1000");
  refuses(cloud("--wedge seeds=1-3"), "did you mean 'seed'?");
  refuses(cloud("--wedge output=a.vdb,b.vdb"), "not an option that a wedge can vary");
  refuses(cloud("--wedge threads"), "OPTION=VALUES");
  for (const char* how : {"threads=1,2", "memory-limit=1G,2G", "display-server=a,b"})
    refuses(rendering("--wedge " + std::string(how)), "not an option that a wedge can vary");
  refuses(rendering("--wedge 'crop=0,0,10,10;0,0,20,20' --contact-sheet '" + file("t.png") + "'"),
          "shows pictures of one size");
  refuses(rendering("--wedge fov=20,30 --contact-sheet '" + file("r.fov_30.png") + "'"),
          "no other of the calls");
  refuses(cloud("--wedge seed=1,2").replace(cloud("").find("c.vdb"), 5, "c.##.a.##.vdb"), "one place");
  refuses(cloud("--wedge seed="), "OPTION=VALUES");
  refuses(cloud("--wedge seed=1,,2"), "OPTION=VALUES");
  refuses(cloud("--wedge seed=3-1"), "a range that grows");
  refuses(cloud("--wedge seed=1,2,1"), "there twice");
  refuses(cloud("--wedge seed=1,2 --wedge seed=3,4"), "there twice");
  refuses(cloud("--wedge seed=1,2 --seed 4"), "given by itself");
  refuses(cloud("--wedge seed=1,2 --wedge billow=0,1 --wedge roughness=0,1"), "two options make a table");
  // Also a value that only the last call would have.
  refuses(cloud("--wedge seed=1,2,x"), "--seed: got 'x'");
  refuses(cloud("--wedge half=true,yes"), "it is a flag");
  refuses(cloud("--wedge seed=1,2 --frames 1-3"), "a place for the frame number");
  refuses(cloud("--wedge seed=1,2 --frames 1-3").replace(cloud("").find("c.vdb"), 5, "c.####.vdb") +
              " --wedge frames=1,2",
          "not an option");
  refuses(cloud("--wedge seed=1-21 --frames 1-48").replace(cloud("").find("c.vdb"), 5, "c.####.vdb"),
          "48 frames of 21 values are 1008 calls, more than 1000");
  refuses(cloud("--wedge seed=1,x --frames 1-2").replace(cloud("").find("c.vdb"), 5, "c.####.vdb"),
          "--seed: got 'x'");
  refuses(fmt::format("render '{}' --deep '{}' --wedge fov=20,30 --contact-sheet '{}'", file("ball.vdb"),
                      file("d.exr"), file("t.png")),
          "shows previews, volumes and meshes");
  refuses(cloud("--contact-sheet '" + file("t.png") + "'"), "give --frames or --wedge");
}

}  // namespace
}  // namespace nephele::test
