// Lengths as a percentage of the longest side, through the program.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

class Lengths : public testing::Test {
 protected:
  /// A ball of radius 1 at voxels of 0.1: its box with a voxel around it is 2.2 wide.
  static constexpr double kSide = 2.2;

  std::string fog() const {
    writeVdbFile(folder_.file("fog.vdb"),
                 {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
    return folder_.file("fog.vdb");
  }
  std::vector<float> alphaOf(const std::string& options, const char* channel = "A") const {
    const ProgramResult result = runProgram("render " + fog() + " --size 24x24 --quiet -o " +
                                            folder_.file("a.exr") + " --camera-position 0,0,10 " + options);
    EXPECT_EQ(result.exitCode, 0) << options << result.errors;
    return readImage(folder_.file("a.exr")).channel(channel).values;
  }
  void expectSame(const std::string& a, const std::string& b, const char* channel = "A") const {
    const std::vector<float> one = alphaOf(a, channel), other = alphaOf(b, channel);
    float most = 0;
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_NEAR(one[i], other[i], 2e-3f) << a << " and " << b << " at " << i;
      most = std::max(most, one[i]);
    }
    EXPECT_GT(most, 0.0f);
  }

  TemporaryFolder folder_;
};

TEST_F(Lengths, OfCamerasMayBePercentages) {
  const auto of = [](double percent) { return std::to_string(percent / 100 * kSide); };
  expectSame("--projection orthographic --orthographic-width 150%",
             "--projection orthographic --orthographic-width " + of(150));
  const std::string lens = "--fov 25 --samples 16 ";
  expectSame(lens + "--lens-radius 20% --focus-distance 300%",
             lens + "--lens-radius " + of(20) + " --focus-distance " + of(300));
  EXPECT_NE(alphaOf(lens + "--lens-radius 20% --focus-distance 300%"), alphaOf(lens));
}

// Focal lengths and f-stops of a camera file are those of its film; --film-width goes before it.
TEST_F(Lengths, OfFilmsAreThoseOfTheCameraFile) {
  std::ofstream(folder_.file("c.json"))
      << R"({"film_width": 24, "frames": [{"frame": 1, "position": [0, 0, 10], "look_at": [0, 0, 0],)"
         R"( "focal_length": 50, "f_stop": 0.1, "focus_distance": 5}]})";
  const auto seen = [&](const std::string& options) {
    const ProgramResult result = runProgram("render " + fog() + " --size 24x24 --samples 16 --quiet -o " +
                                            folder_.file("a.exr") + " " + options);
    EXPECT_EQ(result.exitCode, 0) << options << result.errors;
    return readImage(folder_.file("a.exr")).channel("A").values;
  };
  const std::string typed =
      "--camera-position 0,0,10 --look-at 0,0,0 --focal-length 50 --f-stop 0.1 --focus-distance 5 "
      "--film-width ";
  const std::string file = "--camera " + folder_.file("c.json");
  const std::vector<float> own = seen(file), wide = seen(file + " --film-width 36");
  EXPECT_EQ(own, seen(typed + "24"));
  EXPECT_EQ(wide, seen(typed + "36"));
  EXPECT_EQ(seen(file + " --focal-length 50"), own);
  EXPECT_NE(own, wide);
  EXPECT_NE(own, seen(file + " --lens-radius 0"));
}

// From the lowest point of the volume, as --flat-base counts.
TEST_F(Lengths, OfTheGroundCountFromTheBottom) {
  const std::string ground = "--fov 25 --ground --samples 2 ";
  expectSame(ground + "--ground-height -10%", ground + "--ground-height " + std::to_string(-1.1 - 0.22), "R");
  expectSame(ground + "--ground-height 0%", ground, "R");
}

TEST_F(Lengths, OfLightsThatDecay) {
  const std::string lamp = "--fov 25 --samples 1 --point 0,0,4,20 --light-decay ";
  expectSame(lamp + "quadratic,200%", lamp + "quadratic," + std::to_string(2 * kSide), "R");
  EXPECT_NE(alphaOf(lamp + "quadratic,200%", "R"), alphaOf(lamp + "quadratic", "R"));
}

// A cube of edge 2, shrunk by a tenth of it on either side.
TEST_F(Lengths, OfLevelSetsThatAreMeshed) {
  writeMesh(folder_.file("box.obj"), boxMesh({-1, -1, -1}, {1, 1, 1}));
  ASSERT_EQ(runProgram("levelset " + folder_.file("box.obj") + " --resolution 40 --half-width 6 -o " +
                       folder_.file("box.vdb"))
                .exitCode,
            0);
  ASSERT_EQ(
      runProgram("mesh " + folder_.file("box.vdb") + " --isovalue 10% -o " + folder_.file("in.obj")).exitCode,
      0);
  const Box box = boundingBox(readMesh(folder_.file("in.obj")));
  EXPECT_NEAR(box.max.x, 0.8f, 0.01f);
  EXPECT_NEAR(box.min.y, -0.8f, 0.01f);
  const ProgramResult fogged = runProgram("mesh " + fog() + " --isovalue 10% -o " + folder_.file("in.obj"));
  EXPECT_EQ(fogged.exitCode, 2);
  EXPECT_NE(fogged.errors.find("--isovalue"), std::string::npos) << fogged.errors;
}

TEST_F(Lengths, ThatAreNoneAreRefused) {
  const struct {
    const char *arguments, *says;
  } cases[] = {{"--lens-radius -1%", "--lens-radius"},
               {"--lens-radius %", "--lens-radius"},
               {"--focus-distance 0%", "--focus-distance"},
               {"--focus-distance near", "--focus-distance"},
               {"--orthographic-width 0", "--orthographic-width"},
               {"--orthographic-width 1e400", "--orthographic-width"},
               {"--projection orthographic --orthographic-width 1e300", "--orthographic-width"},
               {"--ground --ground-height 5%%", "--ground-height"},
               {"--light-decay none,-1%", "--light-decay"},
               {"--light-decay none,%", "--light-decay"}};
  for (const auto& c : cases) {
    const ProgramResult result =
        runProgram("render " + fog() + " -o " + folder_.file("a.exr") + " --size 8x8 " + c.arguments);
    EXPECT_EQ(result.exitCode, 2) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.says), std::string::npos) << c.arguments << ": " << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test
