#pragma once

#include <array>
#include <vector>

namespace nephele::detail {

/// Anderson's acceleration of x = g(x), differences weighed by `weights`, which must outlive it. Uses all
/// cores; the result does not depend on their number.
class Anderson {
 public:
  explicit Anderson(const std::vector<float>& weights) : weights_(weights) {}

  /// Moves x, given g(x); returns the relative change |g - x| / |g| that was left.
  float step(std::vector<float>& x, const std::vector<float>& g);

 private:
  static constexpr std::size_t kMemory = 4, kColumns = kMemory + 1;
  // Of the differences with each other, and with the last one; then the change that was left, and the whole.
  using Products = std::array<double, kMemory * kColumns + 2>;

  static std::array<double, kMemory> solve(Products a, std::size_t count);

  const std::vector<float>& weights_;
  std::vector<float> lastX_, lastF_;
  std::vector<std::vector<float>> dx_, df_;
};

}  // namespace nephele::detail
