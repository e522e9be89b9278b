// Samples of pieces without borders: what a cut writes, as fast as memory allows. Values between samples are
// those of the plain loop of grid_kernels.h, read across bricks.
#include "nephele/levelset/cut/piece_level_set.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "nephele/levelset/cut/detail/level_sets/cut_kernels.h"
#include "nephele/levelset/grid/memory_chunks.h"
#include "nephele/levelset/mesh/brick_volume.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/field_node.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;

/// Offset of a sample in its brick.
constexpr std::size_t offsetIn(const Vec3i& inside) {
  return std::size_t((inside.z * kBrick + inside.y) * kBrick + inside.x);
}

}  // namespace

namespace detail {

class PieceLevelSetNode final : public FieldNode<float> {
 public:
  explicit PieceLevelSetNode(PieceLevelSet level)
      : level_(std::move(level)), toIndex_(1 / level_.voxelSize()) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    for (int i = 0; i < points.count; ++i) values[0][i] = valueAt({points.x[i], points.y[i], points.z[i]});
  }
  Interval range(const Box& box, RangeMemo&) const override;
  float differenceStep() const override { return level_.voxelSize(); }

 private:
  float valueAt(const Vec3f& point) const {
    constexpr float kFar = 1e9f;
    const Vec3f q = point * toIndex_;
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::abs(q[axis]) < kFar)) return -level_.band();
    const Vec3f low{std::floor(q.x), std::floor(q.y), std::floor(q.z)};
    const Vec3f t = q - low;
    const Vec3i voxel{int(low.x), int(low.y), int(low.z)};
    std::array<float, 8> corners;
    const Vec3i inside{insideBrick(voxel.x), insideBrick(voxel.y), insideBrick(voxel.z)};
    const std::int32_t entry = level_.table_->at(brickOf(voxel));
    if (entry == PieceLevelSet::kOutside) return -level_.band();
    if (entry == PieceLevelSet::kInside) return level_.band();
    if (std::max({inside.x, inside.y, inside.z}) < kBrick - 1) {
      const float* samples = level_.samplesOf(entry);
      for (int c = 0; c < 8; ++c)
        corners[std::size_t(c)] = samples[offsetIn(inside + Vec3i{c & 1, c >> 1 & 1, c >> 2})];
    } else {
      for (int c = 0; c < 8; ++c)
        corners[std::size_t(c)] = level_.at(voxel + Vec3i{c & 1, c >> 1 & 1, c >> 2});
    }
    const auto blend = [](float a, float b, float s) { return a + (b - a) * s; };
    std::array<float, 4> along;
    for (std::size_t i = 0; i < 4; ++i) along[i] = blend(corners[2 * i], corners[2 * i + 1], t.x);
    return blend(blend(along[0], along[1], t.y), blend(along[2], along[3], t.y), t.z);
  }

  PieceLevelSet level_;
  float toIndex_;
};

/// The range of the samples around the box if it meets few bricks; of larger ones whether they hold samples.
Interval PieceLevelSetNode::range(const Box& box, RangeMemo&) const {
  const float band = level_.band();
  const BrickBox& bricks = level_.table_->box;
  // One brick around the table, for what is beyond it.
  const Vec3i least = (bricks.first - Vec3i{1, 1, 1}) * kBrick;
  const Vec3i most = (bricks.first + bricks.count + Vec3i{1, 1, 1}) * kBrick - Vec3i{1, 1, 1};
  Vec3i low, high;
  for (int axis = 0; axis < 3; ++axis) {
    // As the values: products of floats, off by as much as a rounded product is.
    constexpr double kRounding = 1e-6;
    const double a = double(box.min[axis]) * double(toIndex_), b = double(box.max[axis]) * double(toIndex_);
    if (!(a <= b)) return {-band, band};
    const double first = std::floor(a - kRounding * std::abs(a)),
                 last = std::floor(b + kRounding * std::abs(b)) + 1;
    low[axis] = int(std::clamp(first, double(least[axis]), double(most[axis])));
    high[axis] = int(std::clamp(last, double(least[axis]), double(most[axis])));
  }
  constexpr std::size_t kFew = 27;
  const BrickBox around{brickOf(low), brickOf(high) - brickOf(low) + Vec3i{1, 1, 1}};
  Interval range{band, -band};
  const auto include = [&](float v) { range = {std::min(range.min, v), std::max(range.max, v)}; };
  for (std::size_t i = 0; i < around.size() && !(range.min == -band && range.max == band); ++i) {
    const Vec3i brick = around.at(i);
    const std::int32_t entry = level_.table_->at(brick);
    if (entry != PieceLevelSet::kInside) include(-band);
    if (entry != PieceLevelSet::kOutside) include(band);
  }
  if (around.size() > kFew || range.isPoint()) return range;
  range = {band, -band};
  for (std::size_t i = 0; i < around.size(); ++i) {
    const Vec3i brick = around.at(i), first = max(low - brick * kBrick, Vec3i{}),
                last = min(high - brick * kBrick, Vec3i{kBrick - 1, kBrick - 1, kBrick - 1});
    const std::int32_t entry = level_.table_->at(brick);
    if (entry <= PieceLevelSet::kInside) {
      include(entry == PieceLevelSet::kInside ? band : -band);
      continue;
    }
    const float* samples = level_.samplesOf(entry);
    for (int z = first.z; z <= last.z; ++z)
      for (int y = first.y; y <= last.y; ++y)
        for (int x = first.x; x <= last.x; ++x) include(samples[offsetIn({x, y, z})]);
  }
  // What rounding adds to a blend.
  const float beyond = 2e-6f * band;
  return {std::max(range.min - beyond, -band), std::min(range.max + beyond, band)};
}

}  // namespace detail

