// Parameters of the verb cloud that vary in space, through the program: every kind of field read back as the
// density it makes, and the same fields as parameters of layers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "nephele/levelset/flow/advection_files.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

/// Radius 1 about the origin: heights 0 and 1 are y = -1 and 1.
const std::string kSphere = ownData("data/sphere_uv.obj");

class CloudFields : public testing::Test {
 protected:
  ProgramResult run(const std::string& input, const std::string& options) {
    return runProgram("cloud " + input + " -o " + folder.file("out.vdb") + " --stats " +
                      folder.file("stats.json") + " " + options);
  }

  std::shared_ptr<const BrickGrid> grown(const std::string& options, const std::string& input = kSphere) {
    const ProgramResult result = run(input, options);
    EXPECT_EQ(result.exitCode, 0) << options << ": " << result.errors;
    notes = result.errors;
    if (result.exitCode != 0) return denseGridOfNothing();
    return toBricks(readScalarGrid(folder.file("out.vdb"), "density"));
  }

  /// The density inside the bare sphere where --density is `field`; voxel j lies at y = j / 20.
  std::shared_ptr<const BrickGrid> density(const std::string& field, const std::string& input = kSphere) {
    return grown("--voxel-size 0.05 --layers 1 --amplitude 0 --edge-thickness 0.1 --density " + field, input);
  }

  static std::shared_ptr<const BrickGrid> denseGridOfNothing() {
    return bakeGrid(0.0f, {.voxelSize = 1, .box = {{0, 0, 0}, {1, 1, 1}}});
  }

  /// A fog grid `name` of `field` within `box`, background 0.
  std::string maskFile(const std::string& name, const ScalarField& field, const Box& box) {
    const auto bricks = bakeGrid(field, {.voxelSize = 0.1f, .box = box});
    const std::string path = folder.file("mask.vdb");
    writeVdbFile(path, {toVdb(*bricks, {name, VdbGridInfo::Class::fogVolume})}, {});
    return path;
  }

  /// The sphere with an attribute `growth` that is x, and a colour.
  std::string paintedSphere() {
    Mesh mesh = readMesh(kSphere);
    MeshAttribute growth{"growth", MeshAttribute::Domain::vertex, 1, {}};
    MeshAttribute color{"color", MeshAttribute::Domain::vertex, 3, {}};
    for (const Vec3d& p : mesh.positions) {
      growth.values.push_back(float(p.x));
      color.values.insert(color.values.end(), {p.y > 0 ? 1.0f : 0.0f, 0.0f, 0.0f});
    }
    mesh.attributes = {growth, color};
    writeMesh(folder.file("painted.ply"), mesh);
    return folder.file("painted.ply");
  }

  nlohmann::json stats() { return nlohmann::json::parse(textOf(folder.file("stats.json"))); }

  TemporaryFolder folder;
  std::string notes;
};

TEST_F(CloudFields, RampsRunOverTheBoxOfTheShape) {
  const auto up = density("height:0=0,1=1");
  EXPECT_NEAR(up->at({0, 0, 0}), 0.5, 1e-5);
  EXPECT_NEAR(up->at({0, -10, 0}), 0.25, 1e-5);
  EXPECT_EQ(up->values(), density("along:0,1,0:0=0,1=1")->values());
  const auto aslant = density("along:-3,0,0:0=0,0.5=0,0.5=2,1=4");
  // Towards -x: place 0.25 at x = 0.5, and 0.75 at x = -0.5.
  EXPECT_EQ(aslant->at({10, 0, 0}), 0);
  EXPECT_NEAR(aslant->at({-10, 0, 0}), 3, 1e-5);
  // Over the box of a sphere, along its diagonal, places 0 and 1 are its corners: sqrt(3) from the middle.
  EXPECT_NEAR(density("along:1,1,1:0=0,1=1")->at({6, 6, 6}), 0.5 + 0.3 / 2, 1e-5);
}

TEST_F(CloudFields, FacingFollowsTheSurface) {
  const auto up = density("facing:0,2,0:-1=0,1=1");
  // Straight above the middle the closest surface faces up; at its side, sideways. Interpolated from a grid
  // of 1/48; normals of the faceted sphere are off by less than 0.01.
  EXPECT_NEAR(up->at({0, 10, 0}), 1, 0.02);
  EXPECT_NEAR(up->at({0, -10, 0}), 0, 0.02);
  EXPECT_NEAR(up->at({10, 0, 0}), 0.5, 0.02);
  EXPECT_NEAR(up->at({8, 8, 0}), 0.5 + std::sqrt(0.5) / 2, 0.02);
}

