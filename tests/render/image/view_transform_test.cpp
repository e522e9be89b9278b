#include "nephele/render/image/view_transform.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

constexpr ViewCurve kCurves[] = {ViewCurve::standard, ViewCurve::filmic, ViewCurve::agx, ViewCurve::raw};

Image pixel(const Vec3f& colour) {
  Image image;
  image.width = image.height = 1;
  image.add("R").values[0] = colour.x;
  image.add("G").values[0] = colour.y;
  image.add("B").values[0] = colour.z;
  image.add("A").values[0] = 1;
  return image;
}

Vec3f shown(const Vec3f& colour, ViewCurve curve) {
  ViewTransform view;
  view.curve = curve;
  const std::vector<float> screen = displayed(pixel(colour), view);
  return {screen[0], screen[1], screen[2]};
}

float grey(float value, ViewCurve curve) {
  return shown({value, value, value}, curve).y;
}

// Degrees about the axis of greys, red at 0.
double hue(const Vec3f& v) {
  const auto [r, g, b] = Vec3d(v);
  return std::atan2(std::sqrt(3) * (g - b), 2 * r - g - b) * 180 / std::numbers::pi;
}

// IEC 61966-2-1
double srgb(double x) {
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

TEST(ViewTransform, GreysRiseFromBlackAndStayGrey) {
  for (const ViewCurve curve : kCurves) {
    float last = -1;
    for (float light = 1.0f / 4096; light < 0.99f; light *= 1.05f) {
      const Vec3f v = shown({light, light, light}, curve);
      EXPECT_GE(v.y, last) << light;
      EXPECT_LE(v.y, 1.0f);
      EXPECT_NEAR(v.x, v.y, 5e-4f);
      EXPECT_NEAR(v.z, v.y, 5e-4f);
      last = v.y;
    }
    EXPECT_EQ(shown({}, curve), Vec3f());
    EXPECT_NEAR(grey(1e30f, curve), 1.0f, 1e-4f);
  }
}

// 0.461 is what the sRGB curve makes of 0.18.
TEST(ViewTransform, MiddleGreyStaysInTheMiddle) {
  EXPECT_NEAR(grey(0.18f, ViewCurve::standard), 0.4613f, 1e-4f);
  EXPECT_NEAR(grey(0.18f, ViewCurve::filmic), 0.4613f, 0.005f);
  EXPECT_NEAR(grey(0.18f, ViewCurve::agx), 0.5f, 0.002f);
  EXPECT_EQ(grey(0.18f, ViewCurve::raw), 0.18f);
}

// Of light of 1, 2, 4 and 8: at least a step of 8 bits apart, and no white.
TEST(ViewTransform, HighlightsAreToldApart) {
  for (const ViewCurve curve : {ViewCurve::filmic, ViewCurve::agx}) {
    float last = 0;
    for (const float light : {1.0f, 2.0f, 4.0f, 8.0f}) {
      const float value = grey(light, curve);
      EXPECT_GT(value, last + 1.0f / 255) << light;
      EXPECT_LT(value, 254.0f / 255) << light;
      last = value;
    }
  }
}

// S. Hill's formula: the matrices take grey to grey.
TEST(ViewTransform, FilmicIsTheFitOfTheAcesTransforms) {
  for (const double light : {0.01, 0.05, 0.18, 0.5, 1.0, 3.0, 10.0}) {
    const double x = 1.458 * light;
    const double y = (x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.4329510) + 0.238081);
    EXPECT_NEAR(grey(float(light), ViewCurve::filmic), srgb(y), 1e-4) << light;
  }
}

// B. Wrensch's polynomial for the same table, "Minimal AgX Implementation", mean squared error 3.7e-6.
TEST(ViewTransform, AgxIsTheDefaultContrast) {
  for (double x = 0; x <= 1; x += 0.01) {
    const double light = std::exp2(-12.47393 + x * 16.5);
    const double fit =
        -0.00232 + x * (0.1191 + x * (0.4298 + x * (-6.868 + x * (31.96 + x * (-40.14 + x * 15.5)))));
    EXPECT_NEAR(grey(float(light), ViewCurve::agx), fit, 0.006) << x;
  }
}

