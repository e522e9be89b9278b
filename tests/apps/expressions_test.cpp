// Expressions of Felt where options take values that vary, and scripts as what is looked at.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

const std::string kBase = ownData("data/cloud_base.obj");

std::shared_ptr<BrickGrid> grown(const TemporaryFolder& folder, const std::string& options) {
  const std::string path = folder.file("cloud.vdb");
  const ProgramResult result =
      runProgram("cloud " + kBase + " -o " + path + " --resolution 40 --layers 2 --quiet " + options);
  EXPECT_EQ(result.exitCode, 0) << options << "\n" << result.errors;
  return toBricks(readScalarGrid(path));
}

void writeScript(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
}

/// What render makes of an input, into the folder.
Image seen(const TemporaryFolder& folder, const std::string& input, const std::string& options) {
  const std::string path = folder.file("seen.exr");
  const ProgramResult result =
      runProgram("render " + input + " -o " + path + " --no-backdrop --quiet " + options);
  EXPECT_EQ(result.exitCode, 0) << options << "\n" << result.errors;
  return readImage(path);
}

double sumOf(const Image& image, const std::string& channel) {
  double sum = 0;
  for (const float value : image.channel(channel).values) sum += double(value);
  return sum;
}

// Short forms are short for expressions, so that both make the same voxels bit for bit.
TEST(Expressions, AreWhatShortFormsAreShortFor) {
  const TemporaryFolder folder;
  const std::pair<const char*, const char*> pairs[] = {
      {"--amplitude 2% --amplitude-variation 0", "--amplitude '=2%'"},
      {"--amplitude height:0=1%,0.6=3%", "--amplitude '=ramp(height, [0, 0.6], [1%, 3%])'"},
      {"--amplitude facing:0,2,0:-1=1%,1=3%", "--amplitude '=ramp(facing((0,2,0)), [-1, 1], [1%, 3%])'"},
      {"--billow noise:3x,2:0.2,1",
       "--billow '=lerp(0.2, 1, smoothstep(-1.5, 1.5, fractalsum(2, 3x, seed = seed)))'"},
      {"--frequency 5x --density 2", "--frequency '=5x' --density '=1+1'"}};
  for (const auto& [shortForm, expression] : pairs) {
    const auto a = grown(folder, shortForm), b = grown(folder, expression);
    ASSERT_EQ(a->values().size(), b->values().size()) << expression;
    double most = 0;
    for (std::size_t i = 0; i < a->values().size(); ++i)
      most = std::max(most, double(std::abs(a->values()[i] - b->values()[i])));
    // Only the order of roundings may differ where the formula is written in another way.
    EXPECT_LT(most, 1e-3) << expression;
  }
}

TEST(Expressions, SeeThePlaceTheNormalMasksAndAttributes) {
  const TemporaryFolder folder;
  EXPECT_NE(grown(folder, "--amplitude '=lerp(1%, 3%, height)'")->values(),
            grown(folder, "--amplitude 2%")->values());
  EXPECT_NE(grown(folder, "--amplitude '=2% * clamp(normal.y, 0, 1)'")->values(),
            grown(folder, "--amplitude 2%")->values());
  EXPECT_EQ(
      runProgram("cloud " + kBase + " -o " + folder.file("mask.vdb") + " --resolution 24 --layers 1 --quiet")
          .exitCode,
      0);
  EXPECT_NE(grown(folder, "--density '=0.5 + 0.5 * mask(\"" + folder.file("mask.vdb") + "\")'")->values(),
            grown(folder, "--density 1")->values());
  const ProgramResult missing = runProgram("cloud " + kBase + " -o " + folder.file("a.vdb") +
                                           " --resolution 24 --density '=attribute(\"none\")'");
  EXPECT_EQ(missing.exitCode, 1);
  EXPECT_NE(missing.errors.find("none"), std::string::npos) << missing.errors;
}

