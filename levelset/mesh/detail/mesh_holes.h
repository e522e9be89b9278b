#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele::detail {

/// A triangle mesh with its holes filled. Vertices where the surface touches itself are split, so that every
/// edge has two faces by index.
struct FilledMesh {
  Mesh mesh;
  /// Faces from this one on fill holes.
  std::size_t firstNewFace = 0;
  std::size_t holes = 0;
  std::size_t edges = 0;                 ///< Boundary edges that the holes had.
  std::vector<std::uint32_t> openFaces;  ///< A face at each hole that could not be filled.
};

/// Orients patches, splits what is not manifold, stitches equal borders, and triangulates every hole. @throws
/// Cancelled.
FilledMesh withHolesFilled(const Mesh& triangles, const Progress& progress);

}  // namespace nephele::detail
