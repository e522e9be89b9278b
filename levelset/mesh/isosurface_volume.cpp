#include "nephele/levelset/mesh/isosurface_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "nephele/levelset/mesh/brick_volume.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

constexpr int kSide = kBrickSide;

struct SampledBrick {
  Vec3i at;
  std::int32_t number;
};

std::vector<SampledBrick> sampledBricks(const VoxelGrid<float>& grid) {
  std::vector<SampledBrick> bricks;
  grid.forEachBrick([&](const Vec3i& at, std::int32_t entry) {
    if (entry >= 0) bricks.push_back({at, entry});
  });
  return bricks;
}

BrickMask insideOf(const float* samples) {
  BrickMask inside;
  for (std::size_t z = 0; z != kSide; ++z)
    for (int i = 0; i != kSide * kSide; ++i)
      inside.slices[z] |= std::uint64_t(samples[z * kSide * kSide + std::size_t(i)] > 0) << i;
  return inside;
}

Vec3i stepOf(int corner) {
  return {corner & 1, corner >> 1 & 1, corner >> 2};
}

/// The cells that begin in the bricks of a grid.
class GridCells {
 public:
  explicit GridCells(const VoxelGrid<float>& grid)
      : grid_(grid), inside_(grid.sampledBricks()), constants_(grid.constants().size()) {
    for (std::size_t c = 0; c != constants_.size(); ++c) constants_[c].fill(grid.constants()[c]);
  }

  void prepare(const SampledBrick& brick) {
    inside_[std::size_t(brick.number)] = insideOf(grid_.samples(brick.number));
  }

  /// Of the bricks whose cells have corners in `brick`, those for which it is the first that holds samples:
  /// each is met once.
  double volumeFrom(const SampledBrick& brick, BrickCells& cells) const {
    double sum = 0;
    for (int corner = 0; corner != 8; ++corner) {
      const Vec3i first = brick.at - stepOf(corner);
      std::array<std::int32_t, 8> entries;
      for (int i = 0; i != 8; ++i) entries[std::size_t(i)] = grid_.entryAt(first + stepOf(i));
      const auto isSampled = [](std::int32_t entry) { return entry >= 0; };
      if (std::any_of(entries.begin(), entries.begin() + corner, isSampled)) continue;
      std::array<BrickMask, 8> masks;
      for (std::size_t i = 0; i != 8; ++i) {
        const std::int32_t entry = entries[i];
        const auto constant = std::size_t(-1 - entry);
        cells.samples[i] = entry >= 0 ? grid_.samples(entry) : constants_[constant].data();
        masks[i] = entry >= 0                    ? inside_[std::size_t(entry)]
                   : constants_[constant][0] > 0 ? BrickMask::all()
                                                 : BrickMask();
      }
      cells.setInside(masks);
      if (const BrickMask mixed = cells.mixed(); !mixed.isEmpty())
        sum += volumeShare(cells, mixed, first * kSide);
    }
    return sum;
  }

 private:
  const VoxelGrid<float>& grid_;
  std::vector<BrickMask> inside_;
  std::vector<std::array<float, kSide * kSide * kSide>> constants_;
};

/// How many samples of a brick lie in thin walls, and the largest distance in one of them, in voxels.
struct ThinWalls {
  int count = 0;
  float halfThickness = 0;
};

ThinWalls thinWallsOf(const float* samples, float voxel) {
  constexpr float kNear = 0.5f, kHalfThin = 0.75f;
  ThinWalls walls;
  // Not the outermost samples, so that all neighbours are at hand.
  for (int z = 1; z != kSide - 1; ++z)
    for (int y = 1; y != kSide - 1; ++y)
      for (int x = 1; x != kSide - 1; ++x) {
        const auto at = [&](int i, int j, int k) { return samples[(k * kSide + j) * kSide + i] / voxel; };
        const float value = at(x, y, z);
        if (value < -kNear || value > kHalfThin) continue;
        float highest = value;
        for (int k = z - 1; k <= z + 1; ++k)
          for (int j = y - 1; j <= y + 1; ++j)
            for (int i = x - 1; i <= x + 1; ++i) highest = std::max(highest, at(i, j, k));
        if (highest > value) continue;
        ++walls.count;
        walls.halfThickness = std::max(walls.halfThickness, value);
      }
  return walls;
}

}  // namespace

double isosurfaceVolume(const VoxelGrid<float>& levelSet) {
  const std::vector<SampledBrick> bricks = sampledBricks(levelSet);
  GridCells grid(levelSet);
  // Fixed pieces, summed in order: the same sum at any thread count.
  constexpr std::size_t kPiece = 64;
  parallelFor(bricks.size(), kPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) grid.prepare(bricks[i]);
  });
  std::vector<double> pieces((bricks.size() + kPiece - 1) / kPiece);
  parallelFor(bricks.size(), kPiece, [&](std::size_t begin, std::size_t end) {
    BrickCells cells;
    double sum = 0;
    for (std::size_t i = begin; i != end; ++i) sum += grid.volumeFrom(bricks[i], cells);
    pieces[begin / kPiece] = sum;
  });
  return std::accumulate(pieces.begin(), pieces.end(), 0.0) *
         std::abs(double(determinant(levelSet.lattice().indexToWorld.linear)));
}

std::optional<ThinPlace> thinPlace(const VoxelGrid<float>& levelSet) {
  ThinWalls most;
  Vec3i where;
  for (const SampledBrick& brick : sampledBricks(levelSet)) {
    const ThinWalls walls = thinWallsOf(levelSet.samples(brick.number), float(levelSet.voxelSize()));
    if (walls.count <= most.count) continue;
    most = walls;
    where = brick.at;
  }
  if (most.count == 0) return std::nullopt;
  return ThinPlace{(Vec3d(where) * double(kSide) + Vec3d{1, 1, 1} * (0.5 * kSide)) * levelSet.voxelSize(),
                   2 * double(most.halfThickness)};
}

}  // namespace nephele::detail
