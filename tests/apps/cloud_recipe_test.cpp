// Recipes of layers, through the program.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

/// Radius 1 about the origin.
const std::string kSphere = ownData("data/sphere_uv.obj");

class CloudRecipe : public testing::Test {
 protected:
  ProgramResult run(const std::string& recipe, const std::string& options,
                    const std::string& input = kSphere) {
    std::ofstream(folder.file("recipe.toml")) << recipe;
    return runProgram("cloud " + input + " -o " + folder.file("out.vdb") + " --stats " +
                      folder.file("stats.json") + " --edge-thickness 5% " +
                      (recipe.empty() ? "" : "--recipe " + folder.file("recipe.toml") + " ") + options);
  }

  std::shared_ptr<const BrickGrid> grown(const std::string& recipe, const std::string& options,
                                         const std::string& input = kSphere) {
    const ProgramResult result = run(recipe, options, input);
    EXPECT_EQ(result.exitCode, 0) << recipe << options << ": " << result.errors;
    notes = result.errors;
    if (result.exitCode != 0) return bakeGrid(0.0f, {.voxelSize = 1, .box = {{0, 0, 0}, {1, 1, 1}}});
    layers = nlohmann::json::parse(textOf(folder.file("stats.json")))["layers"];
    return toBricks(readScalarGrid(folder.file("out.vdb"), "density"));
  }

  /// Sum of the density where `side` times y is at least 4 voxels.
  static double mass(const BrickGrid& grid, int side) {
    double sum = 0;
    for (int k = -32; k <= 32; ++k)
      for (int j = 4; j <= 32; ++j)
        for (int i = -32; i <= 32; ++i) sum += grid.at({i, side * j, k});
    return sum;
  }

  TemporaryFolder folder;
  nlohmann::json layers;
  std::string notes;
};

TEST_F(CloudRecipe, OfLayersWithoutKeysIsTheFractalForm) {
  const std::string common =
      "--resolution 40 --amplitude 3% --amplitude-variation 0 --roughness 0.6 --noise value --seed 5 ";
  const auto fractal = grown("", common + "--layers 2"), recipe = grown("[[layer]]\n[[layer]]\n", common);
  EXPECT_EQ(fractal->values(), recipe->values());
  // What the fractal form gives a layer, said again by the recipe.
  const auto same = grown(
      "[[layer]]\nfrequency = \"4.4x\"\nnoise = \"value\"\n[[layer]]\namplitude = \"1.8%\"\nbillow = 0.5\n",
      common);
  for (int i = -30; i <= 30; ++i)
    for (int j = -30; j <= 30; ++j) EXPECT_NEAR(same->at({i, j, 2}), fractal->at({i, j, 2}), 1e-3);
}

TEST_F(CloudRecipe, SetsEveryLayerOnItsOwn) {
  grown(R"([[layer]]
noise = "worley"
amplitude = "4%"
frequency = 1.5
seed = 3

[[layer]]
noise = "fft"
spectrum = { exponent = 3, lowest = 1, highest = 2, resolution = 64 }
amplitude = 0.02
frequency = "6x"
billow = 0.5
billow_scale = 0.7
time = 0.25
period = 8

[[layer]]
octaves = 3
octave_lacunarity = 1.5
octave_roughness = 0.4
frequency = 2
amplitude = "height:0=0,1=1%"
)",
        "--resolution 40");
  ASSERT_EQ(layers.size(), 3u);
  EXPECT_EQ(layers[0]["noise"], "worley");
  EXPECT_NEAR(double(layers[0]["amplitude"]), 0.08, 1e-6);
  EXPECT_NEAR(double(layers[0]["frequency"]), 1.5, 1e-6);
  EXPECT_EQ(layers[1]["noise"], "fft");
  EXPECT_NEAR(double(layers[1]["amplitude"]), 0.02, 1e-7);
  EXPECT_NEAR(double(layers[1]["billow_range"][1]), 0.5, 1e-6);
  EXPECT_NEAR(double(layers[1]["billow_scale_range"][0]), 0.7, 1e-6);
  EXPECT_EQ(layers[2]["noise"], "perlin, 3 octaves");
  EXPECT_NEAR(double(layers[2]["amplitude_range"][0]), 0, 1e-6);
  EXPECT_NEAR(double(layers[2]["amplitude_range"][1]), 0.02, 1e-6);
  EXPECT_NEAR(double(layers[2]["frequency"]), 2, 1e-5);
}

