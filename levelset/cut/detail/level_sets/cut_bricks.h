#pragma once

#include <span>
#include <vector>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/grid/brick_mask.h"
#include "nephele/levelset/grid/memory_chunks.h"

/// The first half of cutting into level sets: which brick knows what.
namespace nephele::detail {

/// A cut into level sets: all knives are fields.
struct CutPlan {
  PieceLattice lattice;
  std::vector<Knife> knives;
  std::vector<Vec3f> cells;
  float kerf = 0.0f;

  /// World units.
  float band() const { return lattice.bandVoxels * lattice.voxelSize; }
  float halfKerf() const { return kerf / 2; }
};

inline bool bitOf(std::span<const std::uint64_t> bits, std::uint32_t k) {
  return (bits[k / 64] >> (k % 64) & 1) != 0;
}

/// A combination of sides, one bit per knife, and a cell.
struct CutCode {
  static constexpr std::uint32_t kNoCell = 0xFFFFFFFFu;

  std::span<const std::uint64_t> sides;
  std::uint32_t cell = kNoCell;
};

/// What is known of all samples of a cube of bricks.
struct CutKnowledge {
  /// Knives whose side is one for the whole cube, and those of them whose side is positive.
  std::span<const std::uint64_t> decided, sides;
  std::span<const std::uint32_t> undecided;
  /// Cells that any sample may belong to, or whose boundary is near.
  std::span<const std::uint32_t> cells;
};

/// A brick that the shape enters.
struct CutBrick {
  static constexpr std::size_t kSamples = 512;

  Vec3i brick;
  /// Deep inside the shape, everything decided: no samples are kept, and one code says it all.
  bool isUniform = false;
  const CutKnowledge* known = nullptr;
  /// kSamples of the shape, then of each undecided knife.
  const float* samples = nullptr;
  /// Where its members begin; they end where those of the next brick begin.
  std::size_t firstMember = 0;

  const float* samplesOf(std::size_t undecided) const { return samples + (1 + undecided) * kSamples; }
  /// World position of a sample.
  Vec3f position(std::size_t sample, float voxelSize) const {
    const int s = int(sample);
    return Vec3f(brick * 8 + Vec3i{s & 7, s >> 3 & 7, s >> 6}) * voxelSize;
  }
};

/// Samples of a brick inside the shape, with one code.
struct CutMember {
  std::uint32_t code;
  BrickMask samples;
};

struct CutBricks {
  /// By z, y, x; and one more, where the members end.
  std::vector<CutBrick> bricks;
  std::vector<CutMember> members;
  /// Those that occur.
  std::vector<CutCode> codes;
  /// What the others point into.
  std::vector<MemoryChunks> chunks;
  LargeArray samples;

  std::size_t count() const { return bricks.size() - 1; }
  std::span<const CutMember> membersOf(std::size_t i) const {
    return {members.data() + bricks[i].firstMember, bricks[i + 1].firstMember - bricks[i].firstMember};
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

/// Every brick whose samples come within the band of the shape or lie inside it.
/// @throws Error if the box is too large for its voxels; Cancelled.
CutBricks cutBricks(const ScalarField& shape, const CutPlan& plan, const Progress& progress);

}  // namespace nephele::detail
