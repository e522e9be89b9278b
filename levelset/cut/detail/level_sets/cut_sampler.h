#pragma once

#include <array>
#include <memory>
#include <vector>

#include "nephele/levelset/cut/detail/level_sets/cut_bricks.h"
#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/field/field_node.h"

namespace nephele::detail {

/// A cube of bricks during the walk: its first brick, what its parent knew, and the shape in it.
struct CutCube {
  Vec3i brick;
  const CutKnowledge* known;
  ScalarField shape;
};

/// A brick that the walk left.
struct CutCandidate {
  CutCube cube;
  bool isUniform;
  std::size_t firstSample = 0;
};

/// Samples of one combination, while a brick is parted.
struct OpenCutMember {
  CutCode code;
  BrickMask samples;
};

/// What a block of bricks became.
struct SampledCutBlock {
  MemoryChunks chunks;
  std::vector<CutBrick> bricks;
  std::vector<OpenCutMember> members;
};

/// The grid behind a shape if its voxels stand where those of the cut do, or null.
std::shared_ptr<const BrickGrid> gridInPlace(const ScalarField& shape, float voxelSize);

/// The samples of a brick as points, and their coordinates on each axis.
struct BrickPoints {
  std::array<std::array<float, BrickGrid::kBrick>, 3> along;
  std::array<PointBlock, 2> blocks;

  BrickPoints(const Vec3i& brick, float voxelSize, Scratch& scratch, Scratch::Frame& frame);
};

/// Parts the samples of one brick after the other.
class CutSampler {
 public:
  /// `grid` holds the samples of `shape`, or is null.
  CutSampler(const ScalarField& shape, const BrickGrid* grid, const CutPlan& plan, SampledCutBlock& block)
      : shape_(shape),
        grid_(grid),
        plan_(plan),
        block_(block),
        h_(plan.lattice.voxelSize),
        band_(plan.band()),
        halfKerf_(plan.halfKerf()) {}

  /// `samples` has room for them.
  void add(const CutCandidate& candidate, float* samples);

 private:
  /// False if the brick has nothing to say.
  bool sample(const CutCandidate& candidate, float* samples);
  void split(std::uint32_t knife, const float* values);
  void splitByCell(const CutKnowledge& known, const BrickPoints& points);

  const ScalarField& shape_;
  const BrickGrid* grid_;
  const CutPlan& plan_;
  SampledCutBlock& block_;
  float h_, band_, halfKerf_;
  std::vector<OpenCutMember> open_, next_;
};

}  // namespace nephele::detail
