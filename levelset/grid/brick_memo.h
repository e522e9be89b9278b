#pragma once

#include <memory>

#include "nephele/modeling/field/field.h"

namespace nephele::detail {

/// Remembers what a field is at the samples of bricks, so that several passes over one lattice evaluate it
/// once. For a field that costs more than to look up.
class BrickMemo {
 public:
  /// For the bricks of 8^3 voxels of size `voxelSize` inside `box`. Remembers nothing if there are more than
  /// `mostBricks` of them.
  BrickMemo(const ScalarField& field, float voxelSize, const Box& box, double mostBricks);

  /// The field: the same values everywhere. It may outlive the memo. Blocks of points that are half a brick,
  /// as bakes evaluate them, are answered from memory from the second time on. Safe to use from many threads.
  const ScalarField& field() const { return field_; }
  /// Gives the memory back; from then on nothing is remembered. Not while the field is evaluated.
  void clear();

 private:
  struct Table;
  std::shared_ptr<Table> table_;
  ScalarField field_{0.0f};
};

}  // namespace nephele::detail
