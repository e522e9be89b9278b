// Marks the samples on both ends of every grid edge over which the displacement jumps, grows the mark by a
// few voxels (6-connected), and replaces the marked samples by the mean of themselves and their neighbours, a
// fixed number of times, with the unmarked samples held: heat that flows inside the mark only.
//
// Marks are bits, one byte per row of a brick. The marked samples become one list with the indices of their
// neighbours, so that a diffusion step is one pass over memory.
//
// Limits: a jump that is smaller than what noise of the layer's frequency can do over one voxel is not seen,
// and stays.
#include "levelset/medial_smoothing.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "modeling/error.h"
#include "modeling/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kRows = kBrick * kBrick;
constexpr std::size_t kBricksPerPiece = 32;

constexpr std::array<Vec3i, 6> kSteps{Vec3i{-1, 0, 0}, Vec3i{1, 0, 0},  Vec3i{0, -1, 0},
                                      Vec3i{0, 1, 0},  Vec3i{0, 0, -1}, Vec3i{0, 0, 1}};

constexpr int storedIndex(int x, int y, int z) {
  return ((z + BrickGrid::kBefore) * BrickGrid::kWidth + y + BrickGrid::kBefore) * BrickGrid::kWidth + x +
         BrickGrid::kBefore;
}

/// The six neighbours of each pool brick; 0 (the background brick) where there is none.
using Neighbours = std::vector<std::array<std::int32_t, 6>>;

std::vector<Vec3i> poolPositions(const BrickGrid& grid) {
  std::vector<Vec3i> positions(grid.poolSize());
  std::size_t entry = 0;
  for (int z = 0; z < grid.brickCount.z; ++z)
    for (int y = 0; y < grid.brickCount.y; ++y)
      for (int x = 0; x < grid.brickCount.x; ++x)
        positions[std::size_t(grid.table[entry++])] = grid.firstBrick + Vec3i{x, y, z};
  return positions;
}

/// One byte per row of eight samples along x; row z * 8 + y of pool brick b at b * 64.
class Mask {
 public:
  Mask(const BrickGrid& grid, const std::vector<Vec3i>& positions)
      : rows_(grid.poolSize() * kRows), neighbours_(grid.poolSize()) {
    for (std::size_t b = 1; b < neighbours_.size(); ++b)
      for (int n = 0; n < 6; ++n) neighbours_[b][n] = grid.poolIndex(positions[b] + kSteps[n]);
  }

  std::size_t brickCount() const { return neighbours_.size(); }
  std::uint8_t& row(std::size_t brick, int index) { return rows_[brick * kRows + index]; }
  std::uint8_t row(std::size_t brick, int index) const { return rows_[brick * kRows + index]; }
  std::int32_t neighbour(std::size_t brick, int direction) const { return neighbours_[brick][direction]; }
  bool isEmpty(std::size_t brick) const {
    const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(brick * kRows);
    return std::all_of(first, first + kRows, [](std::uint8_t r) { return r == 0; });
  }

  /// Row (y, z) where one of the two may lie one step outside the brick.
  std::uint8_t rowAcross(std::size_t brick, int y, int z) const {
    std::int32_t b = static_cast<std::int32_t>(brick);
    if (y < 0) b = neighbour(brick, 2);
    if (y >= kBrick) b = neighbour(brick, 3);
    if (z < 0) b = neighbour(brick, 4);
    if (z >= kBrick) b = neighbour(brick, 5);
    return row(std::size_t(b), (z & 7) * kBrick + (y & 7));
  }

  /// The mask grown by one step along each axis.
  void dilate(const Progress& progress) {
    std::vector<std::uint8_t> grown(rows_.size());
    parallelFor(
        brickCount() - 1, kBricksPerPiece,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t b = begin + 1; b <= end; ++b)
            for (int z = 0; z < kBrick; ++z)
              for (int y = 0; y < kBrick; ++y) {
                const int r = z * kBrick + y;
                const unsigned own = row(b, r);
                const unsigned left = row(std::size_t(neighbour(b, 0)), r) >> 7;
                const unsigned right = row(std::size_t(neighbour(b, 1)), r) & 1u;
                grown[b * kRows + r] = static_cast<std::uint8_t>(
                    own | own << 1 | own >> 1 | left | right << 7 | rowAcross(b, y - 1, z) |
                    rowAcross(b, y + 1, z) | rowAcross(b, y, z - 1) | rowAcross(b, y, z + 1));
              }
        },
        progress);
    rows_ = std::move(grown);
  }

 private:
  std::vector<std::uint8_t> rows_;
  Neighbours neighbours_;
};

