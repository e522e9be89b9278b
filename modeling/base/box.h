#pragma once

#include <limits>

#include "nephele/modeling/base/math.h"

namespace nephele {

/// An axis-aligned box, both corners included. The default box is empty (min > max).
struct Box {
  Vec3f min{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
            std::numeric_limits<float>::infinity()};
  Vec3f max{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
            -std::numeric_limits<float>::infinity()};

  /// All of space.
  static Box everywhere() { return {Box{}.max, Box{}.min}; }

  bool isEmpty() const { return min.x > max.x || min.y > max.y || min.z > max.z; }
  Vec3f center() const { return (min + max) * 0.5f; }
  Vec3f size() const { return isEmpty() ? Vec3f{} : max - min; }
  float longestSide() const {
    const Vec3f s = size();
    return s.x > s.y ? (s.x > s.z ? s.x : s.z) : (s.y > s.z ? s.y : s.z);
  }
  bool contains(const Vec3f& p) const {
    return p.x >= min.x && p.y >= min.y && p.z >= min.z && p.x <= max.x && p.y <= max.y && p.z <= max.z;
  }
  Box including(const Vec3f& p) const { return {nephele::min(min, p), nephele::max(max, p)}; }
  Box including(const Box& b) const { return {nephele::min(min, b.min), nephele::max(max, b.max)}; }
  Box intersection(const Box& b) const { return {nephele::max(min, b.min), nephele::min(max, b.max)}; }
  /// Grown by `margin` (world units) on every side.
  Box expanded(float margin) const {
    return {min - Vec3f{margin, margin, margin}, max + Vec3f{margin, margin, margin}};
  }
  bool operator==(const Box&) const = default;
};

}  // namespace nephele
