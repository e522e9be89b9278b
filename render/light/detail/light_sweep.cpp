// Sweeps: for each of a few directions light is carried slice by slice through the lattice, read between the
// nodes of the slice before. A cell of optical depth t and own light S per optical depth lets through I
// exp(-t) + S (1 - exp(-t)), and holds S + (I - S) (1 - exp(-t)) / t on average. Directions with the same
// axis and side share a pass; the six passes run in parallel and are added in a fixed order.
#include "nephele/render/light/detail/light_sweep.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/exp_of_minus.h"

namespace nephele::detail {

LightSweep::LightSweep(const ScatteringLattice& lattice, float extinction, const std::vector<float>& inflow,
                       const std::vector<Vec3f>& directions)
    : share_(1.0f / float(directions.size())) {
  std::vector<float> perLength(lattice.density);
  for (float& value : perLength) value *= extinction;
  for (int axis = 0; axis != 3; ++axis) {
    extinction_.emplace_back(lattice.size, axis).take(perLength);
    source_.emplace_back(lattice.size, axis);
    for (int side = 0; side != 2; ++side) sums_.emplace_back(lattice.size, axis);
  }
  for (std::size_t i = 0; i != directions.size(); ++i) {
    const Vec3f& d = directions[i];
    int axis = 0;
    for (int a = 1; a != 3; ++a)
      if (std::fabs(d[a]) > std::fabs(d[axis])) axis = a;
    passes_[axis * 2 + (d[axis] > 0)].push_back({d, inflow[i]});
  }
}

void LightSweep::sweep(const std::vector<float>& source, std::vector<float>& mean) {
  parallelFor(3, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t axis = begin; axis != end; ++axis) source_[axis].take(source);
  });
  parallelFor(6, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pass = begin; pass != end; ++pass) {
      TurnedLattice& sum = sums_[pass];
      std::fill(sum.values.begin(), sum.values.end(), 0.0f);
      for (const auto& [d, inflow] : passes_[pass])
        carry({d[sum.order.x], d[sum.order.y], d[sum.order.z]}, inflow, pass / 2, sum);
    }
  });
  mean.assign(source.size(), 0.0f);
  for (const TurnedLattice& sum : sums_)
    parallelFor(std::size_t(sum.size.y), 8,
                [&](std::size_t begin, std::size_t end) { sum.addTo(mean, share_, int(begin), int(end)); });
}

void LightSweep::carry(const Vec3f& d, float inflow, std::size_t axis, TurnedLattice& sum) const {
  // Slices have a rim of cells through which light comes in.
  constexpr int rim = 2;
  const Vec3i n = sum.size;
  const float length = 1 / std::fabs(d.z);  // world units per slice
  const float du = -d.x * length, dv = -d.y * length;
  const int iu = int(std::floor(du)), iv = int(std::floor(dv));
  const float fu = du - float(iu), fv = dv - float(iv);
  const float w00 = (1 - fu) * (1 - fv), w10 = fu * (1 - fv), w01 = (1 - fu) * fv, w11 = fu * fv;
  const std::size_t width = std::size_t(n.x + 2 * rim);
  std::vector<float> before(width * std::size_t(n.y + 2 * rim), inflow), here = before;
  for (int slice = 0; slice != n.z; ++slice) {
    const int z = d.z > 0 ? slice : n.z - 1 - slice;
    for (int y = 0; y != n.y; ++y) {
      const float *a = before.data() + std::size_t(y + iv + rim) * width + std::size_t(iu + rim),
                  *b = a + width;
      const std::size_t row = sum.row(y, z);
      const float *extinction = extinction_[axis].values.data() + row,
                  *own = source_[axis].values.data() + row;
      float *out = here.data() + std::size_t(y + rim) * width + rim, *total = sum.values.data() + row;
      for (int x = 0; x < n.x; ++x) {
        const float in = w00 * a[x] + w10 * a[x + 1] + w01 * b[x] + w11 * b[x + 1];
        const float depth = std::min(length * extinction[x], 80.0f), excess = in - own[x];
        // (1 - exp(-depth)) / depth, by its series where the difference would lose its digits.
        const float thin = 1 - depth * (0.5f - depth * (1.0f / 6));
        const float mean = depth < 0.03f ? thin : (1 - expOfMinus(depth)) / depth;
        total[x] += own[x] + excess * mean;
        out[x] = in - excess * (depth * mean);
      }
    }
    std::swap(before, here);
  }
}

}  // namespace nephele::detail
