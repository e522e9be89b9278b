#include "nephele/render/scene/aerial_perspective.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

// Largest side of a tile in pixels, and how many are to be across a picture at least.
constexpr int kTile = 16, kTiles = 64;
// Depths in metres from one to twice as many, from 1 on.
constexpr int kPerOctave = 4;

// The air before the corners of tiles, at some depths. Tiles are those of the whole picture and depths powers
// of one number, so that parts of a picture fit together.
class AirGrid {
 public:
  AirGrid(const Camera& camera, const AerialPerspective& air, float near, float far)
      : tile_(std::clamp(camera.width() / kTiles, 1, kTile)),
        offX_(camera.window().x0 % tile_),
        offY_(camera.window().y0 % tile_),
        metresPerUnit_(air.metresPerUnit),
        first_(levelOf(near * metresPerUnit_)),
        levels_(levelOf(far * metresPerUnit_) + 2 - first_) {
    const PixelBox window = camera.window();
    across_ = (window.width() + offX_ + tile_ - 1) / tile_ + 1;
    const int down = (window.height() + offY_ + tile_ - 1) / tile_ + 1;
    nodes_.resize(std::size_t(across_) * std::size_t(down) * std::size_t(levels_));
    parallelFor(nodes_.size() / std::size_t(levels_), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i) {
        const Ray ray = camera.ray(window.x0 - offX_ + double(i % std::size_t(across_)) * tile_,
                                   window.y0 - offY_ + double(i / std::size_t(across_)) * tile_);
        const double perDepth = 1 / std::max(dot(ray.direction, camera.forward()), 1e-3);
        for (int n = 0; n != levels_; ++n) {
          ClearSky::Air& node = nodes_[i * std::size_t(levels_) + std::size_t(n)];
          node = air.sky.airBefore(Vec3f(ray.direction), float(metresOf(first_ + n) * perDepth));
          node.light *= air.intensity;
        }
      }
    });
  }

  ClearSky::Air at(int x, int y, float depth) const {
    const float metres = depth * metresPerUnit_;
    const int level = levelOf(metres), k = level - first_;
    const double from = metresOf(level), share = (double(metres) - from) / (metresOf(level + 1) - from);
    const float u = (float(x + offX_) + 0.5f) / float(tile_), v = (float(y + offY_) + 0.5f) / float(tile_),
                w = std::clamp(float(share), 0.0f, 1.0f);
    const int i = int(u), j = int(v);
    ClearSky::Air result{{}, {}};
    for (int corner = 0; corner != 8; ++corner) {
      const int di = corner & 1, dj = corner >> 1 & 1, dk = corner >> 2;
      const float weight =
          (di ? u - float(i) : 1 - u + float(i)) * (dj ? v - float(j) : 1 - v + float(j)) * (dk ? w : 1 - w);
      const ClearSky::Air& node =
          nodes_[(std::size_t(j + dj) * std::size_t(across_) + std::size_t(i + di)) * std::size_t(levels_) +
                 std::size_t(k + dk)];
      result.left += node.left * weight;
      result.light += node.light * weight;
    }
    return result;
  }

 private:
  // Depths are those of whole levels, and 0.
  static double metresOf(int level) { return level < 0 ? 0.0 : std::exp2(double(level) / kPerOctave); }
  static int levelOf(float metres) {
    return metres < 1 ? -1 : int(std::floor(std::log2(std::min(metres, 1e30f)) * float(kPerOctave)));
  }

  int tile_, offX_, offY_, across_ = 0;
  float metresPerUnit_;
  int first_, levels_;
  std::vector<ClearSky::Air> nodes_;
};

// The channels of one colour whose numbers are light.
std::vector<std::size_t> channelsOf(char colour, const Image& image) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i != image.channels.size(); ++i) {
    const std::string& name = image.channels[i].name;
    const bool isLight = name.size() == 1 || name.starts_with("light_") || name.starts_with("emission.");
    if (isLight && name.back() == colour) result.push_back(i);
  }
  return result;
}

}  // namespace

void addAir(Image& image, const Camera& camera, const AerialPerspective& air) {
  require(air.metresPerUnit > 0 && std::isfinite(air.metresPerUnit),
          fmt::format("air: expected a length of world units above 0 metres, got {}", air.metresPerUnit));
  require(air.intensity >= 0 && std::isfinite(air.intensity),
          fmt::format("air: expected an intensity of at least 0, got {}", air.intensity));
  const std::vector<float> depths = image.channel("Z_mean").values;
  require(image.find("R") && image.find("G") && image.find("B") && image.find("A"),
          "air: the picture has no channels R, G, B and A");
  float near = std::numeric_limits<float>::infinity(), far = 0;
  for (const float depth : depths)
    if (std::isfinite(depth)) near = std::min(near, depth), far = std::max(far, depth);
  const std::vector<std::size_t> ofColour[] = {channelsOf('R', image), channelsOf('G', image),
                                               channelsOf('B', image)};
  const bool hasLights = std::ranges::any_of(
      image.channels, [](const Image::Channel& channel) { return channel.name.starts_with("light_"); });
  const std::size_t own = image.channels.size();
  if (hasLights)
    for (const char* name : {"light_air.R", "light_air.G", "light_air.B"}) image.add(name, false);
  if (!(near <= far)) return;
  const AirGrid grid(camera, air, near, far);
  const auto alpha =
      std::size_t(std::ranges::find(image.channels, "A", &Image::Channel::name) - image.channels.begin());
  parallelFor(std::size_t(image.height), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y != end; ++y)
      for (int x = 0; x != image.width; ++x) {
        const std::size_t at = y * std::size_t(image.width) + std::size_t(x);
        if (!std::isfinite(depths[at])) continue;
        const ClearSky::Air before = grid.at(x, int(y), depths[at]);
        const float opacity = image.channels[alpha].values[at];
        for (std::size_t c = 0; c != 3; ++c) {
          for (const std::size_t channel : ofColour[c])
            image.channels[channel].values[at] *= before.left[int(c)];
          const float light = opacity * before.light[int(c)];
          image.channels[ofColour[c].front()].values[at] += light;
          if (hasLights) image.channels[own + c].values[at] = light;
        }
      }
  });
}

}  // namespace nephele
