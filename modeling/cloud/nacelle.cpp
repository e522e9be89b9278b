// The warp field between two level sets: at each point, a search along the gradient of the reference for the
// place where it has the object's value.
//
// Tessendorf, Resolution Independent Volumes, chapter 4. The listing there computes
// (-1 + sqrt(1 + 2 Delta Gamma)) / Gamma, which is 0/0 for every distance, divides by g.g wherever that
// vanishes, and takes steps of any length. nacelleStep has the same A without the cancellation, and bounds
// it; here a step is taken only if it brings the residual down by a tenth, or is halved.
//
// Each evaluation of the reference serves twice: it judges the step before and is the base of the next one.
// Points that are done leave the block. The Hessian is needed along the gradient only, so it is one
// difference of two gradients.
//
// Known limit: the iteration moves along gradients, so between distances it is closest-point projection; that
// tears at the medial axis of the reference, and turning or scaling the object is left to `start`.
#include "nephele/modeling/cloud/nacelle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {
namespace {

using Frame = Scratch::Frame;

constexpr float kFlat = 1e-4f;
constexpr float kEnough = 0.9f;
constexpr int kHalvings = 5;
constexpr int kMostSteps = 20;

/// Where a block's points are in their search.
struct Search {
  BlockLanes<3> x;     ///< The best iterate.
  BlockLanes<3> step;  ///< From there to the one that is being tried.
  float* residual;     ///< At the best iterate.
  float* target;       ///< What the reference should be.
  std::array<std::uint8_t, kBlockSize> halvings{}, steps{};
};

class NacelleNode final : public FieldNode<Vec3f> {
 public:
  NacelleNode(NodePtr<float> object, NodePtr<float> reference, NacelleOptions options)
      : object_(std::move(object)), reference_(std::move(reference)), options_(std::move(options)) {
    const ScalarField l(reference_);
    step_ = differenceStepOf(*reference_);
    voxel_ = options_.voxel.value_or(step_);
    if (!options_.bake) return;
    const VectorField g = memo(grad(l));
    gg_ = options_.bake(dot(g, g)).node();
    if (options_.order == 2) gMg_ = options_.bake(dot(g, grad(grad(l)) * g)).node();
  }

  void eval(const PointBlock& points, const BlockLanes<3>& values, Scratch& scratch) const override {
    Frame frame(scratch);
    solve(points, values, frame.lane(), {}, nullptr, scratch);
  }
  float differenceStep() const override {
    return std::min(step_, std::min(object_->differenceStep(),
                                    options_.start ? options_.start->node()->differenceStep() : kNoLength));
  }
  float voxel() const { return voxel_; }

  /// Writes X and |object - reference(X)|. `history`, if there is one, has steps + 1 arrays for the residuals
  /// of the iterations, `failed` a flag for each point that took the fallback or would have.
  void solve(const PointBlock& points, const BlockLanes<3>& values, float* residual,
             const std::vector<float*>& history, std::uint8_t* failed, Scratch& scratch) const {
    Frame frame(scratch);
    Search search{values, frame.lanes<3>(), residual, frame.lane(), {}, {}};
    object_->eval(points, {search.target}, scratch);
    for (int i = 0; i < points.count; ++i)
      search.target[i] = std::min(std::max(search.target[i], options_.band.min), options_.band.max);
    if (options_.start) {
      options_.start->node()->eval(points, values, scratch);
    } else {
      std::copy_n(points.x, points.count, values[0]);
      std::copy_n(points.y, points.count, values[1]);
      std::copy_n(points.z, points.count, values[2]);
    }
    const BlockLanes<3> first = frame.lanes<3>();
    for (std::size_t c = 0; c < 3; ++c) std::copy_n(values[c], points.count, first[c]);
    iterate(points.count, search, history, scratch);

    std::array<int, kBlockSize> which;
    int count = 0;
    for (int i = 0; i < points.count; ++i) {
      const bool poor = !(residual[i] <= options_.fallbackVoxels * voxel_);
      if (failed) failed[i] = poor;
      if (poor) which[std::size_t(count++)] = i;
    }
    if (count > 0 && options_.closestPoint) fallBack(which, count, first, search, scratch);
  }

