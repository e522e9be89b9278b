// Radiance pictures (.hdr): a text header, then rows of red, green, blue and a common exponent, each row
// packed by runs.
//
// Source: the file format of G. Ward's Radiance. Limits: rows must run from the top and columns from the left
// ("-Y h +X w"), as all programs write them; the packing of before 1991 is not read.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>

#include "nephele/modeling/base/error.h"
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
      if (line[0] != '#' && equals != std::string::npos)
        header.attributes.emplace_back(line.substr(0, equals), line.substr(equals + 1));
    }
    std::getline(file_, line);
    if (std::sscanf(line.c_str(), "-Y %d +X %d", &header.height, &header.width) != 2)
      throw Error(fmt::format("{}: expected its size as '-Y height +X width', found '{}'", path_,
                              line.substr(0, 40)));
    requireSize(path_, header.width, header.height, 3);
    return header;
  }

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
  int byte() {
    const int value = file_.get();
    if (value < 0) throw Error(path_ + ": ends before its last pixel");
    return value;
  }

  std::string path_;
  std::ifstream file_;
};

}  // namespace

void readRadianceFile(const std::string& path, const ImageReader& reader) {
  RadianceFile file(path);
  const ImageHeader header = file.header();
  reader.begin(header);
  const auto count = std::size_t(header.width);
  std::vector<std::uint8_t> planes;
  std::vector<float> values(3 * count);
  for (int y = 0; y != header.height; ++y) {
    file.row(planes, header.width);
    for (std::size_t x = 0; x != count; ++x) {
      const int exponent = planes[3 * count + x];
      const float scale = exponent == 0 ? 0.0f : std::ldexp(1.0f, exponent - 128 - 8);
      for (std::size_t c = 0; c != 3; ++c)
        values[x * 3 + c] = exponent == 0 ? 0.0f : (float(planes[c * count + x]) + 0.5f) * scale;
    }
    reader.row(y, values.data());
  }
}

}  // namespace nephele::detail
