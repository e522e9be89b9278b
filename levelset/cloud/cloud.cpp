// The way from a mesh to a cloud: base distance, layers, density; each part lives in its own file.
#include "nephele/levelset/cloud/cloud.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/cloud/kept_layers.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

namespace {

constexpr float kFarthestVoxels = 1e5f;
/// Of the noise; its absolute value has twice the frequency.
constexpr float kVoxelsPerWave = 4;

Mesh surfaceOfLevelSet(const std::string& path, const Progress& progress) {
  const VdbGrid grid = readScalarGrid(path);
  const VdbGridInfo info = describe(grid);
  require(info.gridClass == VdbGridInfo::Class::levelSet,
          path + ": grid '" + info.name + "' is not a level set, which a shape must be if it is no mesh");
  Mesh mesh = marchingCubes(*toBricks(grid), 0.0f, progress);
  require(mesh.faceCount() > 0, path + ": grid '" + info.name + "' has no surface");
  return mesh;
}

/// Where the last layer is coarser than the result, so may the base be; its own detail shows between the
/// bumps, so not by much.
float baseVoxelSize(const std::vector<CumuloLayer>& layers, float voxelSize) {
  constexpr float kMostVoxels = 2;
  return std::clamp(cumuloVoxelSize(layers, layers.size() - 1, voxelSize), voxelSize,
                    kMostVoxels * voxelSize);
}

/// The share of the box, in level slices, in which `factor` is not one number, so that voxels are stored.
double varyingShare(const ScalarField& factor, const Box& box) {
  constexpr int kSlices = 32;
  int varying = 0;
  for (int i = 0; i < kSlices; ++i) {
    Box slice = box;
    slice.min.y = box.min.y + box.size().y * float(i) / kSlices;
    slice.max.y = box.min.y + box.size().y * float(i + 1) / kSlices;
    varying += !factor.range(slice).isPoint();
  }
  return double(varying) / kSlices;
}

double square(double x) {
  return x * x;
}

/// By how much the space within `reach` around a convex body as large as `box` is more than its surface times
/// `reach`: Steiner's formula.
double volumeAroundCorners(const Box& box, double reach) {
  const Vec3f size = box.size();
  const double sides = double(size.x) + double(size.y) + double(size.z);
  return M_PI * square(reach) * (sides + 4.0 / 3 * reach);
}

float thickestEdge(const CloudOptions& options) {
  const float thickest = options.edgeThickness.range(Box::everywhere()).max;
  require(std::isfinite(thickest), "makeCloud: edgeThickness has no finite range");
  return thickest;
}

}  // namespace

Mesh cloudShapeMesh(const CloudShapeOptions& options, const Progress& progress) {
  // Fine enough that facets are lost beside the first layer of bumps on any cloud.
  constexpr float kVoxels = 96;
  const CloudShape shape = cloudShape(options);
  const float voxel = options.size / kVoxels;
  return marchingCubes(
      *bakeGrid(shape.level,
                {.voxelSize = voxel, .box = shape.box.expanded(2 * voxel), .band = {-2 * voxel, 2 * voxel}},
                progress),
      0.0f, progress);
}

RepairedMesh readShape(const std::string& path, const MeshRepairOptions& repair, const Progress& progress) {
  return namingFile(path, [&] {
    return repairMesh(isVolumeFile(path) ? surfaceOfLevelSet(path, progress) : readMesh(path), repair,
                      progress);
  });
}

namespace {

GriddedCumulo layersOn(const Mesh& mesh, const CloudOptions& options, const Progress& progress,
                       KeptLayers* kept = nullptr) {
  requireValid(mesh);
  require(options.voxelSize > 0, "makeCloud: voxelSize must be > 0, got " + numberText(options.voxelSize));
  require(!options.layers.empty(), "makeCloud: there must be at least one layer");
  const std::vector<CumuloLayer>& layers = options.layers;
  const float edge = cloudEdgeReach(thickestEdge(options), options.voxelSize);
  const Box box = boundingBox(mesh);
  const std::size_t keptCount = kept ? KeptLayers::count(layers, box, options.voxelSize) : 0;
  const float reach = cumuloExteriorBand(layers, options.voxelSize, edge, keptCount);
  require(reach <= kFarthestVoxels * options.voxelSize,
          fmt::format("the layers move the surface by up to {:.3g}, which is {:.3g} voxels, allowed: up to "
                      "{:g}; use a smaller amplitude, a higher frequency or larger voxels",
                      reach, reach / options.voxelSize, kFarthestVoxels));
  const MeshDistanceOptions distance{.voxelSize = baseVoxelSize(layers, options.voxelSize),
                                     .exteriorBand = reach,
                                     .interiorBand = cumuloInteriorBand(layers, options.voxelSize, edge)};
  const auto makeBase = [&] {
    progress.begin("distance");
    return meshDistance(mesh, distance, progress);
  };
  const std::string numbers =
      fmt::format("{} {} {}", distance.voxelSize, distance.exteriorBand, distance.interiorBand);
  const ScalarField base =
      kept ? kept->distance(numbers, keptCount + 1 == layers.size(), makeBase) : makeBase();
  return griddedCumulo(base, layers,
                       {.voxelSize = options.voxelSize,
                        .box = box,
                        .newtonSteps = options.newtonSteps,
                        .edge = edge,
                        .closestPoint = closestPoint(mesh),
                        .medialSmoothing = options.medialSmoothing,
                        .renormalise = options.renormalise,
                        .kept = kept},
                       progress);
}

CloudDensityOptions densityOf(const CloudOptions& options) {
  return {.voxelSize = options.voxelSize,
          .edgeThickness = options.edgeThickness,
          .edgeExponent = options.edgeExponent,
          .factor = options.densityFactor};
}

}  // namespace

