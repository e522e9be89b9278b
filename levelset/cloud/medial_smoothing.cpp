// Marks the samples on both ends of every grid edge over which the displacement jumps, grows the mark by a
// few voxels (6-connected), and replaces the marked samples by the mean of themselves and their neighbours, a
// fixed number of times, with the unmarked samples held: heat that flows inside the mark only.
//
// Marks are bits, one byte per row of a brick. Bricks that hold marked samples get a second set of samples,
// and a diffusion step goes from one set to the other, row by row. Where the first is shared with others, it
// is copied before.
//
// Limits: a jump that is smaller than what noise of the layer's frequency can do over one voxel is not seen,
// and stays.
#include "nephele/levelset/cloud/medial_smoothing.h"

#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <string>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {

namespace {

using detail::BrickSamples;

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kRows = kBrick * kBrick;
constexpr std::size_t kBricksPerPiece = 32;

constexpr std::array<Vec3i, 6> kSteps{Vec3i{-1, 0, 0}, Vec3i{1, 0, 0},  Vec3i{0, -1, 0},
                                      Vec3i{0, 1, 0},  Vec3i{0, 0, -1}, Vec3i{0, 0, 1}};

/// Where a row of a brick stands: the brick, and the row in it (z * 8 + y).
struct RowPlace {
  std::size_t brick;
  int row;
};

/// The six neighbours of each pool brick; 0 (the background brick) where there is none.
class Neighbours {
 public:
  explicit Neighbours(const BrickSamples& samples) : neighbours_(samples.pool.size()) {
    for (const PlacedBrick& brick : samples.placed)
      for (std::size_t n = 0; n < 6; ++n)
        neighbours_[std::size_t(brick.pool)][n] = samples.table.at(brick.brick + kSteps[n]);
  }

  std::size_t brickCount() const { return neighbours_.size(); }
  std::size_t operator()(std::size_t brick, std::size_t direction) const {
    return std::size_t(neighbours_[brick][direction]);
  }
  /// Row (y, z) of a brick where one of the two may lie one step outside.
  RowPlace rowAcross(std::size_t brick, int y, int z) const {
    if (y < 0) brick = (*this)(brick, 2);
    if (y >= kBrick) brick = (*this)(brick, 3);
    if (z < 0) brick = (*this)(brick, 4);
    if (z >= kBrick) brick = (*this)(brick, 5);
    return {brick, (z & 7) * kBrick + (y & 7)};
  }
  /// The rows beside a row in y and z, in the order of the steps.
  std::array<RowPlace, 4> rowsBeside(std::size_t brick, int row) const {
    const int y = row % kBrick, z = row / kBrick;
    return {rowAcross(brick, y - 1, z), rowAcross(brick, y + 1, z), rowAcross(brick, y, z - 1),
            rowAcross(brick, y, z + 1)};
  }

 private:
  std::vector<std::array<std::int32_t, 6>> neighbours_;
};

/// One byte per row of eight samples along x; row z * 8 + y of pool brick b at b * 64.
class Mask {
 public:
  explicit Mask(const Neighbours& neighbours)
      : rows_(neighbours.brickCount() * kRows), neighbours_(neighbours) {}

  std::uint8_t& row(std::size_t brick, int index) { return rows_[brick * kRows + std::size_t(index)]; }
  std::uint8_t row(std::size_t brick, int index) const { return rows_[brick * kRows + std::size_t(index)]; }
  std::uint8_t row(const RowPlace& place) const { return row(place.brick, place.row); }
  bool isEmpty(std::size_t brick) const {
    const auto first = rows_.begin() + static_cast<std::ptrdiff_t>(brick * kRows);
    return std::all_of(first, first + kRows, [](std::uint8_t r) { return r == 0; });
  }
  /// For each of the six steps, the marks of the samples one step from a row's.
  std::array<std::uint8_t, 6> beside(std::size_t brick, int index) const {
    const unsigned own = row(brick, index);
    const unsigned left = row(neighbours_(brick, 0), index) >> 7;
    const unsigned right = row(neighbours_(brick, 1), index) & 1u;
    const std::array<RowPlace, 4> rows = neighbours_.rowsBeside(brick, index);
    return {static_cast<std::uint8_t>(own << 1 | left),
            static_cast<std::uint8_t>(own >> 1 | right << 7),
            row(rows[0]),
            row(rows[1]),
            row(rows[2]),
            row(rows[3])};
  }

