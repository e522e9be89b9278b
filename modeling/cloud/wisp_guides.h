#pragma once

#include <cstdint>
#include <vector>

#include "nephele/modeling/base/box.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/cloud/wisps.h"
#include "nephele/modeling/field/field.h"

/// Where the guides of wisps come from: points of a file, a surface, a shape.
namespace nephele {

struct GuideOptions {
  /// Guides to scatter. Not used for vertices.
  std::size_t count = 200;
  /// Size, density, colour and velocity of guides that bring none of their own.
  WispGuide standard{};
  /// Sizes of guides that bring none are multiplied by a number drawn evenly between 1 - variation and
  /// 1 + variation; 0 to 0.99.
  float sizeVariation = 0.0f;
  std::uint32_t seed = 0;
};

/// True where the vertices of a mesh give guides their sizes, by an attribute as below.
bool bringsGuideSizes(const Mesh& mesh);

/// A guide on every vertex, in order. Vertex attributes give what they are called: the size `size`, `pscale`
/// or `radius`, the density `density`, the colour `color`, the velocity `vx`, `vy`, `vz` or `v` of width 3.
/// @throws Error if there are no vertices, or naming the vertex whose attributes are no guide's.
std::vector<WispGuide> guidesOnVertices(const Mesh& mesh, const GuideOptions& options = {});

/// Guides spread evenly over the area of a mesh, with the attributes of its vertices, as above, interpolated.
/// @throws Error if the mesh has no area or its attributes are no guide's.
std::vector<WispGuide> guidesOnSurface(const Mesh& mesh, const GuideOptions& options = {});

/// Guides spread evenly over the part of `box` where `level` is positive.
/// @throws Error if that is less than about a millionth of the box.
std::vector<WispGuide> guidesInside(const ScalarField& level, const Box& box,
                                    const GuideOptions& options = {});

/// Positions, `color`, `size`, `mass` and velocity (`vx`, `vy`, `vz`) of dots as the vertices of a mesh
/// without faces, for files.
Mesh pointsOf(const DotSpans& dots);

}  // namespace nephele
