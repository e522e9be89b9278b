#pragma once

#include <array>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "nephele/render/image/image.h"
#include "nephele/render/image/transfer_curve.h"

namespace nephele::detail {

/// What an image file says of itself before its pixels.
struct ImageHeader {
  struct Channel {
    std::string name;
    std::string type;  ///< "half", "float", "uint8" ...
  };

  std::string format;
  int width = 0, height = 0;
  /// Where the pixels lie in the picture that is meant, if the format knows such a thing.
  std::optional<Image::Display> display;
  std::vector<Channel> channels;
  /// From the numbers of red, green and blue (or of grey) to light; none where they are light.
  std::optional<std::array<TransferCurve, 3>> curves{};
  /// Whether the light is multiplied by the opacity already, where there is one.
  bool isPremultiplied = true;
  /// Name and value, in the order of the file.
  std::vector<std::pair<std::string, std::string>> attributes;
};

/// Receives a file row by row, from the top; every row holds the channels of a pixel together, 8 and 16 bit
/// integers as 0 to 1.
struct ImageReader {
  std::function<void(const ImageHeader&)> begin;
  std::function<void(int y, const float* values)> row;
  /// Rows of deep images, from the top: the samples of each pixel, and for each channel its values, pixel
  /// after pixel. Without it deep images are refused.
  std::function<void(std::span<const unsigned> counts, std::span<const std::vector<float>> channels)>
      deepRow{};
  /// What a reader may hold of pixels that are there only after the last of them, as in interlaced files.
  double mostBytes = std::numeric_limits<double>::infinity();
};

/// Each reads a whole file. @throws Error naming the path and what is wrong.
void readExrFile(const std::string& path, const ImageReader& reader);
void readPngFile(const std::string& path, const ImageReader& reader);
void readRadianceFile(const std::string& path, const ImageReader& reader);

/// @throws Error naming the path unless the size is one that can be real.
void requireSize(const std::string& path, long long width, long long height, long long channels);

}  // namespace nephele::detail
