#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nephele/levelset/cut/detail/tetrahedra/lattice_carve.h"
#include "nephele/levelset/cut/detail/tetrahedra/vertex_key.h"

namespace nephele::detail {

/// Values nearer to 0 than this share of a voxel are 0.
inline constexpr double kZeroMargin = 1.0 / 4096;

/// A triangle by what its corners are.
struct KeyedTriangle {
  std::array<VertexKey, 3> corners;
  std::uint32_t parent, code;
};

/// What carving makes of a brick.
struct CarvedBrick {
  Vec3i at;
  /// Knives that may be 0 within a voxel of the brick; and the side of the others, per knife.
  std::vector<std::uint32_t> undecided;
  std::vector<char> isPositive;

  /// Own ones first, and as many positions.
  std::vector<VertexKey> keys;
  std::vector<Vec3d> positions;
  std::vector<KeyedTriangle> triangles;
  /// The sides of all knives, numbered by `KeyedTriangle::code`.
  std::vector<std::vector<bool>> codes;
  std::size_t firstVertex = 0;
};

/// What all bricks share.
struct Carving {
  const BrickGrid& level;
  std::span<const LatticeKnife> knives;
  double halfKerf;
  /// The largest value of the level set that counts.
  double largest = 0.0;
  /// Values nearer to 0 than this are 0.
  double margin = 0.0;
  /// The longest edge of a tetrahedron.
  double longestEdge = 0.0;
  std::vector<std::uint32_t> firstFrame{};

  std::uint32_t functionsPerKnife() const { return halfKerf > 0 ? 2 : 1; }
  /// The level set is function 0. With a kerf, a knife has one for its positive side, then one for its
  /// negative side.
  std::uint32_t functionOf(std::uint32_t knife) const { return 1 + knife * functionsPerKnife(); }
  /// The largest value of a knife in a tetrahedron in which it is 0, generously.
  double reach(std::uint32_t knife) const {
    const bool isDistance = halfKerf > 0 && knives[knife].knife.steepest > 1;
    return 2.5 * longestEdge * (isDistance ? 1.0 : double(knives[knife].knife.steepest));
  }
  Vec3d world(const Vec3d& index) const {
    const auto& m = level.indexToWorld().linear.m;
    return Vec3d{double(m[0]) * index.x + double(m[1]) * index.y + double(m[2]) * index.z,
                 double(m[3]) * index.x + double(m[4]) * index.y + double(m[5]) * index.z,
                 double(m[6]) * index.x + double(m[7]) * index.y + double(m[8]) * index.z} +
           Vec3d(level.indexToWorld().translation);
  }
};

}  // namespace nephele::detail
