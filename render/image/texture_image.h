#pragma once

#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/image/image.h"

namespace nephele {

/// A picture that repeats over the plane of texture coordinates, with copies of it, each of half the size,
/// for what is seen from afar. Row 0 is at v = 1. Linear light in and out; white shows through where the
/// picture is transparent, so that times the colour of a surface it lies on that.
class Texture {
 public:
  /// @throws Error if R, G or B is missing or the picture is empty.
  explicit Texture(const Image& image);

  /// The colour at (u, v), filtered over about `texels` texels of the picture in either direction: bilinear
  /// between texels and linear between the two copies nearest in size. Not finite coordinates give black.
  Vec3f at(double u, double v, double texels = 1.0) const;

  int width() const { return levels_[0].width; }
  int height() const { return levels_[0].height; }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<Vec3f> texels;
  };

  static Vec3f bilinear(const Level& level, double u, double v);

  std::vector<Level> levels_;
};

}  // namespace nephele
