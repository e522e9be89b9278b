#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "nephele/levelset/cut/detail/level_sets/brick_lists.h"
#include "nephele/levelset/cut/detail/level_sets/cut_bricks.h"
#include "nephele/levelset/grid/brick_box.h"
#include "nephele/levelset/grid/disjoint_sets.h"

namespace nephele::detail {

inline constexpr std::uint32_t kNobody = 0xFFFFFFFFu;

/// Samples of one code that hang together within a brick.
struct ShellPart {
  std::uint32_t code;
  /// What it belongs to: the shell, later the piece, or nobody.
  std::uint32_t owner;
  BrickMask samples;
};

/// That an owner comes near a brick.
struct NearOwner {
  std::uint32_t owner;
  /// Its surface may cross cells of the brick, not only its band.
  bool isSurface;
};

/// A part of a shell: a brick, and which of its parts.
struct ShellMember {
  std::uint32_t brick, part;
};

/// By x, y and z: the brick itself and those after it.
constexpr Vec3i stepOf(std::size_t i) {
  return {int(i & 1), int(i >> 1 & 1), int(i >> 2)};
}

/// The shells of a cut: samples of one code that hang together, through faces of bricks. Each brick lists
/// those in it and near it.
class CutShells {
 public:
  /// `cut` must outlive this. @throws Cancelled.
  CutShells(const CutBricks& cut, float bandVoxels, const Progress& progress);

  const CutBricks& cut() const { return cut_; }
  const CutBrick& brick(std::size_t i) const { return cut_.bricks[i]; }
  /// The number of the brick at a place, or -1.
  std::int32_t brickAt(const Vec3i& at) const {
    return places_.covers(at) ? brickAt_[places_.numberOf(at)] : -1;
  }
  const BrickLists<ShellPart>& parts() const { return parts_; }
  const BrickLists<NearOwner>& near() const { return near_; }
  std::uint32_t ownerCount() const { return std::uint32_t(codes_.size()); }
  std::uint32_t codeOf(std::uint32_t owner) const { return codes_[owner]; }
  /// The parts of every owner, by brick.
  std::vector<std::vector<ShellMember>> members() const;
  /// Samples of a brick, or of none (-1), that belong to an owner.
  BrickMask ownedBy(std::uint32_t owner, std::int32_t brick) const;
  /// Places without a brick, and owners whose surface crosses cells there: where the box cuts the shape off.
  std::vector<std::pair<Vec3i, std::uint32_t>> surfacesBeyond() const;

  /// Which parts hang together through faces of bricks: of parts of any kind, by their place in `parts`.
  DisjointSets joined(const BrickLists<ShellPart>& parts, const Progress& progress) const;

  /// Owners were shells and become pieces, or nobody.
  void giveTo(const std::vector<std::uint32_t>& pieceOf, std::size_t pieces);

 private:
  /// How far a part goes.
  struct Reach {
    std::uint32_t owner;
    /// Bit i: the brick neighbour(i) is within the band of it.
    std::uint32_t near;
    /// Bit i: it has samples on all faces that lead to the brick before it by i & 1, i >> 1 & 1, i >> 2.
    std::uint8_t touches;
  };

  void placeBricks();
  void findParts(const Progress& progress);
  void findShells(const Progress& progress);
  Reach reachOf(const ShellPart& part, float bandVoxels) const;
  void findNear(float bandVoxels, const Progress& progress);
  void listNear(std::size_t brick, const std::vector<std::uint32_t>& reachOfBrick,
                std::vector<NearOwner>& list) const;

  const CutBricks& cut_;
  BrickBox places_;
  std::vector<std::int32_t> brickAt_;
  BrickLists<ShellPart> parts_;
  /// Of every part.
  std::vector<Reach> reach_;
  BrickLists<NearOwner> near_;
  /// Of every owner.
  std::vector<std::uint32_t> codes_;
};

/// Appends the connected parts of some samples of a brick to a list.
void appendParts(std::uint32_t code, const BrickMask& samples, std::vector<ShellPart>& list);

}  // namespace nephele::detail
