// What turns in the verb turntable beside one volume: several, depth, and what stands in front.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

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

}  // namespace
}  // namespace nephele::test
