// Each layer is one node that answers a_i(y) N_i(y) w_i(y): it evaluates l_{i-1}, keeps the points of the
// block that lie in the band where the layer matters, moves those to the surface by guarded Newton steps, and
// reads noise, amplitude and billow there. Where the layer does not matter it answers 0.
//
// The node keeps the sign of the noise. The displacement |N| has creases, which a grid would blur at any
// affordable voxel size, while N itself is smooth: a sampled layer stores N w and takes the absolute value
// after interpolation.
//
// Source: Tessendorf, Resolution Independent Volumes, 3.3 and 3.4. The valley factor reads the displacement
// that the layer before left at y, the surface it made; its noise evaluated at y would clear other places
// than its valleys. Limits: where the medial axis outside the shape is nearer than the reach of the layers, y
// jumps, and so does the result; the bake in levelset/cloud/layers_on_grids.cpp smooths that, the procedural
// form does not.
#include "nephele/modeling/cloud/cumulo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/cloud/surface_point.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {

namespace {

using detail::kOuterShare;

/// What the valleys of a layer are cleared by: the displacement of the layer before, and its amplitude.
struct Before {
  NodePtr<float> displacement;
  NodePtr<float> amplitude;
};

class LayerNode final : public FieldNode<float> {
 public:
  LayerNode(const CumuloStep& step, const Before& before, const CumuloOptions& options)
      : surface_(step.surface.node()),
        level_(step.level.node()),
        noise_(step.layer->noise.node()),
        amplitude_(step.layer->amplitude.node()),
        billow_(step.layer->billow.node()),
        billowScale_(step.layer->billowScale.node()),
        before_(before),
        band_{-step.reach - kOuterShare * step.margin, step.margin},
        bound_(step.bound),
        noiseBound_(step.layer->noise.range(Box::everywhere()).magnitude()),
        amplitudeVaries_(!step.layer->amplitude.range(Box::everywhere()).isPoint()),
        growsEverywhere_(options.bake && step.layer->amplitude.range(Box::everywhere()).min > 0),
        startsFromLevel_(options.bake && surface_ == level_) {
    projection_.steps = options.newtonSteps;
    projection_.voxel = options.voxelSize;
    projection_.fallback = options.closestPoint;
  }

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    float* level = frame.lane();
    const BlockLanes<3> slope = frame.lanes<3>();
    if (startsFromLevel_)
      level_->evalGrad(points, {level}, slope, scratch);
    else
      level_->eval(points, {level}, scratch);

    const BlockLanes<3> start = frame.lanes<3>();
    float* startLevel = frame.lane();
    std::array<std::uint8_t, kBlockSize> origin;
    int count = 0;
    for (int i = 0; i < points.count; ++i) {
      values[0][i] = 0;
      if (!(level[i] >= band_.min && level[i] <= band_.max)) continue;
      start[0][count] = points.x[i];
      start[1][count] = points.y[i];
      start[2][count] = points.z[i];
      // In place: count <= i.
      startLevel[count] = level[i];
      if (startsFromLevel_)
        for (float* lane : slope) lane[count] = lane[i];
      origin[count++] = static_cast<std::uint8_t>(i);
    }
    if (count == 0) return;

    const detail::KnownStart known{startLevel, slope};
    const BlockLanes<3> end = frame.lanes<3>();
    float* residual = frame.lane();
    detail::projectToSurface(*surface_, scratch.pointBlock(start, count), end, residual, projection_, scratch,
                             startsFromLevel_ ? &known : nullptr);
    const PointBlock surfacePoints = scratch.pointBlock(end, count);

    float* noise = frame.lane();
    float* amplitude = frame.lane();
    noise_->eval(surfacePoints, {noise}, scratch);
    if (amplitudeVaries_)
      evalAmplitude(start, end, level, origin, surfacePoints, amplitude, scratch);
    else
      amplitude_->eval(surfacePoints, {amplitude}, scratch);
    for (int i = 0; i < count; ++i) noise[i] *= amplitude[i];
    if (before_.displacement) clearValleys(surfacePoints, noise, scratch);
    for (int i = 0; i < count; ++i) values[0][origin[i]] = noise[i];
  }

  Interval range(const Box& box, RangeMemo& memo) const override {
    const Interval level = memo.of(level_, box);
    if (level.max < band_.min || level.min > band_.max) return Interval::of(0);
    if (!amplitudeVaries_ || growsEverywhere_) return {-bound_, bound_};
    const float deepest = std::max(-std::max(level.min, band_.min), std::min(level.max, band_.max));
    const float most = memo.of(amplitude_, box.expanded(farthest(deepest))).max * noiseBound_;
    return most > 0 ? Interval{-std::min(most, bound_), std::min(most, bound_)} : Interval::of(0);
  }

