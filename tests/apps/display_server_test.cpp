// Pictures in a viewer while they are made, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/packet_receiver.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

class DisplayServerOption : public testing::Test {
 protected:
  DisplayServerOption() {
    writeVdbFile(folder_.file("ball.vdb"),
                 {toVdb(*ball(1, 0.2f), {"density", VdbGridInfo::Class::fogVolume})}, {});
  }

  ProgramResult render(const std::string& options) const {
    return runProgram(fmt::format("render '{}' -o '{}' --samples 1 {}", folder_.file("ball.vdb"),
                                  folder_.file("a.exr"), options));
  }

  // What 16 bits keep of a value: 11 of its bits, or 2^-25 of what is nearly 0.
  static void expectShown(const PacketReceiver& viewer, const std::string& name, const Image& image) {
    EXPECT_EQ(viewer.problem, "");
    ASSERT_TRUE(viewer.pictures.contains(name));
    const auto& shown = viewer.pictures.at(name);
    EXPECT_EQ(shown.width, image.width);
    EXPECT_EQ(shown.height, image.height);
    ASSERT_EQ(shown.channels.size(), image.channels.size());
    for (const Image::Channel& channel : image.channels) {
      const std::vector<float>& values = shown.channels.at(channel.name);
      for (std::size_t i = 0; i != values.size(); ++i) {
        const float rounding = channel.half ? std::fabs(values[i]) / 2048 + 3e-8f : 0;
        if (values[i] == channel.values[i]) continue;
        ASSERT_NEAR(values[i], channel.values[i], rounding) << channel.name << " " << i;
      }
    }
  }

  const TemporaryFolder folder_;
};

TEST_F(DisplayServerOption, ShowsThePictureThatIsWritten) {
  for (const char* options : {"--size 50x35 --aov Z,light", "--size 50x35 --adaptive 0.1",
                              "--size 50x35 --integrator path --spp 2", "--size 50x35 --crop 5,6,40,30"}) {
    PacketReceiver viewer;
    const ProgramResult result = render(fmt::format("{} --display-server {}", options, viewer.address()));
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    EXPECT_EQ(result.errors.find("viewer"), std::string::npos) << result.errors;
    viewer.finish();
    expectShown(viewer, folder_.file("a.exr"), readImage(folder_.file("a.exr")));
  }
}

TEST_F(DisplayServerOption, ShowsFramesOneAfterTheOther) {
  PacketReceiver viewer;
  const std::string output = folder_.file("f.####.exr");
  const ProgramResult result = runProgram(
      fmt::format("turntable '{}' -o '{}' --frames 1-2 --samples 1 --size 20x15 --display-server {}",
                  folder_.file("ball.vdb"), output, viewer.address()));
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  viewer.finish();
  expectShown(viewer, output, readImage(folder_.file("f.0002.exr")));
}

TEST_F(DisplayServerOption, WritesThePictureWhateverTheViewerDoes) {
  PacketReceiver deaf(PacketReceiver::Habit::takesNothing), early(PacketReceiver::Habit::closesEarly);
  std::string nobody;
  {
    const PacketReceiver gone;
    nobody = gone.address();
  }
  for (const auto& [address, what] : {std::pair{deaf.address(), "takes nothing any more"},
                                      {early.address(), "has closed the connection"},
                                      {nobody, "is not there"}}) {
    const ProgramResult result = render("--size 320x240 --aov Z,light,normal --display-server " + address);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    const std::string note = fmt::format("the viewer at {} {}", address, what);
    const std::size_t at = result.errors.find(note);
    EXPECT_NE(at, std::string::npos) << result.errors;
    EXPECT_EQ(result.errors.find("the viewer at", at + 1), std::string::npos) << result.errors;
    EXPECT_EQ(readImage(folder_.file("a.exr")).width, 320);
    std::filesystem::remove(folder_.file("a.exr"));
  }
}

TEST_F(DisplayServerOption, RefusesWhatIsNoAddress) {
  for (const char* address : {"host:0", "host:70000", ":14158", "host:"}) {
    const ProgramResult result = render(fmt::format("--display-server {}", address));
    EXPECT_EQ(result.exitCode, 2) << address;
    EXPECT_NE(result.errors.find(fmt::format("--display-server: got '{}'", address)), std::string::npos)
        << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test
