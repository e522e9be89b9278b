#pragma once

#include <array>
#include <vector>

#include "nephele/render/light/detail/cell_rows.h"

namespace nephele::detail {

/// Anderson's acceleration of x = g(x) where x has several values per cell, see CellRows::momentsAt:
/// differences of the first of them, weighed by `weights`, tell how the last steps are mixed. `weights` must
/// outlive it. Uses all cores; the result does not depend on their number.
class Anderson {
 public:
  Anderson(const std::vector<float>& weights, std::size_t values) : weights_(weights), values_(values) {}

  /// Moves x, given g(x); returns the relative change of the first values.
  float step(Moments& x, const Moments& g);

 private:
  static constexpr std::size_t kMemory = 1, kColumns = kMemory + 1;
  // Of the differences with each other, and with the last one; then the change that was left, and the whole.
  using Products = std::array<double, kMemory * kColumns + 2>;

  static std::array<double, kMemory> solve(Products a, std::size_t count);

  const std::vector<float>& weights_;
  std::size_t values_;
  // Of the first values: what the last step left.
  std::vector<float> lastF_;
  Moments lastG_;
  std::vector<std::vector<float>> df_;
  std::vector<Moments> dg_;
};

}  // namespace nephele::detail
