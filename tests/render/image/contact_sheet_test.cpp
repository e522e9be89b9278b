#include "nephele/render/image/contact_sheet.h"

#include <gtest/gtest.h>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

// A frame of one colour, opaque.
Image plain(int width, int height, float value) {
  Image image;
  image.width = width;
  image.height = height;
  for (const char* name : {"R", "G", "B", "A"})
    for (float& v : image.add(name).values) v = name[0] == 'A' ? 1.0f : value;
  return image;
}

TEST(ContactSheet, PutsFramesInRowsFromTheUpperLeft) {
  ContactSheet sheet(6, 32, 18, {.width = 200, .gap = 2});
  // 3 x 2 cells of 16:9 are 8:3, 2 x 3 are 32:27; 16:9 lies nearer to the former: 1.5 against 1.5 apart, the
  // fewer columns first.
  const int columns = sheet.columns();
  EXPECT_EQ(columns * sheet.rows(), 6);
  for (int i = 0; i != 6; ++i) sheet.set(i, plain(32, 18, 0.1f * float(i + 1)));
  const Image& image = sheet.image();
  EXPECT_EQ(image.width, columns * 32 + 2 * (columns + 1));
  EXPECT_EQ(image.height, sheet.rows() * 18 + 2 * (sheet.rows() + 1));
  for (int i = 0; i != 6; ++i)
    EXPECT_FLOAT_EQ(image.at("R", 2 + i % columns * 34 + 16, 2 + i / columns * 20 + 9), 0.1f * float(i + 1));
  EXPECT_EQ(image.at("R", 0, 0), 0.0f);
  EXPECT_EQ(image.at("A", 0, 0), 1.0f);
}

TEST(ContactSheet, ShrinksFramesByTheirMean) {
  // A single bright pixel in each of 10 x 10: its mean is the same at any size.
  Image frame = plain(100, 100, 0.0f);
  for (int y = 3; y < 100; y += 10)
    for (int x = 7; x < 100; x += 10) frame.channels[0].values[std::size_t(y * 100 + x)] = 1.0f;
  ContactSheet sheet(1, 100, 100, {.width = 37, .gap = 0});
  sheet.set(0, frame);
  ASSERT_EQ(sheet.image().width, 37);
  double sum = 0;
  for (const float value : sheet.image().channel("R").values) sum += value;
  EXPECT_NEAR(sum / (37 * 37), 0.01, 1e-6);
}

TEST(ContactSheet, ShowsFramesInFrontOfTheirBackdrop) {
  // Half opaque 0.2 in front of 0.6: 0.2 + 0.5 x 0.6, and nothing is left to see through.
  Image frame = plain(16, 16, 0.2f);
  for (float& alpha : frame.channels[3].values) alpha = 0.5f;
  for (const char* name : {"backdrop.R", "backdrop.G", "backdrop.B"})
    for (float& v : frame.add(name).values) v = 0.6f;
  ContactSheet sheet(1, 16, 16, {.gap = 0});
  sheet.set(0, frame);
  EXPECT_FLOAT_EQ(sheet.image().at("G", 8, 8), 0.5f);
  EXPECT_FLOAT_EQ(sheet.image().at("A", 8, 8), 1.0f);
}

TEST(ContactSheet, FitsItsWidthAndNeverEnlarges) {
  for (const int count : {1, 2, 5, 8, 48, 99, 100}) {
    const ContactSheet sheet(count, 960, 540);
    EXPECT_LE(sheet.image().width, 1920) << count;
    EXPECT_GE(sheet.columns() * sheet.rows(), count);
    EXPECT_LE((sheet.rows() - 1) * sheet.columns(), count);
    EXPECT_EQ(int(sheet.shown().size()), count);
  }
  EXPECT_EQ(ContactSheet(1, 8, 8).image().width, 8 + 2 * 4);
}

TEST(ContactSheet, ShowsAnEvenChoiceOfManyFrames) {
  const ContactSheet sheet(1000, 64, 36);
  ASSERT_EQ(sheet.shown().size(), 100u);
  for (int i = 0; i != 100; ++i) EXPECT_EQ(sheet.shown()[std::size_t(i)], 10 * i);
}

TEST(ContactSheet, RefusesFramesThatDoNotFit) {
  ContactSheet sheet(2, 32, 18);
  EXPECT_THROW(sheet.set(0, plain(32, 19, 0)), Error);
  EXPECT_THROW(sheet.set(2, plain(32, 18, 0)), Error);
  EXPECT_THROW(ContactSheet(0, 32, 18), Error);
  EXPECT_THROW(ContactSheet(1, 0, 18), Error);
}

TEST(ContactSheet, WritesALabelBelowEachFrame) {
  const ContactSheetOptions options{
      .width = 400,
      .gap = 4,
      .columns = 1,
      .labels = {"seed 1", "a name that is much too long for so small a frame"}};
  ContactSheet sheet(2, 100, 60, options);
  EXPECT_EQ(sheet.columns(), 1);
  // The clamp of the band is 14 pixels.
  EXPECT_EQ(sheet.image().height, 2 * (60 + 14) + 3 * 4);
  const auto light = [&](int x0, int y0, int x1, int y1) {
    double sum = 0;
    for (int y = y0; y != y1; ++y)
      for (int x = x0; x != x1; ++x) sum += double(sheet.image().at("G", x, y));
    return sum;
  };
  EXPECT_EQ(light(0, 0, 108, 64), 0);
  EXPECT_GT(light(4, 64, 104, 78), 5);
  EXPECT_EQ(light(4, 78, 104, 142), 0);
  EXPECT_GT(light(4, 142, 104, 156), 5);
  // In the middle, and within the frame's width where there is much of it.
  EXPECT_NEAR(light(4, 64, 54, 78) / light(4, 64, 104, 78), 0.5, 0.15);
  EXPECT_EQ(light(0, 142, 4, 156) + light(104, 142, 108, 156), 0);
  EXPECT_THROW(ContactSheet(3, 100, 60, options), Error);
  EXPECT_THROW(ContactSheet(2, 100, 60, {.columns = 0}), Error);
}

}  // namespace
}  // namespace nephele
