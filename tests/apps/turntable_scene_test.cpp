// What turns in the verb turntable beside one volume: several, depth, and what stands in front.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "tests/apps/turntable_verb.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

// The lights turn, so that the first frame is that of a still.
TEST_F(TurntableVerb, AddsUpSeveralVolumes) {
  const std::string both = volume("ball.vdb") + " " + volume("club.vdb");
  const std::string usual = " --size 48x32 --samples 1 --sun 90,38 --extinction 3 --density-scale 0.3,1";
  const ProgramResult turned = runProgram("turntable " + both + usual + " --frames 1-2 --orbit light -o '" +
                                          folder.file("f.####.exr") + "'");
  ASSERT_EQ(turned.exitCode, 0) << turned.errors;
  ASSERT_EQ(runProgram("render " + both + usual + " -o '" + folder.file("still.exr") + "'").exitCode, 0);
  const Image frame = readImage(this->frame(1)), still = readImage(folder.file("still.exr"));
  for (const char* name : {"R", "G", "B", "A"})
    for (std::size_t i = 0; i != still.channel(name).values.size(); ++i)
      // A rounding of 16 bits.
      ASSERT_NEAR(frame.channel(name).values[i], still.channel(name).values[i], 1e-3f) << name;
  // One of them alone covers less.
  ASSERT_EQ(runProgram("turntable " + volume("club.vdb") + usual.substr(0, usual.rfind(" --density")) +
                       " --frames 1-2 --orbit light -o '" + folder.file("one.####.exr") + "'")
                .exitCode,
            0);
  EXPECT_NE(readImage(folder.file("one.0001.exr")).channel("A").values, frame.channel("A").values);
}

TEST_F(TurntableVerb, WritesDeepFramesThatFlattenToThePicture) {
  const std::string deep =
      " --deep '" + folder.file("d.####.exr") + "' --stats '" + folder.file("s.json") + "' --skip-existing";
  ASSERT_EQ(runProgram(call("--frames 1-2" + deep)).exitCode, 0);
  EXPECT_GT(double(statistics()["deep_samples"]), 0);
  for (int number = 1; number <= 2; ++number) {
    const Image flat = readImage(frame(number));
    const DeepImage samples = readDeepExr(folder.file(fmt::format("d.{:04d}.exr", number)));
    for (int y = 0; y != flat.height; ++y)
      for (int x = 0; x != flat.width; ++x)
        // Half floats.
        ASSERT_NEAR(flattened(samples.at(x, y)).alpha, flat.at("A", x, y), 2e-3f) << x << ", " << y;
  }
  // A frame is there only with its depth.
  fs::remove(folder.file("d.0002.exr"));
  ASSERT_EQ(runProgram(call("--frames 1-2" + deep)).exitCode, 0);
  const auto stats = statistics();
  EXPECT_EQ(stats["frames"][0]["skipped"], true);
  EXPECT_EQ(stats["frames"][1]["skipped"], false);
  EXPECT_TRUE(fs::exists(folder.file("d.0002.exr")));
}

// What a volume hides of itself: of a ray that has passed it with the transmittance T, the half of the
// optical depth in front weakens each part, so that of 1 - T there is (1 - T^2) / 2.
TEST_F(TurntableVerb, HidesBehindDeepFrames) {
  ASSERT_EQ(
      runProgram(call("--frames 1-2 --extinction 2 --deep '" + folder.file("d.####.exr") + "'", "ball.vdb"))
          .exitCode,
      0);
  const ProgramResult result = runProgram(
      fmt::format("turntable {} -o '{}' --size 64x36 --samples 1 --frames 1-2 --extinction 2 --holdout '{}'",
                  volume("ball.vdb"), folder.file("h.####.exr"), folder.file("d.####.exr")));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  for (int number = 1; number <= 2; ++number) {
    const Image whole = readImage(frame(number)),
                held = readImage(folder.file(fmt::format("h.{:04d}.exr", number)));
    const float alpha = whole.at("A", 32, 18), t = 1 - alpha;
    EXPECT_GT(alpha, 0.5f);
    EXPECT_NEAR(held.at("A", 32, 18), (1 - t * t) / 2, 0.02f);
  }
}

