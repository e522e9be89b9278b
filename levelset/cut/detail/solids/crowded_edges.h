#pragma once

#include <array>
#include <span>

#include "nephele/modeling/base/mesh.h"

namespace nephele::detail {

/// The two corners of a mesh from which an edge runs to their next corners, there and back.
using CornerPair = std::array<std::uint32_t, 2>;

/// Splits edges of a mesh of triangles in their middle, each with a vertex of its own. Where a surface
/// touches itself along an edge, so that it has two pairs of faces between the same two vertices, splitting
/// one of the pairs leaves a manifold. Attributes of new corners are means, and groups keep their faces.
void splitEdges(Mesh& mesh, std::span<const CornerPair> edges);

}  // namespace nephele::detail
