#pragma once

#include <cmath>
#include <cstdint>

namespace nephele::detail {

/// Random numbers that are a hash of seed, pixel, path and count, so that neither threads nor the number of
/// paths change a path.
class PathRandom {
 public:
  PathRandom() = default;
  PathRandom(std::uint64_t seed, std::uint64_t pixel, std::uint64_t path)
      : state_(mixed(mixed(mixed(seed) + pixel) + path)) {}

  /// Uniform in [0, 1).
  float next() { return float(bits() >> 40) * 0x1p-24f; }
  /// Exponential with mean 1.
  float depth() { return -std::log(1.0f - next()); }
  /// Numbers of their own, for work that is done at another time.
  PathRandom fork() {
    PathRandom other;
    other.state_ = mixed(bits());
    return other;
  }

 private:
  // The finaliser of SplitMix64 (Steele, Lea, Flood 2014), a bijection.
  static std::uint64_t mixed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  std::uint64_t bits() {
    const std::uint64_t value = mixed(state_);
    state_ += 0x9e3779b97f4a7c15u;
    return value;
  }

  std::uint64_t state_ = 0;
};

}  // namespace nephele::detail