TEST_F(CloudFields, MasksAreReadInTheWorld) {
  const ScalarField x = functionField([](const Vec3f& p) { return p.x; }, {.range = [](const Box& b) {
                                        return Interval{b.min.x, b.max.x};
                                      }});
  const std::string path = maskFile("growth", x, {{-2, -2, -2}, {2, 2, 2}});
  const auto masked = density("mask:" + path + ":growth:1,3");
  EXPECT_NEAR(masked->at({5, 2, 0}), 1.5, 1e-4);
  EXPECT_NEAR(masked->at({15, 0, 3}), 2.5, 1e-4);
  // Below 0 it counts as 0.
  EXPECT_EQ(masked->at({-5, 0, 0}), 1);
  EXPECT_EQ(masked->values(), density("mask:" + path + ":1,3")->values());
}

TEST_F(CloudFields, TheInsideOfALevelSetIsOne) {
  const auto bricks =
      bakeGrid(sphere({0.5f, 0, 0}, 0.3f),
               {.voxelSize = 0.05f, .box = {{0, -1, -1}, {1, 1, 1}}, .band = {-0.15f, 0.15f}});
  writeVdbFile(folder.file("mask.vdb"), {toVdb(*bricks, {"surface", VdbGridInfo::Class::levelSet})}, {});
  const auto masked = density("mask:" + folder.file("mask.vdb") + ":1,3");
  EXPECT_EQ(masked->at({10, 0, 0}), 3);
  EXPECT_EQ(masked->at({10, 8, 0}), 1);
  EXPECT_EQ(masked->at({-10, 0, 0}), 1);
}

TEST_F(CloudFields, AttributesSpreadFromTheSurface) {
  const std::string painted = paintedSphere();
  const auto closest = density("attribute:growth:1,2", painted);
  // growth is x at vertices, hence x / |x| inside; below 0 it counts as 0. Edges are 0.13 long, the grid of
  // look-ups 1/48.
  EXPECT_NEAR(closest->at({10, 0, 0}), 2, 0.02);
  EXPECT_NEAR(closest->at({8, 8, 0}), 1 + std::sqrt(0.5), 0.03);
  EXPECT_EQ(closest->at({-10, 4, 0}), 1);
  EXPECT_NEAR(density("attribute:growth:spheres:1,2", painted)->at({18, 0, 0}), 2, 0.05);
  const auto red = density("attribute:color.r:0,4", painted);
  EXPECT_EQ(red->at({0, 10, 0}), 4);
  EXPECT_EQ(red->at({0, -10, 0}), 0);
}

TEST_F(CloudFields, OfOneValueAreThatConstant) {
  const std::string common =
      "--resolution 40 --layers 2 --edge-thickness 5% --edge-variation 1 --amplitude-variation 0 ";
  const auto constants = grown(common +
                               "--amplitude 2% --frequency 5x --lacunarity 2 --roughness 0.5 --billow 0.7 "
                               "--billow-scale 0.9 --advect 1% --density 2");
  const auto fields =
      grown(common +
            "--amplitude height:0=2%,1=2% --frequency along:1,0,0:0=5x,1=5x --lacunarity height:0=2,1=2 "
            "--roughness height:0=0.5,1=0.5 --billow facing:0,1,0:-1=0.7,1=0.7 --billow-scale "
            "height:0=0.9,1=0.9 --advect height:0=1%,1=1% --density height:0=2,1=2");
  EXPECT_EQ(constants->values(), fields->values());
  EXPECT_EQ(constants->table(), fields->table());
}

TEST_F(CloudFields, OfNoiseLieBetweenTheirValuesAndReachBoth) {
  const auto noise = density("noise:4x,2:1,3");
  float least = 10, most = 0;
  for (int k = -8; k <= 8; ++k)
    for (int j = -8; j <= 8; ++j)
      for (int i = -8; i <= 8; ++i) {
        least = std::min(least, noise->at({i, j, k}));
        most = std::max(most, noise->at({i, j, k}));
      }
  EXPECT_GE(least, 1);
  EXPECT_LE(most, 3);
  // 17 voxels are nearly two waves of it: noise beyond its rms, of either sign.
  EXPECT_LT(least, 1.4f);
  EXPECT_GT(most, 2.6f);
}

