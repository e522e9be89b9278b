// The point of a level set's surface that belongs to a point of space: Newton steps along the gradient,
// guarded.
//
// Tessendorf, Resolution Independent Volumes, equation 3.3, steps by l along the unit gradient, which is
// right where |grad l| = 1 and oscillates where displacement has made the gradient longer. Here s = -l g /
// max(|g|^2, 1/4): a Newton step on long gradients, a bounded one on short ones. The divisor also bounds the
// step: |s| = |l| |g| / max(|g|^2, 1/4) is at most 2 |l|, reached at |g| = 1/2, so no further clip is needed.
//
// Points that are done leave the block: the active ones are packed together before each step, so the cost
// follows the number of steps that points really need. Across a medial axis of the surface the result jumps.
#include "nephele/modeling/cloud/surface_point.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele {
namespace {

using Frame = Scratch::Frame;

constexpr float kFlat = 1e-4f;
constexpr float kShortest = 0.25f;

class SurfacePointNode final : public FieldNode<Vec3f> {
 public:
  SurfacePointNode(NodePtr<float> l, SurfacePointOptions options)
      : l_(std::move(l)), options_(std::move(options)) {}

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    detail::projectToSurface(*l_, points, values, frame.lane(), options_, scratch);
  }
  float differenceStep() const override { return l_->differenceStep(); }

 private:
  NodePtr<float> l_;
  SurfacePointOptions options_;
};

/// Replaces the results of `count` points, listed in `which`, by the fallback at those points.
void useFallback(const FieldNode<float>& l, const FieldNode<Vec3f>& fallback, const PointBlock& points,
                 const std::array<int, kBlockSize>& which, int count, const BlockLanes<3>& y, float* residual,
                 Scratch& scratch) {
  Frame frame(scratch);
  const BlockLanes<3> from = frame.lanes<3>(), to = frame.lanes<3>();
  float* const f = frame.lane();
  for (int i = 0; i < count; ++i) {
    from[0][i] = points.x[which[i]];
    from[1][i] = points.y[which[i]];
    from[2][i] = points.z[which[i]];
  }
  fallback.eval(scratch.pointBlock(from, count), to, scratch);
  l.eval(scratch.pointBlock(to, count), {f}, scratch);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) y[k][which[i]] = to[k][i];
    residual[which[i]] = f[i];
  }
}

}  // namespace

namespace detail {

void projectToSurface(const FieldNode<float>& l, const PointBlock& points, const BlockLanes<3>& y,
                      float* residual, const SurfacePointOptions& options, Scratch& scratch,
                      const KnownStart* start) {
  Frame frame(scratch);
  const float tolerance = options.toleranceVoxels * options.voxel.value_or(differenceStepOf(l));
  const BlockLanes<3> x = frame.lanes<3>(), slopes = frame.lanes<3>();
  float* const level = frame.lane();

  std::array<int, kBlockSize> active;
  std::array<int, kBlockSize> flat;
  int activeCount = points.count, flatCount = 0;
  for (int i = 0; i < activeCount; ++i) active[i] = i;

  PointBlock block = points;
  for (int step = 0; activeCount > 0; ++step) {
    const bool last = step == options.steps;
    const bool known = step == 0 && start;
    const float* f = known ? start->values : level;
    const BlockLanes<3>& g = known ? start->grads : slopes;
    if (last && !known)
      l.eval(block, {level}, scratch);
    else if (!known)
      l.evalGrad(block, {level}, slopes, scratch);

    int next = 0;
    for (int i = 0; i < activeCount; ++i) {
      const int at = active[i];
      const float value = f[i], size = std::fabs(value);
      const float px = block.x[i], py = block.y[i], pz = block.z[i];
      if (step == 0 || size < std::fabs(residual[at])) {
        y[0][at] = px;
        y[1][at] = py;
        y[2][at] = pz;
        residual[at] = value;
      }
      if (last || size < tolerance) continue;
      const float gg = g[0][i] * g[0][i] + g[1][i] * g[1][i] + g[2][i] * g[2][i];
      if (!(gg >= kFlat)) {
        flat[flatCount++] = at;
        continue;
      }
      const float s = -value / std::max(gg, kShortest);
      // In place: next <= i, and block reads either the caller's points or these lanes.
      x[0][next] = px + s * g[0][i];
      x[1][next] = py + s * g[1][i];
      x[2][next] = pz + s * g[2][i];
      active[next++] = at;
    }
    activeCount = next;
    block = scratch.pointBlock(x, activeCount);
  }
  if (flatCount > 0 && options.fallback)
    useFallback(l, *options.fallback->node(), points, flat, flatCount, y, residual, scratch);
}

}  // namespace detail

VectorField surfacePoint(const ScalarField& l, const SurfacePointOptions& options) {
  require(options.steps >= 0, "surfacePoint: steps must be >= 0, got " + std::to_string(options.steps));
  require(!options.voxel || (*options.voxel > 0 && std::isfinite(*options.voxel)),
          "surfacePoint: voxel must be > 0 and finite, got " + numberText(options.voxel.value_or(0)));
  require(options.toleranceVoxels >= 0,
          "surfacePoint: toleranceVoxels must be >= 0, got " + numberText(options.toleranceVoxels));
  return VectorField(std::make_shared<SurfacePointNode>(l.node(), options));
}

}  // namespace nephele
