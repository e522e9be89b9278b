// Volumes of marching cubes meshes that are never made.
//
// By the theorem of Gauss a closed surface encloses the flux of (x, 0, 0): of each triangle the mean of x
// times its area as seen along x. Points are those of marching_cubes.cpp, found for all crossed edges of a
// brick at once; triangles are those of its table.
#include "nephele/levelset/mesh/brick_volume.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <span>
#include <utility>

#include "nephele/levelset/mesh/detail/marching_cubes_table.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = 8, kSide = BrickCells::kSide;
constexpr int kEdges = kSide * kSide * kSide;
constexpr int kEdgesPerCell = 12;

/// Triangles of cells whose signs leave nothing open: corners as numbers of edges in a list of all edges of a
/// brick, by axis, for the cell (0, 0, 0).
class PlainTriangles {
 public:
  PlainTriangles() {
    const CellTable& table = CellTable::instance();
    for (int e = 0; e < kEdgesPerCell; ++e) {
      const int start = CellTable::edgeStart(e);
      edge_[std::size_t(e)] = std::uint16_t(CellTable::edgeAxis(e) * kEdges +
                                            ((start >> 2) * kSide + (start >> 1 & 1)) * kSide + (start & 1));
    }
    for (unsigned signs = 0; signs < of_.size(); ++signs) {
      const CellTable::Pattern& pattern = table.pattern(signs, 0);
      if (table.ambiguousFaces(signs) != 0 || pattern.hasCentre) continue;
      Triangles& triangles = of_[signs];
      for (const std::uint8_t corner : table.corners(pattern))
        triangles.corners[triangles.count++] = edge(corner);
    }
  }

  std::uint16_t edge(std::uint8_t edgeOfCell) const { return edge_[edgeOfCell]; }

  /// Corners, three by three; none where the cell takes more thought.
  std::span<const std::uint16_t> of(unsigned signs) const {
    return {of_[signs].corners.data(), of_[signs].count};
  }

 private:
  static constexpr std::size_t kMostCorners = 3 * 12;
  struct Triangles {
    std::uint16_t count = 0;
    std::array<std::uint16_t, kMostCorners> corners{};
  };

  std::array<std::uint16_t, kEdgesPerCell> edge_{};
  std::array<Triangles, 256> of_{};
};

/// Where the samples of each row of corners are: eight, and the one after them.
struct Rows {
  std::array<const float*, kSide * kSide> eight, last;
  std::array<double, kSide * kSide> y, z;

  explicit Rows(const BrickCells& cells) {
    for (int vz = 0, row = 0; vz < kSide; ++vz)
      for (int vy = 0; vy < kSide; ++vy, ++row) {
        const std::size_t brick = std::size_t((vy >> 3) << 1 | (vz >> 3) << 2);
        const std::size_t offset = std::size_t((vz & 7) << 6 | (vy & 7) << 3);
        eight[std::size_t(row)] = cells.samples[brick] + offset;
        last[std::size_t(row)] = cells.samples[brick + 1] + offset;
        y[std::size_t(row)] = vy;
        z[std::size_t(row)] = vz;
      }
  }

  float at(std::size_t row, std::size_t x) const { return x < kBrick ? eight[row][x] : *last[row]; }
};

/// The points on the crossed edges of a brick.
class EdgePoints {
 public:
  EdgePoints(const BrickCells& cells, const Vec3i& first) {
    const Rows rows(cells);
    find<0>(cells, rows, first.x, x);
    find<1>(cells, rows, first.x, y);
    find<2>(cells, rows, first.x, z);
  }

  static constexpr std::size_t kMost = 3 * kEdges;
  /// Coordinates, x from the grid's origin, the others from the brick's. One place more than there are edges.
  std::array<double, kMost + 1> x, y, z;

  std::uint16_t at(int edge) const { return number_[std::size_t(edge)]; }
  std::size_t count() const { return count_; }

 private:
  static_assert(std::endian::native == std::endian::little, "the first row must be in the lowest bits");

  template <int kAxis>
  void find(const BrickCells& cells, const Rows& rows, int firstX, std::array<double, kMost + 1>& along) {
    constexpr std::size_t kRows = kAxis == 2 ? kSide * (kSide - 1) : kSide * kSide;
    constexpr std::size_t kAtOnce = 4;
    constexpr std::uint64_t kWithoutLast = 0x00FF00FF00FF00FFull;
    const auto inside = [&](std::size_t first) {
      std::uint64_t bits;
      std::memcpy(&bits, cells.inside.data() + first, sizeof(bits));
      return bits;
    };
    std::size_t count = count_;
    for (std::size_t first = 0; first < kRows; first += kAtOnce) {
      std::uint64_t crossed = inside(first);
      if constexpr (kAxis == 0) crossed = (crossed ^ crossed >> 1) & kWithoutLast;
      if constexpr (kAxis == 1) crossed = (crossed ^ inside(first + 1)) & rowsWithNext()[first / kAtOnce];
      if constexpr (kAxis == 2) crossed ^= inside(first + kSide);
      if (kAxis == 2 && first + kAtOnce > kRows) crossed &= (std::uint64_t(1) << 16 * (kRows - first)) - 1;
      for (; crossed != 0; crossed &= crossed - 1, ++count) {
        const auto bit = std::size_t(std::countr_zero(crossed)), vx = bit % 16, row = first + bit / 16;
        number_[kAxis * kEdges + row * kSide + vx] = std::uint16_t(count);
        from_[count] = rows.at(row, vx);
        to_[count] = rows.at(row + (kAxis == 1 ? 1 : kAxis == 2 ? kSide : 0), vx + (kAxis == 0));
        x[count] = firstX + int(vx);
        y[count] = rows.y[row];
        z[count] = rows.z[row];
      }
    }
    // As far from the ends as marchingCubes keeps them.
    constexpr double kMargin = 1.0 / 4096;
    for (std::size_t i = count_; i < count; ++i) {
      const double a = from_[i], t = a / (a - double(to_[i]));
      along[i] += std::min(std::max(t, kMargin), 1 - kMargin);
    }
    count_ = count;
  }

