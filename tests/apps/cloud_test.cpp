// The verb cloud, through the program.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

const std::string kSphere = ownData("data/sphere_uv.obj");

TEST(CloudVerb, WritesFogAndSurfaceWithStatistics) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram(
      "cloud " + kSphere + " -o " + folder.file("cloud.vdb") + " --surface " + folder.file("surface.vdb") +
      " --resolution 48 --layers 2 --seed 5 --stats " + folder.file("stats.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;

  const VdbGrid cloud = readScalarGrid(folder.file("cloud.vdb"), "density"),
                level = readScalarGrid(folder.file("surface.vdb"), "surface");
  const VdbGridInfo density = describe(cloud), surface = describe(level);
  EXPECT_EQ(density.gridClass, VdbGridInfo::Class::fogVolume);
  EXPECT_EQ(density.background, 0);
  EXPECT_GE(valueRange(cloud).min, 0);
  EXPECT_EQ(valueRange(cloud).max, 1);
  EXPECT_FALSE(density.halfFloat);
  EXPECT_EQ(density.metadata.at("seed"), "5");
  EXPECT_EQ(surface.gridClass, VdbGridInfo::Class::levelSet);
  EXPECT_LT(valueRange(level).min, 0);

  const auto stats = nlohmann::json::parse(textOf(folder.file("stats.json")));
  ASSERT_EQ(stats["layers"].size(), 2u);
  for (const char* key : {"amplitude", "frequency", "voxel_size", "active_voxels", "unconverged_fraction",
                          "mean_displacement", "seconds"})
    EXPECT_TRUE(stats["layers"][1].contains(key)) << key;
  // Fractal form: amplitude falls by --roughness 0.65, frequency rises by --lacunarity 2.1.
  EXPECT_NEAR(double(stats["layers"][1]["amplitude"]) / double(stats["layers"][0]["amplitude"]), 0.65, 1e-4);
  EXPECT_NEAR(double(stats["layers"][1]["frequency"]) / double(stats["layers"][0]["frequency"]), 2.1, 1e-4);
  EXPECT_LE(double(stats["layers"][1]["unconverged_fraction"]), 0.01);
}

TEST(CloudVerb, IsTheSameAtAnyThreadCount) {
  const TemporaryFolder folder;
  const auto grown = [&](const std::string& options) {
    const std::string path = folder.file("cloud.vdb");
    const ProgramResult result =
        runProgram("cloud " + kSphere + " -o " + path + " --resolution 40 --layers 2 " + options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return toBricks(readScalarGrid(path));
  };
  const auto one = grown("--threads 1"), two = grown("--threads 2"), four = grown("--threads 4");
  EXPECT_EQ(one->values(), two->values());
  EXPECT_EQ(one->values(), four->values());
  EXPECT_EQ(one->table(), four->table());
  EXPECT_NE(one->values(), grown("--threads 1 --seed 9")->values());
}

TEST(CloudVerb, IsTheSameFileEachTime) {
  const TemporaryFolder folder;
  const std::string path = folder.file("cloud.vdb");
  const auto written = [&] {
    EXPECT_EQ(runProgram("cloud " + kSphere + " -o " + path + " --resolution 40 --layers 2").exitCode, 0);
    return textOf(path);
  };
  EXPECT_TRUE(written() == written());
}

TEST(CloudVerb, GrowsOnALevelSetAsOnItsMesh) {
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram("levelset " + kSphere + " -o " + folder.file("in.vdb") + " --resolution 64").exitCode,
            0);
  const auto volumeOf = [&](const std::string& input) {
    // World units, since the box of the level set's surface need not equal that of the mesh.
    const ProgramResult result = runProgram("cloud " + input + " -o " + folder.file("out.vdb") +
                                            " --voxel-size 0.04 --amplitude 0.04 --frequency 3 --layers 2"
                                            " --edge-thickness 0.04");
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    double sum = 0;
    const auto bricks = toBricks(readScalarGrid(folder.file("out.vdb")));
    for (int k = -40; k <= 40; ++k)
      for (int j = -40; j <= 40; ++j)
        for (int i = -40; i <= 40; ++i) sum += bricks->at({i, j, k});
    return sum;
  };
  const double mesh = volumeOf(kSphere), levelSet = volumeOf(folder.file("in.vdb"));
  EXPECT_GT(mesh, 0);
  EXPECT_NEAR(levelSet / mesh, 1.0, 0.01);
}

/// The layers of a cloud on the sphere, as the statistics tell them.
nlohmann::json layersOf(const std::string& options) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram("cloud " + kSphere + " -o " + folder.file("cloud.vdb") +
                                          " --stats " + folder.file("stats.json") + " " + options);
  EXPECT_EQ(result.exitCode, 0) << options << ": " << result.errors;
  EXPECT_EQ(result.errors.find("warning"), std::string::npos) << result.errors;
  return nlohmann::json::parse(textOf(folder.file("stats.json")))["layers"];
}

