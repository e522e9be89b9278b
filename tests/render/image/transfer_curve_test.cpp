// How the numbers of PNG files become light. The curve of sRGB is that of IEC 61966-2-1, worked out here
// anew; the others are powers and tables that the files name.
#include "nephele/render/image/transfer_curve.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/scene/environment.h"
#include "tests/support/png_bytes.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

using test::bigEndian;
using test::pngChunk;
using test::PngPicture;
using test::TemporaryFolder;

double srgbLight(double x) {
  return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4);
}

std::string fixed(double value) {
  return bigEndian(std::uint32_t(std::int32_t(std::lround(value * 65536))));
}

// An ICC profile of a screen or, for grey pictures, of a printer of grey, with one curve for all.
std::string profileOf(const std::string& curve, bool isGrey = false) {
  const std::string names[] = {isGrey ? "kTRC" : "rTRC", "gTRC", "bTRC"};
  const std::uint32_t count = isGrey ? 1 : 3, size = std::uint32_t(132 + 12 * count + curve.size());
  std::string bytes(132, '\0');
  const auto put = [&](std::size_t at, const std::string& text) { bytes.replace(at, text.size(), text); };
  put(0, bigEndian(size));
  put(8, bigEndian(0x02400000));
  put(12, "mntr" + std::string(isGrey ? "GRAY" : "RGB ") + "XYZ ");
  put(36, "acsp");
  put(68, bigEndian(0xf6d6) + bigEndian(0x10000) + bigEndian(0xd32d));
  put(128, bigEndian(count));
  for (std::uint32_t i = 0; i != count; ++i)
    bytes += names[i] + bigEndian(132 + 12 * count) + bigEndian(std::uint32_t(curve.size()));
  return bytes + curve;
}

std::string profileChunk(const std::string& profile) {
  return pngChunk("iCCP", std::string("test\0\0", 6) + test::stored(profile));
}

const std::string kZeros(4, '\0');

class PngLight : public testing::Test {
 protected:
  // Of a pixel of 128, 64 and 10 of 255.
  Vec3f light(const std::string& chunks, ColourEncoding encoding = ColourEncoding::automatic) {
    picture_.rows = std::string{'\0', '\x80', '\x40', '\x0a'};
    std::ofstream(path_, std::ios::binary) << picture_.with(chunks);
    const Image image = readLinearImage(path_, encoding);
    return {image.at("R", 0, 0), image.at("G", 0, 0), image.at("B", 0, 0)};
  }

  static void expectCurve(const Vec3f& light, double (*curve)(double)) {
    EXPECT_NEAR(light.x, curve(128.0 / 255), 1e-6);
    EXPECT_NEAR(light.y, curve(64.0 / 255), 1e-6);
    EXPECT_NEAR(light.z, curve(10.0 / 255), 1e-6);
  }

  TemporaryFolder folder_;
  std::string path_ = folder_.file("a.PNG");
  PngPicture picture_{};
};

TEST_F(PngLight, IsWhatTheFileSays) {
  const std::string linear = pngChunk("gAMA", bigEndian(100000)),
                    said = pngChunk("sRGB", std::string(1, '\0'));
  expectCurve(light(""), srgbLight);
  expectCurve(light(said), srgbLight);
  expectCurve(light(linear), [](double x) { return x; });
  expectCurve(light(pngChunk("gAMA", bigEndian(50000))), [](double x) { return x * x; });
  // Of two, sRGB is the more exact one.
  expectCurve(light(said + linear), srgbLight);
  const std::string cubic = profileChunk(profileOf("curv" + kZeros + bigEndian(1) + std::string("\3\0", 2)));
  expectCurve(light(linear + cubic), [](double x) { return x * x * x; });
}

TEST_F(PngLight, IsThatOfAProfile) {
  const auto of = [&](const std::string& curve) { return light(profileChunk(profileOf(curve))); };
  expectCurve(of("curv" + kZeros + bigEndian(0)), [](double x) { return x; });
  // 0, 0.25 and 1 of 65535 at 0, 1/2 and 1.
  expectCurve(of("curv" + kZeros + bigEndian(3) + std::string("\0\0\x40\0\xff\xff", 6)), [](double x) {
    const double quarter = 0x4000 / 65535.0;
    return x < 0.5 ? 2 * x * quarter : quarter + (2 * x - 1) * (1 - quarter);
  });
  const std::string srgb = "para" + kZeros + std::string("\0\3\0\0", 4) + fixed(2.4) + fixed(1 / 1.055) +
                           fixed(0.055 / 1.055) + fixed(1 / 12.92) + fixed(0.04045);
  const Vec3f close = of(srgb);
  // Numbers of profiles have 16 bits behind the point.
  EXPECT_NEAR(close.x, srgbLight(128.0 / 255), 5e-5);
  EXPECT_NEAR(close.z, srgbLight(10.0 / 255), 5e-5);
  // A table of 2^30 values that is not there, and a kind of curve that there is none: as if nothing was said.
  expectCurve(of("curv" + kZeros + bigEndian(1u << 30)), srgbLight);
  expectCurve(of("para" + kZeros + std::string("\0\x9\0\0", 4) + fixed(2)), srgbLight);
}

