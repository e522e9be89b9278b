// A sweep of light maps x to g(x), and the light is its fixed point, reached by Anderson's
// acceleration (1965): where a plain iteration needs a sweep per scattering, a hundred and more in a cloud,
// this takes some eight.
#include "nephele/render/light/detail/anderson.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

constexpr std::size_t kPiece = 1 << 15;

using Sums = std::array<double, 2>;

// What `each` adds to two sums in pieces of 0 to `count`, added in a fixed order, so that the threads do not
// show.
template <class Each>
Sums summed(std::size_t count, const Each& each) {
  std::vector<Sums> pieces((count + kPiece - 1) / kPiece);
  parallelFor(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p != end; ++p) each(p * kPiece, std::min(count, (p + 1) * kPiece), pieces[p]);
  });
  return std::accumulate(pieces.begin(), pieces.end(), Sums{}, [](const Sums& a, const Sums& b) {
    return Sums{a[0] + b[0], a[1] + b[1]};
  });
}

}  // namespace

// Least squares by the normal equation, a little damped.
float Anderson::shareOfLast(const Moments& x, const Moments& g) const {
  const auto [square, product] = summed(weights_.size(), [&](std::size_t begin, std::size_t end, Sums& sums) {
    for (std::size_t i = begin; i != end; ++i) {
      if (weights_[i] == 0) continue;
      const std::size_t at = CellRows::momentsAt(i, values_);
      const float f = g[at] - x[at], grown = f - lastF_[i], weighed = weights_[i] * grown;
      sums[0] += double(weighed * grown);
      sums[1] += double(weighed * f);
    }
  });
  // A few digits are enough; with all of them the rounding of sums would come back a hundredfold.
  return square > 0 ? float(std::round(1024 * product / (square * (1 + 1e-8))) / 1024) : 0.0f;
}

float Anderson::step(Moments& x, const Moments& g) {
  const bool isFirst = lastG_.empty();
  const float share = isFirst ? 0.0f : shareOfLast(x, g);
  lastF_.resize(weights_.size());
  resizeLarge(lastG_, x.size());
  // A vector of values.
  const auto move = [&, moved = x.data(), last = lastG_.data(), given = g.data()](std::size_t first) {
    for (std::size_t i = first; i != first + CellRows::kVector; ++i) {
      moved[i] = isFirst ? given[i] : given[i] - share * (given[i] - last[i]);
      last[i] = given[i];
    }
  };
  const auto [change, whole] = summed(weights_.size(), [&](std::size_t begin, std::size_t end, Sums& sums) {
    for (std::size_t cell = begin; cell != end; cell += CellRows::kVector) {
      const std::size_t first = cell * values_;
      std::array<float, CellRows::kVector> before;
      std::copy_n(x.begin() + std::ptrdiff_t(first), before.size(), before.begin());
      for (std::size_t v = 0; v != values_; ++v) move(first + v * CellRows::kVector);
      for (std::size_t k = 0; k != before.size(); ++k) {
        lastF_[cell + k] = g[first + k] - before[k];
        sums[0] += double(weights_[cell + k] * std::fabs(x[first + k] - before[k]));
        sums[1] += double(weights_[cell + k] * std::fabs(x[first + k]));
      }
    }
  });
  return whole > 0 ? float(change / whole) : 0.0f;
}

}  // namespace nephele::detail
