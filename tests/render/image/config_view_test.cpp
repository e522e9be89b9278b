#include "nephele/render/image/config_view.h"

#include <gtest/gtest.h>

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
  const std::string table = refusal(config_, "Broken");
  EXPECT_TRUE(table.starts_with(config_ + ": ")) << table;
  EXPECT_NE(table.find("no_such_table.spi1d"), std::string::npos) << table;
}

}  // namespace
}  // namespace nephele