TEST_F(CloudFields, MultiplyAsTheirValuesDo) {
  const auto height = density("height:0=1,1=3"), noise = density("noise:3x:0.5,2"),
             both = density("height:0=1,1=3*noise:3x:0.5,2"),
             three = density("2*height:0=1,1=3*noise:3x:0.5,2");
  for (int k = -6; k <= 6; k += 3)
    for (int j = -6; j <= 6; j += 2)
      for (int i = -6; i <= 6; i += 2) {
        const float product = height->at({i, j, k}) * noise->at({i, j, k});
        EXPECT_NEAR(both->at({i, j, k}), product, 1e-4f * product);
        EXPECT_NEAR(three->at({i, j, k}), 2 * product, 2e-4f * product);
      }
}

TEST_F(CloudFields, AmplitudeLeavesThePlainPartsPlain) {
  const std::string common = "--resolution 48 --layers 2 --edge-thickness 5% --amplitude ";
  const auto bare = grown(common + "0"), half = grown(common + "along:1,0,0:0.5=0,0.5=4%");
  double left = 0, right = 0;
  for (int k = -32; k <= 32; ++k)
    for (int j = -32; j <= 32; ++j)
      // Beyond the samples between which the second layer ends: four, of a sixth of its wave, 0.87 voxels.
      for (int i = 4; i <= 32; ++i) {
        left = std::max(left, double(std::abs(bare->at({-i, j, k}) - half->at({-i, j, k}))));
        right += half->at({i, j, k}) - bare->at({i, j, k});
      }
  // The layers' samples are rounded to 16 bits of ranges of up to 0.61 and 0.31: half a code, times (5/4)^3
  // for the weights of Catmull-Rom, and 15 for the slope of the edge.
  EXPECT_LT(left, (0.61 + 0.31) / 131070 * 1.96 * 15);
  // Bumps of mean height 0.8 x 4 % of 2 on half a sphere of radius 24 voxels: some 7000 voxels.
  EXPECT_GT(right, 3000);
}

TEST_F(CloudFields, EveryParameterTakesOneAndTheStatisticsTellTheirRanges) {
  grown(
      "--resolution 40 --layers 2 --edge-thickness height:0=4%,1=10% --amplitude height:0=1%,1=2% "
      "--frequency "
      "height:0=4x,1=6x --lacunarity height:0=2,1=2.5 --roughness height:0=0.4,1=0.5 --billow "
      "height:0=0.5,1=2 --billow-scale height:0=0.8,1=1.2 --advect height:0=0,1=2% --density height:0=1,1=2");
  const auto layers = stats()["layers"];
  ASSERT_EQ(layers.size(), 2u);
  // The longest side is 2; ranges are rounded outward.
  EXPECT_NEAR(double(layers[0]["amplitude_range"][0]), 0.02, 1e-6);
  EXPECT_NEAR(double(layers[0]["amplitude_range"][1]), 0.04, 1e-6);
  EXPECT_NEAR(double(layers[1]["amplitude_range"][1]), 0.04 * 0.5, 1e-6);
  EXPECT_NEAR(double(layers[1]["billow_range"][0]), 0.5, 1e-6);
  EXPECT_NEAR(double(layers[1]["billow_range"][1]), 2, 1e-6);
  EXPECT_NEAR(double(layers[1]["billow_scale_range"][1]), 1.2, 1e-6);
  EXPECT_NEAR(double(layers[0]["frequency"]), 3, 1e-5);
  EXPECT_NEAR(double(layers[1]["frequency"]), 3 * 2.5, 1e-4);
}

TEST_F(CloudFields, AdvectionStaysWhereItsStrengthIsNone) {
  const std::string common = "--resolution 40 --layers 1 --amplitude 0 --edge-thickness 5% ";
  const auto still = grown(common), carried = grown(common + "--advect along:1,0,0:0.5=0,0.6=4%");
  double left = 0, right = 0;
  for (int k = -24; k <= 24; ++k)
    for (int j = -24; j <= 24; ++j)
      for (int i = 6; i <= 24; ++i) {
        left += std::abs(still->at({-i, j, k}) - carried->at({-i, j, k}));
        right += std::abs(still->at({i, j, k}) - carried->at({i, j, k}));
      }
  EXPECT_LT(left, 1e-3);
  EXPECT_GT(right, 100);
}

