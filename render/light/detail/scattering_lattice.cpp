#include "nephele/render/light/detail/scattering_lattice.h"

#include <algorithm>
#include <utility>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

ScatteringLattice halved(const ScatteringLattice& fine) {
  const Vec3i n = fine.size;
  ScatteringLattice coarse({(n.x + 1) / 2, (n.y + 1) / 2, (n.z + 1) / 2}, 2 * fine.voxels);
  const std::size_t perSlice = std::size_t(coarse.size.x) * std::size_t(coarse.size.y);
  parallelFor(std::size_t(coarse.size.z), 1, [&](std::size_t begin, std::size_t end) {
    for (int z = 2 * int(begin); z != std::min(2 * int(end), n.z); ++z)
      for (int y = 0; y != n.y; ++y)
        for (int x = 0; x != n.x; ++x) {
          const std::size_t from = fine.index(x, y, z), to = coarse.index(x / 2, y / 2, z / 2);
          coarse.density[to] += fine.density[from];
          coarse.beam[to] += fine.density[from] * fine.beam[from];
          const Vec3f half = Vec3f(Vec3i{x & 1, y & 1, z & 1}) - Vec3f{0.5f, 0.5f, 0.5f};
          coarse.centre[to] = coarse.centre[to] + (fine.centre[from] + half) * (0.5f * fine.density[from]);
        }
    for (std::size_t i = begin * perSlice; i != end * perSlice; ++i) {
      if (!(coarse.density[i] > 0)) continue;
      coarse.beam[i] /= coarse.density[i];
      coarse.centre[i] = coarse.centre[i] * (1 / coarse.density[i]);
      coarse.density[i] /= 8;
    }
  });
  return coarse;
}

// Cell i of `coarse` holds the cells 2 i and 2 i + 1.
void refine(const float* values, const CellRows& coarse, const CellRows& fine, std::size_t moments,
            float* out, bool adds) {
  constexpr int vector = CellRows::kVector;
  const auto neighbour = [](int i, int count) { return std::clamp(i / 2 + (i % 2 ? 1 : -1), 0, count - 1); };
  const Vec3i n = coarse.size();
  fine.forEachRow([&](int y, int z, const CellRows::Row& row) {
    const int oy = neighbour(y, n.y), oz = neighbour(z, n.z);
    const std::pair<const CellRows::Row*, float> around[] = {{&coarse.row(y / 2, z / 2), 0.5625f},
                                                             {&coarse.row(oy, z / 2), 0.1875f},
                                                             {&coarse.row(y / 2, oz), 0.1875f},
                                                             {&coarse.row(oy, oz), 0.0625f}};
    const int first = std::max(row.begin / 2 - 1, 0) / vector * vector, last = std::min(row.end / 2, n.x - 1);
    const auto place = [&](int x) { return CellRows::momentsAt(std::size_t(x - first), moments); };
    std::vector<float> mixed(place(last / vector * vector + vector));
    for (const auto& [there, share] : around)
      for (int x = std::max<int>(first, there->begin); x < std::min<int>(last + 1, there->end); x += vector) {
        const float* from = values + CellRows::momentsAt(std::size_t(there->first + x), moments);
        float* to = mixed.data() + place(x);
        for (std::size_t i = 0; i != moments * vector; ++i) to[i] += share * from[i];
      }
    for (int x = row.begin; x != row.end; ++x) {
      const float *near = mixed.data() + place(x / 2), *far = mixed.data() + place(neighbour(x, n.x));
      float* to = out + CellRows::momentsAt(std::size_t(row.first + x), moments);
      for (std::size_t i = 0; i != moments * vector; i += vector)
        to[i] = (adds ? to[i] : 0.0f) + (0.75f * near[i] + 0.25f * far[i]);
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
  const std::size_t along[3] = {std::size_t(n.x), std::size_t(n.y), std::size_t(n.z)};
  std::size_t stride = 1;
  for (int axis = 0; axis != 3; stride *= along[axis++]) {
    // Lines along the axis, side by side: what is `d` away from one place of them is one piece of memory.
    const std::size_t whole = stride * along[axis];
    std::copy(now.begin(), now.end(), next.begin());
    for (std::size_t first = 0; first < now.size(); first += whole)
      for (std::size_t d = stride; d <= std::min(std::size_t(reach) * stride, whole - stride); d += stride) {
        const std::uint8_t* from = now.data() + first;
        std::uint8_t* to = next.data() + first;
        for (std::size_t i = 0; i != whole - d; ++i) to[i + d] |= from[i];
        for (std::size_t i = 0; i != whole - d; ++i) to[i] |= from[i + d];
      }
    std::swap(now, next);
  }
  return now;
}

}  // namespace nephele::detail
