// Views of previews, movies and contact sheets, through the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/view_config.h"

namespace nephele::test {
namespace {

class Views : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    files_ = new TemporaryFolder;
    writeVdbFile(files_->file("fog.vdb"),
                 {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
    writeViewConfig(files_->file("config.ocio"));
  }
  static void TearDownTestSuite() { delete files_; }

  // A small picture with a preview, p.png.
  ProgramResult render(const std::string& options, const std::string& before = {}) const {
    return runProgram("render " + files_->file("fog.vdb") + " -o " + folder_.file("a.exr") + " --preview " +
                          folder_.file("p.png") + " --size 32x24 --samples 1 --octaves 1 --sun 0,0,40 " +
                          options,
                      before);
  }
  bool previewSays(const std::string& view, const std::string& name = "p.png") const {
    const std::vector<std::string> lines = describeImage(folder_.file(name));
    return std::ranges::count(lines, "view_transform: " + view) == 1;
  }
  // Why configurations cannot be tried here, or "".
  static std::string whatIsMissing() {
    const std::string errors =
        runProgram("render a.vdb -o a.exr --ocio-config " + files_->file("config.ocio")).errors;
    return errors.find("built without it") == std::string::npos ? "" : errors;
  }
  std::string config() const { return files_->file("config.ocio"); }

  static inline TemporaryFolder* files_ = nullptr;
  TemporaryFolder folder_;
};

TEST_F(Views, LeaveTheLightOfTheExrAlone) {
  ASSERT_EQ(render("").exitCode, 0);
  EXPECT_TRUE(previewSays("filmic"));
  const Image light = readImage(folder_.file("a.exr"));
  const std::string usual = textOf(folder_.file("p.png"));
  for (const char* name : {"standard", "filmic", "agx", "raw"}) {
    const ProgramResult result = render(std::string("--view-transform ") + name);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    EXPECT_TRUE(previewSays(name)) << name;
    EXPECT_EQ(readImage(folder_.file("a.exr")).channel("R").values, light.channel("R").values);
    const std::vector<std::string> lines = describeImage(folder_.file("a.exr"));
    EXPECT_EQ(std::ranges::count_if(lines, [](auto& line) { return line.starts_with("view_transform"); }), 0);
  }
}

// Half the light, by the configuration.
TEST_F(Views, ComeFromAConfiguration) {
  if (const std::string missing = whatIsMissing(); !missing.empty()) GTEST_SKIP() << missing;
  for (const auto& [options, before] :
       {std::pair{"--ocio-config " + config(), std::string()},
        {"--view-transform screen/Half --ocio-config " + config(), std::string()},
        {std::string("--view-transform Half"), "OCIO=" + config()}}) {
    const ProgramResult result = render("--background 0.5,0.25,1 " + options, before);
    ASSERT_EQ(result.exitCode, 0) << result.errors;
    EXPECT_EQ(result.errors.find("OpenColorIO"), std::string::npos) << result.errors;
    EXPECT_TRUE(previewSays("screen/Half"));
    // The corner shows the background.
    const Image preview = readImage(folder_.file("p.png"));
    EXPECT_NEAR(preview.at("R", 0, 0), 0.25f, 1.01f / 255);
    EXPECT_NEAR(preview.at("G", 0, 0), 0.125f, 1.01f / 255);
    EXPECT_NEAR(preview.at("B", 0, 0), 0.5f, 1.01f / 255);
  }
  // The environment alone changes nothing, be it broken.
  ASSERT_EQ(render("", "OCIO=/nowhere/config.ocio").exitCode, 0);
  EXPECT_TRUE(previewSays("filmic"));
}

TEST_F(Views, AreThoseOfTurntablesToo) {
  if (const std::string missing = whatIsMissing(); !missing.empty()) GTEST_SKIP() << missing;
  const ProgramResult result = runProgram(
      "turntable " + files_->file("fog.vdb") + " -o " + folder_.file("a.#.exr") + " --frames 1-2 --preview " +
      folder_.file("p.#.png") + " --contact-sheet " + folder_.file("c.png") +
      " --size 32x24 --samples 1 --octaves 1 --ocio-config " + config() + " --view-transform Soft/Film");
  ASSERT_EQ(result.exitCode, 0) << result.errors;
  for (const char* name : {"p.1.png", "p.2.png", "c.png"})
    EXPECT_TRUE(previewSays("screen/Soft/Film", name)) << name;
}

// Meshes alone are shaded so that nothing is bright, and textures look as they do.
TEST_F(Views, OfMeshesAloneAreStandardUnlessAskedFor) {
  const std::string ball = "render " + ownData("data/sphere_uv.obj") + " -o " + folder_.file("a.exr") +
                           " --preview " + folder_.file("p.png") + " --size 32x24 ";
  ASSERT_EQ(runProgram(ball).exitCode, 0);
  EXPECT_TRUE(previewSays("standard"));
  ASSERT_EQ(runProgram(ball + "--view-transform agx").exitCode, 0);
  EXPECT_TRUE(previewSays("agx"));
}

TEST_F(Views, ThatAreNotThereAreRefusedBeforeAnythingIsRead) {
  if (const std::string missing = whatIsMissing(); !missing.empty()) GTEST_SKIP() << missing;
  std::ofstream(folder_.file("broken.ocio")) << "displays: [\n";
  std::string circle = textOf(config());
  circle.replace(circle.find("!<FileTransform>"), circle.npos,
                 "!<ColorSpaceTransform> {src: lin_rec709, dst: broken}\n");
  std::ofstream(folder_.file("circle.ocio")) << circle;
  const struct {
    std::string options;
    int exitCode;
    std::string says;
  } cases[] = {
      {"--view-transform flimic", 2, "--view-transform: got 'flimic', allowed: standard, filmic, agx, raw"},
      {"--view-transform Film --ocio-config " + config(), 1,
       config() + ": has no view 'Film'; there are: screen/Half, screen/Soft/Film, projector/Broken"},
      {"--view-transform Broken --ocio-config " + config(), 1, "no_such_table.spi1d"},
      {"--view-transform Broken --ocio-config " + folder_.file("circle.ocio"), 1,
       folder_.file("circle.ocio") + ": the colour space 'broken' is defined by itself"},
      {"--ocio-config " + folder_.file("none.ocio"), 1, folder_.file("none.ocio") + ": "},
      {"--ocio-config " + folder_.file("broken.ocio"), 1, folder_.file("broken.ocio") + ": "}};
  for (const auto& wrong : cases) {
    const ProgramResult result = runProgram("render /nowhere/fog.vdb -o " + folder_.file("b.exr") +
                                            " --preview " + folder_.file("b.png") + " " + wrong.options);
    EXPECT_EQ(result.exitCode, wrong.exitCode) << result.errors;
    EXPECT_NE(result.errors.find(wrong.says), std::string::npos) << result.errors;
    EXPECT_LE(std::ranges::count(result.errors, '\n'), wrong.exitCode) << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test
