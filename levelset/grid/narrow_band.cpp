#include "nephele/levelset/grid/narrow_band.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

constexpr std::size_t kPart = VoxelGrid<float>::kTogether;
constexpr int kLayer = kBrickSide * kBrickSide;

/// Also of zeros with a sign.
bool isSame(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

}  // namespace

NarrowBand::NarrowBand(VoxelGrid<float> grid, float least, float greatest)
    : grid_(std::move(grid)), least_(least), greatest_(greatest) {
  takeOver(true);
}

void NarrowBand::takeOver(bool isFinished) {
  const std::size_t taken = parts_.size(), added = grid_.sampledBricks();
  parts_.resize(isFinished ? (added + kPart - 1) / kPart : added / kPart);
  bricks_.resize(std::min(parts_.size() * kPart, added));
  parallelFor(parts_.size() - taken, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = taken + begin; part < taken + end; ++part)
      take(part * kPart, std::min((part + 1) * kPart, bricks_.size()));
  });
}

void NarrowBand::take(std::size_t first, std::size_t last) {
  std::vector<float> between;
  for (std::size_t b = first; b < last; ++b) {
    Brick& brick = bricks_[b];
    brick.first = std::uint32_t(between.size());
    const float* samples = grid_.samples(std::int32_t(b));
    for (int i = 0; i < kBrickSamples; ++i) {
      const std::uint64_t bit = std::uint64_t(1) << i % kLayer;
      if (isSame(samples[i], greatest_)) {
        brick.isGreatest[std::size_t(i / kLayer)] |= bit;
      } else if (!isSame(samples[i], least_)) {
        brick.isBetween[std::size_t(i / kLayer)] |= bit;
        between.push_back(samples[i]);
      }
    }
  }
  parts_[first / kPart].assign(between.begin(), between.end());
  grid_.releaseSamples(first, last);
}

void NarrowBand::read(std::int32_t entry, float* samples) const {
  if (entry < 0) {
    std::fill_n(samples, kBrickSamples, constants()[std::size_t(-1 - entry)]);
    return;
  }
  const Brick& brick = bricks_[std::size_t(entry)];
  const float* between = parts_[std::size_t(entry) / kPart].data() + brick.first;
  for (int i = 0; i < kBrickSamples; ++i) {
    const auto has = [&](const auto& bits) { return bits[std::size_t(i / kLayer)] >> i % kLayer & 1; };
    samples[i] = has(brick.isBetween) ? *between++ : has(brick.isGreatest) ? greatest_ : least_;
  }
}

VoxelGrid<float> NarrowBand::voxels() const {
  VoxelGrid<float> grid("narrow band", grid_.lattice(), background());
  forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    if (entry < 0)
      grid.setConstant(brick, constants()[std::size_t(-1 - entry)]);
    else
      read(entry, grid.add(brick));
  });
  return grid;
}

std::size_t NarrowBand::memoryBytes() const {
  std::size_t bytes = grid_.memoryBytes() + bricks_.capacity() * sizeof(Brick);
  for (const std::vector<float>& part : parts_) bytes += part.capacity() * sizeof(float);
  return bytes;
}

}  // namespace nephele
