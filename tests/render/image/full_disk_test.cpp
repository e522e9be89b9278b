// Pictures on a disk that is full.
#include "tests/support/full_disk.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/scene/camera.h"
#include "tests/support/run_program.h"

namespace nephele {
namespace {

const ImageCamera& someCamera() {
  static const ImageCamera camera = Camera::lookingAt({1, 2, 3}, {0, 0, 0}, {0, 1, 0}, {64, 48, 40});
  return camera;
}

Image someImage() {
  Image image;
  image.width = 64;
  image.height = 48;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  for (Image::Channel& channel : image.channels)
    for (std::size_t i = 0; i != channel.values.size(); ++i) channel.values[i] = float(i * i % 251) / 250;
  return image;
}

DeepImage someDeepImage() {
  DeepImage image;
  image.width = 64;
  image.height = 48;
  image.pixels.resize(64 * 48);
  for (std::size_t i = 0; i != image.pixels.size(); ++i)
    for (std::size_t k = 0; k != i % 4; ++k)
      image.pixels[i].push_back({float(k), float(k) + 0.5f, 0.25f, {0.1f, 0.2f, float(i % 17) / 100}});
  return image;
}

struct Writer {
  const char* name;
  std::function<void(const std::string&)> write;
};

// Not a byte is lost without a word: a library's stream has its last ones when the file is closed.
TEST(PicturesOnAFullDisk, AreWholeOrAnErrorAndLeaveTheEarlierFile) {
  const Writer writers[] = {
      {"a.exr", [](const std::string& path) { writeExr(path, someImage(), someCamera(), {}); }},
      {"deep.exr", [](const std::string& path) { writeDeepExr(path, someDeepImage(), someCamera(), {}); }},
      {"a.png",
       [](const std::string& path) {
         writePng(path, someImage(), {}, {{"creator", "test"}});
       }},
  };
  for (const Writer& writer : writers) {
    const test::TemporaryFolder folder;
    const std::string path = folder.file(writer.name);
    writer.write(path);
    const auto size = rlim_t(std::filesystem::file_size(path));
    std::ofstream(path) << "earlier";
    for (const rlim_t limit : {rlim_t(0), rlim_t(1), size / 3, size - 5000, size - 100, size - 1}) {
      std::string message;
      {
        const test::FullDisk full(limit);
        try {
          writer.write(path);
        } catch (const Error& error) {
          message = error.what();
        }
      }
      EXPECT_EQ(message, "cannot write " + path + ": File too large") << limit << " of " << size;
      EXPECT_EQ(test::textOf(path), "earlier");
      EXPECT_EQ(folder.entryCount(), 1u) << "no temporary file may stay";
    }
    const test::FullDisk full(size);
    EXPECT_NO_THROW(writer.write(path));
  }
}

}  // namespace
}  // namespace nephele
