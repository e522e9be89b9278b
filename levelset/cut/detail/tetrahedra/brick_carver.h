#pragma once

#include <map>
#include <string>
#include <vector>

#include "nephele/levelset/cut/detail/tetrahedra/blade_vertices.h"
#include "nephele/levelset/cut/detail/tetrahedra/brick_functions.h"
#include "nephele/levelset/cut/detail/tetrahedra/tetrahedron_facets.h"

namespace nephele::detail {

/// The work of carving on one brick after another, by one thread.
class BrickCarver {
 public:
  explicit BrickCarver(const Carving& carving) : carving_(carving), functions_(carving), blades_(carving) {}

  void carve(CarvedBrick& brick);

 private:
  void carveCell(const Vec3i& cell);
  void addFacet(const Vec3i& cell, const std::array<unsigned, 4>& corners, const Facet& facet, bool isOdd);
  /// The number of the code on one side of a facet; -1 within a kerf.
  std::int32_t codeBeside(const Vec3i& cell, const Facet& facet, bool isAbove);
  VertexKey keyOf(const Vec3i& cell, const std::array<unsigned, 4>& corners, const FacetCorner& corner) const;
  /// That of the first edge to a positive neighbour.
  VertexKey keyOfSample(std::size_t f, const Vec3i& sample) const;
  /// In the index space of the grid, relative to the brick.
  Vec3d placeOf(const VertexKey& key) const;
  std::uint32_t frameOf(std::size_t f) const;
  void finish();

  const Carving& carving_;
  CarvedBrick* brick_ = nullptr;
  BrickFunctions functions_;
  BladeVertices blades_;
  TetrahedronFacets facets_;
  /// Functions that cross the cell, and the tetrahedron, by their places in functions_.
  std::vector<std::size_t> crossing_, here_;
  std::vector<CornerValues> values_;
  std::vector<VertexKey> keys_, ring_;
  std::vector<Vec3d> places_;
  std::string signs_;
  std::map<std::string, std::int32_t> codes_;
};

}  // namespace nephele::detail
