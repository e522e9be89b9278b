// The verb render, through the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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

class RenderVerb : public testing::Test {
 protected:
  // A ball of radius 1 and density 1, as the grid `density` of a file.
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    writeVdbFile(fog(), {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string fog() { return folder_->file("fog.vdb"); }
  static inline TemporaryFolder* folder_ = nullptr;
};

// Rays are those of all pixels; of a draft, of those that are not like their neighbours.
TEST_F(RenderVerb, TakesQualitiesWhereNothingElseIsSaid) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("final.toml")) << "quality = \"final\"\n";
  std::ofstream(folder.file("two.toml")) << "samples = 2\n";
  const auto statsOf = [&](const std::string& options) {
    const ProgramResult result = runProgram("render " + fog() + " -o " + folder.file("a.exr") +
                                            " --size 32x24 --stats " + folder.file("s.json") + " " + options);
    EXPECT_EQ(result.exitCode, 0) << options << ": " << result.errors;
    return nlohmann::json::parse(textOf(folder.file("s.json")));
  };
  const auto raysOf = [&](const std::string& options) { return statsOf(options)["rays"].get<int>(); };
  constexpr int pixels = 32 * 24;
  EXPECT_EQ(raysOf(""), 4 * pixels);
  EXPECT_EQ(raysOf("--quality good"), 4 * pixels);
  EXPECT_LT(raysOf("--quality draft"), pixels);
  EXPECT_EQ(raysOf("--quality draft --adaptive 0"), pixels);
  EXPECT_EQ(raysOf("--quality draft --deep " + folder.file("d.exr")), pixels);
  EXPECT_EQ(raysOf("--quality draft --integrator path"), 16 * pixels);
  EXPECT_EQ(raysOf("--quality draft --integrator path --spp 3"), 3 * pixels);
  EXPECT_EQ(raysOf("--quality final"), 16 * pixels);
  EXPECT_EQ(raysOf("--samples 2 --quality final"), 2 * pixels);
  EXPECT_EQ(raysOf("--quality final --config " + folder.file("two.toml")), 2 * pixels);
  EXPECT_EQ(raysOf("--samples 3 --config " + folder.file("final.toml")), 3 * pixels);
  // Half a voxel against the standard step; and one that is given.
  const auto samplesOf = [&](const std::string& options) {
    return statsOf(options)["samples"].get<double>();
  };
  EXPECT_GT(samplesOf("--quality final --samples 4"), 1.2 * samplesOf("--quality good"));
  EXPECT_EQ(samplesOf("--quality final --samples 4 --step 0.2"), samplesOf("--quality good --step 0.2"));
  EXPECT_EQ(runProgram("render " + fog() + " -o " + folder.file("b.exr") + " --quality best").exitCode, 2);
  // Of the light: more directions give another picture, and the same ones the same.
  const auto redOf = [&](const std::string& options) {
    statsOf("--samples 1 --step 0.1 --adaptive 0 " + options);
    return readImage(folder.file("a.exr")).channel("R").values;
  };
  EXPECT_EQ(redOf("--quality draft --light-quality good"), redOf(""));
  EXPECT_EQ(redOf("--light-quality final"), redOf("--quality final"));
  EXPECT_NE(redOf("--quality draft"), redOf(""));
  EXPECT_EQ(runProgram("render " + fog() + " -o " + folder.file("b.exr") + " --light-quality 9").exitCode, 2);
}

TEST_F(RenderVerb, ShowsTinyAndVastThingsAsOthers) {
  const TemporaryFolder folder;
  const Mesh mesh = icosphere(1.0, 3);
  // Powers of two round nothing; the picture is kept in 11 bits.
  std::vector<std::vector<float>> clouds, surfaces;
  for (const int power : {0, -28, 28}) {
    Mesh scaled = mesh;
    for (Vec3d& p : scaled.positions) p = p * std::ldexp(1.0, power);
    writeMesh(folder.file("ball.ply"), scaled);
    const std::string look = " --size 24x16 --light-quality draft --aov none -o " + folder.file("a.exr");
    for (const std::string& call :
         {"cloud " + folder.file("ball.ply") + " --resolution 24 --layers 1 -o " + folder.file("c.vdb"),
          "render " + folder.file("c.vdb") + look}) {
      const ProgramResult result = runProgram(call);
      ASSERT_EQ(result.exitCode, 0) << result.errors;
    }
    clouds.push_back(readImage(folder.file("a.exr")).channel("R").values);
    const ProgramResult result = runProgram("render " + folder.file("ball.ply") + look);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    surfaces.push_back(readImage(folder.file("a.exr")).channel("R").values);
  }
  EXPECT_GT(*std::ranges::max_element(clouds[0]), 0.1f);
  for (const auto* pictures : {&clouds, &surfaces})
    for (const std::size_t other : {1, 2})
      for (std::size_t i = 0; i < (*pictures)[0].size(); ++i)
        EXPECT_NEAR((*pictures)[other][i], (*pictures)[0][i], 2e-3) << other << ", " << i;
}

