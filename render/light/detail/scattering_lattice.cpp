#include "nephele/render/light/detail/scattering_lattice.h"

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

void ScatteringLattice::finish(float samplesPerCell) {
  for (std::size_t i = 0; i != density.size(); ++i) {
    if (!(density[i] > 0)) continue;
    beam[i] /= density[i];
    density[i] /= samplesPerCell;
  }
}

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
  coarse.finish(8);
  return coarse;
}

// Cell i of `coarse` holds the cells 2 i and 2 i + 1.
std::vector<float> refined(const std::vector<float>& values, const ScatteringLattice& coarse,
                           const ScatteringLattice& fine) {
  std::vector<float> result(fine.density.size());
  parallelFor(std::size_t(fine.size.z), 4, [&](std::size_t begin, std::size_t end) {
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
          result[fine.index(x, y, z)] = 0.75f * plane(z / 2) + 0.25f * plane(oz);
        }
  });
  return result;
}

float typicalDensity(const ScatteringLattice& lattice) {
  double sum = 0, squares = 0;
  for (const float value : lattice.density) {
    sum += double(value);
    squares += double(value) * double(value);
  }
  return sum > 0 ? float(squares / sum) : 0.0f;
}

}  // namespace nephele::detail
