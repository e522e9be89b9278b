#include "nephele/render/light/detail/scattering_lattice.h"

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

ScatteringLattice halved(const ScatteringLattice& fine) {
  const Vec3i n = fine.size;
  ScatteringLattice coarse({(n.x + 1) / 2, (n.y + 1) / 2, (n.z + 1) / 2}, 2 * fine.factor);
  for (int z = 0; z != n.z; ++z)
    for (int y = 0; y != n.y; ++y)
      for (int x = 0; x != n.x; ++x) {
        const std::size_t from = fine.index(x, y, z), to = coarse.index(x / 2, y / 2, z / 2);
        coarse.density[to] += fine.density[from];
        coarse.beam[to] += fine.density[from] * fine.beam[from];
      }
  for (std::size_t i = 0; i != coarse.density.size(); ++i) {
    if (!(coarse.density[i] > 0)) continue;
    coarse.beam[i] /= coarse.density[i];
    coarse.density[i] /= 8;
  }
  return coarse;
}

// Cell i of `coarse` holds the cells 2 i and 2 i + 1.
void refine(const float* values, const ScatteringLattice& coarse, const ScatteringLattice& fine, float* out) {
  parallelFor(std::size_t(fine.size.z), 16, [&](std::size_t begin, std::size_t end) {
    const auto neighbour = [](int i, int count) {
      return std::clamp(i / 2 + (i % 2 ? 1 : -1), 0, count - 1);
    };
    for (int z = int(begin); z != int(end); ++z)
      for (int y = 0; y != fine.size.y; ++y)
        for (int x = 0; x != fine.size.x; ++x) {
          const int ox = neighbour(x, coarse.size.x), oy = neighbour(y, coarse.size.y),
                    oz = neighbour(z, coarse.size.z);
          const auto row = [&](int j, int k) {
            return 0.75f * values[coarse.index(x / 2, j, k)] + 0.25f * values[coarse.index(ox, j, k)];
          };
          const auto plane = [&](int k) { return 0.75f * row(y / 2, k) + 0.25f * row(oy, k); };
          out[fine.index(x, y, z)] = 0.75f * plane(z / 2) + 0.25f * plane(oz);
        }
  });
}

float typicalDensity(const ScatteringLattice& lattice) {
  double sum = 0, squares = 0;
  for (const float value : lattice.density) {
    sum += double(value);
    squares += double(value) * double(value);
  }
  return sum > 0 ? float(squares / sum) : 0.0f;
}

std::vector<std::uint8_t> surroundings(const ScatteringLattice& lattice, int reach) {
  const Vec3i n = lattice.size;
  std::vector<std::uint8_t> now(lattice.density.size()), next(now.size());
  for (std::size_t i = 0; i != now.size(); ++i) now[i] = lattice.density[i] > 0;
  const std::size_t strides[3] = {1, std::size_t(n.x), std::size_t(n.x) * std::size_t(n.y)};
  for (int axis = 0; axis != 3; ++axis) {
    std::fill(next.begin(), next.end(), std::uint8_t(0));
    for (int z = 0; z != n.z; ++z)
      for (int y = 0; y != n.y; ++y)
        for (int x = 0; x != n.x; ++x) {
          const std::size_t i = lattice.index(x, y, z);
          if (!now[i]) continue;
          const int at = Vec3i{x, y, z}[axis];
          for (int d = -std::min(reach, at); d <= std::min(reach, n[axis] - 1 - at); ++d)
            next[i + std::size_t(std::ptrdiff_t(d) * std::ptrdiff_t(strides[axis]))] = 1;
        }
    std::swap(now, next);
  }
  return now;
}

}  // namespace nephele::detail
