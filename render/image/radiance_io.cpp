// Radiance pictures (.hdr): a text header, then rows of red, green, blue and a common exponent, each row
// packed by runs.
//
// Source: the file format of G. Ward's Radiance. Limits: rows must run from the top and columns from the left
// ("-Y h +X w"), as all programs write them; the packing of before 1991 is not read. Pictures in CIE XYZ
// become red, green and blue; colours outside of these are cut off.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/math.h"
#include "nephele/render/image/image_file.h"

namespace nephele::detail {

namespace {

class RadianceFile {
 public:
  explicit RadianceFile(const std::string& path) : path_(path), file_(path, std::ios::binary) {
    require(file_.good(), path + ": cannot be read");
  }

  ImageHeader header() {
    ImageHeader header;
    header.format = "Radiance";
    for (const char* name : {"R", "G", "B"}) header.channels.push_back({name, "rgbe"});
    std::string line;
    std::getline(file_, line);
    while (std::getline(file_, line) && !line.empty()) {
      require(line.size() < 4096, path_ + ": is damaged: its header has no end");
      const std::size_t equals = line.find('=');
      if (line[0] == '#' || equals == std::string::npos) continue;
      const std::string name = line.substr(0, equals), value = line.substr(equals + 1);
      if (name == "FORMAT") {
        isXyz_ = value.find("xyze") != std::string::npos;
        require(isXyz_ || value.find("rgbe") != std::string::npos,
                fmt::format("{}: expected the format 32-bit_rle_rgbe or 32-bit_rle_xyze, found '{}'", path_,
                            value.substr(0, 40)));
      }
      header.attributes.emplace_back(name, value);
    }
    std::getline(file_, line);
    if (std::sscanf(line.c_str(), "-Y %d +X %d", &header.height, &header.width) != 2)
      throw Error(fmt::format("{}: expected its size as '-Y height +X width', found '{}'", path_,
                              line.substr(0, 40)));
    requireSize(path_, header.width, header.height, 3);
    requireFits(header.width, header.height);
    return header;
  }

  /// Colours are CIE XYZ, not red, green and blue.
  bool isXyz() const { return isXyz_; }

  // Four bytes per pixel: all reds, all greens, all blues, all exponents where packed, pixel by pixel where
  // not.
  void row(std::vector<std::uint8_t>& planes, int width) {
    std::array<int, 4> first{};
    for (int& value : first) value = byte();
    const auto count = std::size_t(width);
    planes.resize(4 * count);
    if (first[0] != 2 || first[1] != 2 || first[2] * 256 + first[3] != width) {
      for (std::size_t c = 0; c != 4; ++c) planes[c * count] = std::uint8_t(first[c]);
      for (std::size_t x = 1; x < count; ++x)
        for (std::size_t c = 0; c != 4; ++c) planes[c * count + x] = std::uint8_t(byte());
      return;
    }
    for (std::size_t c = 0; c != 4; ++c)
      for (std::size_t x = 0; x < count;) {
        int length = byte();
        const bool run = length > 128;
        if (run) length -= 128;
        if (length == 0 || x + std::size_t(length) > count)
          throw Error(path_ + ": is damaged: a run is longer than its row");
        int value = run ? byte() : 0;
        for (int i = 0; i != length; ++i) {
          if (!run) value = byte();
          planes[c * count + x++] = std::uint8_t(value);
        }
      }
  }

 private:
  void requireFits(std::int64_t width, std::int64_t height) {
    const auto pixels = std::int64_t(file_.tellg());
    file_.seekg(0, std::ios::end);
    const std::int64_t size = std::int64_t(file_.tellg()) - pixels;
    file_.seekg(pixels);
    // A run is two bytes for 127 at most.
    const std::int64_t leastRow = std::min(4 * width, 4 + 8 * ((width + 126) / 127));
    require(file_.good() && size >= height * leastRow,
            fmt::format("{}: is damaged: {} bytes cannot hold {} x {} pixels", path_, size, width, height));
  }

  int byte() {
    const int value = file_.get();
    if (value < 0) throw Error(path_ + ": ends before its last pixel");
    return value;
  }

  std::string path_;
  std::ifstream file_;
  bool isXyz_ = false;
};

/// CIE XYZ to red, green and blue of the primaries that Radiance gives RGBE pictures, (0.64, 0.33), (0.29,
/// 0.60) and (0.15, 0.06), and of white (1/3, 1/3).
Mat3f rgbFromXyz() {
  const Vec3f x{0.64f, 0.29f, 0.15f}, y{0.33f, 0.60f, 0.06f};
  Mat3f chromaticities;
  for (int c = 0; c != 3; ++c) {
    chromaticities(0, c) = x[c];
    chromaticities(1, c) = y[c];
    chromaticities(2, c) = 1 - x[c] - y[c];
  }
  // XYZ of white is (1, 1, 1), and its colour is to be (1, 1, 1), too.
  const Vec3f shares = inverse(chromaticities) * Vec3f{1, 1, 1};
  for (int row = 0; row != 3; ++row)
    for (int c = 0; c != 3; ++c) chromaticities(row, c) *= shares[c];
  return inverse(chromaticities);
}

}  // namespace

void readRadianceFile(const std::string& path, const ImageReader& reader) {
  RadianceFile file(path);
  const ImageHeader header = file.header();
  reader.begin(header);
  const auto count = std::size_t(header.width);
  std::vector<std::uint8_t> planes;
  std::vector<float> values(3 * count);
  const Mat3f toRgb = rgbFromXyz();
  for (int y = 0; y != header.height; ++y) {
    file.row(planes, header.width);
    for (std::size_t x = 0; x != count; ++x) {
      const int exponent = planes[3 * count + x];
      const float scale = exponent == 0 ? 0.0f : std::ldexp(1.0f, exponent - 128 - 8);
      for (std::size_t c = 0; c != 3; ++c)
        values[x * 3 + c] = exponent == 0 ? 0.0f : (float(planes[c * count + x]) + 0.5f) * scale;
      if (!file.isXyz()) continue;
      const Vec3f rgb = toRgb * Vec3f{values[x * 3], values[x * 3 + 1], values[x * 3 + 2]};
      for (int c = 0; c != 3; ++c) values[x * 3 + std::size_t(c)] = std::max(0.0f, rgb[c]);
    }
    reader.row(y, values.data());
  }
}

}  // namespace nephele::detail