TEST_F(RenderVerb, WritesAPictureAPreviewAndStatistics) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("render " + fog() + " -o " + folder.file("a.exr") + " --preview " + folder.file("a.png") +
                 " --size 64x48 --view 30,10 --aov Z,light --seed 5 --stats " + folder.file("s.json"));
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  const Image image = readImage(folder.file("a.exr"));
  EXPECT_EQ(image.width, 64);
  EXPECT_EQ(image.height, 48);
  for (const char* name : {"R", "G", "B", "A", "Z", "light_sun.R", "light_sky.B"})
    EXPECT_TRUE(image.find(name)) << name;
  // Framed: opaque in the middle, empty in the corners; premultiplied: no light without opacity.
  EXPECT_GT(image.at("A", 32, 24), 0.999f);
  EXPECT_EQ(image.at("A", 0, 0), 0.0f);
  EXPECT_EQ(image.at("R", 0, 0), 0.0f);
  EXPECT_EQ(readImage(folder.file("a.png")).width, 64);

  const auto stats = nlohmann::json::parse(textOf(folder.file("s.json")));
  EXPECT_EQ(stats["rays"], 64 * 48 * 4);
  EXPECT_GT(stats["samples"], 1000);
  EXPECT_EQ(stats["values_not_finite"], 0);
  EXPECT_GE(stats["light_seconds"], 0.0);
  EXPECT_GE(stats["march_seconds"], 0.0);
  // 150 / longest side, whose box is the ball's and a voxel around it.
  EXPECT_NEAR(stats["extinction"].get<double>(), 150 / 2.2, 2.5);
  bool seed = false;
  for (const std::string& line : describeImage(folder.file("a.exr"))) seed = seed || line == "seed: 5";
  EXPECT_TRUE(seed);
}

TEST_F(RenderVerb, TakesACameraAndAnExtinction) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram(
      "render " + fog() + " -o " + folder.file("a.exr") +
      " --size 3x3 --camera-position 0,0,9 --look-at 0,0,0 --fov 0.3 --extinction 0.4 --samples 1");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  // Beer's law through the middle of the ball.
  EXPECT_NEAR(readImage(folder.file("a.exr")).at("A", 1, 1), 1 - std::exp(-0.8f), 0.006f);
}

TEST_F(RenderVerb, MakesTheSamePictureAtAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const std::string options = "render " + fog() + " --size 40x30 --quiet -o ";
  ASSERT_EQ(runProgram(options + folder.file("one.exr") + " --threads 1").exitCode, 0);
  ASSERT_EQ(runProgram(options + folder.file("all.exr")).exitCode, 0);
  const Image one = readImage(folder.file("one.exr")), all = readImage(folder.file("all.exr"));
  for (std::size_t c = 0; c != one.channels.size(); ++c)
    EXPECT_EQ(one.channels[c].values, all.channels[c].values);
}

