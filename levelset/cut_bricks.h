#pragma once

#include <compare>
#include <span>
#include <utility>
#include <vector>

#include "levelset/brick_mask.h"
#include "levelset/pieces.h"

/// The first half of cutting: which brick knows what. Not for other folders.
namespace nephele::detail {

/// One bit per knife.
using KnifeBits = std::vector<std::uint64_t>;

inline bool bitOf(const KnifeBits& bits, std::uint32_t k) {
  return (bits[k / 64] >> (k % 64) & 1) != 0;
}

/// A combination of sides, and a cell.
struct CutCode {
  static constexpr std::uint32_t kNoCell = 0xFFFFFFFFu;

  KnifeBits sides;
  std::uint32_t cell = kNoCell;
  auto operator<=>(const CutCode&) const = default;
};

/// A brick that the shape enters.
struct CutBrick {
  static constexpr std::size_t kSamples = 512;

  Vec3i brick;
  /// Knives whose side is one for the whole brick, and those of them whose side is positive.
  KnifeBits decided, sides;
  std::vector<std::uint32_t> undecided;
  /// Cells that any sample may belong to, or whose boundary is near.
  std::vector<std::uint32_t> cells;
  /// Deep inside the shape, everything decided: no samples are kept, and one code says it all.
  bool isUniform = false;
  /// kSamples of the shape, then of each undecided knife.
  std::vector<float> samples;
  /// The samples inside, by code.
  std::vector<std::pair<CutCode, BrickMask>> members;

  /// World position of a sample.
  Vec3f position(std::size_t sample, float voxelSize) const {
    const int s = int(sample);
    return Vec3f(brick * 8 + Vec3i{s & 7, s >> 3 & 7, s >> 6}) * voxelSize;
  }
};

/// The signed distance from the plane between two points, positive at the first one's side. Exchanging the
/// points changes nothing but the sign, exactly.
struct Bisector {
  Vec3f middle, normal;

  Bisector(const Vec3f& a, const Vec3f& b) : middle((a + b) * 0.5f), normal(normalize(a - b)) {}
  float at(const Vec3f& p) const { return dot(p - middle, normal); }
};

/// The knife's values, divided by the length of its gradient where it is no distance.
void evaluateKnife(const Knife& knife, const PointSpans& points, std::span<float> values);

/// Every brick whose samples come within the band of the shape or lie inside it, by z, y, x.
/// @throws Error if the box is too large for its voxels; Cancelled.
std::vector<CutBrick> cutBricks(const ScalarField& shape, const CutOptions& options,
                                const Progress& progress);

}  // namespace nephele::detail
