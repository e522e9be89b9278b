// The options of lights, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/scene/camera.h"
#include "tests/support/density.h"
#include "tests/support/png_bytes.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

class LightOptions : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    data_ = new TemporaryFolder;
    writeVdbFile(data_->file("ball.vdb"),
                 {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
    Image map;
    map.width = 32;
    map.height = 16;
    for (const char* name : {"R", "G", "B"}) map.add(name, false).values.assign(512, 0.5f);
    writeExr(data_->file("map.exr"), map, Camera::framing({}, 0, 0, {32, 16, 35}));
    std::ofstream(data_->file("broken.hdr")) << "#?RADIANCE\n\n-Y 2 +X 4\n";
  }
  static void TearDownTestSuite() { delete data_; }

  static ProgramResult render(const std::string& options, const std::string& name = "a.exr") {
    return runProgram(fmt::format("render '{}' -o '{}' --size 16x12 --samples 1 {}", data_->file("ball.vdb"),
                                  data_->file(name), options));
  }
  static Image picture(const std::string& options) {
    const ProgramResult result = render(options);
    EXPECT_EQ(result.exitCode, 0) << result.errors;
    return readImage(data_->file("a.exr"));
  }
  static std::string file(const std::string& name) { return fmt::format("'{}'", data_->file(name)); }

  static TemporaryFolder* data_;
};
TemporaryFolder* LightOptions::data_ = nullptr;

TEST_F(LightOptions, ASkyThatIsNotGivenIsClear) {
  const Image standard = picture(""), clear = picture("--sky clear --sun 90,38"),
              even = picture("--sky 0.1,0.17,0.28");
  for (const char* name : {"R", "G", "B"}) {
    EXPECT_EQ(standard.at(name, 8, 6), clear.at(name, 8, 6)) << name;
    EXPECT_NE(standard.at(name, 8, 6), even.at(name, 8, 6)) << name;
  }
}

TEST_F(LightOptions, AClearSkyStandsBehindPreviewsUnlessToldNotTo) {
  const std::string preview = "--preview " + file("a.png");
  EXPECT_TRUE(picture(preview).find("backdrop.R"));
  std::ofstream(data_->file("off.toml")) << "backdrop = false\n";
  EXPECT_TRUE(picture(preview + " --backdrop --config " + file("off.toml")).find("backdrop.R"));
  for (const std::string& options :
       {std::string(), preview + " --no-backdrop", preview + " --config " + file("off.toml"),
        preview + " --background 0,0,0", preview + " --sky 0.1,0.1,0.2"})
    EXPECT_FALSE(picture(options).find("backdrop.R")) << options;
}

TEST_F(LightOptions, ScaleGivesTheExtinctionOfARealCloud) {
  // The ball is 2.2 across with its edge, and its density 1: 0.075 per metre, of 1000 / 2.2 metres per unit.
  const ProgramResult result = render("--scale 1km --aov none");
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_NE(result.output.find("extinction 34.0909 per"), std::string::npos) << result.output;
  EXPECT_NE(render("--scale 1km --extinction 3").output.find("extinction 3 per"), std::string::npos);
  for (const char* bad : {"1", "0km", "-3m", "1e9km", "far"}) {
    const ProgramResult refused = render(fmt::format("--scale {}", bad));
    EXPECT_EQ(refused.exitCode, 2) << bad;
    EXPECT_NE(refused.errors.find("--scale"), std::string::npos) << refused.errors;
  }
}

TEST_F(LightOptions, AirIsBeforeWhatIsFarAway) {
  const std::string large = "--scale 8km --aov light,Z_mean";
  const Image without = picture(large), with = picture(large + " --aerial-perspective");
  for (const char* name : {"R", "G", "B"}) {
    const float air = with.at(fmt::format("light_air.{}", name), 8, 6);
    EXPECT_GT(air, 0.01f) << name;
    float sum = air;
    for (const char* light : {"sun", "sky"}) {
      const float before = without.at(fmt::format("light_{}.{}", light, name), 8, 6),
                  after = with.at(fmt::format("light_{}.{}", light, name), 8, 6);
      EXPECT_LT(after, 0.95f * before) << light << name;
      sum += after;
    }
    // R, G, B are 16 bit.
    EXPECT_NEAR(sum, with.at(name, 8, 6), 1e-3f * sum);
  }
  EXPECT_FALSE(picture("--aerial-perspective --aov none").find("Z_mean"));
  EXPECT_EQ(render("--aerial-perspective --sky 0.1,0.1,0.2").exitCode, 2);
  EXPECT_EQ(render("--aerial-perspective --deep " + file("d.exr")).exitCode, 2);
}