TEST(Expressions, HaveTheirFaultsUnderlined) {
  const TemporaryFolder folder;
  const std::string rest = " -o " + folder.file("a.vdb");
  const ProgramResult unknown = runProgram("cloud " + kBase + rest + " --amplitude '=lerp(1%, 3%, heigth)'");
  EXPECT_EQ(unknown.exitCode, 2);
  EXPECT_EQ(
      unknown.errors,
      "--amplitude:1:14: error: there is no 'heigth' here\n  lerp(1%, 3%, heigth)\n               ^~~~~~\n"
      "  hint: did you mean `height`?\n");
  const ProgramResult negative =
      runProgram("cloud " + kBase + rest + " --resolution 24 --amplitude '=1% * perlin(3x)'");
  EXPECT_EQ(negative.exitCode, 1);
  EXPECT_NE(negative.errors.find("clamp(..., LOW, HIGH)"), std::string::npos) << negative.errors;
  EXPECT_EQ(runProgram("advect " + kBase + rest + " --velocity '=1'").exitCode, 2);
  EXPECT_EQ(runProgram("cut " + kBase + " -o " + folder.file("pieces") + " --knife '=P'").exitCode, 2);
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Expressions, CutAndCarry) {
  const TemporaryFolder folder;
  const ProgramResult cut =
      runProgram("cut " + kBase + " -o " + folder.file("pieces") +
                 " --resolution 64 --knife '=P.y - 20% - 1% * perlin(6x)' --stats " + folder.file("s.json"));
  ASSERT_EQ(cut.exitCode, 0) << cut.errors;
  const auto stats = nlohmann::json::parse(textOf(folder.file("s.json")));
  EXPECT_EQ(stats["pieces"].size(), 2u);
  EXPECT_NEAR(double(stats["volume_sum"]), double(stats["volume_original"]),
              1e-6 * double(stats["volume_original"]));
  const ProgramResult nowhere =
      runProgram("cut " + kBase + " -o " + folder.file("none") + " --resolution 64 --knife '=P.y - 100'");
  EXPECT_EQ(nowhere.exitCode, 0);
  EXPECT_NE(nowhere.errors.find("parts nothing"), std::string::npos) << nowhere.errors;

  const auto still = grown(folder, "");
  ASSERT_EQ(runProgram("advect " + folder.file("cloud.vdb") + " -o " + folder.file("moved.vdb") +
                       " --velocity '=(10%, 0, 0)' --steps 1 --quiet")
                .exitCode,
            0);
  // All goes along by a tenth of the longest side, which is that of the density.
  const auto info = [](const std::string& path) { return describe(readScalarGrid(path)); };
  const VdbGridInfo before = info(folder.file("cloud.vdb")), after = info(folder.file("moved.vdb"));
  EXPECT_GT(after.indexMin.x, before.indexMin.x + 2);
  EXPECT_EQ(after.indexMin.y, before.indexMin.y);
}

TEST(Scripts, AreLookedAt) {
  const TemporaryFolder folder;
  const std::string script = folder.file("ball.felt"), picture = folder.file("ball.exr");
  writeScript(script,
              "param float radius = 1 in [0.1, 3] \"of the ball\";\n"
              "scalarfield density = mask(sphere((0,0,0), radius), 0.1);\n"
              "vectorfield color = (1, 0.5, 0.25);\n"
              "float extinction = 3;\n"
              "print(\"time\", time);\n");
  const std::string command =
      "render " + script + " -o " + picture + " --size 48x32 --samples 1 --no-backdrop";
  const ProgramResult result = runProgram(command);
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.errors.find("time 0"), std::string::npos) << result.errors;
  EXPECT_NE(result.output.find("extinction 3 per world unit"), std::string::npos) << result.output;
  const Image image = readImage(picture);
  EXPECT_GT(sumOf(image, "R"), 1.5 * sumOf(image, "B"));
  EXPECT_GT(sumOf(image, "A"), 100);

  EXPECT_EQ(runProgram(command + " --set radius=4").exitCode, 2);
  EXPECT_EQ(runProgram(command + " --set radios=1").exitCode, 2);
  EXPECT_EQ(runProgram("render " + script + " " + script + " -o " + picture).exitCode, 1);
}

TEST(Expressions, ColourVolumes) {
  const TemporaryFolder folder;
  grown(folder, "");
  const auto picture = [&](const std::string& options) {
    const Image image =
        seen(folder, folder.file("cloud.vdb"), "--size 48x32 --samples 1 --sky 1,1,1 --sun none " + options);
    return std::array{sumOf(image, "R"), sumOf(image, "G"), sumOf(image, "B")};
  };
  const auto white = picture(""), red = picture("--color '=(1, 0.6, 0.2)'");
  EXPECT_NEAR(red[0], white[0], 0.01 * white[0]);
  EXPECT_LT(red[1], 0.9 * white[1]);
  EXPECT_LT(red[2], 0.8 * red[1]);
  EXPECT_EQ(runProgram("render " + folder.file("cloud.vdb") + " --preview " + folder.file("p.png") +
                       " --color 1,0,0")
                .exitCode,
            2);
  EXPECT_EQ(runProgram("render " + folder.file("cloud.vdb") + " --preview " + folder.file("p.png") +
                       " --color '=P.x'")
                .exitCode,
            2);
}

