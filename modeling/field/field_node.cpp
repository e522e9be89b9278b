// What a field does that does not say otherwise: central differences, any value, no simplification. And the
// walks over expressions, which remember what they have seen: an expression is a graph, in which the ways
// from the top to a shared node can be as many as two to the power of its depth.
#include "nephele/modeling/field/field_node.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <unordered_map>

#include "nephele/modeling/base/assertion.h"

namespace nephele {
namespace {

/// Questions that a memo answers before it starts to remember: most expressions are small, and asking their
/// nodes again costs less than a table.
constexpr int kUnremembered = 32;

struct NodeAndBox {
  const void* node;
  Box box;

  bool operator==(const NodeAndBox&) const = default;
};

struct NodeAndBoxHash {
  std::size_t operator()(const NodeAndBox& key) const noexcept {
    const auto pair = [](float a, float b) {
      // -0 and 0 are equal.
      return std::uint64_t(std::bit_cast<std::uint32_t>(a + 0.0f)) << 32 |
             std::bit_cast<std::uint32_t>(b + 0.0f);
    };
    const Box& b = key.box;
    const std::uint64_t h = (std::bit_cast<std::uintptr_t>(key.node) >> 4) * 0x9e3779b97f4a7c15ull ^
                            pair(b.min.x, b.min.y) * 0xd1b54a32d192ed03ull ^
                            pair(b.min.z, b.max.x) * 0xaef17502108ef2d9ull ^
                            pair(b.max.y, b.max.z) * 0x632be59bd9b4e019ull;
    return std::size_t(h ^ h >> 32);
  }
};

template <class Value>
using Table = std::unordered_map<NodeAndBox, Value, NodeAndBoxHash>;

}  // namespace

struct RangeMemo::Tables {
  /// Keeps the node, so that no other can have its address while its range is known.
  template <class T>
  struct Known {
    NodePtr<T> node;
    RangeOf<T> range;
  };
  std::tuple<Table<Known<float>>, Table<Known<Vec3f>>, Table<Known<Mat3f>>> of;
};

RangeMemo::RangeMemo() = default;
RangeMemo::~RangeMemo() = default;

template <class T>
RangeOf<T> RangeMemo::of(const NodePtr<T>& node, const Box& box) {
  NEPHELE_ASSERT(node);
  // What nobody else holds is not shared.
  if (++asked_ <= kUnremembered || node.use_count() == 1) return node->range(box, *this);
  const NodeAndBox key{node.get(), box};
  if (tables_) {
    const auto& known = std::get<Table<Tables::Known<T>>>(tables_->of);
    if (const auto found = known.find(key); found != known.end()) return found->second.range;
  }
  const int before = asked_;
  const RangeOf<T> range = node->range(box, *this);
  // A node without parts is asked no more often than others read it.
  if (asked_ == before) return range;
  if (!tables_) tables_ = std::make_unique<Tables>();
  std::get<Table<Tables::Known<T>>>(tables_->of).emplace(key, Tables::Known<T>{node, range});
  return range;
}

struct RestrictionMemo::Done {
  Table<std::shared_ptr<const void>> nodes;
};

RestrictionMemo::RestrictionMemo() : done_(std::make_unique<Done>()) {}
RestrictionMemo::~RestrictionMemo() = default;

template <class T>
void FieldNode<T>::evalGrad(const PointBlock& points, const BlockLanes<kLanes>& values,
                            const BlockLanes<3 * kLanes>& grads, Scratch& scratch) const {
  eval(points, values, scratch);
  const float step = differenceStepOf(*this);
  const float* const from[3] = {points.x, points.y, points.z};
  const int n = points.paddedCount();
  Scratch::Frame frame(scratch);
  const BlockLanes<3> xyz = frame.lanes<3>();
  float *const high = frame.lane(), *const low = frame.lane();
  const BlockLanes<kLanes> above = frame.lanes<kLanes>(), below = frame.lanes<kLanes>();
  for (int a = 0; a < 3; ++a) std::copy_n(from[a], n, xyz[a]);
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < n; ++i) {
      const float x = from[axis][i];
      // Far from the origin `step` may vanish in rounding: move by some floats at least.
      const float s = std::max(step, std::abs(x) * 1e-6f);
      high[i] = x + s;
      low[i] = x - s;
    }
    std::copy_n(high, n, xyz[axis]);
    eval(scratch.pointBlock(xyz, points.count), above, scratch);
    std::copy_n(low, n, xyz[axis]);
    eval(scratch.pointBlock(xyz, points.count), below, scratch);
    std::copy_n(from[axis], n, xyz[axis]);
    for (int c = 0; c < kLanes; ++c)
      for (int i = 0; i < n; ++i) grads[3 * c + axis][i] = (above[c][i] - below[c][i]) / (high[i] - low[i]);
  }
}

template <class T>
RangeOf<T> FieldNode<T>::range(const Box&, RangeMemo&) const {
  return {};
}

template <class T>
NodePtr<T> FieldNode<T>::restricted(Restriction&) const {
  return nullptr;
}

template <class T>
NodePtr<T> restrictNode(const NodePtr<T>& node, Restriction& restriction) {
  NEPHELE_ASSERT(node);
  // What nobody else holds is not shared.
  if (node.use_count() == 1) {
    NodePtr<T> result = node->restricted(restriction);
    return result ? result : node;
  }
  auto& done = restriction.memo.done_->nodes;
  const NodeAndBox key{node.get(), restriction.box};
  if (const auto found = done.find(key); found != done.end())
    return std::static_pointer_cast<const FieldNode<T>>(found->second);
  NodePtr<T> result = node->restricted(restriction);
  if (!result) result = node;
  done.emplace(key, result);
  return result;
}

template RangeOf<float> RangeMemo::of(const NodePtr<float>&, const Box&);
template RangeOf<Vec3f> RangeMemo::of(const NodePtr<Vec3f>&, const Box&);
template RangeOf<Mat3f> RangeMemo::of(const NodePtr<Mat3f>&, const Box&);
template class FieldNode<float>;
template class FieldNode<Vec3f>;
template class FieldNode<Mat3f>;
template NodePtr<float> restrictNode(const NodePtr<float>&, Restriction&);
template NodePtr<Vec3f> restrictNode(const NodePtr<Vec3f>&, Restriction&);
template NodePtr<Mat3f> restrictNode(const NodePtr<Mat3f>&, Restriction&);

}  // namespace nephele
