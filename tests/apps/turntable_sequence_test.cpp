// The verb turntable around a volume that has a file for each frame, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>

#include "nephele/render/image/exr_io.h"
#include "tests/apps/turntable_verb.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

class TurntableOfASequence : public TurntableVerb {
 protected:
  // Balls about the origin that grow from 0.5 to 1, each of another density.
  void SetUp() override {
    for (int number = 1; number <= 3; ++number)
      writeBall(number, 0.25f + 0.25f * float(number), float(number));
  }
  void writeBall(int number, float radius, float value, const std::string& grid = "density") const {
    writeVdbFile(ballFile(number), {toVdb(*ball(radius, 0.1f, value), {grid, VdbGridInfo::Class::fogVolume})},
                 {});
  }
  std::string ballFile(int number) const { return folder.file(fmt::format("ball.{:04d}.vdb", number)); }
  std::string turning(const std::string& options, const std::string& input = "ball.####.vdb") const {
    return fmt::format("turntable '{}' -o '{}' --size 48x36 --samples 1 --quality draft --stats '{}' {}",
                       folder.file(input), folder.file("f.####.exr"), folder.file("s.json"), options);
  }
  static ProgramResult succeeds(const std::string& arguments) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 0) << arguments << '\n' << result.errors;
    return result;
  }
  void fails(const std::string& arguments, int exitCode, const std::string& message) const {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, exitCode) << arguments;
    EXPECT_NE(result.errors.find(message), std::string::npos) << arguments << '\n' << result.errors;
    EXPECT_FALSE(fs::exists(frame(1))) << arguments;
  }
  static void expectSame(const Image& a, const Image& b, const std::string& what) {
    ASSERT_EQ(a.channels.size(), b.channels.size()) << what;
    for (const Image::Channel& channel : a.channels)
      EXPECT_EQ(std::memcmp(channel.values.data(), b.channel(channel.name).values.data(),
                            channel.values.size() * sizeof(float)),
                0)
          << what << ' ' << channel.name;
  }
  std::string made() const {
    std::string result;
    const auto stats = statistics();
    for (const auto& entry : stats["frames"]) result += entry["skipped"] == true ? 's' : 'm';
    return result;
  }
};

// All balls are about one middle, so that with camera and extinction given frame N is that of a turntable of
// volume N, to the last bit.
TEST_F(TurntableOfASequence, ShowsTheVolumeOfEachFrame) {
  for (const std::string orbit : {"camera", "model", "light"}) {
    const std::string options =
        "--camera-position 1,1,6 --look-at 0,0,0 --extinction 4 --frames 1-3 --orbit " + orbit;
    succeeds(turning(options));
    std::vector<Image> frames;
    for (int number = 1; number <= 3; ++number) frames.push_back(readImage(frame(number)));
    EXPECT_NE(frames[0].channel("A").values, frames[2].channel("A").values);
    for (int number = 1; number <= 3; ++number) {
      succeeds(turning(options, fs::path(ballFile(number)).filename()));
      expectSame(readImage(frame(number)), frames[std::size_t(number - 1)],
                 fmt::format("{} {}", orbit, number));
    }
  }
}

TEST_F(TurntableOfASequence, ChoosesCameraAndExtinctionOnce) {
  succeeds(turning("--frames 1-3 --turns 3"));
  // As a sequence of `render` does: an optical depth of 150 across the largest ball, at the largest density,
  // which is 3 but for the soft edge.
  const double expected = 150 / (2.2 * 3);
  EXPECT_NEAR(double(statistics()["extinction"]), expected, 0.1 * expected);
  // Whole turns from frame to frame: the camera is where it was.
  const auto first = readImageCamera(frame(1))->worldToCamera;
  for (int number = 2; number <= 3; ++number)
    for (std::size_t i = 0; i != first.size(); ++i)
      EXPECT_NEAR(readImageCamera(frame(number))->worldToCamera[i], first[i], 1e-5f);
  // It frames the largest ball as a turntable of that alone does.
  succeeds(turning("--frames 1-3", "ball.0003.vdb"));
  EXPECT_EQ(readImageCamera(frame(1))->worldToCamera, first);
}

