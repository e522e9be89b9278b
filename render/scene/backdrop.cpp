#include "nephele/render/scene/backdrop.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/scene/environment.h"

namespace nephele {

namespace {

Vec3f radiance(const Vec3f& towards, const Lights& lights) {
  if (lights.map) return lights.map->smoothRadiance(towards);
  const Vec3f sky = lights.sky;
  const float most = std::max({sky.x, sky.y, sky.z});
  const Vec3f haze = sky * 0.6f + Vec3f{0.7f, 0.7f, 0.7f} * most;
  return haze + (sky * 0.7f - haze) * (1 - std::exp(-3 * std::max(towards.y, 0.0f)));
}

}  // namespace

void addBackdrop(Image& image, const Camera& camera, const Lights& lights) {
  const std::size_t first = image.channels.size();
  for (const char* name : {"backdrop.R", "backdrop.G", "backdrop.B"}) image.add(name, false);
  const PixelBox window = camera.window();
  parallelFor(std::size_t(image.height), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y != end; ++y)
      for (int x = 0; x != image.width; ++x) {
        const Ray ray = camera.ray(window.x0 + x + 0.5, window.y0 + double(y) + 0.5);
        const Vec3f colour = radiance(Vec3f(ray.direction), lights);
        for (std::size_t c = 0; c != 3; ++c)
          image.channels[first + c].values[y * std::size_t(image.width) + std::size_t(x)] = colour[int(c)];
      }
  });
}

}  // namespace nephele
