// A density on smaller voxels, brick by brick: the cells of a fine brick all lie in one coarse brick, whose
// border holds every sample that is needed, so that no brick looks at another.
//
// Limits: made for grids that are only marched; tricubic values are not those of the coarse grid.
#include "nephele/render/volume/finer_density.h"

#include <algorithm>
#include <array>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele::detail {

namespace {

constexpr int kSize = BrickGrid::kBrick, kWide = BrickGrid::kWidth, kPlane = kWide * kWide;

// Where a fine sample lies between stored coarse ones, along one axis.
struct Between {
  int first;
  float share;
};

// `part`: which of the fine bricks of its coarse brick.
std::array<Between, kWide> places(int part, int factor) {
  std::array<Between, kWide> result;
  for (int i = 0; i != kWide; ++i) {
    const int fine = part * kSize + i - BrickGrid::kBefore;
    const int cell = fine >= 0 ? fine / factor : -1;
    result[std::size_t(i)] = {cell + BrickGrid::kBefore, float(fine - cell * factor) / float(factor)};
  }
  return result;
}

void fill(const float* coarse, const Vec3i& part, int factor, float* out) {
  const auto x = places(part.x, factor), y = places(part.y, factor), z = places(part.z, factor);
  for (const Between& k : z)
    for (const Between& j : y)
      for (const Between& i : x) {
        const float* first = coarse + k.first * kPlane + j.first * kWide + i.first;
        *out++ = trilinear(first, {i.share, j.share, k.share}, kWide, kPlane);
      }
}

}  // namespace

std::shared_ptr<const BrickGrid> finerDensity(const BrickGrid& grid, int factor) {
  require(factor == 1 || factor == 2 || factor == 4 || factor == 8,
          "finer density: expected a factor of 1, 2, 4 or 8");
  const float scale = float(factor);
  const Lattice lattice{
      {grid.indexToWorld().linear * Mat3f::scaling(1 / scale), grid.indexToWorld().translation},
      {Mat3f::scaling(scale) * grid.worldToIndex().linear, grid.worldToIndex().translation * scale},
      grid.voxelSize() / scale};
  auto fine = std::make_shared<BrickGrid>(
      lattice, BrickBox{grid.firstBrick() * factor, grid.brickCount() * factor}, 0.0f);
  std::vector<std::int32_t> table(fine->table().size(), 0);

  struct Source {
    std::int32_t pool;
    Vec3i part;
  };
  // A coarse brick that stands at several places is a constant, and so are all its parts.
  std::vector<std::int32_t> uses(grid.poolSize(), 0), made(grid.poolSize(), 0);
  for (const std::int32_t pool : grid.table()) ++uses[std::size_t(pool)];
  std::vector<Source> sources{{0, {0, 0, 0}}};
  std::size_t entry = 0;
  Vec3i b;
  for (b.z = 0; b.z != fine->brickCount().z; ++b.z)
    for (b.y = 0; b.y != fine->brickCount().y; ++b.y)
      for (b.x = 0; b.x != fine->brickCount().x; ++b.x, ++entry) {
        const Vec3i coarse{b.x / factor, b.y / factor, b.z / factor};
        const std::int32_t pool = grid.table()[grid.tableIndex(grid.firstBrick() + coarse)];
        if (!(grid.ranges()[std::size_t(pool)].max > 0)) continue;
        std::int32_t& shared = made[std::size_t(pool)];
        if (uses[std::size_t(pool)] == 1 || shared == 0) {
          shared = std::int32_t(sources.size());
          sources.push_back({pool, b - coarse * factor});
        }
        table[entry] = shared;
      }
  fine->append(sources.size() - 1);
  fine->setTable(std::move(table));
  parallelFor(sources.size() - 1, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin + 1; i != end + 1; ++i) {
      float* out = fine->brick(std::int32_t(i));
      fill(grid.brick(sources[i].pool), sources[i].part, factor, out);
      fine->setRange(std::int32_t(i), rangeOfBrick(out));
    }
  });
  return fine;
}

}  // namespace nephele::detail
