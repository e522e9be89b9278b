#include "nephele/levelset/grid/packed_grid.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "nephele/levelset/grid/detail/brick_borders.h"
#include "nephele/levelset/grid/detail/brick_codes.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr std::size_t kBricksPerTask = 64;
constexpr std::size_t kOwn = kBrickSamples;

/// Where a sample of a brick stands among its codes.
constexpr int offsetOf(const Vec3i& own) {
  return (own.z * kBrickSide + own.y) * kBrickSide + own.x;
}

std::uint32_t nextSerial() {
  static std::atomic<std::uint32_t> last{0};
  return ++last;
}

}  // namespace

PackedGrid::PackedGrid(const Lattice& lattice, const BrickBox& places, float background)
    : BrickLayout(lattice, places, background), codes_(kOwn, 0), signless_(1, 0), serial_(nextSerial()) {
  require(std::isfinite(background), "pack: every sample must be finite");
}

PackedGrid::PackedGrid(BrickGrid grid)
    : BrickLayout(static_cast<BrickLayout&&>(grid)), serial_(nextSerial()) {
  // So many that a batch of floats is worth returning to the system.
  constexpr std::size_t kBatch = 2048;
  const std::size_t bricks = poolSize();
  detail::reserveLarge(codes_, bricks * kOwn);
  signless_.resize(bricks);
  for (std::size_t first = 0; first < bricks; first += kBatch) {
    const std::size_t last = std::min(first + kBatch, bricks);
    codes_.resize(last * kOwn);
    parallelFor(last - first, kBricksPerTask, [&](std::size_t begin, std::size_t end) {
      std::array<float, kOwn> own;
      for (std::size_t b = first + begin; b < first + end; ++b) {
        const float* stored = grid.values_.data() + b * kVolume + sampleOffset(0, 0, 0);
        for (int row = 0; row < kBrick * kBrick; ++row)
          std::copy_n(stored + row / kBrick * kWidth * kWidth + row % kBrick * kWidth, kBrick,
                      own.begin() + row * kBrick);
        encode(std::int32_t(b), own.data(), ranges_[b]);
      }
    });
    detail::releasePages(grid.values_.data() + first * kVolume, grid.values_.data() + last * kVolume);
  }
}

void PackedGrid::reserve(std::size_t bricks) {
  requirePool(bricks);
  ranges_.reserve(bricks);
  const std::size_t count = bricks * kOwn;
  if (count <= codes_.capacity()) return;
  // What stands there moves piece by piece, so that it is never held twice.
  constexpr std::size_t kPiece = std::size_t(1) << 21;
  std::vector<std::uint16_t> larger;
  // More will follow what already stands there.
  detail::reserveLarge(larger, codes_.size() > kOwn ? count + count / 2 : count);
  for (std::size_t first = 0; first < codes_.size(); first += kPiece) {
    std::uint16_t* begin = codes_.data() + first;
    std::uint16_t* end = codes_.data() + std::min(first + kPiece, codes_.size());
    larger.insert(larger.end(), begin, end);
    detail::releasePages(begin, end);
  }
  codes_.swap(larger);
}

std::int32_t PackedGrid::append(std::size_t bricks) {
  requirePool(poolSize() + bricks);
  codes_.resize((poolSize() + bricks) * kOwn);
  signless_.resize(poolSize() + bricks);
  serial_ = nextSerial();
  return appendRanges(bricks);
}

void PackedGrid::encode(std::int32_t pool, const float* samples, const Interval& range, bool isSignless) {
  require(std::isfinite(range.min) && std::isfinite(range.max), "pack: every sample must be finite");
  // Values with signs and without.
  const Interval all = isSignless ? range.hull(abs(range)) : range;
  const float low = all.min, width = all.max - low;
  const float scale = width > 0 ? Code::kLargest / width : 0.0f;
  std::uint16_t* codes = codes_.data() + std::size_t(pool) * kOwn;
  for (std::size_t i = 0; i < kOwn; ++i)
    codes[i] = std::uint16_t(std::min((samples[i] - low) * scale + 0.5f, Code::kLargest));
  signless_[std::size_t(pool)] = isSignless;
  setRange(pool, all);
}