// Copies are one volume: the pictures are those of a turntable around it, and light is made once.
TEST_F(TurntableOfASequence, OfOneVolumeIsItsTurntable) {
  for (int number = 1; number <= 3; ++number)
    fs::copy_file(data_->file("club.vdb"), folder.file(fmt::format("club.{:04d}.vdb", number)));
  succeeds(turning("--frames 1-3", "club.####.vdb"));
  std::vector<Image> frames;
  for (int number = 1; number <= 3; ++number) frames.push_back(readImage(frame(number)));
  int lit = 0;
  const auto stats = statistics();
  for (const auto& stage : stats["stages"]) lit += stage["name"] == "scatter";
  EXPECT_EQ(lit, 1);
  succeeds(turning("--frames 1-3", "club.0001.vdb"));
  for (int number = 1; number <= 3; ++number)
    expectSame(readImage(frame(number)), frames[std::size_t(number - 1)], std::to_string(number));
}

TEST_F(TurntableOfASequence, MakesAgainOnlyTheFrameWhoseVolumeChanged) {
  const std::string options = "--frames 1-3 --skip-existing";
  succeeds(turning(options));
  EXPECT_EQ(made(), "mmm");
  succeeds(turning(options));
  EXPECT_EQ(made(), "sss");
  // Within the largest, and thinner.
  writeBall(2, 0.7f, 1.5f);
  succeeds(turning(options));
  EXPECT_EQ(made(), "sms");
  // The same under another name is the same.
  for (int number = 1; number <= 3; ++number)
    fs::copy_file(ballFile(number), folder.file(fmt::format("other.{}.vdb", number)));
  succeeds(turning(options, "other.#.vdb"));
  EXPECT_EQ(made(), "sss");
  // What is chosen from all changes with the largest.
  writeBall(3, 1.2f, 3);
  succeeds(turning(options));
  EXPECT_EQ(made(), "mmm");
}

TEST_F(TurntableOfASequence, TakesSharesSheetsDepthAndVolumesThatStay) {
  const std::string both = fmt::format("'{}' --density-scale 1,0.5 --orbit light --deep '{}' ",
                                       data_->file("club.vdb"), folder.file("d.####.exr"));
  succeeds(turning(both + "--frames 1-3 --no-backdrop --contact-sheet '" + folder.file("c.png") + "'"));
  // Two columns.
  EXPECT_EQ(readImage(folder.file("c.png")).width, 2 * 48 + 3 * 4);
  std::vector<Image> frames;
  for (int number = 1; number <= 3; ++number) {
    frames.push_back(readImage(frame(number)));
    fs::remove(frame(number));
  }
  for (const char* share : {"--shard 1/2", "--shard 2/2"}) succeeds(turning(both + "--frames 1-3 " + share));
  for (int number = 1; number <= 3; ++number)
    expectSame(readImage(frame(number)), frames[std::size_t(number - 1)], std::to_string(number));
  // What stands in front belongs to a frame, too.
  const std::string behind = fmt::format("'{}' --orbit light --holdout '{}' --frames 1-3 --skip-existing",
                                         data_->file("club.vdb"), folder.file("d.####.exr"));
  succeeds(turning(behind));
  EXPECT_EQ(made(), "mmm");
  fs::copy_file(folder.file("d.0001.exr"), folder.file("d.0002.exr"), fs::copy_options::overwrite_existing);
  succeeds(turning(behind));
  EXPECT_EQ(made(), "sms");
}

TEST_F(TurntableOfASequence, NamesWhatIsWrongBeforeAnyWork) {
  fails(turning("--frames 1-5"), 1, "ball.####.vdb: 2 of 5 frames are missing: 4-5");
  fails(turning("--frames 1-3", "b#.####.vdb"), 2, "2 places");
  writeBall(2, 0.5f, 1, "smoke");
  fails(turning("--frames 1-3"), 1, "ball.0002.vdb: its grids are 'smoke'");
  fails(turning("--frames 1-3 --only 1"), 1, "ball.0002.vdb");
  fs::resize_file(ballFile(2), 100);
  fails(turning("--frames 1-3"), 1, "ball.0002.vdb");
}

TEST_F(TurntableOfASequence, KeepsWhatIsWholeWhereAFrameFails) {
  const ProgramResult result =
      runProgram(turning("--frames 1-3 --shadows deep --camera-position 0,0,6 --orbit light "
                         "--point 0,0,0.9,1"));
  // Deep shadow maps see 75 degrees to each side, and the largest ball reaches around the light.
  EXPECT_EQ(result.exitCode, 1) << result.errors;
  EXPECT_TRUE(isWhole(frame(1)));
  EXPECT_FALSE(fs::exists(frame(3)));
}

}  // namespace
}  // namespace nephele::test
