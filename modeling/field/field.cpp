// The handle of fields: cuts user data of any length into blocks, and copies them in and out of aligned
// lanes, so that a node sees full vectors always and a value does not depend on how many others were asked
// for with it.
#include "nephele/modeling/field/field.h"

#include <algorithm>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/constant_node.h"

namespace nephele {
namespace {

// Messages are made only when they are needed: evaluation must not allocate.
template <std::size_t N>
void requireLength(const std::array<std::span<float>, N>& lanes, std::size_t count, const char* what) {
  for (const auto& lane : lanes)
    if (lane.size() != count)
      throw Error(std::string("eval: ") + what + " have length " + std::to_string(lane.size()) +
                  ", but there are " + std::to_string(count) + " points");
}

void requireLength(const PointSpans& points) {
  if (points.y.size() != points.x.size() || points.z.size() != points.x.size())
    throw Error("eval: the spans x, y, z of the points have lengths " + std::to_string(points.x.size()) +
                ", " + std::to_string(points.y.size()) + ", " + std::to_string(points.z.size()) +
                ", which must be equal");
}

/// Calls body(block, first, count) for consecutive blocks of the points.
template <class Body>
void forBlocks(const PointSpans& points, Scratch& scratch, const Body& body) {
  for (std::size_t first = 0; first < points.size(); first += kBlockSize) {
    const int count = int(std::min<std::size_t>(kBlockSize, points.size() - first));
    Scratch::Frame frame(scratch);
    const BlockLanes<3> xyz = frame.lanes<3>();
    std::copy_n(points.x.data() + first, count, xyz[0]);
    std::copy_n(points.y.data() + first, count, xyz[1]);
    std::copy_n(points.z.data() + first, count, xyz[2]);
    body(scratch.pointBlock(xyz, count), first);
  }
}

template <std::size_t N>
void copyOut(const std::array<float*, N>& from, const std::array<std::span<float>, N>& to, std::size_t first,
             int count) {
  for (std::size_t i = 0; i < N; ++i) std::copy_n(from[i], count, to[i].data() + first);
}

}  // namespace

template <class T>
Field<T>::Field(const T& constant) : node_(std::make_shared<detail::ConstantNode<T>>(constant)) {}

template <class T>
Field<T>::Field(NodePtr<T> node) : node_(std::move(node)) {
  require(node_ != nullptr, "Field: the node must not be null");
}

template <class T>
void Field<T>::eval(const PointSpans& points, const Spans<kComponents<T>>& values) const {
  requireLength(points);
  requireLength(values.lanes, points.size(), "the values");
  Scratch& scratch = Scratch::local();
  Scratch::Frame frame(scratch);
  const auto out = frame.template lanes<kComponents<T>>();
  forBlocks(points, scratch, [&](const PointBlock& block, std::size_t first) {
    node_->eval(block, out, scratch);
    copyOut(out, values.lanes, first, block.count);
  });
}

template <class T>
void Field<T>::evalGrad(const PointSpans& points, const Spans<kComponents<T>>& values,
                        const Spans<3 * kComponents<T>>& grads) const {
  requireLength(points);
  requireLength(values.lanes, points.size(), "the values");
  requireLength(grads.lanes, points.size(), "the gradients");
  Scratch& scratch = Scratch::local();
  Scratch::Frame frame(scratch);
  const auto out = frame.template lanes<kComponents<T>>();
  const auto outGrads = frame.template lanes<3 * kComponents<T>>();
  forBlocks(points, scratch, [&](const PointBlock& block, std::size_t first) {
    node_->evalGrad(block, out, outGrads, scratch);
    copyOut(out, values.lanes, first, block.count);
    copyOut(outGrads, grads.lanes, first, block.count);
  });
}

template <class T>
T Field<T>::operator()(const Vec3f& point) const {
  Scratch& scratch = Scratch::local();
  Scratch::Frame frame(scratch);
  const BlockLanes<3> xyz = frame.lanes<3>();
  const auto out = frame.template lanes<kComponents<T>>();
  xyz[0][0] = point.x, xyz[1][0] = point.y, xyz[2][0] = point.z;
  node_->eval(scratch.pointBlock(xyz, 1), out, scratch);
  T result{};
  for (int c = 0; c < kComponents<T>; ++c) detail::component(result, c) = out[c][0];
  return result;
}

template <class T>
RangeOf<T> Field<T>::range(const Box& box) const {
  return RangeMemo().of(node_, box);
}

template <class T>
Field<T> Field<T>::restrictedTo(const Box& box) const {
  RestrictionMemo memo;
  Restriction restriction{box, memo};
  return Field(restrictNode(node_, restriction));
}

template class Field<float>;
template class Field<Vec3f>;
template class Field<Mat3f>;

}  // namespace nephele