TEST_F(LightOptions, EveryLightHasALayerOfItsName) {
  const Image image = picture(
      "--aov light --sun 30,40 --sun key=90,20,2 --point 0,3,0,5 --point lamp=2,0,0,1,2,3 "
      "--spot 0,0,4,0,0,0,20,5,10");
  double sum = 0;
  for (const char* name : {"sun", "key", "point", "lamp", "spot", "sky"}) {
    const float value = image.at(fmt::format("light_{}.G", name), 8, 6);
    EXPECT_GT(value, 0) << name;
    sum += double(value);
  }
  // R, G, B are 16 bit.
  EXPECT_NEAR(sum, double(image.at("G", 8, 6)), 1e-3 * sum);
}

TEST_F(LightOptions, WithoutLightsThePictureIsBlackWithAlpha) {
  const Image image = picture("--sun none --sky 0,0,0");
  EXPECT_EQ(image.at("R", 8, 6), 0);
  EXPECT_GT(image.at("A", 8, 6), 0.99f);
}

TEST_F(LightOptions, ShadowMultipliersLetColoursThrough) {
  const std::string light = "--sky 0,0,0 --octaves 1 --sun 205,-5,10 ";
  const Image plain = picture(light), coloured = picture(light + "--shadow-multiplier sun=1,0.3,0.05");
  EXPECT_EQ(coloured.at("R", 8, 6), plain.at("R", 8, 6));
  EXPECT_GT(coloured.at("B", 8, 6), 2 * plain.at("B", 8, 6) + 1e-3f);
}

TEST_F(LightOptions, SkyMapsAreSkies) {
  const Image map = picture("--sun none --sky " + file("map.exr") + " --sky-intensity 2");
  const Image constant = picture("--sun none --sky 1,1,1");
  // The iteration for the light ends at 1.5e-3 of it; 16 bit.
  EXPECT_NEAR(map.at("G", 8, 6), constant.at("G", 8, 6), 4e-3f * constant.at("G", 8, 6));
}

TEST_F(LightOptions, ClearSkiesBelongToTheirSun) {
  // Of ClearSky: the sun at 38 degrees is that without a sky; at 3 it is red and weak, and the sky still
  // blue.
  const std::string sun = "--aov light --sun 0,38", clear = " --sky clear";
  const Image high = picture(sun + clear), low = picture("--aov light --sun 0,3" + clear),
              dull = picture(sun + " --sky clear:9"), own = picture(sun + ",2,2,2" + clear);
  const auto at = [](const Image& image, const char* channel) { return image.at(channel, 8, 6); };
  EXPECT_GT(at(low, "light_sun.R"), 3 * at(low, "light_sun.B"));
  EXPECT_LT(at(low, "light_sun.G"), 0.5f * at(high, "light_sun.G"));
  EXPECT_GT(at(high, "light_sky.B"), at(high, "light_sky.R"));
  EXPECT_LT(at(dull, "light_sun.G"), at(high, "light_sun.G"));
  EXPECT_EQ(at(own, "light_sun.R"), at(own, "light_sun.B"));
  const Image black = picture(sun + clear + " --ground-albedo 0"),
              white = picture(sun + clear + " --ground-albedo 1");
  EXPECT_GT(at(white, "light_sky.G"), at(black, "light_sky.G"));
}

TEST_F(LightOptions, DeepShadowsGoThroughFiles) {
  const std::string light = "--extinction 2 --sky 0,0,0 --octaves 1 --sun 90,38 ";
  const Image plain = picture(light);
  const Image deep = picture(light + "--shadows deep --write-deep-shadow " + file("shadow.exr"));
  const Image read = picture(light + "--read-deep-shadow sun=" + file("shadow.exr"));
  const float value = plain.at("R", 8, 6);
  EXPECT_NEAR(deep.at("R", 8, 6), value, 0.03f * value);
  EXPECT_NEAR(read.at("R", 8, 6), deep.at("R", 8, 6), 2e-3f * value);
}

