// A sweep of light maps x to g(x), and the light is its fixed point, reached by Anderson's
// acceleration (1965) with a memory of a few sweeps: where a plain iteration needs a sweep per scattering, a
// hundred and more in a cloud, this takes some eight.
#include "nephele/render/light/detail/anderson.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

float Anderson::step(Moments& x, const Moments& g) {
  const std::size_t n = weights_.size();
  constexpr std::size_t piece = 1 << 15;
  if (!lastG_.empty()) {
    if (dg_.size() == kMemory) {
      std::rotate(dg_.begin(), dg_.begin() + 1, dg_.end());
      std::rotate(df_.begin(), df_.begin() + 1, df_.end());
    } else {
      resizeLarge(dg_.emplace_back(), x.size());
      df_.emplace_back(n);
    }
  }
  const std::size_t m = dg_.size();
  std::vector<Products> pieces((n + piece - 1) / piece);
  parallelFor(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p != end; ++p)
      for (std::size_t i = p * piece; i != std::min(n, (p + 1) * piece); ++i) {
        const std::size_t at = CellRows::momentsAt(i, values_);
        const float f = g[at] - x[at], weight = weights_[i];
        if (m > 0) df_[m - 1][i] = f - lastF_[i];
        if (weight == 0) continue;
        Products& sums = pieces[p];
        for (std::size_t r = 0; r != m; ++r) {
          const float mine = weight * df_[r][i];
          for (std::size_t c = 0; c != m; ++c) sums[r * kColumns + c] += double(mine * df_[c][i]);
          sums[r * kColumns + kMemory] += double(mine * f);
        }
      }
  });
  // Added in a fixed order, so that the sums do not depend on the threads.
  Products a{};
  for (const Products& sums : pieces)
    for (std::size_t k = 0; k != a.size(); ++k) a[k] += sums[k];
  const std::array<double, kMemory> share = solve(a, m);

  const bool isFirst = lastG_.empty();
  lastF_.resize(n);
  resizeLarge(lastG_, x.size());
  std::vector<std::array<double, 2>> changes(pieces.size());
  static_assert(kMemory == 1);
  const float by = m > 0 ? float(share[0]) : 0.0f;
  // A vector of values.
  const auto move = [&, moved = x.data(), last = lastG_.data(), grown = m > 0 ? dg_[0].data() : nullptr,
                     given = g.data()](std::size_t first) {
    for (std::size_t i = first; i != first + CellRows::kVector; ++i) {
      float next = given[i];
      if (!isFirst) {
        grown[i] = given[i] - last[i];
        next -= by * grown[i];
      }
      last[i] = given[i];
      moved[i] = next;
    }
  };
  parallelFor(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p != end; ++p) {
      std::array<double, 2>& sums = changes[p];
      for (std::size_t cell = p * piece; cell != std::min(n, (p + 1) * piece); cell += CellRows::kVector) {
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
    }
  });
  double change = 0, whole = 0;
  for (const auto& sums : changes) change += sums[0], whole += sums[1];
  return whole > 0 ? float(change / whole) : 0.0f;
}

// Least squares by the normal equations, a little damped.
std::array<double, Anderson::kMemory> Anderson::solve(Products a, std::size_t m) {
  std::array<double, kMemory> result{};
  for (std::size_t r = 0; r != m; ++r) a[r * kColumns + r] *= 1 + 1e-8;
  for (std::size_t r = 0; r != m; ++r)
    for (std::size_t below = r + 1; below != m; ++below) {
      if (!(a[r * kColumns + r] > 0)) continue;
      const double times = a[below * kColumns + r] / a[r * kColumns + r];
      for (std::size_t c = r; c != kColumns; ++c) a[below * kColumns + c] -= times * a[r * kColumns + c];
    }
  for (std::size_t r = m; r-- != 0;) {
    double rest = a[r * kColumns + kMemory];
    for (std::size_t c = r + 1; c != m; ++c) rest -= a[r * kColumns + c] * result[c];
    // A few digits are enough; with all of them the rounding of sums would come back a hundredfold.
    result[r] = a[r * kColumns + r] > 0 ? std::round(1024 * rest / a[r * kColumns + r]) / 1024 : 0;
  }
  return result;
}

}  // namespace nephele::detail
