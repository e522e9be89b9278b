#pragma once

#include <limits>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/march/detail/deep_pixel.h"
#include "nephele/render/march/detail/path_random.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/holdout_curve.h"

namespace nephele::detail {

/// What lies between the camera and what a path of it meets.
struct Foreground {
  HoldoutCurve holdout{};
  /// Of the angle between the ray and the line of sight.
  double cosine = 1.0;
  /// Opacity that is seen, per colour, and the same times the albedo there.
  Vec3f opacity{}, albedo{};
  /// What glows on the way, for deep pictures; null where nobody asks.
  std::vector<DeepPixel::Event>* glow = nullptr;

  float heldAt(double distance) const {
    std::size_t cursor = 0;
    return holdout.empty() ? 1.0f : holdout.transmittance(float(distance * cosine), cursor);
  }
};

/// A path's way to its next collision, in the space of the volume. What is known before, then what is found.
struct Flight {
  Ray ray;
  double length = std::numeric_limits<double>::infinity();
  PathRandom random;
  /// Of a ray of the camera; null for all others.
  Foreground* foreground = nullptr;

  /// Of the path, per colour, before and after; and what it was in front of the collision.
  Vec3f weight{1, 1, 1}, arriving{1, 1, 1};
  /// Light of what glows on the way, weighed.
  Vec3d glow{};
  /// To the collision; infinite if there is none.
  double distance = std::numeric_limits<double>::infinity();
};

/// A way on which a light is looked at, in the space of the volume, and an unbiased estimate of what is left
/// of it, per colour.
struct ShadowWay {
  Ray ray;
  double length = std::numeric_limits<double>::infinity();
  PathRandom random;
  /// Multiplies the extinction.
  Vec3f extinction{1, 1, 1};

  Vec3f left{1, 1, 1};
};

}  // namespace nephele::detail