 private:
  void iterate(int pointCount, Search& search, const std::vector<float*>& history, Scratch& scratch) const {
    Frame frame(scratch);
    const BlockLanes<3> trial = frame.lanes<3>(), g = frame.lanes<3>();
    float *const value = frame.lane(), *const gg = frame.lane(), *const gMg = frame.lane();
    std::array<int, kBlockSize> active;
    for (int i = 0; i < pointCount; ++i) {
      active[std::size_t(i)] = i;
      for (std::size_t c = 0; c < 3; ++c) trial[c][i] = search.x[c][i];
    }
    const float tolerance = options_.toleranceVoxels * voxel_;
    bool isFirst = true;
    for (int count = pointCount; count > 0; isFirst = false) {
      const PointBlock block = scratch.pointBlock(trial, count);
      reference_->evalGrad(block, {value}, g, scratch);
      curvature(block, g, gg, gMg, scratch);
      int next = 0;
      for (int k = 0; k < count; ++k) {
        const int i = active[std::size_t(k)];
        const float r = search.target[i] - value[k], size = std::fabs(r);
        const std::size_t at = std::size_t(i);
        const bool accepted = isFirst || (std::isfinite(size) && size <= kEnough * search.residual[i]);
        bool goesOn = true;
        if (accepted || (search.halvings[at] == kHalvings && size < search.residual[i])) {
          if (!isFirst) {
            for (std::size_t c = 0; c < 3; ++c) search.x[c][i] = trial[c][k];
            ++search.steps[at];
          }
          search.residual[i] = size;
          search.halvings[at] = 0;
          record(history, i, search.steps[at], size);
          goesOn = accepted && size > tolerance && search.steps[at] < options_.steps && gg[k] >= kFlat;
          if (goesOn) {
            const float a = nacelleStep(r, gg[k], gMg[k]);
            for (std::size_t c = 0; c < 3; ++c) search.step[c][i] = a * g[c][k];
          }
        } else if (search.halvings[at]++ < kHalvings) {
          for (std::size_t c = 0; c < 3; ++c) search.step[c][i] *= 0.5f;
        } else {
          goesOn = false;
        }
        if (!goesOn) continue;
        // In place: next <= k.
        for (std::size_t c = 0; c < 3; ++c) trial[c][next] = search.x[c][i] + search.step[c][i];
        active[std::size_t(next++)] = i;
      }
      count = next;
    }
  }

  /// g.g and, for order 2, g.M.g at the points where `g` was evaluated.
  void curvature(const PointBlock& block, const BlockLanes<3>& g, float* gg, float* gMg,
                 Scratch& scratch) const {
    if (gg_) {
      gg_->eval(block, {gg}, scratch);
    } else {
      for (int k = 0; k < block.count; ++k) gg[k] = g[0][k] * g[0][k] + g[1][k] * g[1][k] + g[2][k] * g[2][k];
    }
    if (options_.order == 1) {
      std::fill_n(gMg, block.count, 0.0f);
      return;
    }
    if (gMg_) {
      gMg_->eval(block, {gMg}, scratch);
      return;
    }
    Frame frame(scratch);
    const BlockLanes<3> near = frame.lanes<3>(), above = frame.lanes<3>(), below = frame.lanes<3>();
    float *const value = frame.lane(), *const along = frame.lane();
    for (int k = 0; k < block.count; ++k) {
      const float reach =
          std::max({std::fabs(block.x[k]), std::fabs(block.y[k]), std::fabs(block.z[k])}) * 1e-4f;
      along[k] = gg[k] > kFlat ? std::max(step_, reach) / std::sqrt(gg[k]) : 0.0f;
    }
    const float* const from[3] = {block.x, block.y, block.z};
    for (const float sign : {1.0f, -1.0f}) {
      for (std::size_t c = 0; c < 3; ++c)
        for (int k = 0; k < block.count; ++k) near[c][k] = from[c][k] + sign * along[k] * g[c][k];
      reference_->evalGrad(scratch.pointBlock(near, block.count), {value}, sign > 0 ? above : below, scratch);
    }
    for (int k = 0; k < block.count; ++k) {
      float sum = 0;
      for (std::size_t c = 0; c < 3; ++c) sum += g[c][k] * (above[c][k] - below[c][k]);
      gMg[k] = along[k] > 0 ? sum / (2 * along[k]) : 0.0f;
      if (!std::isfinite(gMg[k])) gMg[k] = 0.0f;
    }
  }

  void record(const std::vector<float*>& history, int i, int step, float residual) const {
    for (std::size_t s = std::size_t(step); s < history.size(); ++s) history[s][i] = residual;
  }

  /// X = c + object(x) n for `count` points listed in `which`; kept where that has the smaller residual.
  void fallBack(const std::array<int, kBlockSize>& which, int count, const BlockLanes<3>& first,
                Search& search, Scratch& scratch) const {
    Frame frame(scratch);
    const BlockLanes<3> from = frame.lanes<3>(), to = frame.lanes<3>(), g = frame.lanes<3>();
    float* const value = frame.lane();
    for (int k = 0; k < count; ++k)
      for (std::size_t c = 0; c < 3; ++c) from[c][k] = first[c][which[std::size_t(k)]];
    options_.closestPoint->node()->eval(scratch.pointBlock(from, count), to, scratch);
    reference_->evalGrad(scratch.pointBlock(to, count), {value}, g, scratch);
    for (int k = 0; k < count; ++k) {
      const float size = std::sqrt(g[0][k] * g[0][k] + g[1][k] * g[1][k] + g[2][k] * g[2][k]);
      const float way = size > 0 ? search.target[which[std::size_t(k)]] / size : 0.0f;
      for (std::size_t c = 0; c < 3; ++c) to[c][k] += way * g[c][k];
    }
    reference_->eval(scratch.pointBlock(to, count), {value}, scratch);
    for (int k = 0; k < count; ++k) {
      const int i = which[std::size_t(k)];
      const float size = std::fabs(search.target[i] - value[k]);
      if (!isFinite(Vec3f{to[0][k], to[1][k], to[2][k]})) continue;
      if (!(size < search.residual[i]) && std::isfinite(search.residual[i])) continue;
      for (std::size_t c = 0; c < 3; ++c) search.x[c][i] = to[c][k];
      search.residual[i] = size;
    }
  }

