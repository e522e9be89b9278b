// What a field does that does not say otherwise: central differences, any value, no simplification.
#include "nephele/modeling/field/field_node.h"

#include <algorithm>
#include <cmath>

namespace nephele {

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
RangeOf<T> FieldNode<T>::range(const Box&) const {
  return {};
}

template <class T>
NodePtr<T> FieldNode<T>::restricted(Restriction&) const {
  return nullptr;
}

template <class T>
NodePtr<T> restrictNode(const NodePtr<T>& node, Restriction& restriction) {
  const auto found = restriction.done.find(node.get());
  if (found != restriction.done.end()) return std::static_pointer_cast<const FieldNode<T>>(found->second);
  NodePtr<T> result = node->restricted(restriction);
  if (!result) result = node;
  restriction.done.emplace(node.get(), result);
  return result;
}

template class FieldNode<float>;
template class FieldNode<Vec3f>;
template class FieldNode<Mat3f>;
template NodePtr<float> restrictNode(const NodePtr<float>&, Restriction&);
template NodePtr<Vec3f> restrictNode(const NodePtr<Vec3f>&, Restriction&);
template NodePtr<Mat3f> restrictNode(const NodePtr<Mat3f>&, Restriction&);

}  // namespace nephele
