#include "render/image.h"

#include <cmath>

#include "modeling/error.h"
#include "modeling/parallel.h"

namespace nephele {

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
  require(channel != nullptr, "image: has no channel called " + name);
  return *channel;
}

namespace {

float onScreen(float linear, float shoulder) {
  if (!(linear > 0)) return 0.0f;
  const float room = 1.0f - shoulder;
  const float x =
      linear <= shoulder ? linear : shoulder + room * (1.0f - std::exp(-(linear - shoulder) / room));
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
}

}  // namespace

std::vector<float> displayed(const Image& image, const ViewTransform& view) {
  require(view.shoulder >= 0 && view.shoulder < 1, "view transform: shoulder must be within [0, 1)");
  const std::vector<float>& alpha = image.channel("A").values;
  const std::vector<float>* colour[] = {&image.channel("R").values, &image.channel("G").values,
                                        &image.channel("B").values};
  const float gain = std::exp2(view.exposureStops);
  std::vector<float> screen(alpha.size() * 3);
  parallelFor(alpha.size(), 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i)
      for (int c = 0; c != 3; ++c)
        screen[i * 3 + c] =
            onScreen(gain * ((*colour[c])[i] + (1.0f - alpha[i]) * view.background[c]), view.shoulder);
  });
  return screen;
}

}  // namespace nephele
