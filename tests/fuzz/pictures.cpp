#include <fmt/format.h>

#include <cmath>

#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/png_io.h"
#include "nephele/render/image/texture_image.h"
#include "nephele/render/scene/environment.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"

namespace nephele::fuzz {
namespace {

constexpr double kMostBytes = 64e6;

bool isSame(float a, float b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

/// Channels of 32 bits are read again as they were.
void writeAndReadBack(Image image) {
  const std::string path = scratchPath("again.exr");
  for (Image::Channel& channel : image.channels) channel.half = false;
  if (!succeeds(path, [&] { writeExr(path, image, ImageCamera{}); })) return;
  Image back;
  expect(succeeds(path, [&] { back = readImage(path); }),
         "a picture that was written cannot be read: " + lastError());
  expect(back.width == image.width && back.height == image.height &&
             back.channels.size() == image.channels.size(),
         "a picture that was written has another size");
  for (const Image::Channel& channel : image.channels) {
    const Image::Channel* again = back.find(channel.name);
    expect(again, "a channel that was written is not there: " + channel.name);
    for (std::size_t i = 0; i < channel.values.size(); ++i)
      expect(isSame(again->values[i], channel.values[i]), "a pixel that was written is another");
  }
}

void runVerbs(const Input& input) {
  const std::string& path = input.path;
  switch (input.hash % 3) {
    case 0:
      runRender({ballFog(), "--sky", path}, path);
      break;
    case 1:
      runRender({ballFog(), "--object", ballMesh(), "--texture", path}, path);
      break;
    default:
      runVerb(
          {"transfer", "--from", ballMesh(), "--to", ballMesh(), "-o", scratchPath("out.obj"), "--method",
           "closest", "--texture", path, "--bake-texture", scratchPath("baked.png"), "--bake-size", "8x8"},
          path);
  }
}

}  // namespace

bool usePicture(const Input& input) {
  runVerb({"info", input.path}, input.path);
  succeeds(input.path, [&] { readImageCamera(input.path); });
  Image image;
  if (!succeeds(input.path, [&] { image = readImage(input.path, kMostBytes); })) return false;
  image.check();
  if (image.width > 1024 || image.height > 1024 || image.channels.size() > 64) return true;
  succeeds(input.path, [&] {
    Texture(readLinearImage(input.path, ColourEncoding::automatic, kMostBytes)).at(0.3, 0.7, 2.5);
  });
  succeeds(input.path, [&] {
    Environment sky = Environment::read(input.path, {}, kMostBytes);
    sky.radiance({0, 1, 0});
    sky.takeSpots(2);
    sky.sample(0.1f, 0.2f, 0.3f, 0.4f);
  });
  succeeds("", [&] { screenBytes(image, {}); });
  writeAndReadBack(std::move(image));
  runVerbs(input);
  return true;
}

bool useDeepPicture(const Input& input) {
  runVerb({"info", input.path}, input.path);
  DeepImage image;
  if (!succeeds(input.path, [&] { image = readDeepExr(input.path, kMostBytes); })) return false;
  image.check();
  if (image.width > 256 || image.height > 256 || image.sampleCount() > 1e5) return true;
  for (const auto& samples : image.pixels) flattened(samples);
  const std::string path = scratchPath("again.exr");
  if (succeeds(path, [&] { writeDeepExr(path, image, ImageCamera{}); })) {
    DeepImage back;
    expect(succeeds(path, [&] { back = readDeepExr(path); }),
           "a deep picture that was written cannot be read: " + lastError());
    expect(back.sampleCount() == image.sampleCount(), "a deep picture that was written has other samples");
  }
  const std::string size = fmt::format("{}x{}", std::min(image.width, 16), std::min(image.height, 16));
  if (input.hash % 2 == 0)
    runRender({ballFog(), "--size", size, "--holdout", input.path}, input.path);
  else
    runRender({ballFog(), "--size", size, "--shadows", "deep", "--read-deep-shadow", input.path}, input.path);
  return true;
}

}  // namespace nephele::fuzz
