// Projection of a sampled flow onto those without divergence.
//
// Four passes. Planes: the velocity is evaluated, turned into the axes of the box and transformed along x and
// y. Columns: along z, and while a block of them is at hand the divergent part is taken off and they are
// transformed back. Planes: back along y and x. Bricks: the samples, and one more on each side as the walls
// have it.
//
// In a closed box the component across a wall is a sum of sines and the others are sums of cosines, so that
// the flow goes on beyond the wall as its mirror image. A derivative makes cosines of sines and sines of
// cosines: the divergence is a sum of cosines alone, its gradient has the sines and cosines of the flow, and
// every wave stands for itself as in a periodic box. Signs and factors of i cancel.
#include "nephele/levelset/flow/projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "nephele/levelset/flow/detail/box_transform.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

using detail::AlignedFloats;
using detail::BoxTransform;
using detail::BoxValues;
using detail::Direction;
using detail::kBlock;
using detail::Waves;

/// What is taken off the edges of cells for their lack of a right angle, as a cosine.
constexpr float kMostObliqueness = 1e-4f;
/// Shares of the work in the four passes, for progress.
constexpr double kSampled = 0.5, kProjected = 0.7, kReturned = 0.8;

Vec3f column(const Mat3f& m, int i) {
  return {m(0, i), m(1, i), m(2, i)};
}

/// What central differences over a cell of `edge` make of wave number k of `cycles` (the length of the box,
/// or twice that), and what is left of the wave.
struct WaveNumber {
  float number = 0, kept = 1;

  WaveNumber(int k, int cycles, float edge) {
    if (2 * k == cycles)
      kept = 0;
    else
      number = static_cast<float>(std::sin(2 * 3.14159265358979324 * k / cycles) / double(edge));
  }
};

