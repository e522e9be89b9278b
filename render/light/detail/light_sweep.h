#pragma once

#include <vector>

#include "nephele/render/light/detail/scattering_lattice.h"

namespace nephele::detail {

/// A copy of lattice values whose slowest axis is `last`.
struct TurnedLattice {
  Vec3i order, size;
  std::size_t stride[3];
  std::vector<float> values;

  TurnedLattice(const Vec3i& n, int last)
      : order(last == 0   ? Vec3i{1, 2, 0}
              : last == 1 ? Vec3i{0, 2, 1}
                          : Vec3i{0, 1, 2}),
        size{n[order.x], n[order.y], n[order.z]},
        values(std::size_t(n.x) * std::size_t(n.y) * std::size_t(n.z)) {
    const std::size_t plain[3] = {1, std::size_t(n.x), std::size_t(n.x) * std::size_t(n.y)};
    for (int axis = 0; axis != 3; ++axis) stride[axis] = plain[order[axis]];
  }
  std::size_t row(int y, int z) const {
    return (std::size_t(z) * std::size_t(size.y) + std::size_t(y)) * std::size_t(size.x);
  }
  void take(const std::vector<float>& from) {
    for (int z = 0; z != size.z; ++z)
      for (int y = 0; y != size.y; ++y) {
        const float* at = from.data() + std::size_t(z) * stride[2] + std::size_t(y) * stride[1];
        float* to = values.data() + row(y, z);
        for (int x = 0; x != size.x; ++x) to[x] = at[std::size_t(x) * stride[0]];
      }
  }
  void addTo(std::vector<float>& sum, float share, int beginY, int endY) const {
    for (int z = 0; z != size.z; ++z)
      for (int y = beginY; y < endY; ++y) {
        float* at = sum.data() + std::size_t(z) * stride[2] + std::size_t(y) * stride[1];
        const float* from = values.data() + row(y, z);
        for (int x = 0; x != size.x; ++x) at[std::size_t(x) * stride[0]] += share * from[x];
      }
  }
};

/// Carries light through one lattice in all directions.
class LightSweep {
 public:
  /// `inflow`: what comes in along each of the directions.
  LightSweep(const ScatteringLattice& lattice, float extinction, const std::vector<float>& inflow,
             const std::vector<Vec3f>& directions);

  /// Mean over directions of the light in every cell, whose own light is `source` per optical depth.
  void sweep(const std::vector<float>& source, std::vector<float>& mean);

 private:
  struct Way {
    Vec3f direction;
    float inflow;
  };

  // `d`: the way of the light in cells per world unit.
  void carry(const Vec3f& d, float inflow, std::size_t axis, TurnedLattice& sum) const;

  float share_;
  std::vector<TurnedLattice> extinction_, source_, sums_;
  std::vector<Way> passes_[6];
};

}  // namespace nephele::detail
