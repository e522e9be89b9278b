#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// A sequence of random numbers that follow from whole numbers (SplitMix64). Streams of different numbers are
/// unrelated, as those of neighbouring seeds of `Draw` are not: for many short streams.
class RandomStream {
 public:
  RandomStream(std::initializer_list<std::uint64_t> numbers) {
    for (const std::uint64_t number : numbers) state_ = mixed(state_ ^ mixed(number + kStep));
  }

  std::uint64_t bits() {
    state_ += kStep;
    return mixed(state_);
  }
  /// Uniform in [0, 1).
  float uniform() { return float(bits() >> 40) * 0x1p-24f; }
  double uniformDouble() { return double(bits() >> 11) * 0x1p-53; }

  /// Two independent numbers of mean 0 and variance 1 (Box and Muller).
  void normalPair(float& a, float& b) {
    const std::uint64_t z = bits();
    // In (0, 1], so that the logarithm is finite.
    const float u = (float(z >> 40) + 1) * 0x1p-24f, v = float(z & 0xffffff) * 0x1p-24f;
    const float r = std::sqrt(-2 * std::log(u)), angle = 2 * kPi * v;
    a = r * std::cos(angle);
    b = r * std::sin(angle);
  }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15ull;

  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }

  std::uint64_t state_ = 0;
};

}  // namespace nephele::detail