TEST_F(CloudRecipe, OctavesKeepTheRms) {
  // The mean of |N| over the sphere: 0.8 for a Gaussian of unit rms, and about as much for Perlin noise.
  const std::string common = "--resolution 48";
  grown("[[layer]]\nfrequency = 3\namplitude = 0.05\n", common);
  const double one = layers[0]["mean_displacement"];
  grown("[[layer]]\nfrequency = 3\namplitude = 0.05\noctaves = 3\noctave_roughness = 0.8\n", common);
  EXPECT_NEAR(double(layers[0]["mean_displacement"]) / one, 1, 0.1);
}

TEST_F(CloudRecipe, GrowsInADirection) {
  const std::string layer = "[[layer]]\namplitude = \"5%\"\n", common = "--resolution 40";
  const auto bare = grown("", common + " --layers 1 --amplitude 0"), even = grown(layer, common);
  const auto up = grown(layer + "direction = [0, 1, 0]\n", common);
  const auto tilted = grown(layer + "direction = [0, 1, 0]\nbias = 0.5\n", common);
  const double all = mass(*even, -1) - mass(*bare, -1);
  ASSERT_GT(all, 1000);
  // The cosine over the lower half of a sphere is -1/2 in the mean: a quarter of the amplitude is left, or
  // with half the bias five eighths; parts nearest to the equator, which are not counted, would add to it.
  EXPECT_NEAR((mass(*up, -1) - mass(*bare, -1)) / all, 0.25, 0.08);
  EXPECT_NEAR((mass(*tilted, -1) - mass(*bare, -1)) / all, 0.625, 0.08);
  EXPECT_NEAR((mass(*up, 1) - mass(*bare, 1)) / (mass(*even, 1) - mass(*bare, 1)), 0.75, 0.08);
}

TEST_F(CloudRecipe, MasksALayer) {
  const std::string layer = "[[layer]]\namplitude = \"5%\"\n", common = "--resolution 40";
  const auto bare = grown("", common + " --layers 1 --amplitude 0"), even = grown(layer, common);
  const auto ramp = grown(layer + "mask = \"height:0.5=0,0.5=1\"\n", common);
  // The layers' samples are rounded to 16 bits of their range.
  const double rounding = 1e-5 * mass(*bare, -1);
  EXPECT_NEAR(mass(*ramp, -1), mass(*bare, -1), rounding);
  EXPECT_NEAR(mass(*ramp, 1), mass(*even, 1), 0.01 * mass(*even, 1));

  const auto bricks = bakeGrid(1.0f, {.voxelSize = 0.1f, .box = {{-2, 0, -2}, {2, 2, 2}}});
  writeVdbFile(folder.file("upper half.vdb"), {toVdb(*bricks, {"growth", VdbGridInfo::Class::fogVolume})},
               {});
  const auto masked = grown(layer + "mask = \"" + folder.file("upper half.vdb") + "\"\n", common);
  EXPECT_NEAR(mass(*masked, -1), mass(*bare, -1), rounding);
  EXPECT_NEAR(mass(*masked, 1), mass(*even, 1), 0.01 * mass(*even, 1));
  const auto named = grown(layer + "mask = \"" + folder.file("upper half.vdb") + ":growth\"\n", common);
  EXPECT_EQ(named->values(), masked->values());
}

TEST_F(CloudRecipe, LayersAsTypedCutTheRecipeShortOrGoOnFromIt) {
  const std::string recipe = "[[layer]]\namplitude = 0.06\n[[layer]]\namplitude = 0.05\n";
  grown(recipe, "--resolution 32 --layers 1");
  ASSERT_EQ(layers.size(), 1u);
  EXPECT_NEAR(double(layers[0]["amplitude"]), 0.06, 1e-6);
  grown(recipe,
        "--resolution 32 --layers 3 --amplitude 0.04 --amplitude-variation 0 --roughness 0.5 --frequency 1 "
        "--lacunarity 2");
  ASSERT_EQ(layers.size(), 3u);
  EXPECT_NEAR(double(layers[1]["amplitude"]), 0.05, 1e-6);
  // The third layer of the fractal form: 0.04 / 2 / 2, 1 x 2 x 2.
  EXPECT_NEAR(double(layers[2]["amplitude"]), 0.01, 1e-6);
  EXPECT_NEAR(double(layers[2]["frequency"]), 4, 1e-5);
}