TEST_F(RenderVerb, MarchesFewerRaysForAnAdaptivePicture) {
  const TemporaryFolder folder;
  const std::string start = "render " + fog() + " --size 160x120 --extinction 4 --octaves 1 -o ";
  const auto image = [&](const std::string& options) {
    const ProgramResult result =
        runProgram(start + folder.file("a.exr") + " --stats " + folder.file("s.json") + options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(folder.file("a.exr"));
  };
  const Image full = image(""), adaptive = image(" --adaptive 0.05");
  EXPECT_LT(nlohmann::json::parse(textOf(folder.file("s.json")))["rays"].get<int>(), 160 * 120 * 4 / 2);
  for (const char* name : {"R", "A"}) {
    const auto &exact = full.channel(name).values, &near = adaptive.channel(name).values;
    const float most = *std::max_element(exact.begin(), exact.end());
    for (std::size_t i = 0; i != exact.size(); ++i) ASSERT_NEAR(near[i], exact[i], 0.05f * most) << name;
  }
}

TEST_F(RenderVerb, PathTracesTheSamePicture) {
  const TemporaryFolder folder;
  const std::string start = "render " + fog() +
                            " --size 24x18 --quiet --sky 0,0,0 --extinction 2 --albedo 0.9,0.8,0.7 --phase "
                            "hg:0.3 --aov Z,light -o ";
  const std::string path = " --integrator path --spp 200";
  ASSERT_EQ(runProgram(start + folder.file("march.exr")).exitCode, 0);
  ASSERT_EQ(runProgram(start + folder.file("path.exr") + path + " --stats " + folder.file("s.json")).exitCode,
            0);
  ASSERT_EQ(runProgram(start + folder.file("once.exr") + path + " --scatterings 1").exitCode, 0);
  ASSERT_EQ(runProgram(start + folder.file("march_once.exr") + " --octaves 1").exitCode, 0);
  const auto sum = [&](const std::string& file, const std::string& channel) {
    const Image image = readImage(folder.file(file));
    double total = 0;
    for (const float value : image.channel(channel).values)
      if (std::isfinite(value)) total += double(value);
    return total;
  };
  // 200 paths of some 200 covered pixels leave less than 1 % of noise.
  for (const char* channel : {"R", "B"}) {
    EXPECT_NEAR(sum("march.exr", channel) / sum("path.exr", channel), 1, 0.08);
    EXPECT_NEAR(sum("march_once.exr", channel) / sum("once.exr", channel), 1, 0.03);
  }
  EXPECT_EQ(sum("path.exr", "Z"), sum("march.exr", "Z"));
  EXPECT_GT(sum("path.exr", "R"), 1.2 * sum("once.exr", "R"));
  EXPECT_EQ(nlohmann::json::parse(textOf(folder.file("s.json")))["rays"], 24 * 18 * 200);
}

TEST_F(RenderVerb, RefusesWrongUseWithTheOptionAndWhatIsAllowed) {
  const TemporaryFolder folder;
  const std::string start = "render " + fog() + " -o " + folder.file("a.exr") + " ";
  const struct {
    const char *arguments, *option;
  } cases[] = {{"--size 64", "--size"},
               {"--size 0x10", "--size"},
               {"--size 10x10x10", "--size"},
               {"--view 30", "--view"},
               {"--view a,b", "--view"},
               {"--sun 10", "--sun"},
               {"--sun 1,2,-3", "--sun"},
               {"--sky 1,2", "--sky"},
               {"--sky -1,0,0", "--sky"},
               {"--albedo 1,1,2", "--albedo"},
               {"--phase mie:51", "--phase"},
               {"--phase hg:2", "--phase"},
               {"--octaves 0", "--octaves"},
               {"--samples 0", "--samples"},
               {"--seed -1", "--seed"},
               {"--ground=-1", "--ground"},
               {"--step 0", "--step"},
               {"--step -1", "--step"},
               {"--step 1e-20", "--step"},
               {"--step 1e-10%", "--step"},
               {"--adaptive 1.5", "--adaptive"},
               {"--adaptive nan", "--adaptive"},
               {"--adaptive 0.1 --integrator path", "--adaptive"},
               {"--adaptive 0.1 --deep d.exr", "--adaptive"},
               {"--fov 200", "--fov"},
               {"--extinction -1", "--extinction"},
               {"--aov depth", "--aov"},
               {"--integrator bdpt", "--integrator"},
               {"--spp 0", "--spp"},
               {"--scatterings -1", "--scatterings"},
               {"--phase schlick:1", "--phase"},
               {"--phase two-lobe:0.5,0.5", "--phase"},
               {"--point 1,2,3,-4", "--point"},
               {"--look-at 0,0,0", "--look-at"},
               {"--preview a.jpg", "--preview"},
               {"--exposure x", "--exposure"},
               {"--set x=1", "--set: is for scripts"},
               {"--velocity-scale 2", "--velocity-scale: multiplies a velocity grid"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram(start + c.arguments);
    EXPECT_EQ(result.exitCode, 2) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.option), std::string::npos) << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(RenderVerb, MakesAPartOfThePictureThatACompositorPlaces) {
  const TemporaryFolder folder;
  writeMesh(folder.file("ball.obj"), icosphere(1, 3));
  std::ofstream(folder.file("ball.felt")) << "scalarfield density = max(1 - length(identity()), 0);\n"
                                             "domain bounds = domain((-1, -1, -1), (2, 2, 2), 0.1);\n";
  // What is looked at between pixels or smoothed over them, and what suits what is seen.
  const std::string cases[] = {
      fog(),
      fog() + " --quality draft --aov Z,normal,light",
      fog() + " --sky clear:3 --sun 60,20 --aerial-perspective --scale 2km --ground",
      fog() + " --integrator path --samples 2 --lens-radius 0.05",
      folder.file("ball.obj") + " --camera-position 2,1,2",
      folder.file("ball.felt") + " --detail exact --camera-position 0,0.4,1.3",
  };
  for (const std::string& options : cases) {
    const auto pictures = [&](const std::string& name, const std::string& crop) {
      const ProgramResult result =
          runProgram("render " + options + " --size 40x30 --light-quality draft --quiet -o " +
                     folder.file(name + ".exr") + " --preview " + folder.file(name + ".png") + crop);
      EXPECT_EQ(result.exitCode, 0) << options << ": " << result.errors;
      return std::pair(readImage(folder.file(name + ".exr")), readImage(folder.file(name + ".png")));
    };
    const auto [whole, wholeShown] = pictures("whole", "");
    const auto [part, partShown] = pictures("part", " --crop 10,5,31,25");
    EXPECT_EQ(part.display, (Image::Display{10, 5, 40, 30})) << options;
    const auto expectPart = [&](const Image& found, const Image& of) {
      ASSERT_EQ(found.width, 21) << options;
      ASSERT_EQ(found.height, 20) << options;
      for (const Image::Channel& channel : of.channels)
        for (int y = 0; y != 20; ++y)
          for (int x = 0; x != 21; ++x)
            ASSERT_EQ(found.at(channel.name, x, y), of.at(channel.name, x + 10, y + 5))
                << options << ": " << channel.name << " at " << x << ", " << y;
    };
    expectPart(part, whole);
    expectPart(partShown, wholeShown);
  }
}

// Area of a picture that is covered, and the width of its middle row that is covered somewhat but not quite.
std::pair<double, int> coverage(const Image& image) {
  std::pair<double, int> result{};
  for (int y = 0; y != image.height; ++y)
    for (int x = 0; x != image.width; ++x) {
      const float alpha = image.at("A", x, y);
      result.first += alpha;
      result.second += y == image.height / 2 && alpha > 0.02f && alpha < 0.98f;
    }
  return result;
}

TEST_F(RenderVerb, LooksThroughLenses) {
  const TemporaryFolder folder;
  const std::string start = "render " + fog() + " --size 60x60 --quiet -o " + folder.file("a.exr");
  // The sum of alpha over parallel rays through a thin ball: the integral of 1 - exp(-2 k sqrt(1 - b^2)) over
  // the disc is pi - 2 pi (1 - (1 + 2 k) exp(-2 k)) / (2 k)^2, here with k = 0.1.
  const double disc = kPi - 2 * kPi * (1 - 1.2 * std::exp(-0.2)) / 0.04;
  const auto covered = [&](const std::string& options) {
    EXPECT_EQ(runProgram(start + " --extinction 0.1 " + options).exitCode, 0);
    return coverage(readImage(folder.file("a.exr"))).first / 3600;
  };
  // An orthographic picture 4 wide; one that shows all of the ball and a voxel around it on 92 % of its
  // width.
  EXPECT_NEAR(covered("--projection orthographic --orthographic-width 4"), disc / 16, 0.02 * disc / 16);
  const double shown = disc / 4 * 0.92 * 0.92;
  for (const char* place : {"--view 0,0", "--camera-position 9,0,0 --up 0,0,1"})
    EXPECT_NEAR(covered(std::string("--projection orthographic ") + place), shown / 1.21, 0.03 * shown);
  // 36 mm of film behind 18 mm are 90 degrees: at distance 10 the picture is 20 wide.
  EXPECT_NEAR(covered("--camera-position 0,0,10 --focal-length 18"), disc / 400, 0.03 * disc / 400);

  // A lens of radius 0.5 focused on the ball, and at half its distance: then its edge is blurred over
  // 2 * 0.5 |1 - 10 / 5| world units on either side, of 7.28 / 60 pixels.
  const std::string near = " --extinction 50 --camera-position 0,0,10 --fov 40 --samples 64 ";
  ASSERT_EQ(runProgram(start + near + "--lens-radius 0.5").exitCode, 0);
  const auto sharp = coverage(readImage(folder.file("a.exr")));
  ASSERT_EQ(runProgram(start + near + "--lens-radius 0.5 --focus-distance 5").exitCode, 0);
  const auto blurred = coverage(readImage(folder.file("a.exr")));
  EXPECT_NEAR(blurred.second, 16, 4);
  EXPECT_LT(sharp.second, 7);
  EXPECT_NEAR(blurred.first / sharp.first, 1, 0.05);
  // The same lens by its f-stop, focal length / diameter, the diameter being 1.
  const double focalLength = 0.036 / (2 * std::tan(20 * double(kPi) / 180));
  ASSERT_EQ(runProgram(start + near + "--focus-distance 5 --f-stop " + std::to_string(focalLength)).exitCode,
            0);
  EXPECT_NEAR(coverage(readImage(folder.file("a.exr"))).first, blurred.first, 0.5);
}

TEST_F(RenderVerb, FollowsAnimatedCamerasAndBlursWhatMoves) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("a.chan")) << "1 0 0 10 0 0 0 40\n2 2 0 10 0 0 0 40\n3 4 0 10 0 0 0 40\n";
  std::ofstream(folder.file("a.json"))
      << R"({"frames": [{"frame": 1, "position": [0, 0, 10], "rotation": [0, 0, 0]},
    {"frame": 3, "position": [4, 0, 10], "rotation": [0, 0, 0]}]})";
  const std::string start = "render " + fog() + " --size 60x60 --extinction 50 --samples 32 --quiet -o " +
                            folder.file("a.exr") + " ";
  const auto middle = [&] {
    const Image image = readImage(folder.file("a.exr"));
    double sum = 0, moment = 0;
    for (int x = 0; x != 60; ++x) {
      sum += image.at("A", x, 30);
      moment += image.at("A", x, 30) * (x + 0.5);
    }
    return moment / sum;
  };
  // 7.28 units across at distance 10: 8.24 pixels per unit. At frame 2 the camera is 2 to the right.
  ASSERT_EQ(runProgram(start + "--camera " + folder.file("a.chan")).exitCode, 0);
  EXPECT_NEAR(middle(), 30, 0.2);
  const auto still = coverage(readImage(folder.file("a.exr")));
  for (const char* file : {"a.chan", "a.json"}) {
    ASSERT_EQ(runProgram(start + "--fov 40 --frame 2 --camera " + folder.file(file)).exitCode, 0);
    EXPECT_NEAR(middle(), 30 - 2 * 8.24, 0.3) << file;
  }
  // The shutter is open for half a frame, in which the camera goes one unit to the right; a volume that goes
  // to the left looks the same.
  ASSERT_EQ(runProgram(start + "--shutter 0,0.5 --camera " + folder.file("a.chan")).exitCode, 0);
  const auto moved = coverage(readImage(folder.file("a.exr")));
  EXPECT_NEAR(middle(), 30 - 0.5 * 8.24, 0.3);
  // Both edges are ramps as wide as the way, and the filter of a pixel.
  EXPECT_LT(still.second, 7);
  EXPECT_NEAR(moved.second, 2 * 8.24, 3);
  ASSERT_EQ(
      runProgram(start + "--camera-position 0,0,10 --fov 40 --shutter 0,0.5 --volume-motion -2,0,0").exitCode,
      0);
  EXPECT_NEAR(middle(), 30 - 0.5 * 8.24, 0.3);
  EXPECT_NEAR(coverage(readImage(folder.file("a.exr"))).first, moved.first, 1);
}

