// Bakes ask for a brick in two blocks of 256 points, whose positions follow from its place on the lattice. A
// block that has exactly these positions is one of them; its values are kept in a table over all such blocks.
#include "nephele/levelset/grid/brick_memo.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/levelset/grid/brick_table.h"
#include "nephele/modeling/base/system.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = kBrickSide;
constexpr int kPlane = kBrick * kBrick;
/// Planes of a brick in a block of points, and blocks in a brick.
constexpr int kPlanes = kBlockSize / kPlane;
constexpr int kHalves = kBrick / kPlanes;

}  // namespace

struct BrickMemo::Table {
  /// Where the values of a block are kept: kUnknown, kTaken while a thread writes them, else kFirst and on.
  using Entry = std::atomic<std::uint32_t>;
  static constexpr std::uint32_t kUnknown = 0, kTaken = 1, kFirst = 2;

  float voxelSize = 0.0f;
  BrickBox bricks;
  std::vector<Entry> entries;
  /// Room for the values of all blocks, so that evaluation never allocates; pages come as they are written.
  SampleStore values;
  std::atomic<std::uint32_t> kept = 0;

  /// The values of a block, or null.
  const float* known(const Entry* entry) const {
    const std::uint32_t at = entry ? entry->load(std::memory_order_acquire) : kUnknown;
    return at < kFirst ? nullptr : values.data() + std::size_t(at - kFirst) * kBlockSize;
  }
  void keep(Entry* entry, const float* of) {
    std::uint32_t unknown = kUnknown;
    if (!entry || !entry->compare_exchange_strong(unknown, kTaken, std::memory_order_relaxed)) return;
    const std::uint32_t at = kept.fetch_add(1, std::memory_order_relaxed);
    std::copy_n(of, kBlockSize, values.data() + std::size_t(at) * kBlockSize);
    entry->store(kFirst + at, std::memory_order_release);
  }

  /// The entry of a block of points; null if they are no half of a brick.
  Entry* entryOf(const PointBlock& points) {
    if (entries.empty() || points.count != kBlockSize) return nullptr;
    const Vec3f corner = Vec3f{points.x[0], points.y[0], points.z[0]} / voxelSize;
    constexpr float kFar = 1e7f;
    if (!(std::abs(corner.x) < kFar && std::abs(corner.y) < kFar && std::abs(corner.z) < kFar))
      return nullptr;
    const Vec3i voxel{int(std::lrint(corner.x)), int(std::lrint(corner.y)), int(std::lrint(corner.z))};
    if (insideBrick(voxel.x) != 0 || insideBrick(voxel.y) != 0 || insideBrick(voxel.z) % kPlanes != 0)
      return nullptr;
    const Vec3i brick = brickOf(voxel);
    if (!bricks.covers(brick)) return nullptr;
    bool isHalf = true;
    for (int i = 0; i < kBlockSize; ++i) {
      const Vec3f p = Vec3f(voxel + Vec3i{i % kBrick, i / kBrick % kBrick, i / kPlane}) * voxelSize;
      isHalf &= (points.x[i] == p.x) & (points.y[i] == p.y) & (points.z[i] == p.z);
    }
    if (!isHalf) return nullptr;
    return &entries[bricks.numberOf(brick) * kHalves + std::size_t(insideBrick(voxel.z) / kPlanes)];
  }
};

namespace {

template <class Table>
class MemoNode final : public FieldNode<float> {
 public:
  MemoNode(NodePtr<float> field, std::shared_ptr<Table> table)
      : field_(std::move(field)), table_(std::move(table)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    auto* entry = table_->entryOf(points);
    if (const float* known = table_->known(entry)) {
      std::copy_n(known, kBlockSize, values[0]);
      return;
    }
    field_->eval(points, values, scratch);
    table_->keep(entry, values[0]);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    field_->evalGrad(points, values, grads, scratch);
    table_->keep(table_->entryOf(points), values[0]);
  }
  Interval range(const Box& box, RangeMemo& memo) const override { return memo.of(field_, box); }
  NodePtr<float> restricted(Restriction& restriction) const override {
    // A simpler field for a part of space costs less to evaluate, but is not remembered.
    const NodePtr<float> field = restrictNode(field_, restriction);
    return field == field_ ? nullptr : field;
  }
  float differenceStep() const override { return field_->differenceStep(); }

 private:
  NodePtr<float> field_;
  std::shared_ptr<Table> table_;
};

}  // namespace

BrickMemo::BrickMemo(const ScalarField& field, float voxelSize, const Box& box, double mostBricks)
    : table_(std::make_shared<Table>()) {
  table_->voxelSize = voxelSize;
  double bricks = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double width = double(voxelSize) * kBrick;
    const double low = std::floor(double(box.min[axis]) / width),
                 high = std::floor(double(box.max[axis]) / width);
    bricks *= high - low + 1;
    if (!(bricks <= mostBricks)) break;
    table_->bricks.first[axis] = int(low);
    table_->bricks.count[axis] = int(high - low) + 1;
  }
  if (bricks <= std::min(mostBricks, kMostBricks / kHalves)) {
    const std::size_t blocks = std::size_t(bricks) * kHalves;
    table_->values = SampleStore(blocks * kBlockSize);
    adviseHugePages(table_->values.data(), table_->values.data() + blocks * kBlockSize);
    table_->entries = std::vector<Table::Entry>(blocks);
  }
  field_ = ScalarField(std::make_shared<MemoNode<Table>>(field.node(), table_));
}

void BrickMemo::clear() {
  std::vector<Table::Entry>().swap(table_->entries);
  table_->values = {};
}

}  // namespace nephele::detail