TEST_F(CloudFields, NoisesAndTheirTimeAreChosen) {
  const std::string common = "--resolution 32 --layers 1 --edge-thickness 5% --amplitude 4% ";
  const auto perlin = grown(common);
  for (const std::string kind : {"simplex", "worley", "worley_difference", "value", "gabor", "fft"}) {
    EXPECT_NE(grown(common + "--noise " + kind)->values(), perlin->values()) << kind;
    EXPECT_EQ(stats()["layers"][0]["noise"], kind);
  }
  EXPECT_EQ(grown(common + "--noise perlin")->values(), perlin->values());
  const auto later = grown(common + "--noise-time 0.5 --noise-period 4");
  EXPECT_NE(later->values(), perlin->values());
  const auto round = grown(common + "--noise-time 4.5 --noise-period 4");
  for (int i = -20; i <= 20; ++i)
    for (int j = -20; j <= 20; ++j) EXPECT_NEAR(round->at({i, j, 3}), later->at({i, j, 3}), 0.01);
}

TEST_F(CloudFields, MasksBesideTheCloudAreNotedAndTheirBackgroundCounts) {
  const auto beside = density("mask:" + maskFile("growth", 1.0f, {{5, 5, 5}, {6, 6, 6}}) + ":1,3");
  EXPECT_EQ(beside->at({0, 0, 0}), 1);
  EXPECT_NE(notes.find("warning: --density: mask"), std::string::npos) << notes;
  EXPECT_NE(notes.find("counts as 0"), std::string::npos) << notes;
  const auto part = density("mask:" + maskFile("growth", 1.0f, {{-3, -3, -3}, {0, 3, 3}}) + ":1,3");
  EXPECT_EQ(part->at({-8, 0, 0}), 3);
  EXPECT_EQ(part->at({8, 0, 0}), 1);
  // Voxel centres from -3.1 to 0.1 or so span 55 % of the box from -1 to 1.
  EXPECT_NE(notes.find("% of the shape's box"), std::string::npos) << notes;
  EXPECT_EQ(notes.find("warning"), std::string::npos) << notes;
  density("mask:" + maskFile("growth", 1.0f, {{-3, -3, -3}, {3, 3, 3}}) + ":1,3");
  EXPECT_EQ(notes.find("mask"), std::string::npos) << notes;
}

TEST_F(CloudFields, FrequenciesThatVoxelsCannotHoldAreNotedWithTheLimit) {
  // Voxels of 2 / 20: 1 / (4 x 0.1) = 2.5 cycles per world unit. The second layer has 1.2 x 3.
  grown("--resolution 20 --layers 2 --amplitude 1% --frequency 1.2 --lacunarity 3");
  EXPECT_EQ(notes.find("layer 1"), std::string::npos) << notes;
  EXPECT_NE(notes.find("warning: layer 2 has bumps of frequency 3.6, and voxels of 0.1 hold at most 2.5"),
            std::string::npos)
      << notes;
}

TEST_F(CloudFields, FilesThatDoNotFitAreRefusedAndSayWhatIsThere) {
  const auto refused = [&](const std::string& input, const std::string& options,
                           const std::vector<std::string>& words) {
    const ProgramResult result = run(input, options);
    EXPECT_EQ(result.exitCode, 1) << options;
    for (const std::string& word : words)
      EXPECT_NE(result.errors.find(word), std::string::npos) << options << ": " << result.errors;
  };
  refused(paintedSphere(), "--billow attribute:grwoth:0,1",
          {"--billow", "grwoth", "growth", "color.r", "color.g", "color.b"});
  refused(kSphere, "--billow attribute:growth:0,1", {"--billow", "growth"});
  refused(kSphere, "--frequency height:0=1x,1=300x", {"--frequency", "256 times"});
  refused(kSphere, "--amplitude mask:missing.vdb:0,1%", {"--amplitude", "missing.vdb"});
  const std::string mask = maskFile("growth", 1.0f, {{-3, -3, -3}, {3, 3, 3}});
  refused(kSphere, "--amplitude mask:" + mask + ":growht:0,1%",
          {"--amplitude", "mask.vdb", "growht", "growth"});
  const auto x = bakeGrid(1.0f, {.voxelSize = 0.1f, .box = {{0, 0, 0}, {1, 1, 1}}});
  writeVdbFile(folder.file("v.vdb"), {toVdb(VectorGrids{x, x, x}, {"v"})}, {});
  refused(kSphere, "--amplitude mask:" + folder.file("v.vdb") + ":0,1%",
          {"--amplitude", "v.vdb", "'v'", "vec3s"});
  refused(kSphere, "--amplitude mask:" + folder.file("v.vdb") + ":v:0,1%", {"--amplitude", "'v'", "vec3s"});
  EXPECT_FALSE(std::filesystem::exists(folder.file("out.vdb")));
}

