// Which reader a file needs, by its first bytes, and what is common to all formats.
#include "nephele/render/image/image_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <set>
#include <system_error>

#include "nephele/levelset/io/memory_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/text_file.h"
#include "nephele/render/image/exr_io.h"

namespace nephele {

namespace detail {

void requireSize(const std::string& path, long long width, long long height, long long channels) {
  constexpr long long most = 1 << 20;
  if (width < 1 || height < 1 || channels < 1)
    throw Error(fmt::format("{}: holds no pixels ({} x {}, {} channels)", path, width, height, channels));
  if (width > most || height > most || channels > 4096)
    throw Error(fmt::format("{}: is damaged: {} x {} pixels of {} channels", path, width, height, channels));
}

namespace {

void readFile(const std::string& path, const ImageReader& reader) {
  requireWholeName(path);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file.is_open())
    throw Error(fmt::format("{}: cannot be read: {}", path, std::generic_category().message(errno)));
  std::array<unsigned char, 12> start{};
  if (!file.read(reinterpret_cast<char*>(start.data()), 4)) throw Error(path + ": cannot be read");
  file.read(reinterpret_cast<char*>(start.data()) + 4, 8);
  const auto startsWith = [&](const char* magic, std::size_t count) {
    return std::memcmp(start.data(), magic, count) == 0;
  };
  if (startsWith("\x76\x2f\x31\x01", 4)) return readExrFile(path, reader);
  if (startsWith("\x89PNG", 4)) return readPngFile(path, reader);
  if (startsWith("#?RADIANCE", 10) || startsWith("#?RGBE", 6)) return readRadianceFile(path, reader);
  throw Error(path + ": is not an image of a kind that is known (OpenEXR, PNG, Radiance)");
}

}  // namespace
}  // namespace detail

namespace {

Image readPixels(const std::string& path, double mostBytes, detail::ImageHeader& read) {
  Image image;
  detail::readFile(path, {[&](const detail::ImageHeader& header) {
                            read = header;
                            const double bytes = double(header.width) * header.height *
                                                 double(header.channels.size() * sizeof(float));
                            if (bytes > mostBytes)
                              throw Error(
                                  fmt::format("{}: its pixels need {:.1f} GB of memory, and {:.1f} GB "
                                              "is the limit",
                                              path, bytes / 1e9, mostBytes / 1e9));
                            image.width = header.width;
                            image.height = header.height;
                            if (header.display != Image::Display{0, 0, header.width, header.height})
                              image.display = header.display;
                            for (const auto& channel : header.channels)
                              image.add(channel.name, channel.type != "float");
                          },
                          [&](int y, const float* values) {
                            const std::size_t count = image.channels.size(),
                                              first = std::size_t(y) * image.width;
                            for (std::size_t x = 0; x != std::size_t(image.width); ++x)
                              for (std::size_t c = 0; c != count; ++c)
                                image.channels[c].values[first + x] = values[x * count + c];
                          }});
  return image;
}

// Integers have few values, so that each is worked out once.
void apply(const TransferCurve& curve, const std::string& type, std::vector<float>& values) {
  const int most = type == "uint8" ? 255 : type == "uint16" ? 65535 : 0;
  if (most == 0) {
    for (float& value : values) value = curve(value);
    return;
  }
  std::vector<float> light(std::size_t(most) + 1);
  for (std::size_t i = 0; i != light.size(); ++i) light[i] = curve(float(i) / float(most));
  for (float& value : values) value = light[std::size_t(std::lround(value * float(most)))];
}

}  // namespace

Image readImage(const std::string& path, double mostBytes) {
  if (const auto* held = MemoryFile::contentOf<ExrContent>(path)) return held->image;
  detail::ImageHeader header;
  return readPixels(path, mostBytes, header);
}