TEST(CloudVerb, HasAsManyLayersAsItsVoxelsShow) {
  // Four voxels to a wave: frequencies up to a quarter of the resolution, 4.4, 9.24, 19.4 waves along the
  // longest side.
  EXPECT_EQ(layersOf("--resolution 36").size(), 1u);
  EXPECT_EQ(layersOf("--resolution 38").size(), 2u);
  EXPECT_EQ(layersOf("--resolution 76").size(), 2u);
  EXPECT_EQ(layersOf("--resolution 79").size(), 3u);
  // At least one, of however few voxels.
  EXPECT_EQ(layersOf("--resolution 38 --frequency 9x").size(), 1u);
  EXPECT_EQ(layersOf("--resolution 79 --layers 2").size(), 2u);
  // The coarse cloud has the first layers of the fine one.
  const auto coarse = layersOf("--resolution 38"), fine = layersOf("--resolution 79");
  for (std::size_t i = 0; i < coarse.size(); ++i)
    for (const char* key : {"amplitude_range", "frequency"}) EXPECT_EQ(coarse[i][key], fine[i][key]) << i;
}

TEST(CloudVerb, IsCalmInSomePartsAndRoughInOthers) {
  const auto rangeOf = [](const std::string& options) {
    return layersOf("--resolution 38 " + options)[0]["amplitude_range"].get<std::array<double, 2>>();
  };
  const auto [calm, rough] = rangeOf("--amplitude 0.05 --amplitude-variation 0.8");
  EXPECT_NEAR(calm, 0.05 * (1 - 0.8), 0.05 * 0.3);
  EXPECT_NEAR(rough, 0.05 * (1 + 0.8 / 2), 0.05 * 0.3);
  EXPECT_GE(calm, 0.05 * (1 - 0.8) - 1e-6);
  EXPECT_LE(rough, 0.05 * (1 + 0.8 / 2) + 1e-6);
  const auto [low, high] = rangeOf("--amplitude 0.05 --amplitude-variation 0");
  EXPECT_FLOAT_EQ(float(low), 0.05f);
  EXPECT_FLOAT_EQ(float(high), 0.05f);
  // What varies by itself is taken as it is.
  const auto [least, most] = rangeOf("--amplitude height:0=0.04,1=0.06 --amplitude-variation 1");
  EXPECT_FLOAT_EQ(float(least), 0.04f);
  EXPECT_FLOAT_EQ(float(most), 0.06f);
}

