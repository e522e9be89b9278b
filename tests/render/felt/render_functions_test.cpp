#include "nephele/render/felt/render_functions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "nephele/levelset/felt/grid_functions.h"
#include "nephele/modeling/felt/program.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/message_of.h"
#include "tests/support/run_program.h"

namespace nephele::felt {
namespace {

const Registry& functions() {
  static const Registry* const registry = [] {
    auto* made = new Registry;
    addModelingFunctions(*made);
    addLevelsetFunctions(*made);
    addRenderFunctions(*made);
    return made;
  }();
  return *registry;
}

void run(const std::string& script, Context context = {}) {
  Program("s.felt", script, functions()).run(context);
}

// A black ball of radius R that glows: C = e (1 - exp(-2 k R)) and alpha = 1 - exp(-2 k R) through its
// middle.
TEST(FeltRender, MakesThePictureOfAGlowingBall) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("ball.exr");
  run("render(\"" + path +
      "\", mask(sphere((0,0,0), 1), 0.02), (0,0,6), (0,0,0), fov = 25, width = 65, height = 65, extinction = "
      "0.6, "
      "color = (0,0,0), emission = mask(sphere((0,0,0), 1), 0.02) * (2, 1, 0.5), sun = (0,0,0), sky = "
      "(0,0,0), "
      "samples = 1);");
  const Image image = readImage(path);
  ASSERT_EQ(image.width, 65);
  const double opacity = 1 - std::exp(-1.2);
  const double emission[] = {2, 1, 0.5};
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(image.at(std::string(1, "RGB"[c]), 32, 32), emission[c] * opacity, 0.02 * emission[c]);
  EXPECT_NEAR(image.at("A", 32, 32), opacity, 0.01);
  EXPECT_EQ(image.at("A", 0, 0), 0);
}

// Above and below the camera the picture is that of the same ball, and what no range ends takes a domain.
TEST(FeltRender, LooksFromAnywhereAndIntoADomain) {
  const test::TemporaryFolder folder;
  const auto alpha = [&](const std::string& density, const std::string& where) {
    const std::string path = folder.file("a.exr");
    run("render(\"" + path + "\", " + density + ", " + where +
        ", width = 129, height = 129, extinction = 1, samples = 1);");
    return readImage(path).at("A", 64, 64);
  };
  const std::string ball = "mask(sphere((0,0,0), 1), 0.1)";
  const float front = alpha(ball, "(0,0,5), (0,0,0)");
  EXPECT_NEAR(alpha(ball, "(0,5,0), (0,0,0)"), front, 0.01f);
  EXPECT_NEAR(alpha(ball, "(0,-5,0), (0,0,0)"), front, 0.01f);
  EXPECT_NEAR(alpha("1", "domain((-0.5,-0.5,-0.5), (1,1,1), 0.1), (0,0,5), (0,0,0)"), 1 - std::exp(-1.0),
              0.02);
}

TEST(FeltRender, RefusesWhatMakesNoPicture) {
  const test::TemporaryFolder folder;
  const std::string ball = "mask(sphere((0,0,0), 1), 0.2)";
  const auto says = [&](const std::string& name, const std::string& rest, const std::string& words,
                        const Context& context = {}) {
    const std::string said =
        test::messageOf([&] { run("render(\"" + folder.file(name) + "\", " + rest + ");", context); });
    EXPECT_NE(said.find(words), std::string::npos) << rest << "\n" << said;
  };
  says("a.jpg", "1, (0,0,5), (0,0,0)", "must end with .exr, .png");
  says("no/a.png", ball + ", (0,0,5), (0,0,0)", "does not exist");
  says("a.png", "1, (0,0,5), (0,0,0)", "say within which domain to look");
  says("a.png", ball + ", (0,0,0), (0,0,0)", "looks nowhere");
  says("a.png", ball + ", (0,0,5), (0,0,0), fov = 180", "fov is 180, and may be from 0.01 to 179 degrees");
  says("a.png", ball + ", (0,0,5), (0,0,0), width = 0", "width is 0, and may be from 1 to 16384");
  says("a.png", ball + ", (0,0,5), (0,0,0), samples = 0", "samples is 0, and may be from 1 to 1024");
  says("a.png", ball + ", (0,0,5), (0,0,0), extinction = -1", "extinction is -1, and may be from 0 to 1e9");
  says("a.png", ball + ", (0,0,5), (0,0,0), sun = (0,91,1)", "an elevation from -90 to 90 degrees");
  says("a.png", ball + ", (0,0,5), (0,0,0), sky = (-1,0,0)", "sky: expected three numbers within");
  says("a.png", ball + " - 2, (0,0,5), (0,0,0)", "nowhere above 0");
  Context small;
  small.limits.memoryBytes = 1e6;
  says("a.png", ball + ", (0,0,5), (0,0,0)", "the picture may take", small);
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(FeltRender, HasExamplesThatRun) {
  const test::TemporaryFolder folder;
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.file(""));
  for (const Function* function : functions().named("render")) {
    EXPECT_FALSE(function->text.empty());
    EXPECT_NO_THROW(run(function->example)) << function->signature;
  }
  std::filesystem::current_path(before);
  EXPECT_EQ(folder.entryCount(), functions().named("render").size());
}

TEST(FeltRender, EndingsMayBeInCapitals) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("ball.Png");
  run("render(\"" + path + "\", mask(sphere((0,0,0), 1), 0.2), (0,0,5), (0,0,0), width = 8, height = 8);");
  EXPECT_EQ(test::textOf(path).substr(1, 3), "PNG");
}

}  // namespace
}  // namespace nephele::felt