TEST(CloudFieldOptions, AreUsageErrorsThatNameTheOptionAndWhatIsAllowed) {
  const std::pair<std::string, std::string> bad[] = {
      {"--amplitude height:0=-1%,1=2%", "'-1%' a length >= 0"},
      {"--amplitude height:0=1%", "two stops"},
      {"--amplitude height:0=1%,0.5=2%,0.4=1%", "0.4 comes after 0.5"},
      {"--amplitude height:0=1%,1=2x", "'2x' a length"},
      {"--amplitude height:0=1%,1", "AT=LENGTH"},
      {"--amplitude height:", "AT=LENGTH"},
      {"--amplitude height:a=1%,1=2%", "a place from"},
      {"--amplitude hieght:0=1%,1=2%", "did you mean height:?"},
      {"--amplitude along:0,1:0=1%,1=2%", "X,Y,Z"},
      {"--amplitude along:0,0,0:0=1%,1=2%", "not 0"},
      {"--amplitude facing:0,1,0:-2=1%,1=2%", "from -1 to 1"},
      {"--amplitude facing:0,1,0", "AT=LENGTH"},
      {"--frequency height:0=0x,1=5x", "cycles > 0"},
      {"--lacunarity height:0=2,1=101", "'101' a number from 0.1 to 100"},
      {"--roughness height:0=2,1=nan", "'nan' a number from 0 to 10"},
      {"--billow height:0=2,1=101", "'101' a number from 0 to 100"},
      {"--billow-scale height:0=0,1=1", "'0' a number from 0.01"},
      {"--edge-thickness height:0=0%,1=1%", "a length > 0"},
      {"--density height:0=-1,1=1", "'-1' a number from 0 to 1000"},
      {"--advect height:0=-1%,1=1%", "a length >= 0"},
      {"--amplitude mask:file.txt:0,1%", "mask:FILE.vdb:"},
      {"--amplitude mask:file.vdb", "mask:FILE.vdb:"},
      {"--amplitude mask:file.vdb:1%", "two values"},
      {"--amplitude mask:file.vdb:0,1%,2%", "two values"},
      {"--amplitude mask:file.vdb:0,-1%", "'-1%' a length"},
      {"--amplitude attribute:growth", "attribute:NAME:"},
      {"--amplitude attribute::0,1%", "attribute:NAME:"},
      {"--amplitude attribute:growth:0", "two values"},
      {"--amplitude noise:0x:0,1%", "a frequency above 0"},
      {"--amplitude noise:3x,9:0,1%", "octaves from 1 to 8"},
      {"--amplitude noise:3x", "two values"},
      {"--amplitude 2%*height:0=1%,1=2", "'1%' a number from 0"},
      {"--amplitude 2%*", "a number from 0"},
      {"--noise-period 2", "--noise-time"},
      {"--noise-time soon", "a number from"},
      {"--noise perln", "worley_difference"},
  };
  for (const auto& [options, allowed] : bad) {
    const ProgramResult result = runProgram("cloud " + kSphere + " -o unused.vdb " + options);
    EXPECT_EQ(result.exitCode, 2) << options;
    EXPECT_NE(result.errors.find(options.substr(0, options.find(' '))), std::string::npos)
        << options << ": " << result.errors;
    EXPECT_NE(result.errors.find(allowed), std::string::npos) << options << ": " << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test