  float differenceStep() const override { return *projection_.voxel; }

 private:
  /// Amplitudes are read no farther than this from a point at which the level is `level`. The surface is
  /// nearer but for places where Newton steps lose their way.
  float farthest(float level) const { return detail::farthestSurfacePoint(level, *projection_.voxel); }

  /// The amplitude at the surface points `end` of `start`. What lies beyond `farthest` is read on the way
  /// there, so that the range of a box follows from amplitudes near it.
  void evalAmplitude(const BlockLanes<3>& start, const BlockLanes<3>& end, const float* level,
                     const std::array<std::uint8_t, kBlockSize>& origin, const PointBlock& surfacePoints,
                     float* amplitude, Scratch& scratch) const {
    Scratch::Frame frame(scratch);
    const BlockLanes<3> nearer = frame.lanes<3>();
    bool isFar = false;
    for (int i = 0; i < surfacePoints.count; ++i) {
      const Vec3f from{start[0][i], start[1][i], start[2][i]}, to{end[0][i], end[1][i], end[2][i]};
      const float most = 0.999f * farthest(std::abs(level[origin[i]])), far = length(to - from);
      const Vec3f at = far > most ? from + (to - from) * (most / far) : to;
      isFar |= far > most;
      for (int a = 0; a < 3; ++a) nearer[a][i] = at[a];
    }
    amplitude_->eval(isFar ? scratch.pointBlock(nearer, surfacePoints.count) : surfacePoints, {amplitude},
                     scratch);
  }

  void clearValleys(const PointBlock& points, float* noise, Scratch& scratch) const {
    Scratch::Frame frame(scratch);
    float* height = frame.lane();
    float* full = frame.lane();
    float* billow = frame.lane();
    float* scale = frame.lane();
    billow_->eval(points, {billow}, scratch);
    billowScale_->eval(points, {scale}, scratch);
    before_.displacement->eval(points, {height}, scratch);
    before_.amplitude->eval(points, {full}, scratch);
    for (int i = 0; i < points.count; ++i) {
      // pow(0, 0) is 1 by the C standard, as the formula asks; a layer of amplitude 0 counts as valley
      // everywhere.
      const float h = std::abs(height[i]), q = scale[i] * full[i];
      const float share = h >= q ? (h > 0 ? 1.0f : 0.0f) : h / q;
      if (billow[i] == 1)
        noise[i] *= share;
      else
        noise[i] *= std::pow(share, std::max(billow[i], 0.0f));
    }
  }

  NodePtr<float> surface_, level_, noise_, amplitude_, billow_, billowScale_;
  Before before_;
  Interval band_;
  float bound_, noiseBound_;
  bool amplitudeVaries_;
  /// A bake only asks where the layer adds nothing: no need to search the amplitudes in every box.
  bool growsEverywhere_;
  /// Whether the level's gradient is worth asking for at once: most points that are sampled lie in the band.
  bool startsFromLevel_;
  SurfacePointOptions projection_;
};

}  // namespace

ScalarField cumulo(const ScalarField& base, const std::vector<CumuloLayer>& layers, CumuloOptions options) {
  require(options.voxelSize > 0 && std::isfinite(options.voxelSize),
          "cumulo: voxelSize must be > 0, got " + numberText(options.voxelSize));
  require(options.newtonSteps >= 1 && options.newtonSteps <= 64,
          "cumulo: newtonSteps must be 1 to 64, got " + std::to_string(options.newtonSteps));
  detail::requireSane(layers);

  ScalarField sum = memo(base), surface = sum, level = sum;
  Before before;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const CumuloLayer& layer = layers[i];
    if (layer.billow.range(Box::everywhere()) == Interval::of(0)) before = {};
    CumuloStep step;
    step.index = i;
    step.layer = &layer;
    step.before = sum;
    step.surface = surface;
    step.level = level;
    step.bound = detail::layerBound(layers, i);
    step.reach = options.reach ? options.reach(i) : displacementBound(layers, i);
    step.margin = options.margin ? options.margin(i) : 4 * options.voxelSize;
    step.displacement = ScalarField(std::make_shared<LayerNode>(step, before, options));
    options.closestPoint.reset();
    if (options.bake) {
      const CumuloSampled sampled = options.bake(step);
      before = {sampled.displacement.node(), layer.amplitude.node()};
      sum = sampled.sum;
      surface = sampled.surface;
      level = sampled.level;
    } else {
      before = {step.displacement.node(), layer.amplitude.node()};
      sum = memo(sum + abs(step.displacement));
      surface = level = sum;
    }
  }
  return sum;
}

}  // namespace nephele
