// Results of shared sub-expressions, kept in the scratch of a thread for the points they belong to.
#include <algorithm>
#include <atomic>

#include "nephele/modeling/field/constant_node.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

using detail::constantOf;

std::uint64_t nextSerial() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

template <class T>
class MemoNode final : public FieldNode<T> {
 public:
  static constexpr int kLanes = kComponents<T>;

  explicit MemoNode(NodePtr<T> a) : a_(std::move(a)), serial_(nextSerial()) {}

  void eval(const PointBlock& points, const BlockLanes<kLanes>& values, Scratch& scratch) const override {
    if (const Scratch::MemoEntry* known = find(points, scratch))
      return copy(known->lanes.data(), values, points);
    a_->eval(points, values, scratch);
    keep(points, scratch, false, values);
  }
  void evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const override {
    const Scratch::MemoEntry* known = find(points, scratch);
    if (known && known->hasGradients) {
      copy(known->lanes.data(), values, points);
      return copy(known->lanes.data() + kLanes * kBlockSize, grads, points);
    }
    a_->evalGrad(points, values, grads, scratch);
    float* const rest = keep(points, scratch, true, values);
    for (int c = 0; c < 3 * kLanes; ++c) std::copy_n(grads[c], points.paddedCount(), rest + c * kBlockSize);
  }
  RangeOf<T> range(const Box& box, RangeMemo& memo) const override { return memo.of(a_, box); }
  NodePtr<T> restricted(Restriction& restriction) const override {
    const auto a = restrictNode(a_, restriction);
    if (a == a_) return nullptr;
    return constantOf(a) ? a : std::make_shared<MemoNode>(a);
  }
  float differenceStep() const override { return a_->differenceStep(); }

 private:
  const Scratch::MemoEntry* find(const PointBlock& points, Scratch& scratch) const {
    const Scratch::MemoEntry& entry = scratch.memoEntry(serial_);
    return entry.nodeSerial == serial_ && entry.pointsId == points.id ? &entry : nullptr;
  }
  /// Stores the values and returns where the gradients go.
  float* keep(const PointBlock& points, Scratch& scratch, bool withGradients,
              const BlockLanes<kLanes>& values) const {
    Scratch::MemoEntry& entry = scratch.memoEntry(serial_);
    // Room for gradients from the start: a later request must not allocate.
    constexpr std::size_t kRoom = 4 * kLanes * std::size_t(kBlockSize);
    if (entry.lanes.size() < kRoom) entry.lanes.assign(kRoom, 0.0f);
    entry.nodeSerial = serial_;
    entry.pointsId = points.id;
    entry.hasGradients = withGradients;
    for (int c = 0; c < kLanes; ++c)
      std::copy_n(values[c], points.paddedCount(), entry.lanes.data() + c * kBlockSize);
    return entry.lanes.data() + kLanes * kBlockSize;
  }
  template <std::size_t N>
  static void copy(const float* from, const std::array<float*, N>& to, const PointBlock& points) {
    for (std::size_t c = 0; c < N; ++c) std::copy_n(from + c * kBlockSize, points.paddedCount(), to[c]);
  }

  NodePtr<T> a_;
  std::uint64_t serial_;
};

template <class T>
Field<T> memoField(const Field<T>& f) {
  const bool pointless = constantOf(f.node()) || dynamic_cast<const MemoNode<T>*>(f.node().get());
  return pointless ? f : Field<T>(std::make_shared<MemoNode<T>>(f.node()));
}

}  // namespace

ScalarField memo(const ScalarField& f) {
  return memoField(f);
}
VectorField memo(const VectorField& f) {
  return memoField(f);
}
MatrixField memo(const MatrixField& f) {
  return memoField(f);
}

}  // namespace nephele
