// A map between shapes on bricks about one of them.
//
// A brick holds samples if the surface may be within the band of any of its voxels: the level set at its
// middle decides, since it changes by no more than the way. Both kinds of grid share this layout; borders are
// copied between bricks, so that next to a brick without samples they are its constant.
#include "nephele/levelset/warp/warp_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kOwn = kBrick * kBrick * kBrick;
// From the middle of a brick's voxels to its outermost ones, in voxels.
constexpr double kHalfDiagonal = 3.5 * 1.7320509;

double bricksAlong(double side, double voxelSize) {
  return side / voxelSize / kBrick + 3;
}

}  // namespace

double WarpBricks::estimateBytes(const Box& box, double voxelSize) {
  const Vec3d size(box.size());
  const double x = bricksAlong(size.x, voxelSize), y = bricksAlong(size.y, voxelSize),
               z = bricksAlong(size.z, voxelSize);
  // A surface crosses about three layers of bricks of each side of its box, with three components.
  return x * y * z * 12 + 6 * (x * y + y * z + z * x) * BrickGrid::kVolume * sizeof(float) * 3;
}

WarpBricks::WarpBricks(const ScalarField& object, const Box& box, const WarpGridOptions& options) {
  const double h = options.voxelSize;
  require(std::isfinite(h) && h > 0, fmt::format("warp grid: the voxel size must be > 0, got {:g}", h));
  require(!box.isEmpty() && isFinite(box.min) && isFinite(box.max),
          "warp grid: the box must be bounded and not empty");
  const double across = (options.halfWidthVoxels + 1) * h;
  const Vec3d centre(box.center());
  constexpr double kFar = 1000;
  const Vec3d origin = length(centre) > kFar * std::max(double(box.longestSide()), h) ? centre : Vec3d{};
  const Affine map{Mat3f::scaling(float(h)), Vec3f(origin)};
  lattice_ = {map, inverse(map), float(h)};
  for (int axis = 0; axis < 3; ++axis) {
    const double low = (double(box.min[axis]) - across - origin[axis]) / h,
                 high = (double(box.max[axis]) + across - origin[axis]) / h;
    require(std::abs(low) < 1e7 && std::abs(high) < 1e7,
            fmt::format("warp grid: voxels of {:g} are too small for the object", h));
    box_.first[axis] = brickOf(int(std::floor(low)));
    box_.count[axis] = brickOf(int(std::ceil(high))) - box_.first[axis] + 1;
  }
  requireHoldable("warp grid", box_);
  bound_ = float(across);

  table_.resize(box_.size());
  const float near = float(across + kHalfDiagonal * h);
  parallelFor(table_.size(), 256, [&](std::size_t begin, std::size_t end) {
    const std::size_t n = end - begin;
    std::vector<float> x(n), y(n), z(n), value(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3f middle = Vec3f(box_.at(begin + i)) * float(kBrick) + Vec3f{3.5f, 3.5f, 3.5f};
      const Vec3f p = lattice_.indexToWorld(middle);
      x[i] = p.x, y[i] = p.y, z[i] = p.z;
    }
    object.eval({x, y, z}, value);
    for (std::size_t i = 0; i < n; ++i)
      table_[begin + i] = !(std::abs(value[i]) > near) ? -1 : value[i] > 0 ? 1 : 0;
  });
  for (std::size_t i = 0; i < table_.size(); ++i)
    if (table_[i] == -1) {
      table_[i] = std::int32_t(2 + places_.size());
      places_.push_back(box_.at(i));
    }
}

template <int N, class F>
std::array<std::shared_ptr<BrickGrid>, N> WarpBricks::fill(const F& field, const Progress& progress) const {
  std::array<std::shared_ptr<BrickGrid>, N> grids;
  for (auto& grid : grids) {
    grid = std::make_shared<BrickGrid>(lattice_, box_, N == 1 ? -bound_ : 0.0f);
    grid->reserve(places_.size() + 2);
    grid->appendConstant(N == 1 ? bound_ : 0.0f);
    grid->append(places_.size());
    grid->setTable(table_);
  }
  parallelFor(
      places_.size(), 4,
      [&](std::size_t begin, std::size_t end) {
        std::vector<float> x(kOwn), y(kOwn), z(kOwn);
        std::array<std::vector<float>, N> values;
        for (auto& v : values) v.resize(kOwn);
        for (std::size_t b = begin; b < end; ++b) {
          for (int i = 0; i < kOwn; ++i) {
            const Vec3i voxel = Vec3i{places_[b].x * kBrick, places_[b].y * kBrick, places_[b].z * kBrick} +
                                Vec3i{i & 7, i >> 3 & 7, i >> 6};
            const Vec3f p = lattice_.indexToWorld(Vec3f(voxel));
            x[std::size_t(i)] = p.x, y[std::size_t(i)] = p.y, z[std::size_t(i)] = p.z;
          }
          if constexpr (N == 1)
            field.eval({x, y, z}, values[0]);
          else
            field.eval({x, y, z}, Spans<3>{{values[0], values[1], values[2]}});
          for (std::size_t c = 0; c < std::size_t(N); ++c)
            for (int i = 0; i < kOwn; ++i) {
              const float value = values[c][std::size_t(i)];
              require(std::isfinite(value), "warp grid: the map is not finite near the object");
              grids[c]->brick(std::int32_t(2 + b))[sampleOffset(i & 7, i >> 3 & 7, i >> 6)] = value;
            }
        }
      },
      progress);
  for (auto& grid : grids) fillBorders(*grid);
  return grids;
}

VectorGrids WarpBricks::sample(const VectorField& map, const Progress& progress) const {
  const auto grids = fill<3>(map, progress);
  return {grids[0], grids[1], grids[2]};
}

std::shared_ptr<BrickGrid> WarpBricks::sample(const ScalarField& levelSet, const Progress& progress) const {
  return fill<1>(levelSet, progress)[0];
}

}  // namespace nephele
