#pragma once

#include <vector>

#include "nephele/render/light/detail/cell_rows.h"

namespace nephele::detail {

/// Anderson's acceleration of x = g(x), with a memory of one step, where x has several values per cell, see
/// CellRows::momentsAt: differences of the first of them, weighed by `weights`, tell how the last two steps
/// are mixed. `weights` must outlive it. Uses all cores; the result does not depend on their number.
class Anderson {
 public:
  Anderson(const std::vector<float>& weights, std::size_t values) : weights_(weights), values_(values) {}

  /// Moves x, given g(x); returns the relative change of the first values.
  float step(Moments& x, const Moments& g);

 private:
  float shareOfLast(const Moments& x, const Moments& g) const;

  const std::vector<float>& weights_;
  std::size_t values_;
  // What the last step was given, and of the first values, what it left.
  Moments lastG_;
  std::vector<float> lastF_;
};

}  // namespace nephele::detail
