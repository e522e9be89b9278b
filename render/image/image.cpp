#include "nephele/render/image/image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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
  std::size_t count = 0;
  for (const Image::Channel& channel : image.channels) {
    const bool isDepth = channel.name == "Z" || channel.name.starts_with("Z_");
    count += std::size_t(std::ranges::count_if(
        channel.values, [&](float v) { return !std::isfinite(v) && !(isDepth && std::isinf(v)); }));
  }
  return count;
}

namespace {

float onScreen(float linear, float shoulder) {
  if (!(linear > 0)) return 0.0f;
  const float room = 1.0f - shoulder;
  const float x =
      linear <= shoulder ? linear : shoulder + room * (1.0f - std::exp(-(linear - shoulder) / room));
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
}

// In [-0.5, 0.5), its error high in frequency: hides the steps of 8 bits in smooth skies without visible
// grain.
float dither(std::size_t x, std::size_t y) {
  const double d = 0.7548776662466927 * double(x) + 0.5698402909980532 * double(y);
  return float(d - std::floor(d)) - 0.5f;
}

}  // namespace

std::vector<float> displayed(const Image& image, const ViewTransform& view) {
  image.check();
  require(view.shoulder >= 0 && view.shoulder < 1, "view transform: shoulder must be within [0, 1)");
  const std::vector<float>& alpha = image.channel("A").values;
  const std::vector<float>* colour[] = {&image.channel("R").values, &image.channel("G").values,
                                        &image.channel("B").values};
  const float gain = std::exp2(view.exposureStops);
  const Image::Channel* backdrop[] = {image.find("backdrop.R"), image.find("backdrop.G"),
                                      image.find("backdrop.B")};
  const bool hasBackdrop = backdrop[0] && backdrop[1] && backdrop[2];
  std::vector<float> screen(alpha.size() * 3);
  parallelFor(alpha.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i)
      for (int c = 0; c != 3; ++c) {
        const float behind = hasBackdrop ? backdrop[c]->values[i] : view.background[c];
        screen[i * 3 + c] = onScreen(gain * ((*colour[c])[i] + (1.0f - alpha[i]) * behind), view.shoulder);
      }
  });
  return screen;
}

std::vector<std::uint8_t> screenBytes(const Image& image, const ViewTransform& view) {
  const std::vector<float> screen = displayed(image, view);
  const auto width = std::size_t(image.width);
  std::vector<std::uint8_t> bytes(screen.size());
  for (std::size_t i = 0; i != screen.size(); ++i) {
    const float value = std::floor(screen[i] * 255.0f + 0.5f + 0.999f * dither(i / 3 % width, i / 3 / width));
    bytes[i] = std::uint8_t(std::fmin(255.0f, std::fmax(0.0f, value)));
  }
  return bytes;
}

}  // namespace nephele
