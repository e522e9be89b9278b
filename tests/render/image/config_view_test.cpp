#include "nephele/render/image/config_view.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <fstream>

#include "nephele/modeling/base/error.h"
#include "tests/support/run_program.h"
#include "tests/support/view_config.h"

namespace nephele {
namespace {

class ConfigViews : public testing::Test {
 protected:
  void SetUp() override { test::writeViewConfig(config_); }

  std::vector<float> shown(const std::string& view, std::vector<float> rgb) const {
    readConfigView(config_, view)->apply(rgb);
    return rgb;
  }
  static std::string refusal(const std::string& path, const std::string& view) {
    try {
      readConfigView(path, view);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  }

  /// What is said of a configuration whose view Half is defined so, and with what else it defines.
  std::string refusalOf(const std::string& half, const std::string& others = {},
                        const std::string& environment = "{}") const {
    std::ofstream(config_) << "ocio_profile_version: 2\nenvironment: " << environment << R"(
search_path: ""
roles: {default: lin_rec709, scene_linear: lin_rec709}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  screen:
    - !<View> {name: Half, colorspace: half}
colorspaces:
  - !<ColorSpace>
    name: lin_rec709
  - !<ColorSpace>
    name: half
    from_scene_reference: )"
                           << half << '\n'
                           << others;
    std::string refused = refusal(config_, "Half");
    return refused.starts_with(config_ + ": ") ? refused.substr(config_.size() + 2) : refused;
  }

  test::TemporaryFolder folder_;
  std::string config_ = folder_.file("config.ocio");
};

TEST_F(ConfigViews, AreFoundByDisplayAndViewByViewAndByDefault) {
  const std::vector<float> light{0.04f, 0.25f, 0.64f, 1.0f, 0.0f, 0.16f};
  for (const char* name : {"screen/Half", "Half", ""}) {
    const std::vector<float> half = shown(name, light);
    for (std::size_t i = 0; i != light.size(); ++i) EXPECT_NEAR(half[i], light[i] / 2, 1e-6f);
    EXPECT_EQ(readConfigView(config_, name)->name, "screen/Half");
  }
  for (const char* name : {"screen/Soft/Film", "Soft/Film"}) {
    const std::vector<float> root = shown(name, light);
    // Within OpenColorIO's own fast power.
    for (std::size_t i = 0; i != light.size(); ++i) EXPECT_NEAR(root[i], std::sqrt(light[i]), 1e-3f);
  }
}

TEST_F(ConfigViews, WithoutANameForRec709TakeTheLinearOne) {
  test::writeViewConfig(config_, "somewhere");
  EXPECT_NEAR(shown("Half", {0.5f, 0.25f, 0.125f})[0], 0.25f, 1e-6f);
}

// The columns of Rec. 709 in ACES2065-1 under Bradford adaptation, as SMPTE ST 2065-1 primaries give them.
TEST_F(ConfigViews, CountFromAcesWhereOnlyThatIsKnown) {
  std::ofstream(config_) << R"(ocio_profile_version: 2
roles: {default: aces, scene_linear: acescg, aces_interchange: aces}
file_rules:
  - !<Rule> {name: Default, colorspace: default}
displays:
  screen:
    - !<View> {name: Plain, colorspace: aces}
colorspaces:
  - !<ColorSpace>
    name: aces
  - !<ColorSpace>
    name: acescg
    to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}
)";
  const std::vector<float> values = shown("Plain", {1, 0, 0, 1, 1, 1});
  const float expected[] = {0.4397f, 0.0898f, 0.0175f, 1, 1, 1};
  for (std::size_t i = 0; i != 6; ++i) EXPECT_NEAR(values[i], expected[i], 1e-3f) << i;
}

TEST_F(ConfigViews, ThatAreNotThereAreRefusedWithThoseThatAre) {
  const std::string refused = refusal(config_, "Film");
  EXPECT_EQ(refused,
            config_ + ": has no view 'Film'; there are: screen/Half, screen/Soft/Film, projector/Broken");
}

TEST_F(ConfigViews, OfBrokenConfigurationsAreRefusedByName) {
  for (const std::string& path : {folder_.file("none.ocio"), folder_.file(""), std::string("/dev/zero")})
    EXPECT_EQ(refusal(path, ""), path + ": is no file that can be read");
  std::ofstream(folder_.file("text.ocio")) << "displays: [\n";
  std::ofstream(folder_.file("bare.ocio")) << "ocio_profile_version: 1\nroles: {default: a}\ncolorspaces:\n"
                                              "  - !<ColorSpace> {name: a}\n";
  std::ofstream(folder_.file("empty.ocio"));
  for (const char* name : {"text.ocio", "empty.ocio", "bare.ocio"}) {
    const std::string refused = refusal(folder_.file(name), "Half");
    EXPECT_TRUE(refused.starts_with(folder_.file(name) + ": ")) << refused;
    EXPECT_EQ(refused.find('\n'), std::string::npos) << refused;
  }
  std::ofstream(folder_.file("version.ocio")) << "ocio_profile_version: two\n";
  EXPECT_EQ(refusal(folder_.file("version.ocio"), ""),
            folder_.file("version.ocio") +
                ": cannot be used as an OpenColorIO configuration: ocio_profile_version is no number");
  const std::string table = refusal(config_, "Broken");
  EXPECT_TRUE(table.starts_with(config_ + ": ")) << table;
  EXPECT_NE(table.find("no_such_table.spi1d"), std::string::npos) << table;
}

