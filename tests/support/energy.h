#pragma once

#include <cmath>

#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/march/raymarch.h"

namespace nephele::test {

/// Square views without perspective of what lies about a place.
struct ParallelViews {
  Vec3f middle{};
  float width = 1;
  int pixels = 40;

  /// Sum of a channel over the pixels of the view from a direction.
  double sum(const LitVolume& lit, const RenderOptions& options, const Vec3f& from,
             const char* channel) const {
    Camera::Frame frame;
    frame.width = frame.height = pixels;
    frame.projection = Camera::Projection::orthographic;
    frame.orthographicWidth = width;
    const Vec3f up = std::fabs(from.y) > 0.9f ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0};
    const Camera camera = Camera::lookingAt(middle + from * (4 * width), middle, up, frame);
    const Image image = lit.render(camera, options).image;
    double result = 0;
    for (int y = 0; y != pixels; ++y)
      for (int x = 0; x != pixels; ++x) result += double(image.at(channel, x, y));
    return result;
  }
};

/// What comes out of a volume that absorbs nothing in the directions of a quadrature, see levelSymmetric,
/// over what it takes of its only light, a sun of irradiance 1.
inline double shareThatComesOut(const LitVolume& lit, const Vec3f& towardsSun, const ParallelViews& views,
                                int order, RenderOptions options = {}) {
  options.aovs = {"Z"};
  double out = 0;
  for (const auto& [way, weight] : detail::levelSymmetric(order))
    out += 4 * double(kPi) * double(weight) * views.sum(lit, options, way, "R");
  return out / views.sum(lit, options, towardsSun, "A");
}

}  // namespace nephele::test
