// Mesh to narrow-band level set.
//
// The distance itself comes from signedBand (mesh_band.cpp). Where that finds that sheets of the
// mesh overlap, so that the nearest sheet does not tell inside from outside, floodedBand takes over, which
// keeps the outer sheets.
//
// The enclosed volume of the result is compared with the mesh's: an open mesh, or one too thin for the voxel
// size, loses its sign without any other sign of trouble. The volume sums a share per voxel that rises
// linearly with distance, over one voxel and over two; (4 narrow - wide) / 3 cancels the error that curvature
// makes, and both are exact for planes along the axes. It needs a band of 1 voxel, and holds for displaced
// surfaces too, whose slope scales both ramps alike. What marching cubes would enclose is compared with it,
// too.
#include "nephele/levelset/mesh/mesh_to_level_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "nephele/levelset/mesh/isosurface_volume.h"
#include "nephele/levelset/mesh/mesh_band.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

// Nothing is said of less: any shape loses some of it to its curvature.
constexpr double kWorthANote = 0.01, kSurfaceWorthANote = 0.02;

/// The share of a voxel that is inside, by its signed distance in voxels, positive inside; 0 below -1, 1
/// above 1.
double insideShare(double u) {
  const double narrow = std::clamp(0.5 + u, 0.0, 1.0), wide = std::clamp(0.5 + 0.5 * u, 0.0, 1.0);
  return (4.0 * narrow - wide) / 3.0;
}

/// By how much, where, and what to do.
std::string thinText(const Mesh& mesh, const VoxelGrid<float>& grid, const std::string& what, double better) {
  std::string where;
  if (const auto thin = detail::thinPlace(grid)) {
    // Marching cubes keep walls of two voxels.
    constexpr double kKnown = 0.1, kKept = 2.2;
    if (thin->thickness > kKnown) better = std::min(better, grid.voxelSize() * thin->thickness / kKept);
    where = fmt::format(", for example near ({:.4g}, {:.4g}, {:.4g}), where its wall is {}", thin->position.x,
                        thin->position.y, thin->position.z,
                        thin->thickness > kKnown ? fmt::format("about {:.1f} voxels thick", thin->thickness)
                                                 : "thinner than a voxel");
  }
  return fmt::format(
      "{}: the shape is too thin for a voxel size of {:.4g}{}; try resolution {:.0f} along its longest side "
      "(voxel size {:.4g})",
      what, grid.voxelSize(), where, std::ceil(boundingBox(mesh).longestSide() / better), better);
}

/// Compares the volumes of the sum of shares and of marching cubes with `solid`. Walls of just under half a
/// voxel have the right volume in the former, and next to none as a surface.
void judge(const Mesh& mesh, const VoxelGrid<float>& grid, double gridVolume, double solid,
           const MeshToLevelSetOptions& options, const Progress& progress) {
  const double surfaceVolume = detail::isosurfaceVolume(grid);
  const double gridError = std::abs(gridVolume / solid - 1),
               surfaceError = std::abs(surfaceVolume / solid - 1);
  const double error = std::max(gridError, surfaceError);
  // Whoever allows all of it to be off wants to see what comes, which may be twice as much.
  const double most =
      options.mostVolumeError < 1 ? options.mostVolumeError : std::numeric_limits<double>::infinity();
  // Marching cubes cut off what is curved, too, which falls with the voxels and is no defect of the grid.
  if (error < most && gridError < kWorthANote && surfaceError < kSurfaceWorthANote) return;
  // The error of a shape that is thin for its voxels falls with the square of their size.
  const double wanted = std::min(most, kWorthANote);
  const double better = options.voxelSize * std::min(0.5, std::sqrt(0.5 * wanted / error));
  const std::string volumes =
      gridError >= (error >= most ? most : kWorthANote)
          ? fmt::format("it encloses a volume of {:.6g}, the mesh one of {:.6g} ({:.1f} % apart", gridVolume,
                        solid, 100 * gridError)
          : fmt::format("its surface encloses a volume of {:.6g}, the mesh one of {:.6g} ({:.1f} % apart",
                        surfaceVolume, solid, 100 * surfaceError);
  if (error >= most)
    throw Error("level set: " +
                thinText(mesh, grid, fmt::format("{}, {:g} % allowed)", volumes, 100 * most), better));
  progress.note("the level set is not quite the mesh: " + thinText(mesh, grid, volumes + ")", better));
}

