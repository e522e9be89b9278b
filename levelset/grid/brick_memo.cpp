// Bakes ask for a brick in two blocks of 256 points, whose positions follow from its place on the lattice. A
// block that has exactly these positions is one of them; its values are kept in a table over all such blocks.
#include "nephele/levelset/grid/brick_memo.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/levelset/grid/brick_grid.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kPlane = kBrick * kBrick;
/// Planes of a brick in a block of points, and blocks in a brick.
constexpr int kPlanes = kBlockSize / kPlane;
constexpr int kHalves = kBrick / kPlanes;

}  // namespace

struct BrickMemo::Table {
  /// Values of one block.
  struct Entry {
    std::atomic<float*> values{nullptr};
    Entry() = default;
    Entry(const Entry&) = delete;
    Entry& operator=(const Entry&) = delete;
    ~Entry() { delete[] values.load(); }

    void keep(const float* of) {
      if (values.load(std::memory_order_relaxed)) return;
      auto kept = std::make_unique_for_overwrite<float[]>(kBlockSize);
      std::copy_n(of, kBlockSize, kept.get());
      float* none = nullptr;
      if (values.compare_exchange_strong(none, kept.get(), std::memory_order_acq_rel)) kept.release();
    }
  };

  float voxelSize = 0.0f;
  BrickBox bricks;
  std::vector<Entry> entries;

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
    if (const float* known = entry ? entry->values.load(std::memory_order_acquire) : nullptr) {
      std::copy_n(known, kBlockSize, values[0]);
      return;
    }
    field_->eval(points, values, scratch);
    if (entry) entry->keep(values[0]);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<1>& values, const BlockLanes<3>& grads,
                Scratch& scratch) const override {
    field_->evalGrad(points, values, grads, scratch);
    if (auto* entry = table_->entryOf(points)) entry->keep(values[0]);
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
  if (bricks <= mostBricks) table_->entries = std::vector<Table::Entry>(std::size_t(bricks) * kHalves);
  field_ = ScalarField(std::make_shared<MemoNode<Table>>(field.node(), table_));
}

void BrickMemo::clear() {
  std::vector<Table::Entry>().swap(table_->entries);
}

}  // namespace nephele::detail
