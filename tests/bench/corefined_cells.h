#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "nephele/modeling/base/mesh.h"

namespace nephele {

/// The baseline for exact Voronoi pieces: CGAL's corefinement, which clips a copy of the mesh by one bisector
/// after another, nearest points first, until no other can reach the cell.
class CorefinedCells {
 public:
  explicit CorefinedCells(const Mesh& mesh);
  ~CorefinedCells();

  /// Volume of the mesh in the cell of points[index].
  double volumeOf(std::span<const Vec3f> points, std::uint32_t index) const;

 private:
  struct Source;
  std::unique_ptr<Source> source_;
};

}  // namespace nephele
