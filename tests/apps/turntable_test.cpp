// The verb turntable, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

class TurntableVerb : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    data_ = new TemporaryFolder;
    write("ball.vdb", *ball(1.0f, 0.1f));
    // Long in z, with a thick end: from no two sides alike.
    write("club.vdb", *densityGrid(voxels(0.1f), {-6, -6, -12}, {6, 6, 16}, [](const Vec3f& p) {
            const float rod = 0.25f - std::hypot(p.x, p.y), end = 0.5f - length(p - Vec3f{0.1f, 0, 1.0f});
            return std::clamp(0.5f + 10 * std::max(std::min(rod, 1.1f + p.z), end), 0.0f, 1.0f);
          }));
  }
  static void TearDownTestSuite() { delete data_; }
  static void write(const std::string& name, const BrickGrid& grid) {
    writeVdbFile(data_->file(name), {toVdb(grid, {"density", VdbGridInfo::Class::fogVolume})}, {});
  }

  static std::string volume(const std::string& name) { return fmt::format("'{}'", data_->file(name)); }
  // The arguments of a turntable into the test's own folder.
  std::string call(const std::string& options, const std::string& name = "club.vdb", int samples = 1) const {
    return fmt::format("turntable {} -o '{}' --size 64x36 --samples {} {}", volume(name),
                       folder.file("f.####.exr"), samples, options);
  }
  std::string frame(int number) const { return folder.file(fmt::format("f.{:04d}.exr", number)); }
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder.file(""))) names.insert(entry.path().filename());
    return names;
  }
  nlohmann::json statistics() const { return nlohmann::json::parse(textOf(folder.file("s.json"))); }
  static bool isWhole(const std::string& path) {
    try {
      return readImage(path).width > 0;
    } catch (const Error&) {
      return false;
    }
  }
  // Mean of the green channel.
  static double brightness(const std::string& path) {
    double sum = 0;
    const Image image = readImage(path);
    for (const float value : image.channel("G").values) sum += value;
    return sum / double(image.channel("G").values.size());
  }

  TemporaryFolder folder;
  static inline TemporaryFolder* data_ = nullptr;
};

