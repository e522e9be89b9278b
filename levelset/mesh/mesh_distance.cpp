// Signed distance to a mesh on a few grids behind one field.
//
// Near the surface: trilinear on fine bricks. Distance is smooth away from the surface and its medial axis:
// at distance d its second derivatives are about 1/d, its third about 1/d^2. Catmull-Rom on a grid m times
// coarser errs by about 0.014 m^3/d^2 (all in fine voxels), so the level with m = 2, 4, 8, 16 ... takes over
// at 2.5, 8, 20, 48 ... voxels from the surface: each step doubles the voxel and multiplies the reach by 2.4.
// Over half a coarse voxel beyond that distance both levels are blended. Memory is that of the fine band and
// a quarter more, whatever the width.
//
// The first two levels come from signedBand, the wider ones from queries of a bounding volume hierarchy,
// limited to the samples that interpolation reads, with the fine level's sign. So does the second level of a
// mesh whose triangles are small beside its voxels.
//
// Near the medial axis, where the nearest point jumps, a coarse level rounds the ridge over one of its own
// voxels.
#include "nephele/levelset/mesh/mesh_distance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/mesh/detail/distance_levels.h"
#include "nephele/levelset/mesh/mesh_band.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
/// Of a band, voxels: the coarsest level then has some 10^4 bricks, each farther one twice as many.
constexpr double kWidestBand = 1e6;

/// Distance in fine voxels where level `index` takes over from the one before.
double startOf(int index) {
  constexpr double kStarts[] = {0.0, 2.5, 9.0, 24.0, 64.0};
  return index < 5 ? kStarts[index] : kStarts[4] * std::pow(2.6, index - 4);
}

/// Over which distance, in fine voxels, it takes over.
double blendOf(int index) {
  return std::max(1.0, 0.5 * std::ldexp(1.0, index));
}

/// Up to where level `index` must hold.
double reachOf(int index) {
  return startOf(index + 1) + blendOf(index + 1);
}

/// Bands of one coarse level, in world units: how far its samples are exact on either side.
struct Extent {
  double outside, inside;
};

/// Distances at the samples of a grid `factor` times coarser than `fine`, whose sign they take.
std::shared_ptr<BrickGrid> coarseLevel(const NearestOnMesh& mesh, const BrickGrid& fine, int factor,
                                       const Extent& extent, const Progress& progress) {
  const double h = double(fine.voxelSize()) * factor;
  BrickBox places;
  const Vec3d low = Vec3d(mesh.box().min) - Vec3d(1, 1, 1) * extent.outside;
  const Vec3d high = Vec3d(mesh.box().max) + Vec3d(1, 1, 1) * extent.outside;
  for (int i = 0; i < 3; ++i) {
    places.first[i] = int(std::floor(low[i] / (h * kBrick))) - 1;
    places.count[i] = int(std::floor(high[i] / (h * kBrick))) + 2 - places.first[i];
  }
  auto grid = std::make_shared<BrickGrid>(
      Lattice{{Mat3f::scaling(float(h)), {}}, {Mat3f::scaling(float(1.0 / h)), {}}, float(h)}, places,
      -float(extent.outside));
  const std::int32_t insideBrick = grid->appendConstant(float(extent.inside));
  const auto isInside = [&](const Vec3i& voxel) {
    const Vec3i v{voxel.x * factor, voxel.y * factor, voxel.z * factor};
    const Vec3i b{v.x >> 3, v.y >> 3, v.z >> 3};
    const float* samples = fine.brick(fine.poolIndex(b));
    constexpr int kWidth = BrickGrid::kWidth;
    return samples[((v.z & 7) + 1) * kWidth * kWidth + ((v.y & 7) + 1) * kWidth + (v.x & 7) + 1] > 0;
  };

  // A brick is settled by the distance of its middle, or holds samples.
  constexpr double kHalfBrick = 0.5 * (kBrick - 1);
  const double halfDiagonal = kHalfBrick * std::sqrt(3.0) * h * 1.001;
  constexpr std::int32_t kSampled = -1;
  std::vector<std::int32_t> table(places.size());
  parallelFor(
      table.size(), 16,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3d first = Vec3d(places.at(i)) * double(kBrick);
          const Vec3f middle((first + Vec3d(kHalfBrick, kHalfBrick, kHalfBrick)) * h);
          const double reach = std::max(extent.outside, extent.inside) + halfDiagonal;
          const auto hit = mesh.nearest(middle, float(reach));
          const bool inside = isInside(Vec3i(first));
          const bool near = hit && (hit->distance < halfDiagonal ||
                                    hit->distance < (inside ? extent.inside : extent.outside) + halfDiagonal);
          table[i] = near ? kSampled : inside ? insideBrick : 0;
        }
      },
      progress);
  std::vector<std::size_t> bricks;
  for (std::size_t i = 0; i < table.size(); ++i)
    if (table[i] == kSampled) {
      table[i] = insideBrick + 1 + std::int32_t(bricks.size());
      bricks.push_back(i);
    }
  const std::int32_t firstSampled = grid->append(bricks.size());
  grid->setTable(std::move(table));
  parallelFor(
      bricks.size(), 4,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3i first = places.at(bricks[i]);
          float* samples = grid->brick(firstSampled + std::int32_t(i));
          std::optional<Vec3f> last;
          for (int z = 0; z < kBrick; ++z)
            for (int y = 0; y < kBrick; ++y)
              for (int k = 0; k < kBrick; ++k) {
                // Back and forth: the last answer stays a tight bound.
                const int x = (y & 1) ? kBrick - 1 - k : k;
                const Vec3i voxel{first.x * kBrick + x, first.y * kBrick + y, first.z * kBrick + z};
                const bool inside = isInside(voxel);
                const double limit = inside ? extent.inside : extent.outside;
                const Vec3f p(Vec3d(voxel) * h);
                const float bound = last ? std::min(length(*last - p) * 1.0001f, float(limit)) : float(limit);
                const auto hit = mesh.nearest(p, bound);
                if (hit) last = hit->point;
                const float distance = hit ? hit->distance : bound;
                samples[((z + 1) * BrickGrid::kWidth + y + 1) * BrickGrid::kWidth + x + 1] =
                    inside ? distance : -distance;
              }
        }
      },
      progress);
  fillBorders(*grid);
  return grid;
}