Image readLinearImage(const std::string& path, ColourEncoding encoding, double mostBytes) {
  if (const auto* held = MemoryFile::contentOf<ExrContent>(path)) return held->image;
  detail::ImageHeader header;
  Image image = readPixels(path, mostBytes, header);
  const bool isGrey = image.find("Y") && !image.find("R");
  const std::string type = header.channels.front().type;
  std::optional<std::array<TransferCurve, 3>> curves;
  if (encoding == ColourEncoding::srgb) curves.emplace().fill(TransferCurve::srgb());
  if (encoding == ColourEncoding::automatic) curves = header.curves;
  std::array<std::vector<float>, 3> colours;
  constexpr const char* kNames[] = {"R", "G", "B"};
  for (std::size_t c = 0; c != 3; ++c) {
    const Image::Channel* channel = image.find(isGrey ? "Y" : kNames[c]);
    if (!channel) throw Error(fmt::format("{}: has no channel {}, nor Y", path, kNames[c]));
    colours[c] = channel->values;
    if (curves) apply((*curves)[c], type, colours[c]);
    if (const Image::Channel* opacity = header.isPremultiplied ? nullptr : image.find("A"))
      std::ranges::transform(colours[c], opacity->values, colours[c].begin(), std::multiplies<>());
  }
  for (std::size_t c = 0; c != 3; ++c) {
    if (isGrey) image.add(kNames[c]);
    for (Image::Channel& channel : image.channels)
      if (channel.name == kNames[c]) channel.values = std::move(colours[c]);
  }
  return image;
}

std::vector<std::string> describeImage(const std::string& path, double mostBytes) {
  struct Range {
    float low = INFINITY, high = -INFINITY;
    std::size_t notFinite = 0;
  };
  detail::ImageHeader header;
  std::vector<Range> ranges;
  const auto add = [](Range& range, float value) {
    if (std::isfinite(value)) {
      range.low = std::min(range.low, value);
      range.high = std::max(range.high, value);
    } else {
      ++range.notFinite;
    }
  };
  bool isDeep = false;
  std::size_t samples = 0, most = 0, empty = 0;
  detail::readFile(path,
                   {[&](const detail::ImageHeader& h) {
                      header = h;
                      ranges.resize(h.channels.size());
                    },
                    [&](int, const float* values) {
                      for (int x = 0; x != header.width; ++x)
                        for (Range& range : ranges) add(range, *values++);
                    },
                    [&](std::span<const unsigned> counts, std::span<const std::vector<float>> channels) {
                      isDeep = true;
                      for (const std::size_t count : counts) {
                        samples += count;
                        most = std::max(most, count);
                        empty += count == 0 ? 1 : 0;
                      }
                      for (std::size_t c = 0; c != channels.size(); ++c)
                        for (const float value : channels[c]) add(ranges[c], value);
                    },
                    mostBytes});
  const std::size_t count = header.channels.size();
  std::vector<std::string> lines{fmt::format("{}image {} x {}, {} channel{}, {}", isDeep ? "deep " : "",
                                             header.width, header.height, count, count == 1 ? "" : "s",
                                             header.format)};
  if (isDeep)
    lines.push_back(fmt::format("samples: {}, {:.3g} per pixel, {} at most; {} pixels have none", samples,
                                double(samples) / (double(header.width) * header.height), most, empty));
  std::set<std::string> layers;
  for (std::size_t c = 0; c != count; ++c) {
    const std::string& name = header.channels[c].name;
    if (const std::size_t dot = name.rfind('.'); dot != std::string::npos) layers.insert(name.substr(0, dot));
    const Range& range = ranges[c];
    std::string line = "channel " + name + ": " + header.channels[c].type;
    if (range.low <= range.high) line += fmt::format(", {:g} to {:g}", range.low, range.high);
    if (range.notFinite > 0) line += fmt::format(", {} not finite", range.notFinite);
    lines.push_back(std::move(line));
  }
  std::string names;
  for (const std::string& layer : layers) names += (names.empty() ? "layers: " : ", ") + layer;
  if (!names.empty()) lines.push_back(names);
  for (const auto& [name, value] : header.attributes) lines.push_back(name + ": " + value);
  return lines;
}

}  // namespace nephele
