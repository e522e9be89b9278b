#include "nephele/render/image/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <string_view>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

void Image::setWindow(const PixelBox& window, int displayWidth, int displayHeight) {
  width = window.width();
  height = window.height();
  display.reset();
  if (window != PixelBox{0, 0, displayWidth, displayHeight})
    display = Display{window.x0, window.y0, displayWidth, displayHeight};
}

Image::Channel& Image::add(const std::string& name, bool half) {
  return channels.emplace_back(Channel{name, half, std::vector<float>(std::size_t(width) * height)});
}

const Image::Channel* Image::find(const std::string& name) const {
  for (const Channel& channel : channels)
    if (channel.name == name) return &channel;
  return nullptr;
}

const Image::Channel& Image::channel(const std::string& name) const {
  const Channel* channel = find(name);
  require(channel != nullptr, "image: has no channel called " + printable(name, 60));
  return *channel;
}

void Image::check() const {
  require(width > 0 && height > 0, fmt::format("image: has no pixels, its size is {}x{}", width, height));
  std::set<std::string_view> names;
  for (const Channel& channel : channels) {
    // What OpenEXR takes.
    constexpr std::size_t kLongest = 255;
    require(!channel.name.empty(), "image: a channel has no name");
    require(channel.name.size() <= kLongest && channel.name.find('\0') == std::string::npos,
            fmt::format("image: '{}' cannot be the name of a channel", printable(channel.name, 60)));
    require(names.insert(channel.name).second,
            fmt::format("image: two channels are called '{}'", printable(channel.name, 60)));
    require(channel.values.size() == std::size_t(width) * std::size_t(height),
            fmt::format("image: the channel {} has {} values, but the size is {}x{}",
                        printable(channel.name, 60), channel.values.size(), width, height));
  }
}

std::size_t notFiniteCount(const Image& image) {
  std::vector<std::size_t> counts(image.channels.size());
  parallelFor(counts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c != end; ++c) {
      const Image::Channel& channel = image.channels[c];
      const bool isDepth = channel.name == "Z" || channel.name.starts_with("Z_");
      counts[c] = std::size_t(std::ranges::count_if(
          channel.values, [&](float v) { return !std::isfinite(v) && !(isDepth && std::isinf(v)); }));
    }
  });
  return std::accumulate(counts.begin(), counts.end(), std::size_t(0));
}

}  // namespace nephele
