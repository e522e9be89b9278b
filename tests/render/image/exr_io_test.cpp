#include "nephele/render/image/exr_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/scene/camera.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele {
namespace {

const Camera& someCamera() {
  static const Camera camera = Camera::lookingAt({1, 2, 3}, {0, 0, 0}, {0, 1, 0}, {7, 5, 40});
  return camera;
}

Image someImage() {
  Image image;
  image.width = 7;
  image.height = 5;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  image.add("Z", false);
  image.add("light_sun.R", false);
  for (std::size_t c = 0; c != image.channels.size(); ++c)
    for (std::size_t i = 0; i != 35; ++i) image.channels[c].values[i] = float(c) + float(i) / 64;
  return image;
}

bool says(const std::vector<std::string>& lines, const std::string& text) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string& line) { return line.find(text) != std::string::npos; });
}

TEST(ExrIo, ReadsBackWhatItWrote) {
  const test::TemporaryFolder folder;
  Image image = someImage();
  image.channels[4].values[3] = std::numeric_limits<float>::infinity();
  image.channels[5].values[4] = 1.0f / 3;
  writeExr(folder.file("a.exr"), image, someCamera());
  const Image back = readImage(folder.file("a.exr"));
  ASSERT_EQ(back.channels.size(), 6u);
  for (const Image::Channel& channel : image.channels) {
    const Image::Channel& read = back.channel(channel.name);
    EXPECT_EQ(read.half, channel.half) << channel.name;
    // All values are multiples of 1/64 below 16, which half holds exactly, but for the two that float does.
    EXPECT_EQ(read.values, channel.values) << channel.name;
  }
  EXPECT_EQ(folder.entryCount(), 1u);
}

TEST(ExrIo, ClampsWhatHalfCannotHold) {
  const test::TemporaryFolder folder;
  Image image = someImage();
  image.channels[0].values[0] = 1e6f;
  image.channels[1].values[0] = std::numeric_limits<float>::quiet_NaN();
  writeExr(folder.file("a.exr"), image, someCamera());
  const Image back = readImage(folder.file("a.exr"));
  EXPECT_EQ(back.at("R", 0, 0), 65504.0f);
  EXPECT_EQ(back.at("G", 0, 0), 0.0f);
}

TEST(ExrIo, CarriesCameraColourAndMetadata) {
  const test::TemporaryFolder folder;
  writeExr(folder.file("a.exr"), someImage(), someCamera(),
           {{"commandLine", "nephele render x"}, {"seed", "7"}});
  const std::vector<std::string> lines = describeImage(folder.file("a.exr"));
  EXPECT_TRUE(says(lines, "image 7 x 5, 6 channels, OpenEXR"));
  EXPECT_TRUE(says(lines, "channel R: half, 0 to 0.53125"));
  EXPECT_TRUE(says(lines, "channel Z: float"));
  EXPECT_TRUE(says(lines, "layers: light_sun"));
  EXPECT_TRUE(says(lines, "compression: zip"));
  EXPECT_TRUE(says(lines, "commandLine: nephele render x"));
  EXPECT_TRUE(says(lines, "seed: 7"));
  EXPECT_TRUE(says(lines, "worldToCamera: "));
  EXPECT_TRUE(says(lines, "worldToNDC: "));
  // Rec. 709 red.
  EXPECT_TRUE(says(lines, "chromaticities: red 0.64,0.33"));
}