void markJumps(const BrickGrid& grid, float jump, Mask& mask, const Progress& progress) {
  constexpr std::array<int, 6> kOffsets{-1,
                                        1,
                                        -BrickGrid::kWidth,
                                        BrickGrid::kWidth,
                                        -BrickGrid::kWidth * BrickGrid::kWidth,
                                        BrickGrid::kWidth * BrickGrid::kWidth};
  parallelFor(
      mask.brickCount() - 1, kBricksPerPiece,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin + 1; b <= end; ++b) {
          const Interval range = grid.ranges[b];
          if (range.max - range.min <= jump) continue;
          const float* samples = grid.brick(static_cast<std::int32_t>(b));
          for (int r = 0; r < kRows; ++r) {
            const float* s = samples + storedIndex(0, r % kBrick, r / kBrick);
            unsigned bits = 0;
            for (int x = 0; x < kBrick; ++x, ++s) {
              if (*s == 0) continue;
              for (const int offset : kOffsets)
                if (s[offset] != 0 && std::abs(s[offset] - *s) > jump) bits |= 1u << x;
            }
            mask.row(b, r) = static_cast<std::uint8_t>(bits);
          }
        }
      },
      progress);
}

/// Unmarks what lies outside the band.
void keepInsideBand(const BrickGrid& grid, Mask& mask) {
  for (std::size_t b = 1; b < mask.brickCount(); ++b) {
    if (mask.isEmpty(b)) continue;
    const float* samples = grid.brick(static_cast<std::int32_t>(b));
    for (int r = 0; r < kRows; ++r) {
      const float* s = samples + storedIndex(0, r % kBrick, r / kBrick);
      unsigned bits = mask.row(b, r);
      for (int x = 0; x < kBrick; ++x)
        if (s[x] == 0) bits &= ~(1u << x);
      mask.row(b, r) = static_cast<std::uint8_t>(bits);
    }
  }
}

