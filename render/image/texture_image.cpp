// Pictures on surfaces.
//
// Copies are made by the mean over the area that a texel covers, whatever the sizes: 5 texels become 2 of two
// and a half each. Footprints are taken as square, the larger side counts.
#include "nephele/render/image/texture_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"

namespace nephele {

namespace {

double fraction(double x) {
  return x - std::floor(x);
}

}  // namespace

Texture::Texture(const Image& image) {
  image.check();
  const std::vector<float>&r = image.channel("R").values, &g = image.channel("G").values,
        &b = image.channel("B").values;
  Level first{image.width, image.height, {}};
  first.texels.resize(r.size());
  for (std::size_t i = 0; i < r.size(); ++i) first.texels[i] = {r[i], g[i], b[i]};
  if (const Image::Channel* opacity = image.find("A"))
    for (std::size_t i = 0; i < r.size(); ++i)
      first.texels[i] += Vec3f{1, 1, 1} * std::clamp(1 - opacity->values[i], 0.0f, 1.0f);
  levels_.push_back(std::move(first));
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& from = levels_.back();
    // Along x, then along y: texel i of n covers [i, i + 1) m / n of the m before.
    const auto shrink = [](const std::vector<Vec3f>& source, int count, int to, int lines, int step,
                           int stride, int newStep, int newStride) {
      std::vector<Vec3f> result(std::size_t(to) * std::size_t(lines));
      const double size = double(count) / to;
      for (int line = 0; line < lines; ++line)
        for (int i = 0; i < to; ++i) {
          const double begin = i * size, end = (i + 1) * size;
          Vec3d sum;
          for (int j = int(begin); j < std::min(count, int(std::ceil(end - 1e-9))); ++j) {
            const double weight = std::min(end, j + 1.0) - std::max(begin, double(j));
            sum += Vec3d(source[std::size_t(line * stride + j * step)]) * (weight / size);
          }
          result[std::size_t(line * newStride + i * newStep)] = Vec3f(sum);
        }
      return result;
    };
    const int w = std::max(1, from.width / 2), h = std::max(1, from.height / 2);
    const std::vector<Vec3f> narrow = shrink(from.texels, from.width, w, from.height, 1, from.width, 1, w);
    levels_.push_back({w, h, shrink(narrow, from.height, h, w, w, 1, w, 1)});
  }
}

Vec3f Texture::bilinear(const Level& level, double u, double v) {
  const double x = fraction(u) * level.width - 0.5, y = fraction(1 - v) * level.height - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y);
  const auto wrapped = [](double place, int count) { return (int(place) % count + count) % count; };
  const auto at = [&](double column, double row) -> const Vec3f& {
    return level.texels[std::size_t(wrapped(row, level.height)) * std::size_t(level.width) +
                        std::size_t(wrapped(column, level.width))];
  };
  const auto mix = [](const Vec3f& a, const Vec3f& b, double t) { return a + (b - a) * float(t); };
  return mix(mix(at(x0, y0), at(x0 + 1, y0), x - x0), mix(at(x0, y0 + 1), at(x0 + 1, y0 + 1), x - x0),
             y - y0);
}

Vec3f Texture::at(double u, double v, double texels) const {
  if (!std::isfinite(u) || !std::isfinite(v)) return {};
  const double level = texels > 1 ? std::clamp(std::log2(texels), 0.0, double(levels_.size() - 1)) : 0.0;
  const auto finer = std::size_t(level);
  const Vec3f near = bilinear(levels_[finer], u, v);
  if (finer + 1 >= levels_.size() || level == double(finer)) return near;
  return near + (bilinear(levels_[finer + 1], u, v) - near) * float(level - double(finer));
}

}  // namespace nephele