/// Whether triangles are so small beside voxels that asking for the nearest one, sample by sample, costs less
/// than letting all of them compete for the samples of a wide band.
bool isDense(const Mesh& mesh, double voxelSize) {
  constexpr double kMostPerVoxel = 3;
  return double(mesh.faceCount()) > kMostPerVoxel * surfaceArea(mesh) / (voxelSize * voxelSize);
}

std::shared_ptr<BrickGrid> bandLevel(const Mesh& mesh, const detail::SurfaceGeometry& surface,
                                     const detail::BandOptions& options, const Progress& progress) {
  if (const auto band = detail::signedBand(surface, options, progress))
    return toBricks(*band, Beside::constant);
  return toBricks(detail::floodedBand(mesh, options, progress));
}

}  // namespace

ScalarField meshDistance(const Mesh& mesh, const MeshDistanceOptions& options, const Progress& progress) {
  requireValid(mesh);
  const double h = options.voxelSize;
  require(std::isfinite(h) && h > 0, fmt::format("mesh distance: the voxel size must be > 0, got {}", h));
  require(std::isfinite(options.exteriorBand) && options.exteriorBand > 0 &&
              std::isfinite(options.interiorBand) && options.interiorBand > 0,
          fmt::format("mesh distance: the bands must be > 0, got {} outside and {} inside",
                      options.exteriorBand, options.interiorBand));
  require(mesh.faceCount() > 0, "mesh distance: the mesh has no faces");
  require(mesh.isTriangles(), "mesh distance: the mesh must be triangulated");
  for (const Vec3d& p : mesh.positions)
    require(isFinite(p), "mesh distance: the mesh has positions that are not finite");

  // Nothing lies deeper inside a mesh than its box is wide.
  Vec3d low = mesh.positions.front(), high = low;
  for (const Vec3d& p : mesh.positions) low = min(low, p), high = max(high, p);
  const double exterior = options.exteriorBand / h;
  const double interior = std::min(options.interiorBand, length(high - low)) / h;
  require(
      exterior <= kWidestBand && interior <= kWidestBand,
      fmt::format("mesh distance: the bands may be {:g} voxels wide, got {:g} outside and {:g} inside; use "
                  "larger voxels",
                  kWidestBand, exterior, interior));
  auto levels = std::make_shared<detail::DistanceLevels>();
  levels->exteriorBand = float(options.exteriorBand);
  levels->interiorBand = float(options.interiorBand);
  levels->voxelSize = float(h);
  const detail::SurfaceGeometry surface = detail::surfaceGeometry(mesh);
  std::optional<NearestOnMesh> nearest;
  std::vector<std::shared_ptr<BrickGrid>> grids;
  for (int index = 0;; ++index) {
    progress.check();
    const int factor = 1 << index;
    // Interpolation and its gradient read samples this far from a point; the few at the corners of the
    // stencil that lie farther weigh less than 1/500.
    const double margin = index == 0 ? 2.5 : 2.75 * factor;
    const double across = std::max(1.0 * factor, margin - startOf(index));
    const auto extent = [&](double band) {
      const bool used = index == 0 || band > startOf(index);
      return used ? std::min(band, reachOf(index)) + margin : across;
    };
    const Extent voxels{extent(exterior), extent(interior)};
    std::shared_ptr<BrickGrid> grid;
    if (index == 0 || (index == 1 && !isDense(mesh, h * factor))) {
      grid =
          bandLevel(mesh, surface, {h * factor, voxels.outside / factor, voxels.inside / factor}, progress);
    } else {
      if (!nearest) nearest.emplace(mesh);
      grid = coarseLevel(*nearest, *grids[0], factor, {voxels.outside * h, voxels.inside * h}, progress);
    }
    grids.push_back(std::move(grid));
    detail::DistanceLevel level;
    level.nextStart = float(startOf(index + 1) * h);
    level.nextBlend = float(blendOf(index + 1) * h);
    // Whether a level is there does not depend on how much of it the band uses: a wider band changes no
    // value.
    level.continuesOutside = exterior > startOf(index + 1);
    level.continuesInside = interior > startOf(index + 1);
    levels->all.push_back(level);
    if (!level.continuesOutside && !level.continuesInside) break;
  }
  for (std::size_t i = 0; i < grids.size(); ++i)
    levels->all[i].grid = std::make_shared<const PackedGrid>(std::move(*grids[i]));
  return detail::distanceOfLevels(std::move(levels));
}

}  // namespace nephele