// A ball is the same ball whoever samples it, and has the same colours: pictures differ by what a pixel may.
TEST(Scripts, LookTheSameWithAndWithoutAGrid) {
  const TemporaryFolder folder;
  const std::string script = folder.file("ball.felt");
  const auto picture = [&](const std::string& text, const std::string& detail) {
    writeScript(script, "scalarfield density = mask(sphere((0,0,0), 1) + 0.1 * perlin(3), 0.2);\n" + text);
    return seen(folder, script,
                "--size 64x48 --samples 4 --camera-position 0,0,5 --look-at 0,0,0 --detail " + detail);
  };
  const auto expectTheSame = [](const Image& camera, const Image& exact, const char* channel) {
    const std::vector<float>&a = camera.find(channel)->values, &b = exact.find(channel)->values;
    ASSERT_EQ(a.size(), b.size());
    double difference = 0, total = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      difference += std::abs(double(a[i] - b[i]));
      total += double(b[i]);
    }
    EXPECT_GT(total, 1) << channel;
    EXPECT_LT(difference, 0.03 * total) << channel;
  };
  const std::string grey = "float extinction = 4;\n",
                    coloured = grey + "vectorfield color = (0.5 + 0.5 * P.x, 0.5, 0.5 - 0.4 * P.y);\n";
  expectTheSame(picture(grey, "camera"), picture(grey, "exact"), "A");
  const Image camera = picture(coloured, "camera"), exact = picture(coloured, "exact");
  for (const char* channel : {"R", "G", "B", "A"}) expectTheSame(camera, exact, channel);
}

// What glows by its heat, and is blurred by its motion while the shutter is open.
TEST(Scripts, GlowAndMoveTheSameWithAndWithoutAGrid) {
  const TemporaryFolder folder;
  const std::string script = folder.file("fire.felt");
  writeScript(script,
              "scalarfield ball = sphere((0,0,0), 0.6) + 0.1 * perlin(3);\n"
              "scalarfield density = mask(ball, 0.2);\n"
              "domain bounds = domain((-0.8, -0.8, -0.8), (1.6, 1.6, 1.6), 0.02);\n"
              "scalarfield temperature = 2200 * mask(ball - 0.2, 0.2);\n"
              "vectorfield velocity = (12, 0, 0);\nfloat extinction = 4;\n");
  const auto picture = [&](const std::string& detail, const std::string& shutter) {
    return seen(
        folder, script,
        "--size 48x36 --samples 4 --camera-position 0,0,4 --look-at 0,0,0 --sky 0.1,0.1,0.1 --sun none " +
            shutter + " --detail " + detail);
  };
  const auto difference = [](const Image& a, const Image& b, const char* channel) {
    double sum = 0, total = 0;
    for (std::size_t i = 0; i < a.find(channel)->values.size(); ++i) {
      sum += std::abs(double(a.find(channel)->values[i] - b.find(channel)->values[i]));
      total += double(b.find(channel)->values[i]);
    }
    EXPECT_GT(total, 1) << channel;
    return sum / total;
  };
  const std::string open = "--shutter -0.5,0.5";
  const Image still = picture("exact", ""), moving = picture("exact", open);
  for (const char* channel : {"R", "G", "A"}) {
    EXPECT_LT(difference(picture("camera", ""), still, channel), 0.03);
    EXPECT_LT(difference(picture("camera", open), moving, channel), 0.03);
    EXPECT_GT(difference(still, moving, channel), 0.1);
  }
  // Of a temperature that no fire has, both say the same.
  writeScript(script,
              "scalarfield density = mask(sphere((0,0,0), 1));\nscalarfield temperature = 3e5 * density;\n");
  for (const std::string detail : {"camera", "exact"}) {
    const ProgramResult hot =
        runProgram("render " + script + " -o " + folder.file("a.exr") + " --detail " + detail);
    EXPECT_EQ(hot.exitCode, 1);
    EXPECT_NE(hot.errors.find("more than 100000 K"), std::string::npos) << hot.errors;
  }
}