TEST(CloudVerb, HasThinVeilsBesideSharpEdges) {
  const TemporaryFolder folder;
  // Without bumps the density across the edge of a sphere of radius 1 tells how wide the edge is.
  const auto grown = [&](const std::string& options) {
    const ProgramResult result =
        runProgram("cloud " + kSphere + " -o " + folder.file("cloud.vdb") +
                   " --resolution 64 --layers 1 --amplitude 0 --edge-thickness 0.1 " + options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return describe(readScalarGrid(folder.file("cloud.vdb"), "density"));
  };
  const auto radiusOf = [](const VdbGridInfo& info) { return info.indexMax.y / 32.0; };
  // Half of the edge is outside: 0.05, or at most 2.5 times that; to a voxel, of 1/32.
  EXPECT_NEAR(radiusOf(grown("--edge-variation 1")), 1.05, 1.0 / 32);
  const double veil = radiusOf(grown("--edge-variation 2.5"));
  EXPECT_GT(veil, 1.05 + 1.0 / 64);
  EXPECT_LE(veil, 1.125 + 1.0 / 32);
}

/// The density of a cloud without an input, 1 world unit large, in voxels of 1/24.
std::shared_ptr<const BrickGrid> generated(const std::string& options) {
  const TemporaryFolder folder;
  const std::string path = folder.file("cloud.vdb");
  const ProgramResult result =
      runProgram("cloud -o " + path + " --resolution 24 --layers 1 --amplitude 0.5% " + options);
  EXPECT_EQ(result.exitCode, 0) << options << ": " << result.errors;
  return toBricks(readScalarGrid(path, "density"));
}

TEST(CloudVerb, GrowsCloudsOfEverySpeciesWithoutAnInput) {
  for (const std::string species : {"humilis", "mediocris", "congestus"}) {
    const auto grid = generated("--species " + species + " --shape-seed 7");
    // 0.1 above the middle of the base every cloud is solid.
    EXPECT_EQ(grid->at({0, 3, 0}), 1) << species;
  }
}

TEST(CloudVerb, MakesTheShapeOfItsSeed) {
  const auto first = generated("--species humilis --shape-seed 7 --threads 1");
  EXPECT_EQ(first->values(), generated("--species humilis --shape-seed 7")->values());
  EXPECT_NE(first->values(), generated("--species humilis --shape-seed 8")->values());
}

TEST(CloudVerb, CutsTheBaseOfGeneratedCloudsUnlessToldNotTo) {
  const auto sumBelowGround = [](const BrickGrid& grid) {
    double sum = 0;
    for (int k = -15; k <= 15; ++k)
      for (int j = -15; j <= 0; ++j)
        for (int i = -15; i <= 15; ++i) sum += grid.at({i, j, k});
    return sum;
  };
  // No density below 1 % of the longest side.
  EXPECT_EQ(sumBelowGround(*generated("--species humilis")), 0);
  EXPECT_GT(sumBelowGround(*generated("--species humilis --flat-base off")), 0);
}

TEST(CloudVerb, WritesTheShapeThatItGrowsOn) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram(
      "cloud --species humilis --shape-seed 3 --shape-size 50 --resolution 24 --layers 1 --amplitude 0 -o " +
      folder.file("out.vdb") + " --shape-mesh " + folder.file("shape.obj"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Box box = boundingBox(readMesh(folder.file("shape.obj")));
  EXPECT_NEAR(box.longestSide(), 50, 1.5);
  EXPECT_LT(box.size().y, 0.5f * box.longestSide());
}

TEST(CloudVerb, ShapesTheDensityAsAsked) {
  const TemporaryFolder folder;
  const auto grown = [&](const std::string& options) {
    const std::string path = folder.file("out.vdb");
    const ProgramResult result =
        runProgram("cloud " + kSphere + " -o " + path +
                   " --voxel-size 0.05 --layers 1 --amplitude 0 --edge-thickness 0.1 " + options);
    EXPECT_EQ(result.exitCode, 0) << options << ": " << result.errors;
    return toBricks(readScalarGrid(path, "density"));
  };
  // The unit sphere: heights 0 and 1 are y = -1 and 1. Voxel j lies at y = j / 20.
  EXPECT_NEAR(grown("--height-profile 0:1,0.5:0.5,1:0")->at({0, 5, 0}), 0.375, 1e-5);
  EXPECT_NEAR(grown("--thin-out 0.6")->at({0, 10, 0}), 0.7, 1e-5);
  EXPECT_EQ(grown("--thin-out 0.6,0.8")->at({0, 10, 0}), 1);
  const auto cut = grown("--flat-base -0.5,0.2");
  EXPECT_EQ(cut->at({0, -10, 0}), 0);
  EXPECT_NEAR(cut->at({0, -8, 0}), 0.5, 1e-5);
  EXPECT_EQ(cut->at({0, -5, 0}), 1);
  // Of the longest side, 2, above the lowest point, -1: no density below y = -0.5.
  EXPECT_NEAR(grown("--flat-base 25%,10%")->at({0, -8, 0}), 0.5, 1e-5);
  // At the surface t = 1/2 (the mesh is within 0.01 of the sphere, a tenth of the edge).
  EXPECT_NEAR(grown("--edge-falloff 2")->at({0, 20, 0}), 0.25, 0.1);
  EXPECT_NEAR(grown("--edge-falloff linear")->at({0, 20, 0}), 0.5, 0.1);
  const auto noisy = grown("--interior-noise 0.5,3");
  float least = 10, most = 0;
  for (int i = -10; i <= 10; ++i) {
    least = std::min(least, noisy->at({i, 0, 0}));
    most = std::max(most, noisy->at({i, 0, 0}));
  }
  EXPECT_GE(least, 0);
  EXPECT_LT(least, 0.8f);
  EXPECT_GT(most, 1.2f);
}

TEST(CloudVerb, NeedsAShapeFromOneSource) {
  const ProgramResult neither = runProgram("cloud -o unused.vdb");
  EXPECT_EQ(neither.exitCode, 2);
  EXPECT_NE(neither.errors.find("--species"), std::string::npos) << neither.errors;
  EXPECT_EQ(runProgram("cloud " + kSphere + " --species humilis -o unused.vdb").exitCode, 2);
  EXPECT_EQ(runProgram("cloud " + kSphere + " --shape-seed 3 -o unused.vdb").exitCode, 2);
}

TEST(CloudVerb, WithoutAmplitudeIsTheMesh) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") +
                 " --resolution 64 --layers 1 --amplitude 0 --stats " + folder.file("stats.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const auto stats = nlohmann::json::parse(textOf(folder.file("stats.json")));
  EXPECT_EQ(double(stats["layers"][0]["mean_displacement"]), 0);
}

TEST(CloudVerb, RefusesLayersThatReachFartherThanVoxelsAreNumbered) {
  const TemporaryFolder folder;
  for (const char* amplitude : {"1e10", "1e30"}) {
    const ProgramResult result = runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") +
                                            " --resolution 16 --layers 1 --amplitude " + amplitude);
    EXPECT_EQ(result.exitCode, 1);
    EXPECT_NE(result.errors.find("sphere_uv.obj: layers: they would reach"), std::string::npos)
        << result.errors;
  }
}

TEST(CloudVerb, SavesHalfFloatsOnRequest) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") + " --resolution 32 --layers 1 --half");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_TRUE(describe(readScalarGrid(folder.file("out.vdb"))).halfFloat);
}

