#include "nephele/render/image/text.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

Image blank(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  return image;
}

Image drawn(const std::string& text, double height = 14) {
  Image image = blank(120, 40);
  drawText(image, text, {10, 30, height}, {1, 0.5f, 0});
  return image;
}

// The box of what was drawn: x0, x1, y0, y1.
std::array<int, 4> boxOf(const Image& image) {
  std::array<int, 4> box{image.width, -1, image.height, -1};
  for (int y = 0; y != image.height; ++y)
    for (int x = 0; x != image.width; ++x)
      if (image.at("A", x, y) > 0)
        box = {std::min(box[0], x), std::max(box[1], x), std::min(box[2], y), std::max(box[3], y)};
  return box;
}

TEST(Text, StandsWhereItIsPutAndIsAsWideAsItSays) {
  const auto [left, right, top, bottom] = boxOf(drawn("HEAD 12"));
  // Strokes reach half a width, one pixel here, beyond the lines that they follow.
  EXPECT_NEAR(left, 10, 1);
  EXPECT_NEAR(right, 10 + 14 * textWidth("HEAD 12") - 1, 1);
  EXPECT_NEAR(top, 30 - 14 - 1, 1);
  EXPECT_NEAR(bottom, 30, 1);
  EXPECT_EQ(textWidth(""), 0);
  EXPECT_LT(textWidth("il"), textWidth("MW"));
}

TEST(Text, IsDrawnInItsColour) {
  const Image image = drawn("H");
  float most = 0;
  for (std::size_t i = 0; i != image.channel("A").values.size(); ++i) {
    const float cover = image.channel("A").values[i];
    most = std::max(most, cover);
    EXPECT_EQ(image.channel("R").values[i], cover);
    EXPECT_EQ(image.channel("G").values[i], 0.5f * cover);
    EXPECT_EQ(image.channel("B").values[i], 0);
  }
  EXPECT_EQ(most, 1);
}

// Nobody should read one sign for another.
TEST(Text, SignsDiffer) {
  std::set<std::vector<float>> pictures;
  int count = 0;
  for (char sign = 'a'; sign <= 'z'; ++sign, ++count) pictures.insert(drawn({sign}).channel("A").values);
  for (char sign = 'A'; sign <= 'Z'; ++sign, ++count) pictures.insert(drawn({sign}).channel("A").values);
  for (const char sign : std::string("0123456789.,:;-+=/\\%()[]#_|*!?<>'\"~@"))
    pictures.insert(drawn({sign}).channel("A").values), ++count;
  // One frame for all others.
  pictures.insert(drawn("&").channel("A").values);
  pictures.insert(drawn("\xe9").channel("A").values);
  EXPECT_EQ(int(pictures.size()), count + 1);
}

TEST(Text, EndsAtTheEdgesOfTheImage) {
  for (const double x : {-30.0, 110.0, 500.0}) {
    Image image = blank(120, 40);
    EXPECT_NO_THROW(drawText(image, "seed 12", {x, 3, 20}, {1, 1, 1}));
    EXPECT_NO_THROW(drawText(image, "seed 12", {x, 55, 20}, {1, 1, 1}));
  }
}

TEST(Text, RefusesWhatItCannotDraw) {
  Image image = blank(8, 8);
  EXPECT_THROW(drawText(image, "a", {0, 0, 0}, {}), Error);
  image.channels.pop_back();
  EXPECT_THROW(drawText(image, "a", {0, 8, 8}, {}), Error);
}

}  // namespace
}  // namespace nephele