PieceLevelSet::PieceLevelSet(float voxelSize, float band, FlatBrickTable table,
                             std::shared_ptr<const detail::LargeArray> bricks)
    : voxelSize_(voxelSize),
      band_(band),
      table_(std::make_shared<const FlatBrickTable>(std::move(table))),
      bricks_(std::move(bricks)) {}

std::size_t PieceLevelSet::storedBricks() const {
  return std::size_t(std::count_if(table_->entries.begin(), table_->entries.end(),
                                   [](std::int32_t entry) { return entry > kInside; }));
}

std::size_t PieceLevelSet::memoryBytes() const {
  return sizeof(FlatBrickTable) + table_->memoryBytes() + storedBricks() * kSamples * sizeof(float);
}

const float* PieceLevelSet::samplesOf(std::int32_t entry) const {
  return bricks_->data() + std::size_t(entry - 2) * kSamples;
}

float PieceLevelSet::at(const Vec3i& voxel) const {
  const std::int32_t entry = table_->at(brickOf(voxel));
  if (entry == kOutside) return -band_;
  if (entry == kInside) return band_;
  return samplesOf(entry)[offsetIn({insideBrick(voxel.x), insideBrick(voxel.y), insideBrick(voxel.z)})];
}

ScalarField PieceLevelSet::field() const {
  return ScalarField(std::make_shared<detail::PieceLevelSetNode>(*this));
}

double PieceLevelSet::volume() const {
  // By table entry and by place among the bricks that hold samples, which come after the two ends.
  std::vector<const float*> samples(2);
  std::vector<detail::BrickMask> inside{{}, detail::BrickMask::all()};
  std::array<std::array<float, kSamples>, 2> ends;
  ends[kOutside].fill(-band_);
  ends[kInside].fill(band_);
  for (std::size_t end = 0; end < ends.size(); ++end) samples[end] = ends[end].data();
  FlatBrickTable places = *table_;
  for (std::int32_t& entry : places.entries) {
    if (entry <= kInside) continue;
    samples.push_back(samplesOf(entry));
    inside.push_back(detail::sidesOf(samples.back(), 0).above);
    entry = std::int32_t(samples.size()) - 1;
  }
  // The cells before the first samples have corners in the table's first bricks.
  const Vec3i one{1, 1, 1};
  const BrickBox around{places.box.first - one, places.box.count + one};
  const auto shareOf = [&](const Vec3i& at, detail::BrickCells& cells) {
    std::array<std::size_t, 8> corners;
    for (int i = 0; i < 8; ++i)
      corners[std::size_t(i)] = std::size_t(places.at(at + Vec3i{i & 1, i >> 1 & 1, i >> 2}));
    if (corners[0] <= kInside &&
        std::all_of(corners.begin(), corners.end(), [&](std::size_t corner) { return corner == corners[0]; }))
      return 0.0;
    std::array<detail::BrickMask, 8> masks;
    for (std::size_t i = 0; i < 8; ++i) {
      masks[i] = inside[corners[i]];
      cells.samples[i] = samples[corners[i]];
    }
    cells.setInside(masks);
    const detail::BrickMask mixed = cells.mixed();
    return mixed.isEmpty() ? 0.0 : detail::volumeShare(cells, mixed, at * kBrick);
  };
  // In blocks that are always the same, so that the sum is.
  constexpr std::size_t kBlock = 512;
  std::vector<double> sums((around.size() + kBlock - 1) / kBlock);
  parallelFor(sums.size(), 1, [&](std::size_t begin, std::size_t end) {
    detail::BrickCells cells;
    for (std::size_t block = begin; block < end; ++block)
      for (std::size_t i = block * kBlock; i < std::min((block + 1) * kBlock, around.size()); ++i)
        sums[block] += shareOf(around.at(i), cells);
  });
  const double voxel = double(voxelSize_);
  return std::accumulate(sums.begin(), sums.end(), 0.0) * voxel * voxel * voxel;
}

std::shared_ptr<BrickGrid> PieceLevelSet::toBricks() const {
  auto grid = std::make_shared<BrickGrid>(Lattice::uniform(voxelSize_), table_->box, -band_);
  grid->reserve(2 + storedBricks());
  grid->appendConstant(band_);
  std::int32_t next = grid->append(storedBricks());
  std::vector<std::int32_t> table = table_->entries;
  for (std::int32_t& entry : table) {
    if (entry <= kInside) continue;
    const float* samples = samplesOf(entry);
    entry = next++;
    float* brick = grid->brick(entry);
    for (int row = 0; row < kBrick * kBrick; ++row)
      std::copy_n(samples + row * kBrick, kBrick, brick + sampleOffset(0, row % kBrick, row / kBrick));
  }
  grid->setTable(std::move(table));
  fillBorders(*grid);
  return grid;
}

}  // namespace nephele