TEST_F(RenderVerb, RefusesCamerasThatCannotBe) {
  const TemporaryFolder folder, files;
  std::ofstream(files.file("a.chan")) << "1 0 0 10 0 0 0 40\n5 2 0 10 0 0 0 40\n";
  std::ofstream(files.file("bad.chan")) << "1 0 0 10 0 0 0 40\n2 zero 0 10 0 0 0 40\n";
  std::ofstream(files.file("bad.json")) << "{\n\"frames\": 3}";
  std::ofstream(files.file("narrow.chan")) << "1 0 0 10 0 0 0 0.001\n";
  std::ofstream(files.file("away.json"))
      << R"({"frames": [{"frame": 7, "position": [0, 0, 9], "rotation": [0, 180, 0], "f_stop": 2}]})";
  const std::string start = "render " + fog() + " -o " + folder.file("a.exr") + " --size 8x6 ";
  const std::string chan = "--camera " + files.file("a.chan") + " ";
  const struct {
    std::string arguments;
    int exitCode;
    std::string message;
  } cases[] = {
      {"--crop 1,2,3", 2, "--crop"},
      {"--crop 3,0,3,5", 2, "--crop"},
      {"--crop 0,0,4.5,5", 2, "--crop"},
      {"--crop 0,0,9,5", 2, "0,0,8,6"},
      {"--projection fisheye", 2, "--projection"},
      {"--orthographic-width 0", 2, "--orthographic-width"},
      {"--orthographic-width 4", 2, "--orthographic-width: is for --projection orthographic"},
      {"--focal-length 50 --fov 30", 2, "--fov"},
      {"--focal-length 0", 2, "--focal-length"},
      {"--film-width -3", 2, "--film-width"},
      {"--f-stop 0", 2, "--f-stop"},
      {"--f-stop 2 --lens-radius 1", 2, "--f-stop"},
      {"--f-stop 2 --projection orthographic", 2, "--lens-radius"},
      {"--lens-radius 1 --camera-position 0,0,9 --look-at 0,0,20", 2, "--focus-distance"},
      {"--focus-distance 0", 2, "--focus-distance"},
      {"--shutter 0.5", 2, "--shutter"},
      {"--shutter 0.5,0", 2, "--shutter"},
      {"--shutter 0,0.5", 2, "--shutter"},
      {"--volume-motion 1,2", 2, "--volume-motion"},
      {"--volume-motion 1,2,3", 2, "--shutter"},
      {"--frame 3", 2, "--frame"},
      {chan + "--frame 6", 2, "1 to 5"},
      {chan + "--frame x", 2, "--frame"},
      {chan + "--view 1,2", 2, "--view"},
      {chan + "--rotation-order XYX", 2, "--rotation-order"},
      {"--camera " + files.file("bad.chan"), 1, "bad.chan:2: 'zero' is not a number"},
      {"--camera " + files.file("bad.json"), 1, "bad.json:2: "},
      {"--camera " + files.file("away.json") + " --frame 7", 1, "away.json: frame 7: --focus-distance: "},
      {"--camera " + files.file("narrow.chan") + " --frame 1", 1,
       "narrow.chan: frame 1: fov: must be from 0.01 to 179"},
      {"--camera " + files.file("none.chan"), 1, "none.chan: cannot be opened for reading"},
      {"--camera " + fog(), 1, ".chan, .json"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram(start + c.arguments);
    EXPECT_EQ(result.exitCode, c.exitCode) << c.arguments << ": " << result.errors;
    EXPECT_NE(result.errors.find(c.message), std::string::npos) << c.arguments << ": " << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(RenderVerb, RefusesFilesThatHoldNoDensity) {
  const TemporaryFolder folder;
  const std::string out = " -o " + folder.file("a.exr");
  EXPECT_EQ(runProgram("render " + folder.file("missing.vdb") + out).exitCode, 1);
  EXPECT_EQ(runProgram("render " + fog() + " --grid other" + out).exitCode, 1);
  EXPECT_EQ(runProgram("render " + fog() + " -o " + folder.file("missing/a.exr")).exitCode, 1);
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST_F(RenderVerb, RefusesMoreMemoryThanItMayUse) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("render " + fog() + " -o " + folder.file("a.exr") + " --size 60000x60000");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("--size"), std::string::npos) << result.errors;
}

}  // namespace
}  // namespace nephele::test
