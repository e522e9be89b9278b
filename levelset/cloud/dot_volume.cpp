// Dots of any size and any smear become points in index space with a mass, which are added to voxels with
// trilinear weights, blurred by a discrete kernel where a dot is larger than a voxel. Trilinear weights
// sum up to 1 and have their centroid at the splat, and a symmetric kernel keeps both.
//
// The points of a smeared dot are sorted in runs of four voxels: a brick adds those of a run that it holds.
//
// A batch of splats is sorted by brick: a splat has an entry in every brick that it touches (1.4 on average).
// Counting and placing entries use atomic counters beside the numbers of a sparse table of bricks; each brick
// then sorts its entries by number, which makes the order that of the input whatever the threads did, and
// adds them up, alone.
//
// Places are computed in double precision, from the dots each time that they are asked for, and kept in
// single precision only relative to a brick: a dot lands in the right voxel however far from the origin it
// lies.
//
// Source: Tessendorf, Production Volume Rendering (2008), "Baking anti-aliased dots".
// Limits: sums are single precision, so a voxel that collects n dots is off by some sqrt(n) roundings.
#include "nephele/levelset/cloud/dot_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "nephele/levelset/cloud/detail/dot_batches.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = kBrickSide;
constexpr std::size_t kVoxels = kBrickSamples;

}  // namespace

DotVolume::DotVolume(const DotVolumeOptions& o) : impl_(std::make_unique<Impl>(o)) {
  require(o.voxelSize >= kLeastVoxel && o.voxelSize <= kLargestVoxel,
          fmt::format("dots: voxels may be from {:g} to {:g} wide, got {:g}; scale what they are made from, "
                      "or give another size of voxels",
                      kLeastVoxel, kLargestVoxel, o.voxelSize));
  require(o.radius >= 0 && o.radius <= kLargestRadius * o.voxelSize,
          fmt::format("dots: radius must be from 0 to {:g} ({:g} voxels), got {:g}",
                      kLargestRadius * o.voxelSize, kLargestRadius, o.radius));
  require(std::isfinite(o.shutterOpen) && std::isfinite(o.shutterClose) && o.shutterOpen <= o.shutterClose,
          fmt::format("dots: the shutter must open before it closes, both finite, got {:g} and {:g}",
                      o.shutterOpen, o.shutterClose));
  impl_->ownRadius = o.radius / o.voxelSize;
  impl_->ownReach = detail::reachOf(impl_->ownRadius);
  impl_->perVoxel = float(1 / (double(o.voxelSize) * double(o.voxelSize) * double(o.voxelSize)));
}

DotVolume::~DotVolume() = default;
DotVolume::DotVolume(DotVolume&&) noexcept = default;
DotVolume& DotVolume::operator=(DotVolume&&) noexcept = default;

void DotVolume::add(const DotSpans& dots, const Progress& progress) {
  dots.requireFit("dots");
  impl_->requireSound(dots);
  std::vector<std::size_t>& firstSplat = impl_->firstSplat;
  for (std::size_t begin = 0; begin < dots.size();) {
    firstSplat.assign(1, 0);
    double entries = 0;
    std::size_t end = begin;
    for (; end < dots.size() && entries < detail::kEntriesOfBatch; ++end) {
      const std::size_t count = (impl_->pointsOf(dots, end) + Impl::kRun - 1) / Impl::kRun;
      const double wide = 2.0 * impl_->reach(dots, end) + (count > 1 ? 1 + double(Impl::kRun) / 4 : 1);
      const double bricks = 1 + wide / kBrick;
      firstSplat.push_back(firstSplat.back() + count);
      entries += double(count) * bricks * bricks * bricks;
    }
    impl_->addBatch(dots.part(begin, end - begin), progress);
    progress.advance(double(end) / double(dots.size()));
    begin = end;
  }
  impl_->dotCount += dots.size();
  for (const float mass : dots.masses) impl_->mass += double(mass);
  if (dots.masses.empty()) impl_->mass += double(dots.size());
}

const float* DotVolume::Impl::sampleAt(const Vec3i& voxel) const {
  const float* const own = bricks.find(brickOf(voxel));
  if (!own) return nullptr;
  const int i = (insideBrick(voxel.x) * kBrick + insideBrick(voxel.y)) * kBrick + insideBrick(voxel.z);
  return own + std::size_t(i) * channels();
}

float DotVolume::density(const Vec3i& voxel) const {
  const float* const sample = impl_->sampleAt(voxel);
  return sample ? sample[0] : 0;
}

Vec3f DotVolume::color(const Vec3i& voxel) const {
  const float* const sample = impl_->sampleAt(voxel);
  if (!impl_->options.withColor || !sample || !(sample[0] > 0)) return {};
  return Vec3f{sample[1], sample[2], sample[3]} / sample[0];
}