TEST_F(ConfigViews, DefinedByThemselvesAreRefused) {
  const std::string circle = "the colour space 'half' is defined by itself";
  EXPECT_EQ(refusalOf("!<ColorSpaceTransform> {src: lin_rec709, dst: half}"), circle);
  EXPECT_EQ(refusalOf("!<DisplayViewTransform> {src: lin_rec709, display: screen, view: Half}"), circle);
  EXPECT_EQ(
      refusalOf("!<ColorSpaceTransform> {src: other, dst: lin_rec709}",
                "  - !<ColorSpace>\n    name: other\n    to_scene_reference: !<GroupTransform> {children: "
                "[!<ColorSpaceTransform> {src: lin_rec709, dst: half, direction: inverse}]}\n"),
      circle);
  EXPECT_EQ(refusalOf("!<LookTransform> {src: lin_rec709, dst: lin_rec709, looks: +warm}",
                      "looks:\n  - !<Look>\n    name: warm\n    process_space: half\n"),
            circle);
  EXPECT_EQ(refusalOf("!<FileTransform> {src: $A}", "", "{A: x$A}"), "the variable 'A' is defined by itself");
  // Another that is named more than once is none.
  EXPECT_EQ(
      refusalOf("!<GroupTransform> {children: [&a !<ColorSpaceTransform> {src: lin_rec709, dst: other}, *a]}",
                "  - !<ColorSpace>\n    name: other\n    from_scene_reference: !<MatrixTransform> {}\n",
                "{A: x, B: $A$A}"),
      "none");
}

// 24 spaces of two steps each, 16.8 million in all.
TEST_F(ConfigViews, OfMillionsOfStepsAreRefused) {
  const std::string tooMuch = "leads through more than 10000 steps, or through 100 within each other";
  std::string repeats = "!<GroupTransform> {children: [&a0 !<MatrixTransform> {}", spaces, chain, end = "]}";
  for (int i = 1; i <= 24; ++i) {
    repeats += fmt::format(", &a{0} !<GroupTransform> {{children: [*a{1}, *a{1}]}}", i, i - 1);
    spaces += fmt::format(
        "  - !<ColorSpace>\n    name: s{0}\n    from_scene_reference: !<GroupTransform> {{children: "
        "[!<ColorSpaceTransform> {{src: s0, dst: s{1}}}, !<ColorSpaceTransform> {{src: s0, dst: s{1}}}]}}\n",
        i, i - 1);
  }
  for (int i = 1; i <= 1000; ++i)
    chain += fmt::format(
        "  - !<ColorSpace>\n    name: s{}\n    from_scene_reference: !<ColorSpaceTransform> {{src: s0, dst: "
        "s{}}}\n",
        i, i - 1);
  const std::string first = "  - !<ColorSpace>\n    name: s0\n";
  EXPECT_EQ(refusalOf(repeats + end), "repeats parts of itself (*name) more than 16 times");
  EXPECT_EQ(refusalOf("!<ColorSpaceTransform> {src: s0, dst: s24}", first + spaces), tooMuch);
  EXPECT_EQ(refusalOf("!<ColorSpaceTransform> {src: s0, dst: s1000}", first + chain), tooMuch);
  EXPECT_EQ(refusalOf("!<ColorSpaceTransform> {src: s0, dst: s50}", first + chain), "none");
}

TEST_F(ConfigViews, DoNotWaitForTablesThatAreNoFiles) {
  const std::string pipe = folder_.file("pipe"), table = folder_.file("table.ctf");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {pipe, std::string("/dev/zero"), std::string("/dev")})
    EXPECT_EQ(refusalOf("!<FileTransform> {src: " + path + "}"),
              "the table " + path + " is no file that can be read");
  std::ofstream(table)
      << "<?xml version=\"1.0\"?>\n<ProcessList version=\"2\" id=\"a\">\n"
         "<Reference inBitDepth=\"32f\" outBitDepth=\"32f\" path=\"/dev/zero\"/></ProcessList>\n";
  EXPECT_EQ(refusalOf("!<FileTransform> {src: table.ctf}"), "the table " + table + " refers to other files");
}

}  // namespace
}  // namespace nephele
