// The verb turntable, through the program: frames, movies and sheets.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <set>

#include "nephele/render/image/exr_io.h"
#include "tests/apps/turntable_verb.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

TEST_F(TurntableVerb, ShowsTheBackdropOnTheSheet) {
  // A sheet of one frame of 64 x 36 has its pixels, 4 from the corner; dither and a rounding of 16 bits
  // apart.
  const ProgramResult result = runProgram(call("--frames 1 --backdrop --preview '" + folder.file("p.#.png") +
                                               "' --contact-sheet '" + folder.file("sheet.png") + "'"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Image sheet = readImage(folder.file("sheet.png")), preview = readImage(folder.file("p.1.png"));
  ASSERT_EQ(sheet.width, 64 + 2 * 4);
  for (int y = 0; y != 36; ++y)
    for (int x = 0; x != 64; ++x)
      ASSERT_NEAR(sheet.at("G", 4 + x, 4 + y), preview.at("G", x, y), 2.5f / 255) << x << ", " << y;
}

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
  const ProgramResult traced = runProgram(call("--frames 1-2 --integrator path --spp 1 --ground"));
  EXPECT_EQ(traced.exitCode, 0) << traced.errors;
}

TEST_F(TurntableVerb, MakesDeepShadowMapsAnewForLightsThatTurn) {
  // A ball looks the same from all sides.
  ASSERT_EQ(runProgram(call("--frames 1-4 --orbit model --extinction 5 --shadows deep", "ball.vdb")).exitCode,
            0);
  for (int number = 2; number <= 4; ++number)
    EXPECT_NEAR(brightness(frame(number)), brightness(frame(1)), 0.03 * brightness(frame(1)));
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