TEST_F(CloudRecipe, ThoseOfTheDocumentationAreRead) {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(ownData("docs/recipes"))) {
    // All of it is read and checked, one layer grown.
    const ProgramResult result = run("", "--resolution 24 --layers 1 --recipe " + entry.path().string());
    EXPECT_EQ(result.exitCode, 0) << entry.path() << ": " << result.errors;
    ++count;
  }
  EXPECT_GE(count, 1);
}

TEST_F(CloudRecipe, IsToldWithVerbose) {
  grown("[[layer]]\nnoise = \"gabor\"\namplitude = \"height:0=0.01,1=0.02\"\n", "--resolution 24 --verbose");
  EXPECT_NE(notes.find("layer 1: gabor, frequency 2.2, amplitude 0.01 to 0.02, billow 0.5"),
            std::string::npos)
      << notes;
}

TEST_F(CloudRecipe, ThatIsNotThereIsNamed) {
  const ProgramResult missing = runProgram("cloud " + kSphere + " -o unused.vdb --recipe missing.toml");
  EXPECT_EQ(missing.exitCode, 2);
  EXPECT_NE(missing.errors.find("missing.toml"), std::string::npos) << missing.errors;
}

TEST_F(CloudRecipe, ASpectrumForAnotherNoiseIsNamedWithThePlace) {
  const ProgramResult spectrum = run("[[layer]]\nspectrum = { lowest = 1 }\n", "");
  EXPECT_EQ(spectrum.exitCode, 2);
  EXPECT_NE(spectrum.errors.find("recipe.toml:2:12: error: only noise = \"fft\" has a spectrum"),
            std::string::npos)
      << spectrum.errors;
}

TEST_F(CloudRecipe, WorksWithPaintAndMaskAllTheWayToAPicture) {
  // The project's painted mesh: `amplitude` rises from 0 at its base to 1, `billow` from 0 on its right to 1
  // on its left. The mask is the half in front.
  const std::string painted = ownData("data/cloud_base_painted.ply");
  const Box box = boundingBox(readMesh(painted));
  Box half = box.expanded(0.3f);
  half.min.z = box.center().z;
  const auto bricks = bakeGrid(1.0f, {.voxelSize = 0.05f, .box = half});
  writeVdbFile(folder.file("mask.vdb"), {toVdb(*bricks, {"front", VdbGridInfo::Class::fogVolume})}, {});
  const std::string recipe =
      "[[layer]]\nfrequency = \"6x\"\namplitude = \"attribute:amplitude:0,4%\"\n"
      "[[layer]]\nnoise = \"worley\"\namplitude = \"1%\"\nbillow = \"attribute:billow:0,1\"\nmask = \"" +
      folder.file("mask.vdb") + "\"\n";
  const ProgramResult result = run(recipe, "--resolution 40", painted);
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const auto stats = nlohmann::json::parse(textOf(folder.file("stats.json")));
  const double longest = box.longestSide();
  EXPECT_NEAR(double(stats["layers"][0]["amplitude_range"][0]), 0, 1e-6);
  EXPECT_NEAR(double(stats["layers"][0]["amplitude_range"][1]), 0.04 * longest, 1e-5);
  EXPECT_NEAR(double(stats["layers"][1]["amplitude_range"][0]), 0, 1e-6);
  EXPECT_NEAR(double(stats["layers"][1]["billow_range"][1]), 1, 1e-6);
  // Only the front half has a second layer; the other half is not even sampled.
  const double masked = stats["layers"][1]["active_voxels"];
  grown(recipe.substr(0, recipe.find("mask")), "--resolution 40", painted);
  EXPECT_NEAR(masked / double(layers[1]["active_voxels"]), 0.5, 0.15);
  const ProgramResult picture =
      runProgram("render " + folder.file("out.vdb") + " -o " + folder.file("out.exr") + " --size 32x32");
  EXPECT_EQ(picture.exitCode, 0) << picture.errors;
}

}  // namespace
}  // namespace nephele::test