TEST(CloudVerb, RefusesFogAsInput) {
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram("cloud " + kSphere + " -o " + folder.file("fog.vdb") + " --resolution 24 --layers 1")
                .exitCode,
            0);
  const ProgramResult result =
      runProgram("cloud " + folder.file("fog.vdb") + " -o " + folder.file("out.vdb"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("not a level set"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("fog.vdb"), std::string::npos) << result.errors;
}

TEST(CloudVerb, RefusesWorkThatDoesNotFitAndNamesTheOption) {
  const TemporaryFolder folder;
  for (const std::string options : {"--resolution 100000", "--resolution 24 --edge-thickness 500"}) {
    const ProgramResult result =
        runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") + " " + options);
    EXPECT_EQ(result.exitCode, 1) << options;
    EXPECT_NE(result.errors.find("--resolution"), std::string::npos) << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(CloudVerb, WindCarriesPartsOfItToTheLeeAndFartherAboveThanBelow) {
  const TemporaryFolder folder;
  // The means of x of both halves.
  const auto middles = [&](const std::string& options) {
    const std::string path = folder.file("cloud.vdb");
    const ProgramResult result =
        runProgram("cloud " + kSphere + " -o " + path + " --resolution 48 --layers 1 " + options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    const auto grid = toBricks(readScalarGrid(path));
    std::array<double, 2> sum{}, mass{};
    for (int k = -40; k <= 40; ++k)
      for (int j = -40; j <= 40; ++j)
        for (int i = -40; i <= 40; ++i) {
          const double density = double(grid->at({i, j, k}));
          sum[j > 0] += density * i;
          mass[j > 0] += density;
        }
    return std::array{sum[0] / mass[0], sum[1] / mass[1]};
  };
  const auto still = middles(""), sheared = middles("--wind 90,20%"), even = middles("--wind 90,20%,0");
  // From +x, hence towards -x; a fifth of the longest side is ten voxels, of which smooth noise lets go of a
  // part.
  EXPECT_LT(sheared[1], still[1] - 0.3);
  EXPECT_LT(even[0], sheared[0] - 0.2);
  // Means of the height: 0.25 of the whole way below, 0.75 above.
  const auto share = [&](std::size_t half) {
    return (sheared[half] - still[half]) / (even[half] - still[half]);
  };
  EXPECT_LT(share(0), 0.75 * share(1));
}

TEST(CloudVerb, WorksAtResolutionOne) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("cloud " + kSphere + " -o " + folder.file("out.vdb") + " --resolution 1 --layers 1");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
}

TEST(CloudVerb, BadOptionsAreUsageErrorsThatNameThem) {
  for (const std::string bad : {"--layers -1",
                                "--layers 99",
                                "--amplitude -1%",
                                "--frequency 0x",
                                "--billow -0.5",
                                "--billow nan",
                                "--renormalise maybe",
                                "--medial-smoothing 17",
                                "--edge-thickness 0",
                                "--voxel-size 0",
                                "--resolution 0",
                                "--species nimbus",
                                "--edge-falloff 0",
                                "--edge-falloff steep",
                                "--edge-falloff 11",
                                "--interior-noise -1",
                                "--interior-noise 0.5,",
                                "--interior-noise 0.5,0x",
                                "--interior-noise 3",
                                "--flat-base",
                                "--flat-base high",
                                "--flat-base 1%,0",
                                "--flat-base 1,2,3",
                                "--height-profile 0",
                                "--height-profile 1:1,0:1",
                                "--height-profile 0:-1",
                                "--height-profile 0:1,",
                                "--thin-out 1.5",
                                "--thin-out 0.5,1",
                                "--thin-out nan",
                                "--shape-mesh shape.vdb",
                                "--advect -1%",
                                "--wind 90",
                                "--wind 90,0%",
                                "--wind 90,5%,2",
                                "--advect-steps 0"}) {
    const ProgramResult result = runProgram("cloud " + kSphere + " -o unused.vdb " + bad);
    EXPECT_EQ(result.exitCode, 2) << bad;
    EXPECT_NE(result.errors.find(bad.substr(0, bad.find(' '))), std::string::npos)
        << bad << ": " << result.errors;
  }
}

TEST(CloudVerb, TakesEitherVoxelSizeOrResolution) {
  EXPECT_EQ(runProgram("cloud " + kSphere + " -o unused.vdb --voxel-size 0.1 --resolution 20").exitCode, 2);
}

}  // namespace
}  // namespace nephele::test