TEST_F(PngLight, IsWhatTheUserSays) {
  const std::string linear = pngChunk("gAMA", bigEndian(100000));
  expectCurve(light("", ColourEncoding::linear), [](double x) { return x; });
  expectCurve(light(linear, ColourEncoding::srgb), srgbLight);
}

TEST_F(PngLight, IsTheSameForGreyAndForSixteenBits) {
  picture_.depth = 16;
  picture_.colourType = 0;
  picture_.rows = std::string{'\0', '\x80', '\x00'};
  const double value = 0x8000 / 65535.0;
  const auto grey = [&](const std::string& chunks) {
    std::ofstream(path_, std::ios::binary) << picture_.with(chunks);
    const Image image = readLinearImage(path_);
    EXPECT_EQ(image.at("R", 0, 0), image.at("B", 0, 0));
    return image.at("G", 0, 0);
  };
  EXPECT_NEAR(grey(""), srgbLight(value), 1e-6);
  EXPECT_NEAR(grey(pngChunk("gAMA", bigEndian(100000))), value, 1e-6);
  const std::string square = "curv" + kZeros + bigEndian(1) + std::string("\2\0", 2);
  EXPECT_NEAR(grey(profileChunk(profileOf(square, true))), value * value, 1e-6);
}

TEST_F(PngLight, IsMultipliedByTheOpacity) {
  picture_.width = 2;
  picture_.colourType = 6;
  picture_.rows = std::string("\0\xff\x80\0\x40\xff\xff\xff\0", 9);
  std::ofstream(path_, std::ios::binary) << picture_.with("");
  const auto expectPixel = [](const Image& image, int x, const std::array<double, 4>& values) {
    for (std::size_t c = 0; c != 4; ++c)
      EXPECT_NEAR(image.at(std::string(1, "RGBA"[c]), x, 0), values[c], 1e-6);
  };
  const double opacity = 64 / 255.0;
  const Image image = readLinearImage(path_);
  expectPixel(image, 0, {opacity, srgbLight(128 / 255.0) * opacity, 0, opacity});
  expectPixel(image, 1, {0, 0, 0, 0});
  expectPixel(readLinearImage(path_, ColourEncoding::linear), 0,
              {opacity, 128 / 255.0 * opacity, 0, opacity});
  // Grey with opacity.
  picture_.colourType = 4;
  picture_.rows = std::string("\0\x80\x40\xff\0", 5);
  std::ofstream(path_, std::ios::binary) << picture_.with("");
  EXPECT_NEAR(readLinearImage(path_).at("G", 0, 0), srgbLight(128 / 255.0) * opacity, 1e-6);
}

TEST_F(PngLight, IsThatOfSkies) {
  picture_.width = 2;
  picture_.rows = std::string{'\0', '\x80', '\x80', '\x80', '\x80', '\x80', '\x80'};
  std::ofstream(path_, std::ios::binary) << picture_.with("");
  EXPECT_NEAR(Environment::read(path_).mean().y, srgbLight(128.0 / 255), 1e-6);
  const Environment::Options linear{.encoding = ColourEncoding::linear};
  EXPECT_NEAR(Environment::read(path_, linear).mean().y, 128.0 / 255, 1e-6);
}

TEST(TransferCurve, GoesOnBeyondOneAndBelowZero) {
  EXPECT_NEAR(TransferCurve::srgb()(2), std::pow(2.055 / 1.055, 2.4), 1e-6);
  EXPECT_NEAR(TransferCurve::srgb()(-0.5f), -0.5 / 12.92, 1e-6);
  EXPECT_EQ(TransferCurve::power(2)(-3), -9);
  EXPECT_EQ(TransferCurve::linear()(-3), -3);
}

}  // namespace
}  // namespace nephele
