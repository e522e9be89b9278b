#include "nephele/render/scene/backdrop.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/scene/environment.h"

namespace nephele {

namespace {

// How far apart a clear sky is looked at, in pixels: less than it changes by.
constexpr int kApart = 8;

Vec3f radiance(Vec3f towards, const Lights& lights) {
  if (lights.clear) towards.y = 0.5f * (towards.y + std::hypot(towards.y, 0.04f));
  if (lights.map) return lights.map->smoothRadiance(towards);
  const Vec3f sky = lights.sky;
  const float most = std::max({sky.x, sky.y, sky.z});
  const Vec3f haze = sky * 0.6f + Vec3f{0.7f, 0.7f, 0.7f} * most;
  return haze + (sky * 0.7f - haze) * (1 - std::exp(-3 * std::max(towards.y, 0.0f)));
}

}  // namespace

void addBackdrop(Image& image, const Camera& camera, const Lights& lights) {
  const std::size_t first = image.channels.size();
  for (const char* name : {"backdrop.R", "backdrop.G", "backdrop.B"}) image.add(name);
  const PixelBox window = camera.window();
  // Between nodes it is interpolated: those of the whole picture, so that its parts fit together.
  const int apart = lights.clear ? kApart : 1;
  const int offX = window.x0 % apart, offY = window.y0 % apart;
  const int across = (image.width + offX) / apart + 2, down = (image.height + offY) / apart + 2;
  std::vector<Vec3f> nodes(std::size_t(across) * std::size_t(down));
  parallelFor(nodes.size(), std::size_t(across), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      const Ray ray = camera.ray(window.x0 - offX + double(i % std::size_t(across)) * apart + 0.5,
                                 window.y0 - offY + double(i / std::size_t(across)) * apart + 0.5);
      nodes[i] = radiance(Vec3f(ray.direction), lights);
    }
  });
  parallelFor(std::size_t(image.height), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y != end; ++y)
      for (int x = 0; x != image.width; ++x) {
        const int i = x + offX, j = int(y) + offY;
        const float u = float(i % apart) / float(apart), v = float(j % apart) / float(apart);
        const Vec3f* at = nodes.data() + std::size_t(j / apart) * std::size_t(across) + i / apart;
        const Vec3f colour =
            (at[0] * (1 - u) + at[1] * u) * (1 - v) + (at[across] * (1 - u) + at[across + 1] * u) * v;
        for (std::size_t c = 0; c != 3; ++c)
          image.channels[first + c].values[y * std::size_t(image.width) + std::size_t(x)] = colour[int(c)];
      }
  });
}

}  // namespace nephele
