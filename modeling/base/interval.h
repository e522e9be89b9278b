#pragma once

#include <array>
#include <limits>
#include <type_traits>

#include "nephele/modeling/base/box.h"

namespace nephele {

/// A closed range of values [min, max] that is known to contain a result.
///
/// Arithmetic on intervals rounds outward, so that the result contains every value that floats inside the
/// operands can give. NaN never widens a bound silently: an operation that could give NaN returns
/// `everything()`.
struct Interval {
  float min = -std::numeric_limits<float>::infinity();
  float max = std::numeric_limits<float>::infinity();

  static constexpr Interval everything() { return {}; }
  static constexpr Interval of(float value) { return {value, value}; }

  bool contains(float v) const { return v >= min && v <= max; }
  bool contains(const Interval& b) const { return b.min >= min && b.max <= max; }
  bool isPoint() const { return min == max; }
  Interval hull(const Interval& b) const { return {min < b.min ? min : b.min, max > b.max ? max : b.max}; }
  /// Largest absolute value inside.
  float magnitude() const { return -min > max ? -min : max; }
  bool operator==(const Interval&) const = default;
};

Interval operator+(const Interval& a, const Interval& b);
Interval operator-(const Interval& a, const Interval& b);
Interval operator-(const Interval& a);
Interval operator*(const Interval& a, const Interval& b);
Interval operator/(const Interval& a, const Interval& b);
Interval abs(const Interval& a);
Interval min(const Interval& a, const Interval& b);
Interval max(const Interval& a, const Interval& b);
Interval square(const Interval& a);
Interval sqrt(const Interval& a);

/// What `range` of a field of T returns: one Interval, or one per component (rows first for matrices).
template <class T>
using RangeOf =
    std::conditional_t<std::is_same_v<T, float>, Interval, std::array<Interval, sizeof(T) / sizeof(float)>>;

/// The box spanned by three component ranges, and back.
inline Box boxOf(const std::array<Interval, 3>& r) {
  return {{r[0].min, r[1].min, r[2].min}, {r[0].max, r[1].max, r[2].max}};
}
inline std::array<Interval, 3> rangeOf(const Box& b) {
  return {Interval{b.min.x, b.max.x}, Interval{b.min.y, b.max.y}, Interval{b.min.z, b.max.z}};
}

}  // namespace nephele
