#pragma once

#include <optional>
#include <span>
#include <vector>

#include "nephele/levelset/cut/detail/solids/knife_sheets.h"
#include "nephele/modeling/base/progress.h"

namespace nephele::detail {

/// A solid parted by knives that are surfaces.
struct Carved {
  /// Those of the solid come first.
  std::vector<Vec3d> positions;
  std::vector<TriangleIndices> triangles;
  /// Per triangle: the triangle of the solid that it is part of, or kOnPlane | its frame.
  std::vector<std::uint32_t> parents;
  std::vector<PlaneFrame> frames;

  struct Part {
    /// Per knife.
    std::vector<bool> sides;
    /// A closed surface, but not always in one piece.
    std::vector<std::uint32_t> triangles;
    /// If there are walls between cells among the sheets.
    std::optional<std::uint32_t> cell{};
  };
  /// By sides, the negative one first. Two parts that meet do so in the same triangles, in reverse.
  std::vector<Part> parts;
};

/// Parts a solid by sheets. With a kerf, what is between the two sheets of a knife belongs to nobody.
/// @throws Error if the solid or a sheet crosses itself where another surface passes; Cancelled.
Carved carve(std::span<const Vec3d> positions, std::span<const TriangleIndices> triangles,
             std::span<const KnifeSheet> sheets, const Progress& progress);

}  // namespace nephele::detail
