#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/levelset/grid/detail/sample_buffer.h"
#include "nephele/levelset/grid/detail/voxel_box.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/constant_node.h"

namespace nephele::detail {

inline Interval including(const Interval& r, float v) {
  return v == v ? r.hull(Interval::of(v)) : Interval::everything();
}

/// The walk of a bake from an expression to constants and bricks of samples.
template <class T>
class BakeWalk {
 public:
  static constexpr int kBrick = BrickGrid::kBrick;
  /// Samples of a brick's own.
  static constexpr int kOwn = kBrick * kBrick * kBrick;
  /// Bricks per edge of the cells that threads share out among themselves.
  static constexpr int kCellSize = 8;
  static constexpr int kLanes = kComponents<T>;
  using Values = std::array<float, kLanes>;
  using Ranges = std::array<Interval, kLanes>;

  struct Settled {
    Vec3i brick;
    int size;
    Values value;
  };
  /// A brick that was evaluated: kLanes * kOwn samples. Bricks of nothing but the background share theirs.
  struct Leaf {
    Vec3i brick;
    float* samples;
    Ranges range;
  };
  /// What one cell of the octree gave.
  struct CellResult {
    int firstZ = 0;
    std::vector<Settled> settled;
    std::vector<Leaf> leaves;
    SampleStore samples;
  };
  /// What stands at a brick position: a constant, an evaluated brick, or neither where it is not known yet.
  struct Standing {
    const Values* constant = nullptr;
    const Leaf* leaf = nullptr;
  };

  /// Keeps references to both. @throws Error if the box is too large to hold.
  BakeWalk(const BakeOptions& options, const Progress& progress);

  const BakeOptions& options() const { return options_; }
  const Values& background() const { return background_; }
  const BrickBox& places() const { return places_; }
  /// Whether a brick is all background.
  bool isShared(const Leaf& leaf) const { return leaf.samples == backgroundSamples_.data(); }

  /// Cells that are settled by their ranges go to `settled`, the others are evaluated, in parallel.
  std::vector<CellResult> evaluated(const NodePtr<T>& node, std::vector<Settled>& settled);

  /// The constant that an evaluated brick may become, given what stands at the positions around it. None
  /// while one of them is not known. That a brick beside it was collapsed before does not matter: the
  /// constant settles the same.
  template <class StandingAt>
  std::optional<Values> collapsed(const Leaf& leaf, const StandingAt& standingAt) const {
    Ranges ranges = leaf.range;
    std::optional<Values> value = settledValue(ranges);
    for (int z = -margin_; value && z <= 1; ++z)
      for (int y = -margin_; value && y <= 1; ++y)
        for (int x = -margin_; value && x <= 1; ++x) {
          const Vec3i side{x, y, z};
          if (side == Vec3i{}) continue;
          const Standing s =
              places_.covers(leaf.brick + side) ? standingAt(leaf.brick + side) : Standing{&background_};
          if (!s.constant && !s.leaf) return std::nullopt;
          if (s.constant)
            for (int c = 0; c < kLanes; ++c) ranges[c] = including(ranges[c], (*s.constant)[c]);
          else
            ranges = includingRead(ranges, *s.leaf, side);
          value = settledValue(ranges);
        }
    return value && mayStand(*value, leaf.brick, 1) ? value : std::nullopt;
  }

  /// `ranges` and the samples of the leaf on `side` that interpolation in a brick reads.
  Ranges includingRead(Ranges ranges, const Leaf& leaf, const Vec3i& side) const;

 private:
  /// size^3 bricks from `brick` on, and an expression that holds there.
  struct Cell {
    Vec3i brick;
    int size;
    NodePtr<T> node;
  };
  using Buffers = tbb::enumerable_thread_specific<SampleBuffer>;

  Vec3f position(const Vec3i& voxel) const { return Vec3f(voxel) * options_.voxelSize; }

  /// The constant that stands for values in `ranges`, if one may.
  std::optional<Values> settledValue(const Ranges& ranges) const;
  /// The samples that size^3 bricks own.
  VoxelBox ownVoxels(const Vec3i& brick, int size) const;
  /// The samples that interpolation in the bricks' cells reads.
  VoxelBox readVoxels(const Vec3i& brick, int size) const;
  /// Whether a constant may stand for bricks that reach out of the box, where the background is due.
  bool mayStand(const Values& value, const Vec3i& brick, int size) const;

  /// Settles `cell` by range; else restricts its expression and returns false.
  bool settle(Cell& cell, std::vector<Settled>& settled) const;

  /// The eight parts of a cell that touch the table, in Z order.
  template <class Take>
  void split(const Cell& cell, const Take& take) const;

  std::vector<Cell> cellsToEvaluate(const NodePtr<T>& node, std::vector<Settled>& all) const;

  /// Bricks of `cell` that range does not settle.
  void collect(Cell cell, std::vector<Cell>& bricks, std::vector<Settled>& settled) const;

  CellResult evaluate(const Cell& cell, SampleBuffer& buffer);
  /// Collapses the bricks that can be judged within their cell, and copies the others to a store of just
  /// their size.
  void keepUnsettled(const Vec3i& cell, const std::vector<Leaf>& leaves, CellResult& result);

  bool isBackground(const Leaf& leaf) const;
  /// The own samples of one brick, component by component.
  void evaluate(const FieldNode<T>& node, const Vec3i& brick, float* samples, Scratch& scratch) const;

  const BakeOptions& options_;
  const Progress& progress_;
  /// Samples beyond a cell's corners that interpolation reads.
  int margin_;
  Values background_;
  std::vector<float> backgroundSamples_;
  VoxelBox voxels_;
  BrickBox places_;
};

}  // namespace nephele::detail