std::uint64_t DotVolume::dotCount() const {
  return impl_->dotCount;
}

double DotVolume::mass() const {
  return impl_->mass;
}

std::size_t DotVolume::brickCount() const {
  return impl_->bricks.count();
}

std::size_t DotVolume::memoryBytes() const {
  const std::size_t grids = impl_->bricks.count() * impl_->bricks.samplesPerBrick() * sizeof(float);
  return impl_->bricks.memoryBytes() + grids + impl_->counters.capacity() * sizeof(std::uint32_t) +
         impl_->dotOfSplat.capacity() * sizeof(std::uint32_t) +
         impl_->entries.capacity() * sizeof(detail::Splat);
}

namespace {

/// Colours of one brick, x fastest: sums over density, and the mean where there is none.
void fillColors(const float* samples, const Vec3f& mean, Vec3f* colors) {
  for (int z = 0; z < kBrick; ++z)
    for (int y = 0; y < kBrick; ++y)
      for (int x = 0; x < kBrick; ++x, ++colors) {
        const float* const s = samples + 4 * ((x * kBrick + y) * kBrick + z);
        *colors = s[0] > 0 ? Vec3f{s[1] / s[0], s[2] / s[0], s[3] / s[0]} : mean;
      }
}

/// The mean colour of a brick, or nothing if it has none.
std::optional<Vec3f> meanColor(const float* samples) {
  double sum[4] = {};
  for (std::size_t v = 0; v < kVoxels; ++v)
    for (std::size_t c = 0; c < 4; ++c) sum[c] += double(samples[4 * v + c]);
  if (!(sum[0] > 0)) return std::nullopt;
  return Vec3f{float(sum[1] / sum[0]), float(sum[2] / sum[0]), float(sum[3] / sum[0])};
}

}  // namespace

VoxelGrid<float> DotVolume::densityGrid() const {
  VoxelGrid<float> grid("dots", double(impl_->options.voxelSize), 0.0f);
  impl_->forEachNumber([&](const Vec3i& brick, std::int32_t) { grid.add(brick); });
  const std::size_t channels = impl_->channels();
  parallelFor(impl_->bricks.count(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float* const samples = impl_->bricks.samples(std::int32_t(i));
      float* target = grid.samples(std::int32_t(i));
      for (int z = 0; z < kBrick; ++z)
        for (int y = 0; y < kBrick; ++y)
          for (int x = 0; x < kBrick; ++x)
            *target++ = samples[std::size_t((x * kBrick + y) * kBrick + z) * channels];
    }
  });
  return grid;
}

VoxelGrid<Vec3f> DotVolume::colorGrid() const {
  require(impl_->options.withColor, "dots: no colours are kept");
  std::vector<std::optional<Vec3f>> means(impl_->bricks.count());
  parallelFor(means.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) means[i] = meanColor(impl_->bricks.samples(std::int32_t(i)));
  });
  VoxelGrid<Vec3f> grid("dots", double(impl_->options.voxelSize), Vec3f{});
  std::vector<std::size_t> numbers;
  impl_->forEachNumber([&](const Vec3i& brick, std::int32_t number) {
    if (!means[std::size_t(number)]) return;
    grid.add(brick);
    numbers.push_back(std::size_t(number));
  });
  parallelFor(numbers.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      fillColors(impl_->bricks.samples(std::int32_t(numbers[i])), *means[numbers[i]],
                 grid.samples(std::int32_t(i)));
  });
  return grid;
}

double estimatedDotVolumeBytes(const Box& box, double brickCount, double dotCount,
                               const DotVolumeOptions& options) {
  // What the table has for one place, for the cubes of 8^3 places that hold bricks: mostly surfaces.
  constexpr double kPlace = sizeof(std::int32_t) + sizeof(std::uint32_t), kCube = 8;
  const double edge = double(options.voxelSize) * kBrick;
  double positions = 1;
  for (int axis = 0; axis < 3; ++axis) positions *= double(box.size()[axis]) / edge + 2 * kCube;
  const double samples = double(kVoxels) * sizeof(float) * (options.withColor ? 4 : 1);
  const double bricks = std::min(brickCount, positions);
  const double places = std::min(positions, brickCount * kCube * kCube * kCube);
  // Samples here and in the grids; a table with two numbers, and a colour's leaf; a batch.
  return 2 * bricks * samples + places * (kPlace + (options.withColor ? 8 : 0)) +
         std::min(dotCount, detail::kEntriesOfBatch) * 3 * double(sizeof(detail::Splat));
}

}  // namespace nephele