float PackedGrid::at(const Vec3i& voxel) const {
  const std::int32_t pool = poolIndex(brickOf(voxel));
  const Code code = Code::of(ranges()[std::size_t(pool)]);
  const float value = code.value(codes(pool)[offsetOf(insideBrick(voxel))]);
  return signless_[std::size_t(pool)] ? std::abs(value) : value;
}

void PackedGrid::assemble(std::size_t place, float* samples) const {
  const std::int32_t pool = table()[place];
  const Interval& range = ranges()[std::size_t(pool)];
  if (range.isPoint()) {
    std::fill_n(samples, kVolume, range.min);
    return;
  }
  const Vec3i brick = places().at(place);
  detail::CodesAround around;
  for (std::size_t i = 0; i < detail::kBorderParts.size(); ++i) {
    const std::int32_t of = poolIndex(brick + detail::kBorderParts[i].side);
    around.codes[i] = codes(of);
    const Code code = Code::of(ranges()[std::size_t(of)]);
    around.low[i] = code.low, around.unit[i] = code.unit;
  }
  detail::decodeBrick(around, samples);
  if (!signless_[std::size_t(pool)]) return;
  for (int i = 0; i < kVolume; ++i) samples[i] = std::abs(samples[i]);
}

void PackedGrid::assembleCell(std::size_t place, int first, int begin, int count, float* samples) const {
  const std::int32_t pool = table()[place];
  const bool isConstant = ranges()[std::size_t(pool)].isPoint();
  const bool isSignless = signless_[std::size_t(pool)] != 0;
  // Along each axis the first samples are of one brick, and the others of the next.
  const Vec3i own = Vec3i{first % kWidth, first / kWidth % kWidth, first / (kWidth * kWidth)} +
                    Vec3i{1, 1, 1} * (begin - kBefore);
  Vec3i side, split;
  for (int axis = 0; axis < 3; ++axis) {
    side[axis] = own[axis] < 0 ? -1 : 0;
    split[axis] = std::min((own[axis] < 0 ? 0 : kBrick) - own[axis], count);
  }
  const Vec3i brick = places().at(place) + side;
  for (int part = 0; part < 8; ++part) {
    const Vec3i next{part & 1, part >> 1 & 1, part >> 2};
    Vec3i from, to;
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = next[axis] ? split[axis] : 0;
      to[axis] = next[axis] ? count : split[axis];
    }
    if (from.x >= to.x || from.y >= to.y || from.z >= to.z) continue;
    const std::int32_t of = isConstant ? pool : poolIndex(brick + next);
    const Code code = Code::of(ranges()[std::size_t(of)]);
    const std::uint16_t* source = codes(of) + offsetOf(insideBrick(own + from));
    float* target = samples + ((begin + from.z) * kWidth + begin + from.y) * kWidth + begin + from.x;
    for (int z = from.z; z < to.z; ++z, source += kBrick * kBrick, target += kWidth * kWidth)
      for (int y = 0; y < to.y - from.y; ++y)
        for (int x = 0; x < to.x - from.x; ++x) target[y * kWidth + x] = code.value(source[y * kBrick + x]);
  }
  if (!isSignless) return;
  for (int z = begin; z < begin + count; ++z)
    for (int y = begin; y < begin + count; ++y)
      for (int x = begin; x < begin + count; ++x) {
        float& value = samples[(z * kWidth + y) * kWidth + x];
        value = std::abs(value);
      }
}

std::size_t PackedGrid::memoryBytes() const {
  return sizeof(PackedGrid) + layoutBytes() + codes_.capacity() * sizeof(std::uint16_t) +
         signless_.capacity();
}

}  // namespace nephele
