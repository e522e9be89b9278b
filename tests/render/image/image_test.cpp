#include "nephele/render/image/image.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/view_transform.h"

namespace nephele {
namespace {

Image grey(float value, float alpha) {
  Image image;
  image.width = image.height = 1;
  for (const char* name : {"R", "G", "B"}) image.add(name).values[0] = value;
  image.add("A").values[0] = alpha;
  return image;
}

// IEC 61966-2-1
float sRgb(float x) {
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f;
}

TEST(Image, ShowsMidtonesThroughTheSrgbCurveAlone) {
  for (const float value : {0.0f, 0.001f, 0.18f, 0.6f})
    EXPECT_NEAR(displayed(grey(value, 1), {})[0], sRgb(value), 1e-6f);
}

TEST(Image, CompressesHighlightsWithoutReachingWhite) {
  float last = displayed(grey(0.6f, 1), {})[0];
  for (const float value : {0.7f, 1.0f, 1.5f, 3.0f}) {
    const float shown = displayed(grey(value, 1), {})[1];
    EXPECT_GT(shown, last);
    EXPECT_LT(shown, 1.0f);
    last = shown;
  }
}

TEST(Image, PutsTheBackgroundBehindPremultipliedColour) {
  ViewTransform view;
  view.background = {0.1f, 0.2f, 0.4f};
  // 0.25 + (1 - 0.5) 0.4
  EXPECT_NEAR(displayed(grey(0.25f, 0.5f), view)[2], sRgb(0.45f), 1e-6f);
  view.exposureStops = -1;
  EXPECT_NEAR(displayed(grey(0.25f, 0.5f), view)[2], sRgb(0.225f), 1e-6f);
}

TEST(Image, NamesAChannelThatIsMissing) {
  Image image;
  image.width = image.height = 1;
  EXPECT_THROW(displayed(image, {}), Error);
}

TEST(Image, CountsWhatNoFileCanHold) {
  Image image;
  image.width = image.height = 2;
  image.add("R").values = {NAN, INFINITY, -INFINITY, 1};
  EXPECT_EQ(notFiniteCount(image), 3u);
  // An infinite depth says that nothing is there.
  for (const char* name : {"Z", "Z_median"}) image.add(name, false).values = {INFINITY, INFINITY, 1, 2};
  EXPECT_EQ(notFiniteCount(image), 3u);
  image.channels.back().values[3] = NAN;
  image.add("normal.X", false).values[0] = INFINITY;
  EXPECT_EQ(notFiniteCount(image), 5u);
}

}  // namespace
}  // namespace nephele
