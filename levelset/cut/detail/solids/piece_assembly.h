#pragma once

#include <vector>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/solids/cut_source.h"

namespace nephele::detail {

/// A triangle of a piece that a knife made.
struct InnerTriangle {
  /// The same number for triangles with the same three corners.
  std::uint64_t place;
  std::uint32_t piece;
  double area;
};

/// What one solid became.
struct Assembly {
  std::vector<Piece> pieces;
  /// Of each piece.
  std::vector<std::vector<InnerTriangle>> inner;
  std::size_t slivers = 0;
  double sliverVolume = 0.0;
};

/// The connected parts of a solid, which is used up, as pieces with the attributes of the source.
Assembly assemble(const CutSource& source, const SolidSplitter& splitter, Solid& solid, const PieceCode& code,
                  double minVolume);

/// Leaves out the splinters among all pieces, see kSplinterOfMedian; `whole`: the volume of what was cut.
void dropSplinters(std::vector<Assembly>& assemblies, double whole);

/// All pieces, in their order, and which of them touch.
Pieces gathered(std::vector<Assembly> assemblies);

}  // namespace nephele::detail