/// Bricks that store a marked sample, their own or in their border.
std::vector<bool> bricksThatSee(const BrickGrid& grid, const std::vector<Vec3i>& positions,
                                const Mask& mask) {
  // Own samples that a neighbour in direction -1, 0, +1 stores: the first kAfter, all, the last kBefore.
  constexpr std::array<std::array<int, 2>, 3> kShared{
      {{0, BrickGrid::kAfter}, {0, kBrick}, {kBrick - BrickGrid::kBefore, kBrick}}};
  std::vector<bool> result(grid.poolSize());
  for (std::size_t b = 1; b < mask.brickCount(); ++b) {
    if (mask.isEmpty(b)) continue;
    for (int n = 0; n < 27; ++n) {
      const Vec3i direction{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
      const auto& xs = kShared[direction.x + 1];
      const unsigned bits = (1u << xs[1]) - (1u << xs[0]);
      unsigned seen = 0;
      for (int z = kShared[direction.z + 1][0]; z < kShared[direction.z + 1][1]; ++z)
        for (int y = kShared[direction.y + 1][0]; y < kShared[direction.y + 1][1]; ++y)
          seen |= mask.row(b, z * kBrick + y) & bits;
      if (seen != 0) result[std::size_t(grid.poolIndex(positions[b] + direction))] = true;
    }
  }
  result[0] = false;
  return result;
}

/// The marked samples as one list.
class Heat {
 public:
  Heat(const BrickGrid& grid, const Mask& mask) : rowStart_(mask.brickCount() * kRows) {
    std::uint32_t count = 0;
    for (std::size_t b = 0; b < mask.brickCount(); ++b)
      for (int r = 0; r < kRows; ++r) {
        rowStart_[b * kRows + r] = count;
        count += static_cast<std::uint32_t>(std::popcount(mask.row(b, r)));
      }
    values_.resize(count);
    links_.resize(count);
    fixed_.resize(count);
    parallelFor(mask.brickCount(), kBricksPerPiece, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) link(grid, mask, b);
    });
  }

  std::size_t size() const { return values_.size(); }

  void diffuse(int steps, const Progress& progress) {
    std::vector<float> next(values_.size());
    for (int step = 0; step < steps; ++step) {
      progress.check();
      parallelFor(values_.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          float sum = values_[i] + fixed_[i].sum;
          int count = 1 + fixed_[i].count;
          for (const std::int32_t other : links_[i]) {
            if (other < 0) continue;
            sum += values_[std::size_t(other)];
            ++count;
          }
          next[i] = sum / float(count);
        }
      });
      values_.swap(next);
    }
  }

  /// Writes the diffused values back, with the sign that the samples had.
  void store(BrickGrid& grid, const Mask& mask) const {
    for (std::size_t b = 1; b < mask.brickCount(); ++b)
      for (int r = 0; r < kRows; ++r) {
        std::uint32_t id = rowStart_[b * kRows + r];
        float* s = grid.brick(static_cast<std::int32_t>(b)) + storedIndex(0, r % kBrick, r / kBrick);
        for (unsigned bits = mask.row(b, r); bits != 0; bits &= bits - 1, ++id) {
          float& sample = s[std::countr_zero(bits)];
          sample = std::copysign(values_[id], sample);
        }
      }
  }

 private:
  struct Fixed {
    float sum = 0;
    int count = 0;
  };

  void link(const BrickGrid& grid, const Mask& mask, std::size_t b) {
    for (int r = 0; r < kRows; ++r) {
      std::uint32_t id = rowStart_[b * kRows + r];
      const float* s = grid.brick(static_cast<std::int32_t>(b)) + storedIndex(0, r % kBrick, r / kBrick);
      for (unsigned bits = mask.row(b, r); bits != 0; bits &= bits - 1, ++id) {
        const Vec3i voxel{std::countr_zero(bits), r % kBrick, r / kBrick};
        values_[id] = std::abs(s[voxel.x]);
        for (int n = 0; n < 6; ++n) links_[id][n] = linkTo(grid, mask, b, voxel, n, fixed_[id]);
      }
    }
  }

  std::int32_t linkTo(const BrickGrid& grid, const Mask& mask, std::size_t b, const Vec3i& from,
                      int direction, Fixed& fixed) const {
    const Vec3i to = from + kSteps[direction];
    const bool leaves = ((to.x | to.y | to.z) & ~7) != 0;
    const std::size_t other = leaves ? std::size_t(mask.neighbour(b, direction)) : b;
    const int row = (to.z & 7) * kBrick + (to.y & 7), x = to.x & 7;
    const unsigned bits = mask.row(other, row);
    if (bits >> x & 1u)
      return static_cast<std::int32_t>(rowStart_[other * kRows + row] +
                                       unsigned(std::popcount(bits & ((1u << x) - 1u))));
    const float sample =
        other == 0 ? 0.0f : grid.brick(static_cast<std::int32_t>(b))[storedIndex(to.x, to.y, to.z)];
    if (sample != 0) {
      fixed.sum += std::abs(sample);
      ++fixed.count;
    }
    return -1;
  }

  std::vector<std::uint32_t> rowStart_;
  std::vector<float> values_;
  std::vector<std::array<std::int32_t, 6>> links_;
  std::vector<Fixed> fixed_;
};

void dropSign(BrickGrid& grid, std::size_t brick) {
  float* samples = grid.brick(static_cast<std::int32_t>(brick));
  for (int i = 0; i < BrickGrid::kVolume; ++i) samples[i] = std::abs(samples[i]);
  grid.ranges[brick] = abs(grid.ranges[brick]);
}

}  // namespace

std::size_t smoothMedialJumps(BrickGrid& grid, const MedialSmoothingOptions& options,
                              const Progress& progress) {
  require(options.jump > 0, "smoothMedialJumps: jump must be > 0, got " + std::to_string(options.jump));
  require(options.dilation >= 0 && options.steps >= 0, "smoothMedialJumps: counts must be >= 0");
  const std::vector<Vec3i> positions = poolPositions(grid);
  Mask mask(grid, positions);
  markJumps(grid, options.jump, mask, progress);
  std::size_t smoothed = 0;
  if (options.dilation > 0 && options.steps > 0) {
    for (int i = 0; i < options.dilation; ++i) mask.dilate(progress);
    keepInsideBand(grid, mask);
    Heat heat(grid, mask);
    smoothed = heat.size();
    if (smoothed > 0) {
      heat.diffuse(options.steps, progress);
      heat.store(grid, mask);
      fillBorders(grid);
    }
  }
  const std::vector<bool> seen = bricksThatSee(grid, positions, mask);
  for (std::size_t b = 1; b < seen.size(); ++b)
    if (seen[b]) dropSign(grid, b);
  return smoothed;
}

}  // namespace nephele