  /// Four rows at once: those that have another one after them in their slice.
  static const std::array<std::uint64_t, 21>& rowsWithNext() {
    static const std::array<std::uint64_t, 21> masks = [] {
      std::array<std::uint64_t, 21> made{};
      for (std::size_t row = 0; row < kSide * kSide; ++row)
        if (row % kSide != kSide - 1) made[row / 4] |= std::uint64_t(0xFFFF) << 16 * (row % 4);
      return made;
    }();
    return masks;
  }

  std::size_t count_ = 0;
  std::array<std::uint16_t, kMost> number_;
  std::array<float, kMost> from_, to_;
};

}  // namespace

void BrickCells::setInside(const std::array<BrickMask, 8>& bricks) {
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y) {
      const std::size_t brick = 2 * std::size_t(y >> 3) + 4 * std::size_t(z >> 3), slice = std::size_t(z & 7);
      const auto row = [&](std::size_t i) {
        return unsigned(bricks[brick + i].slices[slice] >> (8 * (y & 7)) & 0xFF);
      };
      inside[rowOf(y, z)] = std::uint16_t(row(0) | (row(1) & 1) << 8);
    }
}

BrickMask BrickCells::mixed() const {
  BrickMask mask;
  for (int z = 0; z < kBrick; ++z)
    for (int y = 0; y < kBrick; ++y) {
      const unsigned a = inside[rowOf(y, z)], b = inside[rowOf(y + 1, z)], c = inside[rowOf(y, z + 1)],
                     d = inside[rowOf(y + 1, z + 1)];
      const unsigned any = a | b | c | d, all = a & b & c & d;
      mask.slices[std::size_t(z)] |= std::uint64_t((any | any >> 1) & ~(all & all >> 1) & 0xFF) << (8 * y);
    }
  return mask;
}

double volumeShare(const BrickCells& cells, const BrickMask& mixed, const Vec3i& first) {
  static const CellTable& table = CellTable::instance();
  static const PlainTriangles plain;
  EdgePoints points(cells, first);
  const auto centre = std::uint16_t(points.count());
  const auto flux = [&](std::size_t a, std::size_t b, std::size_t c) {
    const double area = (points.y[b] - points.y[a]) * (points.z[c] - points.z[a]) -
                        (points.z[b] - points.z[a]) * (points.y[c] - points.y[a]);
    return (points.x[a] + points.x[b] + points.x[c]) * area;
  };
  // Two sums in turn, which do not wait for each other.
  double sum = 0, other = 0;
  for (int z = 0; z < kBrick; ++z)
    for (std::uint64_t rest = mixed.slices[std::size_t(z)]; rest != 0; rest &= rest - 1) {
      const int bit = std::countr_zero(rest), x = bit % kBrick, y = bit / kBrick;
      const auto row = [&](int dy, int dz) {
        return cells.inside[BrickCells::rowOf(y + dy, z + dz)] >> x & 3u;
      };
      const unsigned signs = row(0, 0) | row(1, 0) << 2 | row(0, 1) << 4 | row(1, 1) << 6;
      const int cell = (z * kSide + y) * kSide + x;
      const std::span<const std::uint16_t> triangles = plain.of(signs);
      for (std::size_t i = 0; i < triangles.size(); i += 3) {
        std::swap(sum, other);
        sum += flux(points.at(cell + triangles[i]), points.at(cell + triangles[i + 1]),
                    points.at(cell + triangles[i + 2]));
      }
      if (!triangles.empty()) continue;

      const auto valueAt = [&](int corner) {
        return double(cells.valueAt(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)));
      };
      const unsigned joined = CellTable::joinedFaces(signs, table.ambiguousFaces(signs), valueAt);
      const CellTable::Pattern& pattern = table.pattern(signs, joined);
      const auto corners = table.corners(pattern);
      const auto pointOf = [&](std::uint8_t edge) {
        return edge == CellTable::kCentre ? centre : points.at(cell + plain.edge(edge));
      };
      if (pattern.hasCentre) {
        double count = 0;
        points.x[centre] = points.y[centre] = points.z[centre] = 0;
        for (std::size_t i = 0; i < corners.size(); i += 3) {
          if (corners[i + 2] != CellTable::kCentre) continue;
          const std::uint16_t p = pointOf(corners[i]);
          points.x[centre] += points.x[p], points.y[centre] += points.y[p], points.z[centre] += points.z[p];
          ++count;
        }
        points.x[centre] /= count, points.y[centre] /= count, points.z[centre] /= count;
      }
      for (std::size_t i = 0; i < corners.size(); i += 3)
        sum += flux(pointOf(corners[i]), pointOf(corners[i + 1]), pointOf(corners[i + 2]));
    }
  constexpr double kMeanAndHalf = 6;
  return (sum + other) / kMeanAndHalf;
}

}  // namespace nephele::detail
