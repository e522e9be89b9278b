#pragma once

#include <array>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "nephele/levelset/cut/knives.h"
#include "nephele/levelset/mesh/triangle_tree.h"

namespace nephele::detail {

/// Two directions across a surface, of length 1.
struct PlaneFrame {
  Vec3d u{}, v{};

  /// Depends on the normal alone; u x v = normal.
  static PlaneFrame of(const Vec3d& normal);
};

/// A surface that parts a solid: a knife, or with a kerf one of its two sides.
struct KnifeSheet {
  /// What it is, for errors.
  std::string name;
  /// Which knife it belongs to: rough blades, then solids. The lower side of a knife comes first.
  std::uint32_t knife = 0;
  std::vector<Vec3d> positions;
  /// They face the negative side.
  std::vector<TriangleIndices> triangles;
  /// Above 0 on the positive side, below on the other; the larger the number, the surer the sign.
  std::function<double(const Vec3d&)> side;
  /// Where a point is on the knife: one frame for all triangles, or one for each.
  std::vector<PlaneFrame> frames;
  std::vector<std::uint32_t> frameOf;
  /// Of walls between cells, which have no sides: the cells behind and before each triangle.
  std::vector<std::array<std::uint32_t, 2>> cells{};
  /// The cell at a point, and the larger the number, the surer it is.
  std::function<std::pair<std::uint32_t, double>(const Vec3d&)> cellAt{};
};

/// Between the points of a rough surface in a solid of that size: an eighth of the shortest wave.
double roughSpacing(const RoughnessOptions& roughness, double size);

class CutSource;

/// The sheets of all rough blades and solids of a cut; of blades, what is in and near the solid that is cut.
/// @throws Error if a knife's options are out of range, or a solid is open, inside out or not finite;
/// Cancelled.
std::vector<KnifeSheet> knifeSheets(const Knives& knives, float kerf, const CutSource& solid,
                                    const Progress& progress);

}  // namespace nephele::detail