TEST_F(TurntableVerb, WritesFramesPreviewsSheetAndStatistics) {
  const ProgramResult result =
      runProgram(call("--frames 8-11 --preview '" + folder.file("p/v.%03d.png") + "' --contact-sheet '" +
                      folder.file("sheet.png") + "' --stats '" + folder.file("s.json") + "'"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(files(), (std::set<std::string>{"f.0008.exr", "f.0009.exr", "f.0010.exr", "f.0011.exr", "p",
                                            "s.json", "sheet.png"}));
  for (int number = 8; number <= 11; ++number) {
    EXPECT_EQ(readImage(frame(number)).width, 64);
    EXPECT_EQ(readImage(folder.file(fmt::format("p/v.{:03d}.png", number))).height, 36);
  }
  // Four frames of 64 x 36 with 4 pixels around them are not made smaller.
  const Image sheet = readImage(folder.file("sheet.png"));
  EXPECT_EQ(sheet.width * sheet.height, (2 * 64 + 3 * 4) * (2 * 36 + 3 * 4));
  const auto stats = statistics();
  ASSERT_EQ(stats["frames"].size(), 4u);
  for (int i = 0; i != 4; ++i) {
    EXPECT_EQ(stats["frames"][std::size_t(i)]["frame"], 8 + i);
    EXPECT_EQ(stats["frames"][std::size_t(i)]["skipped"], false);
    EXPECT_GT(stats["frames"][std::size_t(i)]["seconds"], 0.0);
  }
  EXPECT_GT(stats["light_seconds"], 0.0);
  EXPECT_EQ(stats["rays"], 4 * 64 * 36);
  // The light is a stage of its own, once.
  int lights = 0;
  for (const auto& stage : stats["stages"]) lights += stage["name"] == "light sun";
  EXPECT_EQ(lights, 1);
}

TEST_F(TurntableVerb, MakesTheFramesOfRender) {
  const std::string camera = " --camera-position 0,1,6 --look-at 0,0,0 ";
  ASSERT_EQ(runProgram(call("--frames 1-4" + camera)).exitCode, 0);
  ASSERT_EQ(runProgram("render " + volume("club.vdb") + " -o '" + folder.file("r.exr") +
                       "' --size 64x36 --samples 1" + camera)
                .exitCode,
            0);
  const Image a = readImage(frame(1)), b = readImage(folder.file("r.exr"));
  for (const char* name : {"R", "G", "B", "A", "Z"})
    EXPECT_EQ(a.channel(name).values, b.channel(name).values);
}

TEST_F(TurntableVerb, IsALoopThatNeverJumpsAndDoesNotFlicker) {
  constexpr std::size_t kFrames = 32;
  for (const char* orbit : {"camera", "model", "light"}) {
    ASSERT_EQ(runProgram(call("--frames 1-32 --extinction 10 --orbit " + std::string(orbit))).exitCode, 0);
    std::vector<double> mean;
    for (std::size_t i = 0; i != kFrames; ++i) mean.push_back(brightness(frame(int(i) + 1)));
    const auto jump = [&](std::size_t i, std::size_t step) {
      return std::fabs(mean[(i + step) % kFrames] - mean[i]);
    };
    double one = 0, two = 0;
    for (std::size_t i = 0; i != kFrames; ++i) {
      one = std::max(one, jump(i, 1));
      two = std::max(two, jump(i, 2));
    }
    // From the last frame to the first it is no farther than elsewhere.
    double others = 0;
    for (std::size_t i = 0; i + 1 != kFrames; ++i) others = std::max(others, jump(i, 1));
    EXPECT_LE(jump(kFrames - 1, 1), others) << orbit;
    // What changes smoothly changes half as much in one frame as in two; what flickers, as much or more.
    EXPECT_LT(one, 0.65 * two) << orbit;
    EXPECT_LT(one, 0.3 * *std::ranges::max_element(mean)) << orbit;
    EXPECT_GT(two, 0.01 * mean[0]) << orbit;
  }
}

TEST_F(TurntableVerb, TurnsTheModelUnderLightsThatStandStill) {
  // A ball looks the same from all sides, so only the light can change it.
  const auto means = [&](const std::string& orbit) {
    EXPECT_EQ(runProgram(call("--frames 1-8 --extinction 5 --orbit " + orbit, "ball.vdb")).exitCode, 0);
    std::vector<double> mean;
    for (int i = 1; i <= 8; ++i) mean.push_back(brightness(frame(i)));
    return mean;
  };
  const std::vector<double> model = means("model"), camera = means("camera"), light = means("light");
  for (std::size_t i = 0; i != 8; ++i) {
    // But for how sunlight lies to the voxels, half an optical depth wide.
    EXPECT_NEAR(model[i], model[0], 0.03 * model[0]) << i;
    // A sun that walks forward is a camera that walks back. The framing of the ball differs by a little:
    // swept or as it stands.
    EXPECT_NEAR(light[i] / light[0], camera[(8 - i) % 8] / camera[0], 0.03) << i;
  }
  EXPECT_GT(*std::ranges::max_element(camera), 1.3 * *std::ranges::min_element(camera));
}

TEST_F(TurntableVerb, AStepMakesTheSameFramesAsTheWhole) {
  ASSERT_EQ(runProgram(call("--frames 1-6")).exitCode, 0);
  const Image whole = readImage(frame(5));
  ASSERT_EQ(runProgram(call("--frames 1-6x2")).exitCode, 0);
  EXPECT_EQ(readImage(frame(5)).channel("G").values, whole.channel("G").values);
  ASSERT_EQ(runProgram(call("--frames 1-6 --only 5-99")).exitCode, 0);
  EXPECT_EQ(readImage(frame(5)).channel("G").values, whole.channel("G").values);
}

TEST_F(TurntableVerb, SkipsWholeFramesAndMakesDamagedOnesAgain) {
  ASSERT_EQ(runProgram(call("--frames 1-6")).exitCode, 0);
  const Image truth = readImage(frame(2));
  // 1 stays. 2 loses its end; 3 is damaged in the middle; 4 is empty; 5 is of another size; 6 is not there.
  fs::resize_file(frame(2), fs::file_size(frame(2)) - 40);
  {
    std::fstream file(frame(3), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(std::streamoff(fs::file_size(frame(3)) * 2 / 3));
    file << std::string(200, '\xaa');
  }
  fs::resize_file(frame(4), 0);
  fs::copy_file(frame(1), frame(5), fs::copy_options::overwrite_existing);
  ASSERT_EQ(runProgram("render " + volume("club.vdb") + " -o '" + frame(5) + "' --size 32x18").exitCode, 0);
  fs::remove(frame(6));
  const auto before = fs::last_write_time(frame(1));

  const ProgramResult result =
      runProgram(call("--frames 1-6 --skip-existing --stats '" + folder.file("s.json") + "'"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(fs::last_write_time(frame(1)), before);
  const auto stats = statistics();
  for (std::size_t i = 0; i != 6; ++i) EXPECT_EQ(stats["frames"][i]["skipped"], i == 0) << i;
  for (int number = 1; number <= 6; ++number) {
    ASSERT_TRUE(isWhole(frame(number))) << number;
    EXPECT_EQ(readImage(frame(number)).width, 64);
  }
  EXPECT_EQ(readImage(frame(2)).channel("G").values, truth.channel("G").values);
  // Each of them is named; the one that is missing is no surprise.
  for (int number = 2; number <= 5; ++number)
    EXPECT_NE(result.errors.find(fs::path(frame(number)).filename().string()), std::string::npos)
        << result.errors;
  EXPECT_EQ(result.errors.find("f.0006"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("32x18 and not 64x36"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("skipping 1 of 6"), std::string::npos) << result.errors;
}

TEST_F(TurntableVerb, SkipsWithoutMakingLightAndAddsMissingPreviews) {
  const std::string preview =
      " --preview '" + folder.file("v.#.png") + "' --stats '" + folder.file("s.json") + "'";
  ASSERT_EQ(runProgram(call("--frames 1-3" + preview)).exitCode, 0);
  const std::string second = textOf(folder.file("v.2.png"));
  fs::remove(folder.file("v.2.png"));
  ASSERT_EQ(runProgram(call("--frames 1-3 --skip-existing" + preview)).exitCode, 0);
  EXPECT_TRUE(isWhole(folder.file("v.2.png")));
  EXPECT_EQ(statistics()["light_seconds"], 0.0);
  EXPECT_EQ(statistics()["rays"], 0);
}

TEST_F(TurntableVerb, SkipsOnlyWhatWasMadeWithTheSameOptionsOfTheSameInput) {
  const std::string input = folder.file("in.vdb");
  fs::copy_file(data_->file("club.vdb"), input);
  const auto skipped = [&](const std::string& options) {
    const ProgramResult result = runProgram(
        fmt::format("turntable '{}' -o '{}' --size 16x12 --samples 1 --skip-existing --stats '{}' {}", input,
                    folder.file("f.####.exr"), folder.file("s.json"), options));
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    int count = 0;
    const auto stats = statistics();
    for (const auto& entry : stats["frames"]) count += entry["skipped"] == true;
    if (count == 0 && fs::exists(folder.file("once"))) {
      EXPECT_NE(result.errors.find("other options"), std::string::npos) << options << result.errors;
    }
    std::ofstream(folder.file("once")) << "x";
    return count;
  };
  EXPECT_EQ(skipped("--frames 1-3"), 0);
  // What says where files go, how many frames are made and by how many threads does not count.
  EXPECT_EQ(skipped("--frames 1-3 --threads 1 --exposure 1 --preview '" + folder.file("v.#.png") + "'"), 3);
  EXPECT_EQ(skipped("--frames 1-3x2"), 2);
  EXPECT_EQ(skipped("--frames 1-3 --only 2"), 1);
  EXPECT_EQ(skipped("--frames 1-3 --sun 10,20"), 0);
  EXPECT_EQ(skipped("--frames 1-3 --sun 10,20"), 3);
  // A turn of other frames has them elsewhere.
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 0);
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 3);
  // The same file elsewhere is the same; another of its name is not.
  const std::string other = folder.file("other.vdb");
  fs::rename(input, other);
  fs::copy_file(other, input);
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 3);
  fs::copy_file(data_->file("ball.vdb"), input, fs::copy_options::overwrite_existing);
  EXPECT_EQ(skipped("--frames 1-4 --only 1-3 --sun 10,20"), 0);
}

TEST_F(TurntableVerb, ObjectsStandBesideTheVolumeInEveryOrbit) {
  std::ofstream(folder.file("wall.obj")) << "v 1 -2 -2\nv 1 2 -2\nv 1 0 2\nf 1 2 3\n";
  const std::string common = " --object '" + folder.file("wall.obj") + "' --ground --backdrop " +
                             "--camera-position 0,1,6 --look-at 0,0,0 --extinction 10 ";
  ASSERT_EQ(runProgram("render " + volume("club.vdb") + " -o '" + folder.file("r.exr") +
                       "' --size 64x36 --samples 1" + common)
                .exitCode,
            0);
  const Image still = readImage(folder.file("r.exr"));
  for (const char* orbit : {"camera", "model", "light"}) {
    const ProgramResult result = runProgram(call("--frames 1-2 --orbit " + std::string(orbit) + common));
    ASSERT_EQ(result.exitCode, 0) << orbit << result.errors;
    const Image first = readImage(frame(1));
    for (const char* name : {"R", "B", "A", "backdrop.G"})
      EXPECT_EQ(first.channel(name).values, still.channel(name).values) << orbit;
    EXPECT_NE(readImage(frame(2)).channel("R").values, still.channel("R").values) << orbit;
  }
  // Half a turn of the lights: the sun stands on the other side of the wall, as in a picture of its own.
  ASSERT_EQ(runProgram("render " + volume("club.vdb") + " -o '" + folder.file("r.exr") +
                       "' --size 64x36 --samples 1 --sun 270,38" + common)
                .exitCode,
            0);
  const Image turned = readImage(folder.file("r.exr")), second = readImage(frame(2));
  for (std::size_t i = 0; i != turned.channel("R").values.size(); ++i)
    ASSERT_NEAR(second.channel("R").values[i], turned.channel("R").values[i], 2e-3f);
  const ProgramResult refused = runProgram(call("--frames 1-2 --integrator path --ground"));
  EXPECT_EQ(refused.exitCode, 2) << refused.errors;
}

TEST_F(TurntableVerb, MakesDeepShadowMapsAnewForLightsThatTurn) {
  // A ball looks the same from all sides.
  ASSERT_EQ(runProgram(call("--frames 1-4 --orbit model --extinction 5 --shadows deep", "ball.vdb")).exitCode,
            0);
  for (int number = 2; number <= 4; ++number)
    EXPECT_NEAR(brightness(frame(number)), brightness(frame(1)), 0.03 * brightness(frame(1)));
}

TEST_F(TurntableVerb, ShardsTogetherMakeAllFrames) {
  for (int shard = 1; shard <= 3; ++shard) {
    const ProgramResult result = runProgram(call("--frames 1-7 --shard " + std::to_string(shard) + "/3"));
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    // 1 4 7, then 2 5, then 3 6.
    EXPECT_EQ(files().size(), shard == 1 ? 3u : shard == 2 ? 5u : 7u);
  }
  EXPECT_EQ(runProgram(call("--frames 1-2 --shard 3/3")).exitCode, 0);
  // The end of the work: a call with all frames there.
  const ProgramResult result =
      runProgram(call("--frames 1-7 --skip-existing --contact-sheet '" + folder.file("c.png") + "'"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("skipping 7 of 7"), std::string::npos) << result.errors;
  EXPECT_TRUE(isWhole(folder.file("c.png")));
}

TEST_F(TurntableVerb, MakesAMovieOfAllFrames) {
  if (std::system("command -v ffmpeg >/dev/null 2>&1 && command -v ffprobe >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "the package ffmpeg is not installed";
  // Names that a shell would take apart.
  const std::string movie = folder.file("a $(b);c.mp4");
  const ProgramResult result = runProgram(call("--frames 1-5 --fps 10 --movie '" + movie + "'"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const std::string command =
      "ffprobe -v error -count_frames -show_streams '" + movie + "' >'" + folder.file("probe") + "'";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string text = textOf(folder.file("probe"));
  for (const char* line : {"codec_name=h264", "width=64", "height=36", "pix_fmt=yuv420p", "nb_read_frames=5",
                           "r_frame_rate=10/1"})
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
}

TEST_F(TurntableVerb, SaysBeforeItStartsThatFfmpegIsMissing) {
  const ProgramResult result =
      runProgram(call("--frames 1-2 --movie '" + folder.file("m.mp4") + "'"), "PATH=/nowhere");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("package ffmpeg"), std::string::npos) << result.errors;
  EXPECT_TRUE(files().empty());
}

TEST_F(TurntableVerb, RefusesWrongUseWithTheOptionAndWhatIsAllowed) {
  const std::string movie = fmt::format("'{}'", folder.file("m.mp4")),
                    sheet = fmt::format("'{}'", folder.file("c.png"));
  const struct {
    std::string arguments, says;
  } cases[] = {{"", "--frames"},
               {"--frames 9-1", "backwards"},
               {"--frames 1-3,x", "'x'"},
               {"--frames 1-99999999", "more than"},
               {"--frames 1-4 --only 3-", "--only"},
               {"--frames 1-4 --shard 0/3", "--shard"},
               {"--frames 1-4 --shard 4/3", "--shard"},
               {"--frames 1-4 --shard 1", "--shard"},
               {"--frames 1-4 --shard 1/3x", "--shard"},
               {"--frames 1-4 --turns 0", "--turns"},
               {"--frames 1-4 --turns many", "--turns"},
               {"--frames 1-4 --orbit moon", "--orbit"},
               {"--frames 1-4 --fps 10", "--movie"},
               {"--frames 1-4 --fps 0 --movie " + movie, "--fps"},
               {"--frames 1-4 --movie a.avi", "--movie"},
               {"--frames 1-4 --contact-sheet a.jpg", "--contact-sheet"},
               {"--frames 1-4 --preview a.png", "--preview"},
               {"--frames 1-4 --preview a.#.#.png", "--preview"},
               {"--frames 1-4 --shard 1/2 --movie " + movie, "--skip-existing"},
               {"--frames 1-4 --only 2 --contact-sheet " + sheet, "--skip-existing"},
               {"--frames 1-4 --frame-rate 3", "--frame"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram(call(c.arguments));
    EXPECT_EQ(result.exitCode, 2) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.says), std::string::npos) << c.arguments << ": " << result.errors;
  }
  const ProgramResult result =
      runProgram("turntable " + volume("ball.vdb") + " -o '" + folder.file("f.exr") + "' --frames 1-4");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.errors.find("NAME.####.exr"), std::string::npos) << result.errors;
  EXPECT_TRUE(files().empty());
}

TEST_F(TurntableVerb, FailsAtOnceWhereItCannotWrite) {
  std::ofstream(folder.file("file")) << "x";
  const ProgramResult result = runProgram("turntable " + volume("ball.vdb") + " -o '" +
                                          folder.file("file/f.####.exr") + "' --frames 1-4");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("f.0001.exr"), std::string::npos) << result.errors;
}

TEST_F(TurntableVerb, KeepsEarlierFramesWhenAFileCannotBeWritten) {
  // A limit on the size of files stands for a full disk: the club seen from its end makes small files, from
  // its side large ones.
  ASSERT_EQ(runProgram(call("--frames 1-8 --view 180,0 --aov none")).exitCode, 0);
  std::vector<std::uintmax_t> sizes;
  for (int i = 1; i <= 8; ++i) sizes.push_back(fs::file_size(frame(i)));
  // In units of 512 bytes: enough for the first frame.
  const std::uintmax_t limit = sizes[0] / 512 + 1;
  int first = 0;
  while (first != 8 && sizes[std::size_t(first)] <= limit * 512) ++first;
  ASSERT_LT(first, 8) << "all frames have the same size";
  for (int i = 1; i <= 8; ++i) fs::remove(frame(i));
  const ProgramResult result =
      runProgram(call("--frames 1-8 --view 180,0 --aov none"), "ulimit -f " + std::to_string(limit) + ";");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find(fs::path(frame(first + 1)).filename().string()), std::string::npos)
      << result.errors;
  EXPECT_EQ(int(files().size()), first);
  for (int i = 1; i <= first; ++i) EXPECT_TRUE(isWhole(frame(i)));
}

TEST_F(TurntableVerb, EndsCleanlyOnSignalsAndResumes) {
  for (const auto& [signal, code] : {std::pair{"INT", 130}, {"TERM", 143}, {"KILL", 137}}) {
    // Sent once the second frame is there; the whole would take minutes.
    std::ofstream(folder.file("script"))
        << "'" << programPath() << "' " << call("--frames 1-2000", "club.vdb", 64) << " 2>'"
        << folder.file("err") << "' >/dev/null &\nid=$!\nwhile [ ! -e '" << frame(2)
        << "' ] && kill -0 $id; do sleep 0.02; done\nkill -" << signal << " $id\nwait $id\n";
    const int status = std::system(("sh '" + folder.file("script") + "' 2>/dev/null").c_str());
    fs::remove(folder.file("script"));
    EXPECT_EQ(WEXITSTATUS(status), code) << signal;
    if (code != 137) {
      EXPECT_NE(textOf(folder.file("err")).find("--skip-existing makes the rest"), std::string::npos)
          << textOf(folder.file("err"));
    }
    fs::remove(folder.file("err"));
    int count = 0;
    for (const std::string& name : files()) {
      // Killed without a chance, it may leave the hidden file that it was writing.
      if (code == 137 && name.starts_with('.')) continue;
      EXPECT_TRUE(isWhole(folder.file(name))) << name;
      ++count;
    }
    EXPECT_GE(count, 2);

    const ProgramResult rest =
        runProgram(call("--frames 1-2000 --skip-existing --only 1-" + std::to_string(count + 2) +
                            " --stats '" + folder.file("s.json") + "'",
                        "club.vdb", 64));
    EXPECT_EQ(rest.exitCode, 0) << rest.errors;
    int skipped = 0;
    const auto stats = statistics();
    for (const auto& entry : stats["frames"]) skipped += entry["skipped"] == true;
    EXPECT_EQ(skipped, count);
    for (int i = 1; i <= count + 2; ++i) {
      EXPECT_TRUE(isWhole(frame(i)));
      fs::remove(frame(i));
    }
    fs::remove(folder.file("s.json"));
  }
}

TEST_F(TurntableVerb, TellsFarmsHowFarItIs) {
  const ProgramResult result = runProgram(call("--frames 1-40 --progress alf", "club.vdb", 16));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  std::istringstream lines(result.output);
  int last = -1, count = 0;
  for (std::string line; std::getline(lines, line);) {
    int percent = 0;
    if (std::sscanf(line.c_str(), "ALF_PROGRESS %d%%", &percent) != 1) continue;
    EXPECT_GT(percent, last);
    last = percent;
    ++count;
  }
  EXPECT_EQ(last, 100);
  EXPECT_GE(count, 2);
}

TEST_F(TurntableVerb, MakesTheSameFramesAtAnyNumberOfThreads) {
  ASSERT_EQ(runProgram(call("--frames 1-2 --orbit light --threads 1")).exitCode, 0);
  const Image one = readImage(frame(2));
  ASSERT_EQ(runProgram(call("--frames 1-2 --orbit light")).exitCode, 0);
  const Image all = readImage(frame(2));
  for (std::size_t c = 0; c != one.channels.size(); ++c)
    EXPECT_EQ(one.channels[c].values, all.channels[c].values);
}

TEST(TurntableData, SaysThatAnEmptyVolumeMakesEmptyPictures) {
  const std::string path = sharedData("volumes/empty_grid.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("turntable " + path + " -o " + folder.file("a.#.exr") + " --frames 1-3 --size 8x6");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("empty"), std::string::npos);
  const Image image = readImage(folder.file("a.3.exr"));
  for (const float alpha : image.channel("A").values) EXPECT_EQ(alpha, 0.0f);
}

}  // namespace
}  // namespace nephele::test