TEST(ExrIo, LeavesNothingWhereItCannotWrite) {
  const test::TemporaryFolder folder;
  EXPECT_THROW(writeExr(folder.file("missing/a.exr"), someImage(), someCamera()), Error);
  EXPECT_THROW(writePng(folder.file("missing/a.png"), someImage(), {}), Error);
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(ExrIo, RefusesAChannelThatHasNotAValueForEveryPixel) {
  // Rows of pixels that are not there would be read from behind the channel's memory.
  const test::TemporaryFolder folder;
  Image image = someImage();
  image.channels[0].values.pop_back();
  EXPECT_THROW(writeExr(folder.file("a.exr"), image, someCamera()), Error);
  EXPECT_THROW(writePng(folder.file("a.png"), image, {}), Error);
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(ExrIo, SaysInOneLineWhichChannelIsOfAnotherSize) {
  Image image = someImage();
  image.channels[0].name = "two\nlines";
  image.channels[0].values.pop_back();
  try {
    image.check();
    ADD_FAILURE() << "a channel without its last pixel was taken";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "image: the channel two\\nlines has 34 values, but the size is 7x5");
  }
}

TEST(ExrIo, NamesTheFileOfAPictureWithoutChannels) {
  const test::TemporaryFolder folder;
  Image image = someImage();
  image.channels.clear();
  try {
    writeExr(folder.file("a.exr"), image, someCamera());
    ADD_FAILURE() << "a picture of nothing was written";
  } catch (const Error& error) {
    EXPECT_EQ(error.what(), folder.file("a.exr") + ": the image has no channels");
  }
}

TEST(ExrIo, NamesTheFileOfAPictureWithoutAlpha) {
  const test::TemporaryFolder folder;
  Image image = someImage();
  std::erase_if(image.channels, [](const Image::Channel& channel) { return channel.name == "A"; });
  try {
    writePng(folder.file("a.png"), image, {});
    ADD_FAILURE() << "a preview was made without alpha";
  } catch (const Error& error) {
    EXPECT_TRUE(std::string(error.what()).starts_with(folder.file("a.png"))) << error.what();
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(ExrIo, NamesTheFileThatItCannotRead) {
  const test::TemporaryFolder folder;
  std::vector<std::string> paths{folder.file("missing.exr"), test::ownData("CMakeLists.txt")};
  for (const char* name : {"malformed/damaged_1.exr", "malformed/damaged_3.exr"})
    if (std::filesystem::exists(test::sharedData(name))) paths.push_back(test::sharedData(name));
  for (const std::string& path : paths) {
    try {
      describeImage(path);
      ADD_FAILURE() << path << " was read";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    }
  }
}

TEST(PngIo, WritesWhatTheScreenShows) {
  const test::TemporaryFolder folder;
  const Image image = someImage();
  ViewTransform view;
  view.background = {0.2f, 0.3f, 0.5f};
  writePng(folder.file("a.png"), image, view, {{"seed", "7"}});
  const Image back = readImage(folder.file("a.png"));
  ASSERT_EQ(back.channels.size(), 3u);
  const std::vector<float> screen = displayed(image, view);
  for (std::size_t i = 0; i != 35; ++i)
    for (std::size_t c = 0; c != 3; ++c)
      // A step of 8 bits, and the dither's half.
      EXPECT_NEAR(back.channels[c].values[i], screen[i * 3 + c], 1.01 / 255);
  EXPECT_EQ(folder.entryCount(), 1u);
}

// A plain text chunk (tEXt) is in Latin-1, an international one (iTXt) in UTF-8: PNG specification, 11.3.4.
TEST(PngIo, TextsBeyondAsciiAreInUtf8) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.png"), title = "Wölkchen 雲 ☁", bytes = "caf\xe9";
  writePng(path, someImage(), {}, {{"seed", "7"}, {"title", title}, {"bytes", bytes}});
  const std::string file = test::textOf(path);
  EXPECT_NE(file.find("tEXtseed"), std::string::npos);
  // Keyword, not compressed, no language, no translated keyword.
  EXPECT_NE(file.find("iTXttitle" + std::string(5, '\0') + title), std::string::npos);
  EXPECT_NE(file.find("tEXtbytes" + std::string(1, '\0') + bytes), std::string::npos) << "no UTF-8";
  const std::vector<std::string> lines = describeImage(path);
  for (const std::string line : {"seed: 7", "bytes: café"})
    EXPECT_NE(std::find(lines.begin(), lines.end(), line), lines.end()) << line;
  EXPECT_NE(std::find(lines.begin(), lines.end(), "title: " + title), lines.end());
}

TEST(ExrIo, KeepsWhereAPartOfAPictureBelongs) {
  const test::TemporaryFolder folder;
  Image part;
  part.setWindow({5, 7, 8, 9}, 20, 10);
  ASSERT_EQ(part.width, 3);
  ASSERT_EQ(part.height, 2);
  for (const bool half : {true, false}) {
    auto& values = part.add(half ? "A" : "Z", half).values;
    for (std::size_t i = 0; i != values.size(); ++i) values[i] = float(i);
  }
  const Camera camera = Camera::lookingAt({0, 0, 1}, {0, 0, 0}, {0, 1, 0}, {20, 10, 90.0f});
  writeExr(folder.file("a.exr"), part, camera);
  const Image back = readImage(folder.file("a.exr"));
  EXPECT_EQ(back.display, (Image::Display{5, 7, 20, 10}));
  for (const char* name : {"A", "Z"}) EXPECT_EQ(back.channel(name).values, part.channel(name).values);
  bool data = false, display = false, width = false;
  for (const std::string& line : describeImage(folder.file("a.exr"))) {
    data = data || line == "dataWindow: 3 x 2 at 5,7";
    display = display || line == "displayWindow: 20 x 10 at 0,0";
    width = width || line == "screenWindowWidth: 2";  // 2 tan(45 degrees)
  }
  EXPECT_TRUE(data && display && width);

  Image whole;
  whole.setWindow({0, 0, 20, 10}, 20, 10);
  EXPECT_FALSE(whole.display);
}

TEST(ExrIo, NamesThatTheFormatCannotHoldAreRefused) {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  const auto errorOf = [&](const std::vector<std::string>& channels,
                           const std::map<std::string, std::string>& metadata) -> std::string {
    Image image;
    image.width = image.height = 1;
    for (const std::string& name : channels) image.add(name);
    try {
      writeExr(path, image, ImageCamera{}, metadata);
    } catch (const Error& error) {
      EXPECT_FALSE(std::filesystem::exists(path));
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(errorOf({""}, {}), "image: a channel has no name");
  EXPECT_EQ(errorOf({"R", "R"}, {}), "image: two channels are called 'R'");
  EXPECT_NE(errorOf({std::string(256, 'a')}, {}).find("cannot be the name of a channel"), std::string::npos);
  EXPECT_EQ(errorOf({std::string("a\0b", 3)}, {}), "image: 'a\\x00b' cannot be the name of a channel");
  EXPECT_EQ(errorOf({"R"}, {{"", "text"}}), path + ": '' cannot be the name of metadata");
  // The format's own names have types of their own.
  EXPECT_EQ(errorOf({"R"}, {{"dataWindow", "text"}}), path + ": 'dataWindow' cannot be the name of metadata");
  EXPECT_EQ(errorOf({std::string(255, 'a')}, {{"note", "text"}}), "");
}

}  // namespace
}  // namespace nephele