  NodePtr<float> object_, reference_, gg_, gMg_;
  NacelleOptions options_;
  float step_ = kDefaultStep, voxel_ = kDefaultStep;
};

std::shared_ptr<const NacelleNode> nacelleNode(const ScalarField& object, const ScalarField& reference,
                                               const NacelleOptions& options) {
  const auto refuse = [](const char* what, const std::string& allowed, double value) {
    return std::string("nacelle: ") + what + " must be " + allowed + ", got " + numberText(value);
  };
  require(options.steps >= 1 && options.steps <= kMostSteps,
          refuse("steps", "1 to " + std::to_string(kMostSteps), options.steps));
  require(options.order == 1 || options.order == 2, refuse("order", "1 or 2", options.order));
  require(!options.voxel || (*options.voxel > 0 && std::isfinite(*options.voxel)),
          refuse("voxel", "> 0 and finite", double(options.voxel.value_or(0))));
  require(options.toleranceVoxels >= 0, refuse("toleranceVoxels", ">= 0", double(options.toleranceVoxels)));
  require(options.fallbackVoxels >= 0, refuse("fallbackVoxels", ">= 0", double(options.fallbackVoxels)));
  require(options.band.min <= options.band.max, "nacelle: band must not be empty");
  return std::make_shared<NacelleNode>(object.node(), reference.node(), options);
}

}  // namespace

VectorField nacelle(const ScalarField& object, const ScalarField& reference, const NacelleOptions& options) {
  return VectorField(nacelleNode(object, reference, options));
}

WarpResidual residualOf(std::vector<float>& values) {
  if (values.empty()) return {};
  for (float& v : values) v = std::isnan(v) ? std::numeric_limits<float>::infinity() : std::fabs(v);
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return double(values[std::min(values.size() - 1, std::size_t(share * double(values.size())))]);
  };
  return {at(0.5), at(0.95), at(0.99), double(values.back())};
}

NacelleStatistics nacelleAt(const ScalarField& object, const ScalarField& reference, const PointSpans& points,
                            const Spans<3>& images, const NacelleOptions& options) {
  const std::size_t count = points.size();
  require(points.y.size() == count && points.z.size() == count && images.lanes[0].size() == count &&
              images.lanes[1].size() == count && images.lanes[2].size() == count,
          "nacelle: all spans of points and images must have one length");
  const auto node = nacelleNode(object, reference, options);
  std::vector<std::vector<float>> history(std::size_t(options.steps) + 1, std::vector<float>(count));
  std::vector<float> residual(count);
  std::vector<std::uint8_t> failed(count);
  parallelFor(count, kBlockSize, [&](std::size_t begin, std::size_t end) {
    Scratch& scratch = Scratch::local();
    Frame frame(scratch);
    const BlockLanes<3> x = frame.lanes<3>(), to = frame.lanes<3>();
    float* const rest = frame.lane();
    for (; begin < end; begin += kBlockSize) {
      const auto n = std::min(end - begin, std::size_t(kBlockSize));
      std::copy_n(points.x.data() + begin, n, x[0]);
      std::copy_n(points.y.data() + begin, n, x[1]);
      std::copy_n(points.z.data() + begin, n, x[2]);
      std::vector<float*> rows;
      for (std::vector<float>& row : history) rows.push_back(row.data() + begin);
      node->solve(scratch.pointBlock(x, int(n)), to, rest, rows, failed.data() + begin, scratch);
      for (std::size_t c = 0; c < 3; ++c) std::copy_n(to[c], n, images.lanes[c].data() + begin);
      std::copy_n(rest, n, residual.data() + begin);
    }
  });
  NacelleStatistics result;
  const auto inVoxels = [&](std::vector<float>& values) {
    for (float& v : values) v /= node->voxel();
    return residualOf(values);
  };
  for (std::vector<float>& row : history) result.iterations.push_back(inVoxels(row));
  result.result = inVoxels(residual);
  std::size_t poor = 0;
  for (const std::uint8_t f : failed) poor += f;
  result.unconvergedFraction = count > 0 ? double(poor) / double(count) : 0.0;
  return result;
}

}  // namespace nephele
