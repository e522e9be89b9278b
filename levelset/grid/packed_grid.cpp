#include "nephele/levelset/grid/packed_grid.h"

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr std::size_t kBricksPerTask = 64;

}  // namespace

PackedGrid::PackedGrid(const Lattice& lattice, const BrickBox& places, float background)
    : BrickLayout(lattice, places, background), codes_(kVolume, 0) {
  require(std::isfinite(background), "pack: every sample must be finite");
}

PackedGrid::PackedGrid(BrickGrid grid) : BrickLayout(static_cast<BrickLayout&&>(grid)) {
  // So many that a batch of floats is worth returning to the system.
  constexpr std::size_t kBatch = 2048;
  const std::size_t bricks = poolSize();
  detail::reserveLarge(codes_, bricks * kVolume);
  for (std::size_t first = 0; first < bricks; first += kBatch) {
    const std::size_t last = std::min(first + kBatch, bricks);
    codes_.resize(last * kVolume);
    parallelFor(last - first, kBricksPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = first + begin; b < first + end; ++b)
        encode(std::int32_t(b), grid.values_.data() + b * kVolume, ranges_[b]);
    });
    detail::releasePages(grid.values_.data() + first * kVolume, grid.values_.data() + last * kVolume);
  }
}

void PackedGrid::reserve(std::size_t bricks) {
  requirePool(bricks);
  ranges_.reserve(bricks);
  const std::size_t count = bricks * kVolume;
  if (count <= codes_.capacity()) return;
  // What stands there moves piece by piece, so that it is never held twice.
  constexpr std::size_t kPiece = std::size_t(1) << 21;
  std::vector<std::uint16_t> larger;
  // More will follow what already stands there.
  detail::reserveLarge(larger, codes_.size() > std::size_t(kVolume) ? count + count / 2 : count);
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
  codes_.resize((poolSize() + bricks) * kVolume);
  return appendRanges(bricks);
}

void PackedGrid::encode(std::int32_t pool, const float* samples, const Interval& range) {
  require(std::isfinite(range.min) && std::isfinite(range.max), "pack: every sample must be finite");
  const float low = range.min, width = range.max - low;
  const float scale = width > 0 ? Code::kLargest / width : 0.0f;
  std::uint16_t* codes = codes_.data() + std::size_t(pool) * kVolume;
  for (int i = 0; i < kVolume; ++i)
    codes[i] = std::uint16_t(std::min((samples[i] - low) * scale + 0.5f, Code::kLargest));
  setRange(pool, range);
}

float PackedGrid::at(const Vec3i& voxel) const {
  const std::int32_t pool = poolIndex(brickOf(voxel));
  const Code code = Code::of(ranges()[std::size_t(pool)]);
  return code.low + code.unit * float(codes(pool)[sampleOffset(insideBrick(voxel))]);
}

std::size_t PackedGrid::memoryBytes() const {
  return sizeof(PackedGrid) + layoutBytes() + codes_.capacity() * sizeof(std::uint16_t);
}

}  // namespace nephele
