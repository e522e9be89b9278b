#pragma once

#include <cstddef>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// As many lights go along a line together, since what is between them and the eye is the same.
inline constexpr std::size_t kLightsTogether = 3;

/// What light meets at a node: with the density a vector of four numbers.
struct Met {
  alignas(16) float values[1 + kLightsTogether] = {};

  Met operator+(const Met& b) const {
    Met sum;
    for (std::size_t i = 0; i != 1 + kLightsTogether; ++i) sum.values[i] = values[i] + b.values[i];
    return sum;
  }
  Met operator-(const Met& b) const {
    Met difference;
    for (std::size_t i = 0; i != 1 + kLightsTogether; ++i) difference.values[i] = values[i] - b.values[i];
    return difference;
  }
  Met operator*(float x) const {
    Met product;
    for (std::size_t i = 0; i != 1 + kLightsTogether; ++i) product.values[i] = values[i] * x;
    return product;
  }
};

/// The lattice that lines go through.
struct SightLattice {
  Vec3i size{};
  /// At its nodes, the first axis fastest: density, and sources.
  const Met* met = nullptr;
  /// Of a cell.
  float depthPerDensity = 0;
  /// Light that this share of what a line begins with is behind is not looked for.
  float cutoff = 0;
};

/// Lines from nodes away from the eye, and what they send to it.
struct LinesOfSight {
  static constexpr int kCount = 16;

  alignas(64) float node[3][kCount] = {};
  alignas(64) float way[3][kCount] = {};
  alignas(64) float sent[kLightsTogether][kCount] = {};
  /// Of what is behind the lattice.
  alignas(64) float through[kCount] = {};
};

/// Follows the first `count` lines, with vectors of them.
void follow(const SightLattice& lattice, int count, LinesOfSight& lines);

}  // namespace nephele::detail