  /// The mask grown by one step along each axis.
  void dilate(const Progress& progress) {
    std::vector<std::uint8_t> grown(rows_.size());
    parallelFor(
        neighbours_.brickCount() - 1, kBricksPerPiece,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t b = begin + 1; b <= end; ++b)
            for (int r = 0; r < kRows; ++r) {
              unsigned bits = row(b, r);
              for (const std::uint8_t other : beside(b, r)) bits |= other;
              grown[b * kRows + std::size_t(r)] = static_cast<std::uint8_t>(bits);
            }
        },
        progress);
    rows_ = std::move(grown);
  }

 private:
  std::vector<std::uint8_t> rows_;
  const Neighbours& neighbours_;
};

using RowValues = std::array<float, kBrick>;

/// The samples one step from those of a row, in the order of the steps; `rowAt` finds rows.
template <class RowAt>
std::array<RowValues, 6> valuesBeside(const Neighbours& neighbours, std::size_t brick, int row,
                                      const RowAt& rowAt) {
  std::array<RowValues, 6> values;
  const float* own = rowAt({brick, row});
  values[0][0] = rowAt({neighbours(brick, 0), row})[kBrick - 1];
  std::copy_n(own, kBrick - 1, values[0].begin() + 1);
  std::copy_n(own + 1, kBrick - 1, values[1].begin());
  values[1][kBrick - 1] = rowAt({neighbours(brick, 1), row})[0];
  const std::array<RowPlace, 4> rows = neighbours.rowsBeside(brick, row);
  for (std::size_t n = 0; n < 4; ++n) std::copy_n(rowAt(rows[n]), kBrick, values[2 + n].begin());
  return values;
}

void markJumps(const BrickSamples& samples, const Neighbours& neighbours, float jump, Mask& mask,
               const Progress& progress) {
  const auto rowAt = [&](const RowPlace& place) { return samples.pool[place.brick] + place.row * kBrick; };
  parallelFor(
      neighbours.brickCount() - 1, kBricksPerPiece,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin + 1; b <= end; ++b) {
          Interval range = samples.ranges[b];
          for (std::size_t n = 0; n < 6; ++n) range = range.hull(samples.ranges[neighbours(b, n)]);
          if (range.max - range.min <= jump) continue;
          for (int r = 0; r < kRows; ++r) {
            const float* own = rowAt({b, r});
            const std::array<RowValues, 6> beside = valuesBeside(neighbours, b, r, rowAt);
            std::array<std::int32_t, kBrick> jumps{};
            for (const RowValues& other : beside)
              for (std::size_t x = 0; x < kBrick; ++x)
                jumps[x] |= std::int32_t(other[x] != 0) & std::int32_t(own[x] != 0) &
                            std::int32_t(std::abs(other[x] - own[x]) > jump);
            unsigned bits = 0;
            for (std::size_t x = 0; x < kBrick; ++x) bits |= unsigned(jumps[x]) << x;
            mask.row(b, r) = static_cast<std::uint8_t>(bits);
          }
        }
      },
      progress);
}

/// Unmarks what lies outside the band.
void keepInsideBand(const BrickSamples& samples, Mask& mask) {
  parallelFor(samples.pool.size() - 1, kBricksPerPiece, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin + 1; b <= end; ++b)
      for (int r = 0; r < kRows; ++r) {
        unsigned bits = mask.row(b, r);
        if (bits == 0) continue;
        const float* row = samples.pool[b] + r * kBrick;
        for (int x = 0; x < kBrick; ++x)
          if (row[x] == 0) bits &= ~(1u << x);
        mask.row(b, r) = static_cast<std::uint8_t>(bits);
      }
  });
}