TEST_F(LightOptions, RefusesWhatIsWrongByItsOption) {
  const struct {
    std::string options, message;
    int exitCode;
  } cases[] = {
      {"--point 1,2,3", "--point: got '1,2,3'", 2},
      {"--point 1,2,3,-4", "--point: got '1,2,3,-4'", 2},
      {"--spot 0,0,4,0,0,0,95,5,10", "--spot: got '0,0,4,0,0,0,95,5,10'", 2},
      {"--sun 1,2,3,4", "--sun: got '1,2,3,4'", 2},
      {"--light-decay cubic", "--light-decay: got 'cubic'", 2},
      {"--shadow-detail 3", "--shadow-detail: got '3'", 2},
      {"--shadow-multiplier 1,2", "--shadow-multiplier: got '1,2'", 2},
      {"--sky 1,2", "--sky: got '1,2'", 2},
      {"--sky clear:0.5", "--sky: got 'clear:0.5'", 2},
      {"--sky clear:2,3", "--sky: got 'clear:2,3'", 2},
      {"--sky clear --ground-albedo 1.5", "--ground-albedo: got '1.5'", 2},
      {"--write-deep-shadow a.png", "--write-deep-shadow: got 'a.png'", 2},
      {"--shadow-multiplier lamp=1,1,1", "no light is called 'lamp'; there are: sun", 1},
      {"--sun a=1,2 --point a=1,2,3,4", "the name 'a' is taken twice", 1},
      {"--point 1e9,0,0,4", "use a sun", 1},
      {"--point 1,2,3,1e30", "point: expected three numbers", 1},
      {"--sky nowhere.exr", "nowhere.exr: cannot be read", 1},
      {"--sky " + file("broken.hdr"), "broken.hdr: is damaged: 0 bytes cannot hold 4 x 2 pixels", 1},
      {"--read-deep-shadow " + file("map.exr"), "map.exr: is not a deep image", 1},
      {"--point 0.1,0,0,1 --shadows deep", "choose shadows from a volume", 1},
      {"--point 2e9,0,0,4", "point: expected a position at most 1e+09 from the origin", 1},
      {"--sun key=60,30,3 --light-decay key=linear", "--light-decay: 'key' is a sun", 1},
      {"--sky clear --sky-rotation 30", "--sky-rotation: turns a map", 2},
  };
  for (const auto& c : cases) {
    const ProgramResult result = render(c.options, "bad.exr");
    EXPECT_EQ(result.exitCode, c.exitCode) << c.options;
    EXPECT_NE(result.errors.find(c.message), std::string::npos) << c.options << ": " << result.errors;
    EXPECT_FALSE(std::filesystem::exists(data_->file("bad.exr")));
  }
}

TEST_F(LightOptions, ADeepShadowIsThatOfItsLightOnly) {
  const ProgramResult made = render("--sun 60,30 --write-deep-shadow " + file("sun.exr"));
  ASSERT_EQ(made.exitCode, 0) << made.errors;
  EXPECT_EQ(render("--sun 60,30 --read-deep-shadow " + file("sun.exr")).exitCode, 0);
  const ProgramResult other = render("--sun 61,30 --read-deep-shadow " + file("sun.exr"));
  EXPECT_EQ(other.exitCode, 1);
  EXPECT_NE(other.errors.find("sun.exr: was made for another light"), std::string::npos) << other.errors;
  EXPECT_EQ(render("--point 0,0,9,50 --read-deep-shadow " + file("sun.exr")).exitCode, 1);
}

TEST_F(LightOptions, IntensityMultipliesAnEvenSky) {
  const Image once = picture("--sun none --sky 0.5,0.5,0.5"),
              twice = picture("--sun none --sky 0.5,0.5,0.5 --sky-intensity 2");
  EXPECT_NEAR(twice.at("G", 8, 6), 2 * once.at("G", 8, 6), 2e-3f * twice.at("G", 8, 6));
}

// A grey of 128 of 255 is 0.216 of the light on the curve of sRGB and 0.502 of it as it stands: times 2.325.
TEST_F(LightOptions, SkiesFromPngAreOnTheCurveOfTheirFileOrOnTheOneThatIsSaid) {
  PngPicture picture{.width = 2};
  picture.rows = std::string(7, '\x80');
  picture.rows[0] = '\0';
  std::ofstream(data_->file("sky.PNG"), std::ios::binary) << picture.with("");
  const std::string sky = "--sun none --sky " + file("sky.PNG");
  const float curved = this->picture(sky).at("G", 8, 6);
  EXPECT_GT(curved, 0.01f);
  EXPECT_EQ(this->picture(sky + " --sky-encoding srgb").at("G", 8, 6), curved);
  const double linear = double(this->picture(sky + " --sky-encoding linear").at("G", 8, 6));
  EXPECT_NEAR(linear, 2.325 * double(curved), 0.01 * linear);
}

}  // namespace
}  // namespace nephele::test
