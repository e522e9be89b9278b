#pragma once

#include <array>
#include <span>
#include <vector>

#include "nephele/levelset/cut/detail/level_sets/cut_kernels.h"
#include "nephele/levelset/cut/detail/level_sets/cut_shells.h"
#include "nephele/levelset/cut/piece_level_set.h"
#include "nephele/levelset/mesh/brick_volume.h"

namespace nephele::detail {

/// The samples of owners: min(shape, +-knives), where their surfaces are.
class PieceSamples {
 public:
  /// Both must outlive this.
  PieceSamples(const CutPlan& plan, const CutShells& shells)
      : plan_(plan),
        shells_(shells),
        h_(plan.lattice.voxelSize),
        band_(plan.band()),
        halfKerf_(plan.halfKerf()) {}

  /// Volumes of the owners that are small, by marching cubes, voxels cubed; 0 for others. @throws Cancelled.
  std::vector<double> smallVolumes(const std::vector<bool>& isSmall, const Progress& progress) const;

  /// The level sets of all owners. @throws Cancelled.
  std::vector<PieceLevelSet> levelSets(const Progress& progress) const;

 private:
  /// What one owner's level set is in one brick.
  struct View {
    enum class Kind { outside, inside, mixed };

    Kind kind = Kind::outside;
    const CutBrick* brick = nullptr;
    /// Samples inside others with the same code.
    BrickMask others;
    std::vector<KnifeSide> knives;
    std::vector<Bisector> planes;
  };

  /// Working memory of a thread.
  struct Work {
    BrickCells cells;
    View view;
    std::vector<float> planes;
    std::array<std::array<float, CutBrick::kSamples>, 8> samples;
  };

  void look(View& view, std::int32_t brick, std::uint32_t owner, const BrickMask& own) const;
  Interval evaluate(View& view, std::vector<float>& planes, float* values) const;
  void evaluateSome(const View& view, std::span<const std::uint16_t> samples, float* values) const;
  double volumeIn(const Vec3i& at, std::uint32_t owner, Work& work) const;
  std::vector<FlatBrickTable> emptyTables() const;

  const CutPlan& plan_;
  const CutShells& shells_;
  float h_, band_, halfKerf_;
};

}  // namespace nephele::detail
