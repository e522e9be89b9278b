// The boxes of occupied bricks, projected into cells of the picture: each widens the ranges of the cells that
// its outline's bounds touch. Where there are many bricks, cubes of 2^3, 4^3 ... of them stand for those
// within, until they are few enough.
#include "nephele/render/volume/depth_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr std::size_t kMostBoxes = 40000;
// Rays of a pixel spread over a tent that reaches half a pixel beyond it, and a little for rounding.
constexpr double kSpread = 1.0;
constexpr float kMargin = 0.5f;

// Cubes of `size`^3 bricks that hold an occupied one, by their lower corner in bricks.
std::vector<Vec3i> cubesOf(const RenderVolume& volume, int size) {
  const BrickGrid& grid = volume.density();
  const Vec3i n{(grid.brickCount().x + size - 1) / size, (grid.brickCount().y + size - 1) / size,
                (grid.brickCount().z + size - 1) / size};
  std::vector<bool> seen(std::size_t(n.x) * std::size_t(n.y) * std::size_t(n.z));
  std::vector<Vec3i> cubes;
  for (const Vec3i& brick : volume.occupiedBricks()) {
    const Vec3i at = brick - grid.firstBrick(), cube{at.x / size, at.y / size, at.z / size};
    const std::size_t entry =
        (std::size_t(cube.z) * std::size_t(n.y) + std::size_t(cube.y)) * std::size_t(n.x) +
        std::size_t(cube.x);
    if (seen[entry]) continue;
    seen[entry] = true;
    cubes.push_back(grid.firstBrick() + cube * size);
  }
  return cubes;
}

// The bounds of a cube in the picture, and its depths.
struct Seen {
  static constexpr double kInfinite = std::numeric_limits<double>::infinity();
  Vec3d low{kInfinite, kInfinite, kInfinite}, high{-kInfinite, -kInfinite, -kInfinite};

  Seen() = default;
  Seen(const BrickGrid& grid, const Camera& camera, const Vec3i& cube, int size) {
    const Vec3f first = Vec3f(cube * BrickGrid::kBrick) - Vec3f{kMargin, kMargin, kMargin};
    const float side = float(size * BrickGrid::kBrick) + 2 * kMargin;
    for (int corner = 0; corner != 8; ++corner) {
      const Vec3d at = camera.project(Vec3d(grid.indexToWorld()(
          first + Vec3f{corner & 1 ? side : 0, corner & 2 ? side : 0, corner & 4 ? side : 0})));
      for (int axis = 0; axis != 3; ++axis) {
        low[axis] = std::min(low[axis], at[axis]);
        high[axis] = std::max(high[axis], at[axis]);
      }
    }
  }

  bool isInFront() const { return low.z > 0 && low.x <= high.x && low.y <= high.y; }
};

}  // namespace

DepthBounds::DepthBounds(const RenderVolume& volume, const Camera& camera, const PixelBox& window)
    // Cells of the whole picture, as rays begin where these say.
    : window_{window.x0 / kCell * kCell, window.y0 / kCell * kCell, window.x1, window.y1},
      across_((window_.width() + kCell - 1) / kCell) {
  const int down = (window_.height() + kCell - 1) / kCell;
  cells_.resize(std::size_t(across_) * std::size_t(down));
  const BrickGrid& grid = volume.density();
  int size = 1;
  std::vector<Vec3i> cubes = volume.occupiedBricks();
  while (cubes.size() > kMostBoxes) cubes = cubesOf(volume, size *= 2);

  std::vector<Seen> seen(cubes.size());
  parallelFor(cubes.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) seen[i] = Seen(grid, camera, cubes[i], size);
  });
  for (const Seen& cube : seen) {
    if (!cube.isInFront()) {
      cells_.assign(cells_.size(), {0, std::numeric_limits<float>::infinity()});
      return;
    }
    // Far beyond the window numbers of cells are no ints.
    const auto cellOf = [](double at, int from, int count) {
      return int(std::clamp(std::floor((at - from) / kCell), -1.0, double(count)));
    };
    const int x0 = std::max(cellOf(cube.low.x - kSpread, window_.x0, across_), 0),
              y0 = std::max(cellOf(cube.low.y - kSpread, window_.y0, down), 0),
              x1 = std::min(cellOf(cube.high.x + kSpread, window_.x0, across_), across_ - 1),
              y1 = std::min(cellOf(cube.high.y + kSpread, window_.y0, down), down - 1);
    // Depths are rounded to float here and again by whoever asks.
    const float near = float(cube.low.z * (1 - 1e-5)), far = float(cube.high.z * (1 + 1e-5));
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x) {
        Range& cell = cells_[std::size_t(y) * std::size_t(across_) + std::size_t(x)];
        cell = {std::min(cell.near, near), std::max(cell.far, far)};
      }
  }
}

}  // namespace nephele
