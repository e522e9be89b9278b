// Pictures whose headers promise more than the files hold, cut short, or changed in single bytes: each ends
// in a picture or in one line that names the file, without memory out of proportion.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <random>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "tests/support/message_of.h"
#include "tests/support/png_bytes.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

using test::bigEndian;
using test::checksum;
using test::TemporaryFolder;
using test::textOf;

void write(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

std::string messageFor(const std::string& path) {
  try {
    readImage(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

void expectRefused(const std::string& path, const std::string& why) {
  const std::string message = messageFor(path);
  EXPECT_TRUE(message.starts_with(path + ": ")) << message;
  EXPECT_NE(message.find(why), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

Image smallImage() {
  Image image;
  image.width = 5;
  image.height = 4;
  for (const char* name : {"R", "G", "B", "A"})
    for (std::size_t i = 0; float& value : image.add(name).values) value = float(i++) / 20;
  return image;
}

std::string pngHeader(std::uint32_t width, std::uint32_t height, bool interlaced) {
  const std::string header = "IHDR" + bigEndian(width) + bigEndian(height) + std::string("\x8\x2\0\0", 4) +
                             (interlaced ? '\1' : '\0');
  return "\x89PNG\r\n\x1a\n" + bigEndian(13) + header + bigEndian(checksum(header));
}

TEST(ImageDamage, SizesThatAFileCannotHoldAreRefusedBeforeAnythingIsAllocated) {
  const TemporaryFolder folder;
  const std::string png = folder.file("a.png"), hdr = folder.file("a.hdr");
  for (const bool interlaced : {false, true}) {
    write(png, pngHeader(30000, 30000, interlaced) + bigEndian(24) + "IDAT" + std::string(28, '\0'));
    expectRefused(png, "cannot hold 30000 x 30000 pixels");
  }
  for (const char* start : {"tEXtTitle", "tEXt"}) {
    write(png, pngHeader(1, 1, false) + bigEndian(0x7fffffff) + start);
    expectRefused(png, "a chunk is longer than the file");
  }
  write(hdr, "#?RADIANCE\n\n-Y 30000 +X 30000\n");
  expectRefused(hdr, "cannot hold 30000 x 30000 pixels");
}

TEST(ImageDamage, PixelsBeyondTheLimitAreRefused) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  writeExr(path, smallImage(), {});
  EXPECT_NO_THROW(readImage(path, 4 * 5 * 4 * 4));
  EXPECT_THROW(readImage(path, 4 * 5 * 4 * 4 - 1), Error);
}

// Three bytes a pixel, which 30 000 packed ones can hold; a row at a time is not held.
TEST(ImageDamage, InterlacedPixelsBeyondTheLimitAreNotDescribed) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.png");
  const std::string pixels = bigEndian(30000) + "IDAT" + std::string(30004, '\0');
  const auto messageFor = [&](bool interlaced) -> std::string {
    write(path, pngHeader(3000, 3000, interlaced) + pixels);
    try {
      describeImage(path, 20e6);
    } catch (const Error& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(messageFor(true),
            path + ": is interlaced: its pixels need 27 MB of memory, and 20 MB is the limit");
  EXPECT_NE(messageFor(false).find("is damaged: "), std::string::npos) << "the pixels are none";
}

// By hand of the matrix from the primaries of Radiance, in Lindbloom's way: white is white, and of X, Y, Z =
// the chromaticity of a primary over its y nothing but that primary is left.
TEST(ImageDamage, RadianceInXyzBecomesRedGreenAndBlue) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.hdr");
  const auto pixel = [&](int x, int y, int z) {
    std::string bytes = "#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
    for (const int value : {x, y, z, 129}) bytes += char(value);
    write(path, bytes);
    const Image image = readImage(path);
    return Vec3f{image.at("R", 0, 0), image.at("G", 0, 0), image.at("B", 0, 0)};
  };
  const Vec3f white = pixel(128, 128, 128);
  EXPECT_NEAR(white.x, 128.5 / 128, 1e-5);
  EXPECT_NEAR(white.y, white.x, 1e-5);
  EXPECT_NEAR(white.z, white.x, 1e-5);
  // 0.29, 0.60, 0.11 are 96.67 : 200 : 36.67 of Y = 200; in 8 bits within half a step of 200.
  const Vec3f green = pixel(96, 199, 36);
  EXPECT_NEAR(green.x / green.y, 0, 0.01);
  EXPECT_NEAR(green.z / green.y, 0, 0.01);
  write(path, "#?RADIANCE\nFORMAT=32-bit_rle_lab\n\n-Y 1 +X 1\n1234");
  expectRefused(path, "32-bit_rle_lab");
}

// Where an attribute's size stands: behind its name and type.
void setSize(std::string& exr, const std::string& attribute, std::int32_t size) {
  const std::size_t at = exr.find(attribute);
  ASSERT_NE(at, std::string::npos);
  std::memcpy(exr.data() + at + attribute.size(), &size, 4);
}

TEST(ImageDamage, OpenExrIsFollowedBeforeItIsRead) {
  using namespace std::string_literals;
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  writeExr(path, smallImage(), {}, {{"note", "text"}});
  const std::string whole = textOf(path);
  std::string bytes = whole;
  setSize(bytes, "note\0string\0"s, 0x7fffffff);
  write(path, bytes);
  expectRefused(path, "an attribute is said to be of 2147483647 bytes");

  bytes = whole;
  const std::string window = "dataWindow\0box2i\0"s;
  const std::int32_t far = 1 << 19;
  std::memcpy(bytes.data() + bytes.find(window) + window.size() + 4 + 8, &far, 4);
  write(path, bytes);
  expectRefused(path, "is damaged");
  const std::int32_t farther = 0x7fffffff;
  std::memcpy(bytes.data() + bytes.find(window) + window.size() + 4 + 8, &farther, 4);
  write(path, bytes);
  expectRefused(path, "a window lies too far away");

  // Four rows are in one chunk, which follows its place.
  bytes = whole;
  std::uint64_t place = 0;
  std::size_t header = 0;
  while (place != header + 8 && header + 16 < bytes.size()) std::memcpy(&place, bytes.data() + ++header, 8);
  ASSERT_EQ(place, header + 8);
  place = bytes.size();
  std::memcpy(bytes.data() + header, &place, 8);
  write(path, bytes);
  expectRefused(path, "a chunk of pixels is missing");

  write(path, whole.substr(0, whole.size() - 1));
  expectRefused(path, "cut short");
  write(path, whole);
  EXPECT_EQ(readImage(path).width, 5);
}

TEST(ImageDamage, DeepSamplesAreNoMoreThanTheFileHolds) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exr");
  DeepImage image;
  image.width = 3;
  image.height = 2;
  image.pixels.assign(6, {DeepSample{.z = 1, .zBack = 2, .alpha = 0.5f}});
  writeDeepExr(path, image, {});
  const std::string whole = textOf(path);
  ASSERT_EQ(readDeepExr(path).sampleCount(), 6u);
  // The last chunk: row, three sizes in 64 bits, the table of counts, samples.
  for (std::size_t at = whole.size() - 120; at != whole.size(); ++at)
    for (const char byte : {'\x7f', '\xff'}) {
      std::string bytes = whole;
      bytes[at] = byte;
      write(path, bytes);
      try {
        EXPECT_LE(readDeepExr(path).sampleCount(), 100000u);
      } catch (const Error& error) {
        EXPECT_TRUE(std::string(error.what()).starts_with(path)) << error.what();
      }
    }
}

TEST(ImageDamage, AnyByteMayBeAnother) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a");
  writeExr(folder.file("b.exr"), smallImage(), {}, {{"note", "text"}});
  writePng(folder.file("b.png"), smallImage(), {});
  write(folder.file("b.hdr"), "#?RADIANCE\n\n-Y 1 +X 8\n\2\2\0\x8" + std::string(16, '\x81'));
  std::mt19937 random(1);
  for (const char* name : {"b.exr", "b.png", "b.hdr"}) {
    const std::string whole = textOf(folder.file(name));
    for (int i = 0; i != 500; ++i) {
      std::string bytes = whole;
      for (int k = 0; k != 1 + i % 3; ++k) bytes[random() % bytes.size()] = char(random());
      if (i % 7 == 0) bytes.resize(random() % bytes.size());
      write(path, bytes);
      const std::string message = messageFor(path);
      if (message == "no error") continue;
      EXPECT_TRUE(message.starts_with(path + ": ")) << message;
      EXPECT_LT(message.size(), path.size() + 200) << message;
      for (const char* foreign : {"std::", "bad_alloc", "Cannot read image file"})
        EXPECT_EQ(message.find(foreign), std::string::npos) << message;
    }
  }
}

TEST(ImageDamage, NamesThatWouldEndAtAByteOfZeroAreRefused) {
  const TemporaryFolder folder;
  writeExr(folder.file("b.exr"), smallImage(), {}, {});
  writePng(folder.file("b.png"), smallImage(), {});
  for (const char* name : {"b.exr", "b.png"}) {
    const std::string path = folder.file(name);
    EXPECT_EQ(messageFor(path + std::string("\0b", 2)),
              path + "\\x00b: the name of a file may not have a byte of zero in it");
  }
  EXPECT_EQ(test::messageOf([&] { readDeepExr(folder.file("b.exr") + std::string("\0b", 2)); }),
            folder.file("b.exr") + "\\x00b: the name of a file may not have a byte of zero in it");
}

}  // namespace
}  // namespace nephele