float cloudEdgeReach(float edgeThickness, float voxelSize) {
  // What layers are good for in any case, and no less.
  constexpr float kLeastVoxels = 2.25f;
  require(voxelSize > 0 && std::isfinite(edgeThickness),
          fmt::format("cloudEdgeReach: expected voxels > 0 and a finite edge, got {} and {}", voxelSize,
                      edgeThickness));
  float reach = kLeastVoxels * voxelSize;
  while (reach < edgeThickness / 2) reach *= 2;
  return reach;
}

std::size_t layersThatShow(const std::vector<CumuloLayer>& layers, float voxelSize) {
  const auto isTooFine = [&](const CumuloLayer& layer) {
    return layer.frequency * layer.detail * kVoxelsPerWave * voxelSize > 1;
  };
  std::size_t count = layers.size();
  while (count > 1 && isTooFine(layers[count - 1])) --count;
  return count;
}

Cloud makeCloud(const Mesh& mesh, const CloudOptions& options, const Progress& progress) {
  GriddedCumulo cumulo = layersOn(mesh, options, progress);
  Cloud cloud{cloudDensity(cumulo, densityOf(options), progress), {}, std::move(cumulo.layers)};
  if (options.withSurface) cloud.surface = cloudSurface(cumulo, options.voxelSize, progress);
  return cloud;
}

CloudLevels makeCloudLevels(const Mesh& mesh, const CloudOptions& options, const Progress& progress,
                            KeptLayers* kept) {
  const GriddedCumulo cumulo = layersOn(mesh, options, progress, kept);
  const float edge = cloudEdgeReach(thickestEdge(options), options.voxelSize);
  return cloudLevels(cumulo, options.voxelSize, std::max(edge, kCloudSurfaceVoxels * options.voxelSize),
                     progress);
}

Cloud makeCloud(const CloudLevels& levels, const CloudOptions& options, const Progress& progress) {
  Cloud cloud{cloudDensity(levels, densityOf(options), progress), {}, levels.layers};
  if (options.withSurface) cloud.surface = cloudSurface(levels, progress);
  return cloud;
}

double estimatedCloudBytes(const Mesh& mesh, const CloudOptions& options) {
  requireValid(mesh);
  // Measured, bytes: the program itself; the mesh and what finds its closest points, per face; the distance
  // to it, per voxel of its area; and both while they are made. The result stores leaves of 8 voxels on an
  // edge that layers make larger; around corners and edges of the shape, thick ones take more.
  constexpr double kProgram = 4.8e7, kFace = 160, kFaceWork = 330, kBase = 90, kBaseWork = 320, kLeaf = 8;
  constexpr double kGrowth = 1.5, kCaution = 1.1, kEdgeVoxel = 4;
  require(!options.layers.empty(), "estimatedCloudBytes: there must be at least one layer");
  const double area = surfaceArea(mesh), voxel = options.voxelSize;
  const double baseVoxels = area / square(double(baseVoxelSize(options.layers, options.voxelSize)));
  const double grids = options.withSurface ? 2 : 1;
  const double varying =
      std::abs(signedVolume(mesh)) * varyingShare(options.densityFactor, boundingBox(mesh));
  const double edge = double(cloudEdgeReach(thickestEdge(options), options.voxelSize));
  const double edges = kEdgeVoxel * volumeAroundCorners(boundingBox(mesh), edge) / (voxel * voxel * voxel);
  const CumuloBytes layers = estimatedCumuloBytes(options.layers, options.voxelSize, area, boundingBox(mesh));
  const double growth = std::min(1.45 + 0.17 * double(options.layers.size()), 2.2);
  const double stored = growth * (kLeaf + double(thickestEdge(options)) / voxel) * grids;
  const double result =
      sizeof(float) * (area * stored / square(voxel) + kGrowth * varying / (voxel * voxel * voxel));
  const double faces = double(mesh.faceCount());
  const double making = kFaceWork * faces + kBaseWork * baseVoxels;
  const double base = kFace * faces + kBase * baseVoxels;
  return kCaution * (kProgram + edges + std::max({making, base + layers.peak, base + layers.kept + result}));
}

}  // namespace nephele