/// Bricks that store a marked sample, their own or in their border.
std::vector<bool> bricksThatSee(const BrickSamples& samples, const Mask& mask) {
  // Own samples that a neighbour in direction -1, 0, +1 stores: the first kAfter, all, the last kBefore.
  constexpr std::array<std::array<int, 2>, 3> kShared{
      {{0, BrickGrid::kAfter}, {0, kBrick}, {kBrick - BrickGrid::kBefore, kBrick}}};
  std::vector<bool> result(samples.pool.size());
  for (const PlacedBrick& brick : samples.placed) {
    const auto b = std::size_t(brick.pool);
    if (mask.isEmpty(b)) continue;
    for (int n = 0; n < 27; ++n) {
      const Vec3i direction{n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
      const auto shared = [&](int axis) { return kShared[std::size_t(direction[axis] + 1)]; };
      const unsigned bits = (1u << shared(0)[1]) - (1u << shared(0)[0]);
      unsigned seen = 0;
      for (int z = shared(2)[0]; z < shared(2)[1]; ++z)
        for (int y = shared(1)[0]; y < shared(1)[1]; ++y) seen |= mask.row(b, z * kBrick + y) & bits;
      if (seen != 0) result[std::size_t(samples.table.at(brick.brick + direction))] = true;
    }
  }
  result[0] = false;
  return result;
}

/// 1 where a bit of a byte is set, else 0.
struct BitsAsFloats {
  std::array<RowValues, 256> of{};

  constexpr BitsAsFloats() {
    for (unsigned byte = 0; byte < 256; ++byte)
      for (unsigned x = 0; x < kBrick; ++x) of[byte][x] = float(byte >> x & 1u);
  }
};
constexpr BitsAsFloats kBitsAsFloats;

/// The bricks that hold marked samples, and two sets of samples of each: those of the grid and others.
class Heat {
 public:
  Heat(BrickSamples& samples, const Neighbours& neighbours, const Mask& mask)
      : neighbours_(neighbours), mask_(mask) {
    for (std::size_t b = 1; b < samples.pool.size(); ++b)
      if (!mask.isEmpty(b)) bricks_.push_back(b);
    if (samples.areShared) samples.own(bricks_);
    current_ = samples.pool;
    others_ = detail::SampleStore(bricks_.size() * std::size_t(BrickSamples::kCount));
    for (std::size_t i = 0; i < bricks_.size(); ++i)
      next_.push_back(others_.data() + i * std::size_t(BrickSamples::kCount));
  }

  void diffuse(int steps, const Progress& progress) {
    for (int step = 0; step < steps; ++step) {
      progress.check();
      parallelFor(bricks_.size(), kBricksPerPiece, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) diffuse(bricks_[i], next_[i]);
      });
      for (std::size_t i = 0; i < bricks_.size(); ++i) std::swap(current_[bricks_[i]], next_[i]);
    }
  }

  /// Leaves the result in the grid's own samples.
  void store(BrickSamples& samples) {
    parallelFor(bricks_.size(), kBricksPerPiece, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t b = bricks_[i];
        if (current_[b] != samples.pool[b]) std::copy_n(current_[b], BrickSamples::kCount, samples.pool[b]);
        samples.ranges[b] = rangeOfSamples({samples.pool[b], std::size_t(BrickSamples::kCount)});
      }
    });
  }

 private:
  /// The absolute values of a brick and of the layer of samples around it, without edges and corners.
  class Around {
   public:
    Around(const std::vector<float*>& samples, const Neighbours& neighbours, std::size_t brick) {
      const auto rowsOf = [&](std::size_t direction) { return samples[neighbours(brick, direction)]; };
      for (int z = 0; z < kBrick; ++z)
        for (int y = 0; y < kBrick; ++y) {
          const int row = z * kBrick + y;
          put(y, z, samples[brick] + row * kBrick);
          at(y, z)[-1] = std::abs(rowsOf(0)[row * kBrick + kBrick - 1]);
          at(y, z)[kBrick] = std::abs(rowsOf(1)[row * kBrick]);
        }
      constexpr int kLast = kBrick - 1;
      for (int i = 0; i < kBrick; ++i) {
        put(-1, i, rowsOf(2) + (i * kBrick + kLast) * kBrick);
        put(kBrick, i, rowsOf(3) + i * kBrick * kBrick);
        put(i, -1, rowsOf(4) + (kLast * kBrick + i) * kBrick);
        put(i, kBrick, rowsOf(5) + i * kBrick);
      }
    }
    /// The first sample of a row.
    const float* row(int y, int z) const { return values_.data() + offset(y, z); }

   private:
    // Room on both sides, and rows that begin where vectors do.
    static constexpr int kStride = 2 * kBrick, kWidth = kBrick + 2;

    static std::size_t offset(int y, int z) {
      return std::size_t(((z + 1) * kWidth + y + 1) * kStride + kStride / 2);
    }
    float* at(int y, int z) { return values_.data() + offset(y, z); }
    void put(int y, int z, const float* from) {
      float* row = at(y, z);
      for (int x = 0; x < kBrick; ++x) row[x] = std::abs(from[x]);
    }

    alignas(64) std::array<float, std::size_t(kWidth* kWidth* kStride + kStride)> values_;
  };

  /// One step of one brick, by absolute values; signs stay. What is 0 is outside of the band.
  void diffuse(std::size_t brick, float* next) const {
    const Around around(current_, neighbours_, brick);
    for (int r = 0; r < kRows; ++r) {
      const float* own = current_[brick] + r * kBrick;
      const std::uint8_t bits = mask_.row(brick, r);
      float* result = next + r * kBrick;
      if (bits == 0) {
        std::copy_n(own, kBrick, result);
        continue;
      }
      const int y = r % kBrick, z = r / kBrick;
      const float* row = around.row(y, z);
      const std::array<const float*, 6> beside{row - 1,
                                               row + 1,
                                               around.row(y - 1, z),
                                               around.row(y + 1, z),
                                               around.row(y, z - 1),
                                               around.row(y, z + 1)};
      const float* marked = kBitsAsFloats.of[bits].data();
      const hn::CappedTag<float, kBrick> d;
      const auto one = hn::Set(d, 1.0f);
      for (std::size_t x = 0; x < kBrick; x += hn::Lanes(d)) {
        auto sum = hn::LoadU(d, row + x), count = one;
        for (const float* values : beside) {
          const auto value = hn::LoadU(d, values + x);
          sum = hn::Add(sum, value);
          count = hn::Add(count, hn::IfThenElseZero(hn::Ne(value, hn::Zero(d)), one));
        }
        const auto old = hn::LoadU(d, own + x);
        const auto isMarked = hn::Ne(hn::LoadU(d, marked + x), hn::Zero(d));
        hn::StoreU(hn::IfThenElse(isMarked, hn::CopySign(hn::Div(sum, count), old), old), d, result + x);
      }
    }
  }

  const Neighbours& neighbours_;
  const Mask& mask_;
  std::vector<std::size_t> bricks_;
  /// The samples of every pool brick, and the other samples of those in `bricks_`.
  std::vector<float*> current_, next_;
  detail::SampleStore others_;
};

}  // namespace

MedialSmoothing smoothMedialJumps(BrickSamples& samples, const MedialSmoothingOptions& options,
                                  const Progress& progress) {
  require(options.jump > 0, "smoothMedialJumps: jump must be > 0, got " + numberText(options.jump));
  require(options.dilation >= 0 && options.steps >= 0, "smoothMedialJumps: counts must be >= 0");
  const Neighbours neighbours(samples);
  Mask mask(neighbours);
  markJumps(samples, neighbours, options.jump, mask, progress);
  MedialSmoothing result;
  if (options.dilation > 0 && options.steps > 0) {
    for (int i = 0; i < options.dilation; ++i) mask.dilate(progress);
    keepInsideBand(samples, mask);
    for (std::size_t b = 1; b < samples.pool.size(); ++b)
      for (int r = 0; r < kRows; ++r) result.diffused += std::size_t(std::popcount(mask.row(b, r)));
    Heat heat(samples, neighbours, mask);
    heat.diffuse(options.steps, progress);
    heat.store(samples);
  }
  result.signless = bricksThatSee(samples, mask);
  return result;
}

}  // namespace nephele
