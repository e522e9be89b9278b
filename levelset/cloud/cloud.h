#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nephele/levelset/cloud/cloud_density.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/shape/cloud_shapes.h"

namespace nephele {

/// Everything between a mesh and the grids of its cloud. Lengths in world units.
struct CloudOptions {
  /// At least one; see `cumuloLayers`.
  std::vector<CumuloLayer> layers;
  /// > 0.
  float voxelSize = 0.0f;
  int newtonSteps = 5;
  int medialSmoothing = 4;
  CumuloGridOptions::Renormalise renormalise = CumuloGridOptions::Renormalise::off;
  /// > 0; see CloudDensityOptions.
  ScalarField edgeThickness{0.0f};
  /// Shape of the rise over the edge, and what the density is multiplied by; see CloudDensityOptions.
  std::optional<float> edgeExponent{};
  ScalarField densityFactor{1.0f};
  /// Makes the displaced level set, too.
  bool withSurface = false;
};

struct Cloud {
  /// As `cloudDensity` gives it.
  VoxelGrid<float> density;
  /// As `cloudSurface` gives it.
  std::optional<VoxelGrid<float>> surface;
  std::vector<CumuloLayerReport> layers;
};

/// Grows cumulo layers on a closed, outward-oriented mesh: distance with the band that the displacement
/// needs, layers, density. @throws Error for options outside their range; Cancelled.
Cloud makeCloud(const Mesh& mesh, const CloudOptions& options, const Progress& progress = silent());

/// The same in two steps: `makeCloud(makeCloudLevels(mesh, options), other)` is `makeCloud(mesh, other)`, bit
/// for bit, for other edges, exponents, factors and surfaces, as long as `cloudEdgeReach` of the edges is the
/// same.
/// `kept` lends what it has of the distance and the layers, and keeps them.
CloudLevels makeCloudLevels(const Mesh& mesh, const CloudOptions& options,
                            const Progress& progress = silent(), KeptLayers* kept = nullptr);
Cloud makeCloud(const CloudLevels& levels, const CloudOptions& options, const Progress& progress = silent());

/// How far from the surface layers are made for an edge that is nowhere thicker than this: 2.25 voxels, or
/// twice that as often as it takes. @throws Error unless voxelSize > 0 and edgeThickness is finite.
float cloudEdgeReach(float edgeThickness, float voxelSize);

/// How many of the layers, from the first, voxels of this size show: bumps of the last have four voxels to a
/// wave, of which the absolute value makes two. At least 1, if there is one.
std::size_t layersThatShow(const std::vector<CumuloLayer>& layers, float voxelSize);

/// Memory that a program needs for `makeCloud`, bytes, from the area of the mesh: -10 to +50 % of what was
/// measured. @throws Error if there is no layer.
double estimatedCloudBytes(const Mesh& mesh, const CloudOptions& options);

/// The surface of a generated shape, sampled at 1/96 of its size: what `makeCloud` grows a cloud on where
/// there is no mesh. Closed, oriented outward. Costs about 0.1 s. @throws Error as `cloudShape`;
/// Cancelled.
Mesh cloudShapeMesh(const CloudShapeOptions& options, const Progress& progress = silent());

/// The shape in a file as a closed mesh: a mesh file, repaired, or the zero surface of a level set in a .vdb
/// or .nvdb. A narrow band is no distance where the displacement needs one; its surface gives that back.
/// @throws Error naming the path: unreadable, no level set, not closed and not to be repaired.
RepairedMesh readShape(const std::string& path, const MeshRepairOptions& repair = {},
                       const Progress& progress = silent());

}  // namespace nephele