TEST_F(TurntableVerb, RefusesDepthThatDoesNotFit) {
  const auto fails = [&](const std::string& options, int exitCode, const std::string& message) {
    const ProgramResult result = runProgram(call("--frames 1-3 " + options));
    EXPECT_EQ(result.exitCode, exitCode) << options;
    EXPECT_NE(result.errors.find(message), std::string::npos) << options << '\n' << result.errors;
  };
  ASSERT_EQ(runProgram(call("--frames 1 --deep '" + folder.file("d.####.exr") + "'")).exitCode, 0);
  fails("--holdout '" + folder.file("d.####.exr") + "'", 1, "2 of 3 frames are missing: 2-3");
  fails("--deep '" + folder.file("d.exr") + "'", 2, "--deep");
  fails("--deep '" + folder.file("f.%04d.exr") + "'", 2, "--deep");
  fails("--deep '" + folder.file("e.####.exr") + "' --adaptive 0.1", 2, "--adaptive");
  // One file for all frames is that of one camera.
  fails("--holdout '" + folder.file("d.0001.exr") + "'", 1, "d.0001.exr");
}

TEST_F(TurntableVerb, TellsScriptsAndColoursTheFrame) {
  const std::string script = folder.file("a.felt");
  std::ofstream(script) << "scalarfield density = mask(sphere((0, 0, 0), 1), 0.1);\n"
                           "vectorfield color = (time / 4, 1, 1);\n";
  const std::string options = " -o '" + folder.file("f.####.exr") +
                              "' --frames 1-2 --size 16x12 --samples 1 --aov albedo --extinction 40";
  for (const std::string& input : {script, volume("ball.vdb") + " --color '=(time / 4, 1, 1)'"}) {
    const ProgramResult result = runProgram("turntable " + input + options);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    for (int number = 1; number <= 2; ++number) {
      const Image image = readImage(frame(number));
      EXPECT_NEAR(image.at("albedo.R", 8, 6), 0.25f * float(number) * image.at("albedo.G", 8, 6), 0.01f)
          << input << number;
    }
  }
}

// Long in x: nearer, and so finer, where the camera looks along it. Frames are those of render with the same
// camera.
TEST_F(TurntableVerb, SamplesAScriptForTheCameraOfEveryFrame) {
  const std::string script = folder.file("long.felt");
  std::ofstream(script) << "domain bounds = domain((-2.4, -0.8, -0.8), (4.8, 1.6, 1.6), 0.1);\n"
                           "scalarfield density = mask(0.5 - sqrt((P.x / 4)^2 + P.y^2 + P.z^2), 0.05);\n"
                           "float extinction = 4;\n";
  const std::string common = " --size 48x32 --samples 1 --sun 30,20 --look-at 0,0,0 ";
  const auto turn = [&](const std::string& options) {
    const ProgramResult result = runProgram("turntable " + script + " -o " + folder.file("f.####.exr") +
                                            " --frames 1-4 --camera-position 0,0,5 --stats " +
                                            folder.file("s.json") + common + options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    std::vector<double> sizes;
    const nlohmann::json stats = statistics();
    for (const auto& frame : stats["frames"]) sizes.push_back(frame["voxel_size"]);
    return sizes;
  };
  const auto expectTheSame = [](const std::string& a, const std::string& b) {
    const Image first = readImage(a), second = readImage(b);
    for (const char* channel : {"R", "G", "B", "A", "Z"}) {
      const std::vector<float>&x = first.channel(channel).values, &y = second.channel(channel).values;
      // Rounded to 16 bits, one way or the other.
      for (std::size_t i = 0; i != x.size(); ++i)
        ASSERT_LE(x[i] == y[i] ? 0 : std::fabs(x[i] - y[i]), 1e-3f * std::fabs(y[i])) << a << channel;
    }
  };
  const std::vector<double> sizes = turn("");
  ASSERT_EQ(sizes.size(), 4u);
  EXPECT_EQ(sizes[0], sizes[2]);
  EXPECT_EQ(sizes[1], sizes[3]);
  // 5 - 0.5 and 5 - 2 away, in steps of an eighth of an octave.
  EXPECT_NEAR(sizes[0] / sizes[1], 1.5, 0.2);
  const std::string still = folder.file("still.exr");
  for (const auto& [number, position] : {std::pair{1, "0,0,5"}, {2, "5,0,0"}}) {
    ASSERT_EQ(
        runProgram("render " + script + " -o " + still + common + "--camera-position " + position).exitCode,
        0);
    expectTheSame(frame(number), still);
  }
  // Whatever other frames are made, and with lights that turn, whose camera stands still.
  std::filesystem::rename(frame(2), folder.file("second.exr"));
  turn("--only 2");
  expectTheSame(frame(2), folder.file("second.exr"));
  for (const double size : turn("--orbit light")) EXPECT_EQ(size, sizes[0]);
  turn("--orbit model");
  EXPECT_GT(brightness(frame(2)), 0);
}

}  // namespace
}  // namespace nephele::test