// Hue is that of light, not of screen values: this undoes the sRGB curve.
double hueTurned(const Vec3f& colour, ViewCurve curve) {
  const auto light = [](float s) {
    return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
  };
  const Vec3f v = shown(colour, curve);
  return std::fabs(hue({light(v.x), light(v.y), light(v.z)}) - hue(colour));
}

// Of a flame, a clear sky and leaves. Channels by themselves turn the brightest of them by 32 to 39 degrees;
// what filmic and agx turn, 12.4 and 18.4 at most, comes from a second implementation in double precision.
TEST(ViewTransform, SaturatedLightKeepsItsHue) {
  for (const Vec3f colour : {Vec3f(1, 0.34f, 0.04f), Vec3f(0.2f, 0.45f, 1), Vec3f(0.3f, 1, 0.2f)}) {
    for (const float brightness : {0.2f, 1.0f, 4.0f}) {
      EXPECT_LT(hueTurned(brightness * colour, ViewCurve::filmic), 12.5) << colour.x << " x " << brightness;
      EXPECT_LT(hueTurned(brightness * colour, ViewCurve::agx), 18.5) << colour.x << " x " << brightness;
    }
    EXPECT_GT(hueTurned(4.0f * colour, ViewCurve::standard), 30) << colour.x;
  }
  // Fire is not one yellow: what is brighter is paler.
  for (const ViewCurve curve : {ViewCurve::filmic, ViewCurve::agx})
    EXPECT_GT(shown({6, 2, 0.2f}, curve).z, shown({1.5f, 0.5f, 0.05f}, curve).z + 0.1f);
}

TEST(ViewTransform, RawIsTheLightItself) {
  EXPECT_EQ(shown({0.25f, 0.5f, 0.75f}, ViewCurve::raw), Vec3f(0.25f, 0.5f, 0.75f));
  EXPECT_EQ(shown({-1, 2, 1}, ViewCurve::raw), Vec3f(0, 1, 1));
}

TEST(ViewTransform, TakesWhatIsNotFinite) {
  for (const ViewCurve curve : kCurves)
    for (const float x : {NAN, INFINITY, -INFINITY, 3e38f}) {
      const Vec3f v = shown({x, 0.5f, x}, curve);
      for (int c = 0; c != 3; ++c) EXPECT_TRUE(v[c] >= 0 && v[c] <= 1) << x;
    }
}

TEST(ViewTransform, AConfigViewTakesThePlaceOfTheCurve) {
  ViewTransform view;
  view.exposureStops = 1;
  view.configView = std::make_shared<ConfigView>(ConfigView{"mine", [](std::span<float> rgb) {
                                                              for (float& v : rgb) v = v * 3 - 1;
                                                            }});
  const std::vector<float> screen = displayed(pixel({0.2f, 0.1f, 0.5f}), view);
  EXPECT_NEAR(screen[0], 0.2f, 1e-6f);
  EXPECT_EQ(screen[1], 0.0f);
  EXPECT_EQ(screen[2], 1.0f);
  EXPECT_EQ(view.name(), "mine");
}

// A file of raw numbers says so (gAMA of 1), and comes back as light.
TEST(ViewTransform, PicturesSayWhichViewTheyShow) {
  const test::TemporaryFolder folder;
  for (const ViewCurve curve : kCurves) {
    ViewTransform view;
    view.curve = curve;
    writePng(folder.file("a.png"), pixel({0.2f, 0.4f, 0.8f}), view, {});
    const std::vector<std::string> lines = describeImage(folder.file("a.png"));
    EXPECT_EQ(std::ranges::count(lines, "view_transform: " + view.name()), 1) << view.name();
    const bool isSrgb = test::textOf(folder.file("a.png")).find("sRGB") != std::string::npos;
    EXPECT_EQ(isSrgb, curve != ViewCurve::raw);
  }
}

}  // namespace
}  // namespace nephele