class Projection {
 public:
  Projection(const VectorField& velocity, const ProjectionBox& box)
      : velocity_(velocity),
        box_(box),
        n_(box.cells + (isClosed() ? Vec3i{1, 1, 1} : Vec3i{})),
        values_{BoxValues(n_), BoxValues(n_), BoxValues(n_)} {
    const Mat3f& linear = box.lattice.indexToWorld.linear;
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3f edge = column(linear, axis);
      edges_[axis] = length(edge);
      for (int row = 0; row < 3; ++row) toWorld_(row, axis) = edge[row] / edges_[axis];
    }
    isTurned_ = toWorld_ != Mat3f::identity();
    for (int axis = 0; axis < 3; ++axis)
      require(std::abs(dot(column(toWorld_, axis), column(toWorld_, (axis + 1) % 3))) <= kMostObliqueness,
              "projection: the edges of the box must be perpendicular to each other");
    for (int component = 0; component < 3; ++component) {
      std::array<Waves, 3> waves{};
      waves.fill(isClosed() ? Waves::cosines : Waves::exponentials);
      if (isClosed()) waves[std::size_t(component)] = Waves::sines;
      // A periodic box treats all components alike.
      if (transforms_.empty() || isClosed()) transforms_.emplace_back(box.cells, waves);
    }
  }

  VectorField result(const Progress& progress) {
    forward(SubProgress(progress, 0, kSampled));
    project(SubProgress(progress, kSampled, kProjected));
    inverse(SubProgress(progress, kProjected, kReturned));
    return bricks(SubProgress(progress, kReturned, 1));
  }

 private:
  bool isClosed() const { return box_.walls == Walls::closed; }
  const BoxTransform& transform(int component) const {
    return transforms_[isClosed() ? std::size_t(component) : 0];
  }

  void forward(const Progress& progress) {
    parallelFor(
        std::size_t(n_.z), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t z = begin; z < end; ++z) {
            sample(int(z));
            for (int c = 0; c < 3; ++c) transform(c).inPlane(Direction::forward, values_[c], int(z));
          }
        },
        progress);
  }

  void sample(int z) {
    const auto nx = std::size_t(n_.x);
    // Few enough for the cache, and all that evaluation needs to be quick.
    constexpr std::size_t kPoints = 2048;
    const int rows = std::max(1, int(kPoints / nx));
    std::vector<float> points[3], found[3];
    for (int first = 0; first < n_.y; first += rows) {
      const int last = std::min(first + rows, n_.y);
      const std::size_t count = std::size_t(last - first) * nx;
      for (int c = 0; c < 3; ++c) points[c].resize(count), found[c].resize(count);
      std::size_t i = 0;
      const Affine& map = box_.lattice.indexToWorld;
      const Vec3f step = column(map.linear, 0);
      for (int y = first; y < last; ++y) {
        const Vec3f start = map(Vec3f(Vec3i{0, y, z}));
        for (int x = 0; x < n_.x; ++x, ++i)
          for (int c = 0; c < 3; ++c) points[c][i] = start[c] + float(x) * step[c];
      }
      velocity_.eval({points[0], points[1], points[2]}, Spans<3>{{found[0], found[1], found[2]}});
      i = 0;
      for (int y = first; y < last; ++y) {
        float* to[3];
        for (int c = 0; c < 3; ++c) to[c] = values_[c].row(y, z);
        for (int x = 0; x < n_.x; ++x, ++i) {
          const Vec3f u(found[0][i], found[1][i], found[2][i]);
          if (!isFinite(u))
            throw Error(fmt::format("projection: the velocity at {:g},{:g},{:g} is not finite", points[0][i],
                                    points[1][i], points[2][i]));
          for (int c = 0; c < 3; ++c) to[c][x] = isTurned_ ? dot(column(toWorld_, c), u) : u[c];
        }
      }
    }
    // What rows are padded with is transformed, too, and must be numbers.
    for (int c = 0; c < 3; ++c)
      for (int y = 0; y < n_.y; ++y)
        std::fill(values_[c].row(y, z) + nx, values_[c].row(y, z) + values_[c].rowLength(), 0.0f);
  }

  /// Wave number of place `i` along an axis.
  WaveNumber waveNumber(int axis, int i) const {
    return {i, isClosed() ? 2 * box_.cells[axis] : box_.cells[axis], edges_[axis]};
  }

  void project(const Progress& progress) {
    std::vector<WaveNumber> alongX, alongZ;
    for (std::size_t x = 0; x < values_[0].rowLength(); ++x)
      alongX.push_back(waveNumber(0, int(isClosed() ? x : x / 2)));
    for (int z = 0; z < n_.z; ++z) alongZ.push_back(waveNumber(2, z));
    const float scale = float((isClosed() ? 0.125 : 1.0) /
                              (double(box_.cells.x) * double(box_.cells.y) * double(box_.cells.z)));
    const std::size_t plane = values_[0].planeLength();
    parallelFor(
        std::size_t(n_.y), 1,
        [&](std::size_t begin, std::size_t end) {
          AlignedFloats blocks[3];
          for (AlignedFloats& block : blocks) block = detail::alignedFloats(std::size_t(n_.z) * kBlock);
          const AlignedFloats room = detail::alignedFloats(transform(0).alongZ().roomSize());
          for (std::size_t y = begin; y < end; ++y)
            for (std::size_t x = 0; x < values_[0].rowLength(); x += kBlock) {
              for (int c = 0; c < 3; ++c) {
                detail::gather(values_[c].row(int(y), 0) + x, plane, n_.z, blocks[c].get());
                transform(c).alongZ().run(Direction::forward, blocks[c].get(), room.get());
              }
              takeOff(&alongX[x], waveNumber(1, int(y)), alongZ, scale, blocks);
              for (int c = 0; c < 3; ++c) {
                transform(c).alongZ().run(Direction::inverse, blocks[c].get(), room.get());
                detail::scatter(blocks[c].get(), n_.z, values_[c].row(int(y), 0) + x, plane);
              }
            }
        },
        progress);
  }

  static void takeOff(const WaveNumber* alongX, const WaveNumber& y, const std::vector<WaveNumber>& alongZ,
                      float scale, const AlignedFloats* blocks) {
    float sx[kBlock], kept[kBlock];
    for (std::size_t i = 0; i < kBlock; ++i) {
      sx[i] = alongX[i].number;
      kept[i] = alongX[i].kept * y.kept * scale;
    }
    const float sy = y.number;
    for (std::size_t k = 0; k < alongZ.size(); ++k) {
      const float sz = alongZ[k].number, keptZ = alongZ[k].kept;
      float *ux = blocks[0].get() + k * kBlock, *uy = blocks[1].get() + k * kBlock,
            *uz = blocks[2].get() + k * kBlock;
      for (std::size_t i = 0; i < kBlock; ++i) {
        const float square = sx[i] * sx[i] + (sy * sy + sz * sz);
        const float along = sx[i] * ux[i] + sy * uy[i] + sz * uz[i];
        const float share = along / (square > 0 ? square : 1.0f), factor = kept[i] * keptZ;
        ux[i] = factor * (ux[i] - sx[i] * share);
        uy[i] = factor * (uy[i] - sy * share);
        uz[i] = factor * (uz[i] - sz * share);
      }
    }
  }

  void inverse(const Progress& progress) {
    parallelFor(
        std::size_t(n_.z), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t z = begin; z < end; ++z)
            for (int c = 0; c < 3; ++c) transform(c).inPlane(Direction::inverse, values_[c], int(z));
        },
        progress);
  }

  /// A sample of the box that stands for one at or beyond its faces.
  struct Source {
    int index = 0;
    /// There is one.
    bool isThere = false;
    /// The mirror image of a closed box.
    bool isMirrored = false;
  };

  Source sourceOf(int axis, int i) const {
    const int cells = box_.cells[axis];
    if (i < -1 || i > cells + 1) return {};
    if (!isClosed()) return {(i + cells) % cells, true, false};
    return {std::abs(i > cells ? 2 * cells - i : i), true, i < 0 || i > cells};
  }

  /// Voxel (1, 1, 1) is sample (0, 0, 0), so that the samples before it lie in bricks of their own no more
  /// than those behind.
  Lattice gridLattice() const {
    Affine map = box_.lattice.indexToWorld;
    map.translation = map(Vec3f(-1, -1, -1));
    return Lattice::of(map);
  }

  VectorField bricks(const Progress& progress) {
    BrickBox places;
    for (int axis = 0; axis < 3; ++axis) places.count[axis] = (box_.cells[axis] + 2) / kBrickSide + 1;
    std::vector<std::int32_t> table(places.size());
    for (std::size_t b = 0; b < table.size(); ++b) table[b] = std::int32_t(b + 1);
    std::array<std::shared_ptr<BrickGrid>, 3> grids;
    for (auto& grid : grids) {
      grid = std::make_shared<BrickGrid>(gridLattice(), places, 0.0f);
      grid->reserve(table.size() + 1);
      grid->appendUnset(table.size());
      grid->setTable(table);
    }
    parallelFor(
        places.size(), 8,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t b = begin; b < end; ++b) {
            const auto pool = std::int32_t(b + 1);
            fill(places.at(b), {grids[0]->brick(pool), grids[1]->brick(pool), grids[2]->brick(pool)});
            for (auto& grid : grids) grid->setRange(pool, rangeOfBrick(grid->brick(pool)));
          }
        },
        progress);
    return gridField(VectorGrids{grids[0], grids[1], grids[2]});
  }

  void fill(const Vec3i& brick, const std::array<float*, 3>& stored) const {
    constexpr int kWidth = BrickGrid::kWidth;
    std::array<std::array<Source, kWidth>, 3> sources;
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kWidth; ++i)
        sources[std::size_t(axis)][std::size_t(i)] =
            sourceOf(axis, brick[axis] * kBrickSide + i - BrickGrid::kBefore - 1);
    // Most of a row lies side by side in the box, too.
    const int before = brick.x * kBrickSide - BrickGrid::kBefore - 1;
    const int first = std::clamp(-before, 0, kWidth), last = std::clamp(n_.x - before, first, kWidth);
    std::size_t place = 0;
    for (const Source& z : sources[2])
      for (const Source& y : sources[1]) {
        if (!y.isThere || !z.isThere) {
          for (float* to : stored) std::fill_n(to + place, kWidth, 0.0f);
          place += kWidth;
          continue;
        }
        const float signs[3] = {1.0f, y.isMirrored ? -1.0f : 1.0f, z.isMirrored ? -1.0f : 1.0f};
        float turned[3][kWidth];
        for (int c = 0; c < 3; ++c) {
          const float* const row = values_[c].row(y.index, z.index);
          float* const to = isTurned_ ? turned[c] : stored[std::size_t(c)] + place;
          const auto copyOne = [&](int x) {
            const Source& from = sources[0][std::size_t(x)];
            to[x] = from.isThere ? (c == 0 && from.isMirrored ? -1.0f : signs[c]) * row[from.index] : 0.0f;
          };
          for (int x = 0; x < first; ++x) copyOne(x);
          for (int x = first; x < last; ++x) to[x] = signs[c] * row[before + x];
          for (int x = last; x < kWidth; ++x) copyOne(x);
        }
        if (isTurned_)
          for (int c = 0; c < 3; ++c)
            for (int x = 0; x < kWidth; ++x)
              stored[std::size_t(c)][place + std::size_t(x)] = toWorld_(c, 0) * turned[0][x] +
                                                               toWorld_(c, 1) * turned[1][x] +
                                                               toWorld_(c, 2) * turned[2][x];
        place += kWidth;
      }
  }

  const VectorField& velocity_;
  const ProjectionBox& box_;
  /// Samples along each axis.
  Vec3i n_;
  /// Of a cell.
  Vec3f edges_;
  /// From the axes of the box to those of the world: a turn, perhaps with a mirror.
  Mat3f toWorld_;
  bool isTurned_ = false;
  /// The components along the axes of the box.
  BoxValues values_[3];
  /// One for all components, or one for each.
  std::vector<BoxTransform> transforms_;
};

void requireSane(const ProjectionBox& box) {
  const Vec3i& n = box.cells;
  require(n.x >= 1 && n.y >= 1 && n.z >= 1,
          fmt::format("projection: the box must have 1 cell or more along each axis, not {} x {} x {}", n.x,
                      n.y, n.z));
  require(double(n.x) * n.y * n.z <= 2147483648.0,
          fmt::format("projection: a box of {} x {} x {} cells is too large", n.x, n.y, n.z));
}

}  // namespace

VectorField withoutDivergence(const VectorField& velocity, const ProjectionBox& box,
                              const Progress& progress) {
  requireSane(box);
  return Projection(velocity, box).result(progress);
}

}  // namespace nephele
