#pragma once

#include <vector>

#include "nephele/levelset/cut/detail/solids/crowded_edges.h"
#include "nephele/levelset/cut/detail/solids/solid_split.h"

namespace nephele::detail {

struct SolidTriangle {
  /// As `SolidFace::id`.
  std::uint32_t face = 0;
  TriangleIndices vertices{};
};

/// The faces of a solid as triangles. Faces with the same corners at the same places, seen from either side,
/// get the same triangles. Points that rounding brought together are one.
std::vector<SolidTriangle> trianglesOf(const SolidSplitter& splitter, const Solid& solid);

/// A connected part of a solid, with the walls of the cavities in it.
struct Shell {
  std::vector<SolidTriangle> triangles;
  /// Per corner of the triangles: numbers of vertices from 0 such that each has one fan of faces.
  std::vector<std::uint32_t> corners;
  /// Per such number: the vertex of the solid.
  std::vector<std::uint32_t> vertices;
  /// Edges between two such vertices that have more than two faces: all pairs of faces but the first, by
  /// `corners`.
  std::vector<CornerPair> crowded;
  double volume = 0.0;
};

/// The connected parts of closed triangles, in the order of their first triangles.
std::vector<Shell> shellsOf(const SolidSplitter& splitter, const std::vector<SolidTriangle>& triangles);

}  // namespace nephele::detail
