#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/image/image.h"
#include "nephele/render/image/image_camera.h"

namespace nephele {

class OutputFile;

/// One piece of what lies behind a pixel: from depth z to zBack along the line of sight, with the opacity and
/// the premultiplied colour that it has by itself. Both are spread over it as in a homogeneous medium.
struct DeepSample {
  float z = 0.0f, zBack = 0.0f;
  float alpha = 0.0f;
  Vec3f colour{};
};

/// A picture whose pixels are lists of samples, rows from the top.
struct DeepImage {
  int width = 0, height = 0;
  std::optional<Image::Display> display{};
  std::vector<std::vector<DeepSample>> pixels;

  const std::vector<DeepSample>& at(int x, int y) const { return pixels[std::size_t(y) * width + x]; }
  std::size_t sampleCount() const;
  /// @throws Error unless there is a list for each of width * height pixels, and one at least.
  void check() const;
};

/// The nearest number to `value` that 16 bit floats hold, at most 65504 either way: what files keep of alpha
/// and colour.
float roundedToHalf(float value);

/// Front to back: what the samples of a pixel look like together; colour and, last, opacity.
struct FlatPixel {
  Vec3f colour{};
  float alpha = 0.0f;
};
FlatPixel flattened(const std::vector<DeepSample>& samples);

/// Writes a deep OpenEXR file: Z and ZBack as floats, A, R, G, B as 16 bit, marked as tidy, attributes as
/// writeExr, but the metadata `version` is called `softwareVersion`. Written beside `path` and renamed.
/// @throws Error naming the path.
void writeDeepExr(const std::string& path, const DeepImage& image, const ImageCamera& camera,
                  const std::map<std::string, std::string>& metadata = {});
/// Writes a picture and its deep form, so that neither is there without the other. @throws Error naming the
/// path of what could not be written; then neither is.
struct ExrPair {
  std::string flat, deep;
};
void writeExrPair(const ExrPair& paths, const Image& flat, const DeepImage& deep, const ImageCamera& camera,
                  const std::map<std::string, std::string>& metadata = {});

/// As the other, into `output`, which the caller commits.
void writeDeepExr(const OutputFile& output, const DeepImage& image, const ImageCamera& camera,
                  const std::map<std::string, std::string>& metadata = {});

/// Reads a deep OpenEXR file made of scan lines, its first part: Z and A are needed, ZBack is Z and colours
/// are 0 where they are missing. Samples are as in the file, whether tidy or not.
/// @throws Error naming the path and what is wrong, also if it would take more than `mostBytes`.
DeepImage readDeepExr(const std::string& path, double mostBytes = 8e9);

}  // namespace nephele