void checkVolume(const Mesh& mesh, const VoxelGrid<float>& grid, const MeshToLevelSetOptions& options,
                 const Progress& progress) {
  const double meshVolume = signedVolume(mesh), gridVolume = enclosedVolume(grid);
  const double tolerance = std::min(options.mostVolumeError, kWorthANote);
  if (std::abs(gridVolume / meshVolume - 1.0) < tolerance)
    return judge(mesh, grid, gridVolume, meshVolume, options, progress);
  // Triangles of parts that overlap count the overlap twice; the solid they bound counts it once.
  progress.begin("volume of the solid");
  const double solid = solidVolume(mesh);
  require(solid > 0, "level set: the mesh encloses nothing: it is inside out, or flat");
  judge(mesh, grid, gridVolume, solid, options, progress);
  constexpr double kOverlap = 0.005;
  if (std::abs(meshVolume / solid - 1) > kOverlap)
    progress.note(fmt::format(
        "parts of the mesh overlap, so that the volume of its triangles ({:.6g}) is not that of the "
        "solid ({:.6g}); the level set encloses {:.6g}",
        meshVolume, solid, gridVolume));
}

void checkMesh(const Mesh& mesh) {
  requireValid(mesh);
  require(mesh.faceCount() > 0, "level set: the mesh has no faces");
  require(mesh.isTriangles(), "level set: the mesh must be triangulated");
  for (const Vec3d& p : mesh.positions)
    require(isFinite(p), "level set: the mesh has positions that are not finite");
}

}  // namespace

double enclosedVolume(const VoxelGrid<float>& levelSet) {
  const double voxel = std::abs(double(determinant(levelSet.lattice().indexToWorld.linear)));
  const double perVoxel = 1.0 / std::cbrt(voxel);
  std::vector<std::int32_t> sampled;
  std::size_t constantInside = 0;
  levelSet.forEachBrick([&](const Vec3i&, std::int32_t entry) {
    if (entry >= 0)
      sampled.push_back(entry);
    else
      constantInside += levelSet.constants()[std::size_t(-1 - entry)] > 0;
  });
  // Fixed pieces, summed in order: the same sum at any thread count.
  constexpr std::size_t kPiece = 64;
  std::vector<double> pieces((sampled.size() + kPiece - 1) / kPiece);
  parallelFor(sampled.size(), kPiece, [&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const float* values = levelSet.samples(sampled[i]);
      for (int k = 0; k < kBrickSamples; ++k) sum += insideShare(perVoxel * double(values[k]));
    }
    pieces[begin / kPiece] = sum;
  });
  const double voxels = std::accumulate(pieces.begin(), pieces.end(), double(constantInside) * kBrickSamples);
  return voxels * voxel;
}

double estimateLevelSetBytes(const Mesh& mesh, const MeshToLevelSetOptions& options) {
  requireValid(mesh);
  // Per brick near the surface its samples, its leaf and the triangles near it; per brick far from it,
  // samples.
  constexpr double kBrickBytes = 9000.0, kFarBrickBytes = 2600.0;
  constexpr double kTableBytes = 12.0;
  const double brick = BrickGrid::kBrick * options.voxelSize;
  const Vec3d size = Vec3d(boundingBox(mesh).size()) / brick;
  const double reach = (options.halfWidthVoxels + BrickGrid::kBrick) / BrickGrid::kBrick;
  const double bandBricks = 2.0 * reach;
  // Steiner's formula, the mean width being that of the box's diagonal, as a slender body has it.
  const double bricks = surfaceArea(mesh) / (brick * brick) * bandBricks;
  // What a band wider than its shape has beside it by Steiner's formula, the mean width being at most the
  // diagonal.
  const double far = std::numbers::pi * reach * reach * (length(size) + 4.0 / 3.0 * reach);
  const double table = (size.x + bandBricks) * (size.y + bandBricks) * (size.z + bandBricks);
  return std::min(bricks, table) * kBrickBytes + std::min(far, table) * kFarBrickBytes + table * kTableBytes +
         100.0 * double(mesh.corners.size());
}

VoxelGrid<float> meshToLevelSet(const Mesh& mesh, const MeshToLevelSetOptions& options,
                                const Progress& progress) {
  const double h = options.voxelSize;
  require(std::isfinite(h) && h > 0, fmt::format("level set: the voxel size must be > 0, got {}", h));
  require(std::isfinite(options.halfWidthVoxels) && options.halfWidthVoxels >= 1,
          fmt::format("level set: the half-width must be at least 1 voxel, got {}", options.halfWidthVoxels));
  require(
      options.mostVolumeError > 0,
      fmt::format("level set: the largest error of the volume must be > 0, got {}", options.mostVolumeError));
  checkMesh(mesh);
  progress.begin("level set");
  const detail::BandOptions bandOptions{h, options.halfWidthVoxels, options.halfWidthVoxels};
  const detail::SurfaceGeometry surface = detail::surfaceGeometry(mesh);
  require(surface.closed, "level set: the mesh is not closed, so that it has no inside; repair it first");
  std::optional<VoxelGrid<float>> band = detail::signedBand(surface, bandOptions, progress);
  if (!band) band = detail::floodedBand(mesh, bandOptions, progress);
  checkVolume(mesh, *band, options, progress);
  return *std::move(band);
}

}  // namespace nephele
