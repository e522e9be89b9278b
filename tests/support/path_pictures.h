#pragma once

#include <cmath>
#include <string>

#include "nephele/render/image/image.h"
#include "nephele/render/volume/render_volume.h"
#include "tests/support/density.h"

namespace nephele::test {

struct Estimate {
  double mean, standardError;
};

/// Mean over the pixels of a channel, and its standard error from their spread.
inline Estimate estimate(const Image& image, const std::string& name) {
  const std::vector<float>& values = image.channel(name).values;
  double sum = 0, squares = 0;
  for (const float value : values) sum += double(value), squares += double(value) * double(value);
  const double n = double(values.size()), mean = sum / n;
  return {mean, std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1))};
}

/// A density with soft and hard parts across two world units, on voxels of 1 / 16.
inline float lumpyBall(const Vec3f& p) {
  const float bumps = 0.3f * std::sin(5 * p.x) * std::sin(4 * p.y) * std::sin(6 * p.z);
  return std::fmin(std::fmax((1 + bumps - length(p)) / 0.3f, 0.0f), 1.0f);
}
inline std::shared_ptr<BrickGrid> lumpyCloud() {
  return densityGrid(voxels(0.0625f), {-24, -24, -24}, {24, 24, 24}, lumpyBall);
}

/// How two pictures compare in the blocks of 8 x 8 pixels of a channel: the mean ratio of the worst block,
/// less what five standard errors of its 64 pixels, estimated from their differences, may make of it.
inline double worstBlock(const Image& marched, const Image& traced, const std::string& name, float least) {
  double worst = 0;
  for (int by = 0; by + 8 <= marched.height; by += 8)
    for (int bx = 0; bx + 8 <= marched.width; bx += 8) {
      double a = 0, b = 0, squares = 0;
      for (int y = by; y != by + 8; ++y)
        for (int x = bx; x != bx + 8; ++x) {
          const double first = double(marched.at(name, x, y)), second = double(traced.at(name, x, y));
          a += first;
          b += second;
          squares += (second - first) * (second - first);
        }
      if (a < 64 * double(least)) continue;
      const double noise = 5 * std::sqrt(std::max(0.0, squares - (b - a) * (b - a) / 64));
      worst = std::max(worst, (std::fabs(b - a) - noise) / a);
    }
  return worst;
}

}  // namespace nephele::test
