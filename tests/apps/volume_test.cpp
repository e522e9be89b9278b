// What the verb render makes of the grids of its files, through the program.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

class VolumeOptionsOfRender : public testing::Test {
 protected:
  // A ball of radius 1 with its two halves, and a fog of which a part is hot.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    const auto whole = ball(1.0f, 0.1f);
    write("whole", {{"density", whole}});
    const auto half = [](bool upper) {
      return densityGrid(voxels(0.1f), {-12, -12, -12}, {12, 12, 12}, [=](const Vec3f& p) {
        const float inside = std::fmin(1.0f, std::fmax(0.0f, (1.0f - length(p)) / 0.1f + 0.5f));
        return (p.y > 0.05f) == upper ? inside : 0.0f;
      });
    };
    write("upper", {{"density", half(true)}});
    write("lower", {{"density", half(false)}});
    write("fire", {{"density", whole}, {"temperature", ball(0.5f, 0.1f)}, {"flame", ball(0.5f, 0.1f, 2)}});
    write("negative",
          {{"density", densityGrid(voxels(0.1f), {-12, -12, -12}, {12, 12, 12}, [](const Vec3f& p) {
              return length(p) < 1 ? 1.0f : length(p) < 1.1f ? -5.0f : 0.0f;
            })}});
  }
  static void TearDownTestSuite() { delete folder_; }

  static void write(const std::string& name,
                    const std::vector<std::pair<std::string, std::shared_ptr<BrickGrid>>>& grids) {
    std::vector<VdbGrid> vdb;
    for (const auto& [label, grid] : grids) vdb.push_back(toVdb(*grid, {label, VdbGridInfo::Class::unknown}));
    writeVdbFile(file(name + ".vdb"), vdb, {});
  }
  static std::string file(const std::string& name) { return folder_->file(name); }
  static ProgramResult render(const std::string& inputs, const std::string& options = {}) {
    return runProgram("render " + inputs + " -o " + file("a.exr") +
                      " --quiet --size 24x18 --camera-position 0,1,6 --look-at 0,0,0 --extinction 3 " +
                      options);
  }
  static Image picture(const std::string& inputs, const std::string& options = {}) {
    const ProgramResult result = render(inputs, options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(file("a.exr"));
  }
  static float difference(const Image& a, const Image& b) {
    float most = 0;
    for (const char* name : {"R", "G", "B", "A"})
      for (std::size_t i = 0; i != a.channel(name).values.size(); ++i)
        most = std::max(most, std::fabs(a.channel(name).values[i] - b.channel(name).values[i]));
    return most;
  }

  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(VolumeOptionsOfRender, AVolumeInTwoFilesIsTheWhole) {
  const Image whole = picture(file("whole.vdb"));
  EXPECT_GT(whole.at("A", 12, 9), 0.99f);
  EXPECT_EQ(difference(picture(file("upper.vdb") + " " + file("lower.vdb")), whole), 0.0f);
  EXPECT_EQ(difference(picture(file("lower.vdb") + " " + file("upper.vdb")), whole), 0.0f);
}

TEST_F(VolumeOptionsOfRender, DensitiesAreScaledOneByOneOrAllTogether) {
  const std::string whole = file("whole.vdb"), twice = whole + " " + whole;
  const Image expected = picture(whole, "--density-scale 2");
  EXPECT_EQ(difference(picture(twice), expected), 0.0f);
  EXPECT_EQ(difference(picture(twice, "--density-scale 0.5,1.5"), expected), 0.0f);
  EXPECT_GT(difference(picture(whole), expected), 0.01f);
}

TEST_F(VolumeOptionsOfRender, ExtinctionHasAColour) {
  const Image image = picture(file("whole.vdb"), "--aov transmittance --extinction-color 1,0.5,0");
  const float red = image.at("transmittance.R", 12, 9), green = image.at("transmittance.G", 12, 9);
  EXPECT_NEAR(red, green * green, 1e-3f);
  EXPECT_EQ(image.at("transmittance.B", 12, 9), 1.0f);
}

TEST_F(VolumeOptionsOfRender, TemperaturesAndNumbersGlow) {
  const std::string dark = " --sun 0,0,0 --sky 0,0,0";
  const Image fire = picture(file("fire.vdb"), "--temperature-grid temperature" + dark);
  EXPECT_GT(fire.at("R", 12, 9), fire.at("G", 12, 9));
  EXPECT_GT(fire.at("G", 12, 9), fire.at("B", 12, 9));
  EXPECT_GT(fire.at("B", 12, 9), 0.0f);
  const Image flame = picture(file("fire.vdb"), "--emission-grid flame --aov emission" + dark);
  EXPECT_EQ(flame.at("R", 12, 9), flame.at("B", 12, 9));
  EXPECT_NEAR(flame.at("emission.G", 12, 9), flame.at("G", 12, 9), 1e-3f * flame.at("G", 12, 9));
  const Image twice = picture(file("fire.vdb"), "--emission-grid flame --emission-scale 2" + dark);
  EXPECT_NEAR(twice.at("R", 12, 9), 2 * flame.at("R", 12, 9), 2e-3f * twice.at("R", 12, 9));
  // Only the second of two volumes has the grid.
  EXPECT_EQ(render(file("whole.vdb") + " " + file("fire.vdb"), "--emission-grid none,flame").exitCode, 0);
}

TEST_F(VolumeOptionsOfRender, DensityBelowZeroCountsAsNone) {
  // Shadows and opacity of a ball with a shell of -5 around it are at most those of the ball.
  const Image shell = picture(file("negative.vdb"));
  EXPECT_GT(shell.at("A", 12, 9), 0.99f);
  for (const float alpha : shell.channel("A").values) {
    EXPECT_GE(alpha, 0.0f);
    EXPECT_LE(alpha, 1.0f);
  }
  for (const float red : shell.channel("R").values) EXPECT_TRUE(red >= 0 && std::isfinite(red));
}

TEST_F(VolumeOptionsOfRender, RefusesGridsThatAreNotThere) {
  for (const char* option : {"--grid", "--color-grid", "--emission-grid", "--temperature-grid"}) {
    const ProgramResult result = render(file("fire.vdb"), std::string(option) + " smoke");
    EXPECT_EQ(result.exitCode, 1);
    for (const char* name : {"fire.vdb", "'smoke'", "'density'", "'temperature'", "'flame'"})
      EXPECT_NE(result.errors.find(name), std::string::npos) << option << ": " << result.errors;
  }
}

TEST_F(VolumeOptionsOfRender, RefusesGridsOfTheWrongKind) {
  const ProgramResult numbers = render(file("fire.vdb"), "--color-grid flame");
  EXPECT_EQ(numbers.exitCode, 1);
  EXPECT_NE(numbers.errors.find("'flame' holds float values; a grid of vectors is needed"), std::string::npos)
      << numbers.errors;
  // 1000 times 2000 K is hotter than anything that glows by its heat.
  const ProgramResult hot = render(file("fire.vdb"), "--temperature-grid flame --temperature-scale 90000");
  EXPECT_EQ(hot.exitCode, 1);
  EXPECT_NE(hot.errors.find("temperature scale"), std::string::npos) << hot.errors;
}

TEST_F(VolumeOptionsOfRender, RefusesListsThatDoNotFitTheVolumes) {
  const ProgramResult result = render(file("whole.vdb"), "--density-scale 1,2");
  EXPECT_NE(result.exitCode, 0);
  EXPECT_NE(result.errors.find("--density-scale: got 2 entries for 1 volume, allowed: 1"), std::string::npos)
      << result.errors;
  EXPECT_EQ(render(file("whole.vdb"), "--density-scale -1").exitCode, 2);
  EXPECT_EQ(render(file("whole.vdb"), "--extinction-color 1,1").exitCode, 2);
  EXPECT_EQ(render(file("whole.vdb"), "--temperature-scale 0").exitCode, 2);
}

TEST_F(VolumeOptionsOfRender, SendsMeshesToTheVerbThatMakesDensitiesOfThem) {
  const std::string mesh = ownData("data/sphere_uv.obj");
  for (const std::string& verb : {"render " + file("whole.vdb"), std::string("turntable --frames 1")}) {
    const ProgramResult result = runProgram(verb + " " + mesh + " --quiet -o " +
                                            file(verb.starts_with("render") ? "a.exr" : "a.#.exr"));
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_NE(result.errors.find("is a mesh, not a density; 'nephele cloud " + mesh), std::string::npos)
        << result.errors;
  }
}

TEST(VolumeData, RefusesVectorsAndLevelSetsAsDensities) {
  const std::string fluid = sharedData("volumes/blender_fluid_5_grids.vdb"),
                    cube = sharedData("volumes/cube_levelset.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(fluid);
  NEPHELE_REQUIRE_SHARED_DATA(cube);
  const TemporaryFolder folder;
  const std::string out = " --quiet --size 8x6 -o " + folder.file("a.exr");
  const ProgramResult vectors = runProgram("render " + fluid + " --grid velocity" + out);
  EXPECT_EQ(vectors.exitCode, 1);
  EXPECT_NE(vectors.errors.find("'velocity' holds vec3s values"), std::string::npos) << vectors.errors;
  const ProgramResult surface = runProgram("render " + fluid + " " + cube + out);
  EXPECT_EQ(surface.exitCode, 1);
  EXPECT_NE(surface.errors.find("is a level set, not a density"), std::string::npos) << surface.errors;
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.exr")));
}

TEST(VolumeData, BlursAFluidByItsVelocities) {
  const std::string fluid = sharedData("volumes/blender_fluid_5_grids.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(fluid);
  const TemporaryFolder folder;
  const std::string start = "render " + fluid + " --quiet --size 48x48 --extinction 0.2 --view 0,0 -o ";
  // As many rays as a blurred picture takes.
  ASSERT_EQ(runProgram(start + folder.file("a.exr") + " --samples 64").exitCode, 0);
  const std::string velocity = " --velocity-grid velocity";
  const ProgramResult blurred = runProgram(start + folder.file("b.exr") + velocity + " --shutter=-12,12");
  ASSERT_EQ(blurred.exitCode, 0) << blurred.errors;
  // The largest slope of the opacity is less.
  const auto steepest = [](const Image& image) {
    float most = 0;
    for (int y = 0; y != 48; ++y)
      for (int x = 1; x != 48; ++x)
        most = std::max(most, std::fabs(image.at("A", x, y) - image.at("A", x - 1, y)));
    return most;
  };
  EXPECT_LT(steepest(readImage(folder.file("b.exr"))), 0.9f * steepest(readImage(folder.file("a.exr"))));
  const ProgramResult still = runProgram(start + folder.file("c.exr") + velocity);
  EXPECT_EQ(still.exitCode, 2);
  EXPECT_NE(still.errors.find("--shutter"), std::string::npos) << still.errors;
}

TEST(VolumeData, RendersTheFireOfAFluidSimulation) {
  const std::string fluid = sharedData("volumes/blender_fluid_5_grids.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(fluid);
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("render " + fluid + " --temperature-grid temperature --color-grid velocity --quiet" +
                 " --size 48x48 --aov emission -o " + folder.file("a.exr"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Image image = readImage(folder.file("a.exr"));
  double red = 0, blue = 0;
  for (std::size_t i = 0; i != image.channel("emission.R").values.size(); ++i) {
    red += double(image.channel("emission.R").values[i]);
    blue += double(image.channel("emission.B").values[i]);
  }
  // At most 2000 K: far redder than white, ratio 130 there.
  EXPECT_GT(red, 50 * blue);
  EXPECT_GT(red, 0.0);
}

}  // namespace
}  // namespace nephele::test
