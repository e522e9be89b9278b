#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/levelset/mesh/range_tree.h"

namespace nephele::detail {

/// A sphere of one value.
struct ValueSphere {
  Vec3f centre;
  float radius;
  float value;
};

/// Spheres of values, found by point through a hash grid for each power of two of the radii.
class VertexSpheres {
 public:
  /// Spheres of radius 0 are left out.
  explicit VertexSpheres(std::span<const ValueSphere> spheres);

  /// Sum of the weights w = (1 - d^2 / r^2)^3 of the spheres that contain a point at distance d of their
  /// centres, and of w times their values; zeros where there are none.
  struct Sum {
    double weight = 0, weighted = 0;
  };
  Sum at(const Vec3f& p) const;
  /// Hull of the values of the spheres that reach into `box`; nothing if none does.
  std::optional<Interval> near(const Box& box) const { return ranges_.near(box, 0.0f); }

 private:
  struct Slot {
    std::uint64_t cell = 0;
    std::uint32_t first = 0, count = 0;
  };
  /// Spheres of similar radius: cells at least twice as wide, so that eight cells hold all that reach a
  /// point.
  struct Level {
    float cellSize = 0;
    std::vector<Slot> slots;
  };
  struct Sphere {
    Vec3f centre;
    float squaredRadius;
    float value;
  };

  const Slot* find(const Level& level, std::uint64_t cell) const;

  Vec3f origin_{};
  std::vector<Sphere> spheres_;
  std::vector<Level> levels_;
  RangeTree ranges_;
};

}  // namespace nephele::detail