// In a sky alone, what is seen is in proportion to its radiance, and no brighter where the medium scatters
// once.
TEST(Scripts, SayWhatTheyAreLitBy) {
  const TemporaryFolder folder;
  const std::string script = folder.file("s.felt");
  const auto brightness = [&](const std::string& lights, const std::string& options) {
    writeScript(script,
                "scalarfield density = mask(sphere((0,0,0), 1), 0.2);\nfloat extinction = 2;\n" + lights);
    const Image image = seen(folder, script, "--size 33x33 --albedo 1,1,1 --octaves 1 --view 0,0 " + options);
    return image.at("G", 16, 16) / image.at("A", 16, 16);
  };
  const std::string sky = "vector sky = (0, 0.5, 0);\n", noSun = "vector sun = (0, 0, 0);\n";
  const float dark = brightness(sky + noSun, "");
  EXPECT_GT(dark, 0.1f);
  EXPECT_LT(dark, 0.51f);
  EXPECT_NEAR(brightness(sky + noSun, "--sky 0,1,0"), 2 * dark, 0.02f * dark);
  EXPECT_GT(brightness(sky + "vector sun = (0, 10, 5);\n", ""), 1.5f * dark);
  EXPECT_EQ(brightness(sky + "vector sun = (0, 10, 5);\n", "--sun none"), dark);
}

// Gas that glows where there is next to no density gives off what cannot be told per optical depth.
TEST(Scripts, MayGlowWhereThereIsNextToNoDensity) {
  const TemporaryFolder folder;
  const std::string script = folder.file("s.felt"), stats = folder.file("s.json");
  writeScript(script,
              "scalarfield density = exp(-square(identity().y / 0.035));\n"
              "vectorfield emission = exp(-identity() * identity()) * (1, 0.5, 0.2);\n"
              "domain bounds = domain((-1, -0.6, -1), (2, 1.2, 2), 0.02);\nfloat extinction = 25;\n");
  const ProgramResult result = runProgram("render " + script + " -o " + folder.file("s.exr") +
                                          " --size 48x32 --samples 1 --stats " + stats);
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_EQ(nlohmann::json::parse(std::ifstream(stats))["values_not_finite"], 0);
}

TEST(Scripts, ThatAreNoVolumesAreRefused) {
  const TemporaryFolder folder;
  const std::string script = folder.file("s.felt");
  const auto refused = [&](const std::string& text, const std::string& words, int code = 1) {
    writeScript(script, text);
    const ProgramResult result =
        runProgram("render " + script + " -o " + folder.file("a.exr") + " --size 16x16");
    EXPECT_EQ(result.exitCode, code) << text << result.errors;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result.errors;
  };
  refused("float a = 1;", "declares no 'density'");
  refused("vectorfield density = identity();",
          "'density' is a vectorfield, and of a volume it is a scalarfield");
  refused("scalarfield density = perlin(1);", "has no end");
  refused("scalarfield density = mask(sphere((0,0,0), 1) - 2);", "nowhere above 0");
  refused("scalarfield density = mask(sphere((0,0,0), 1);", "s.felt:1:46: error: expected", 2);
  refused("scalarfield density;", "has no value");
  const std::string ball = "scalarfield density = mask(sphere((0,0,0), 1), 0.1);\n";
  refused(ball + "float extinction = -1;", "'extinction' is -1, allowed: 0 to 1e9");
  refused(ball + "vector sky = (1, -1, 0);", "'sky' has -1, allowed: 0 to 1e9");
  refused(ball + "vector sun = (0, 91, 1);", "an elevation from -90 to 90");
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(Scripts, MoveWithTheFrame) {
  const TemporaryFolder folder;
  const std::string script = folder.file("s.felt");
  writeScript(script, "scalarfield density = mask(sphere((0.3 * time, 0, 0), 1), 0.2);\n");
  const ProgramResult result = runProgram("render " + script + " -o " + folder.file("f.##.exr") +
                                          " --frames 1-2 --size 32x24 --samples 1 --no-backdrop");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(readImage(folder.file("f.01.exr")).find("A")->values,
            readImage(folder.file("f.02.exr")).find("A")->values);
}

}  // namespace
}  // namespace nephele::test
