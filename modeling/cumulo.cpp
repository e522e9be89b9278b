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
// jumps, and so does the result; the bake in levelset/cumulo_grids.cpp smooths that, the procedural form does
// not.
#include "modeling/cumulo.h"

#include <array>
#include <cmath>
#include <random>
#include <string>

#include "modeling/error.h"
#include "modeling/field_ops.h"
#include "modeling/noise.h"
#include "modeling/surface_point.h"

namespace nephele {

namespace {

/// A layer's band needs less beyond its reach than inside, where the next sums still rise: 3 voxels to 4.
constexpr float kOuterShare = 0.75f;

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
        before_(before),
        billowScale_(step.layer->billowScale),
        band_{-step.reach - kOuterShare * step.margin, step.margin},
        bound_(step.bound) {
    projection_.steps = options.newtonSteps;
    projection_.voxel = options.voxelSize;
    if (step.index == 0) projection_.fallback = options.closestPoint;
  }

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    Scratch::Frame frame(scratch);
    float* level = frame.lane();
    level_->eval(points, {level}, scratch);

    const BlockLanes<3> start = frame.lanes<3>();
    std::array<std::uint8_t, kBlockSize> origin;
    int count = 0;
    for (int i = 0; i < points.count; ++i) {
      values[0][i] = 0;
      if (!(level[i] >= band_.min && level[i] <= band_.max)) continue;
      start[0][count] = points.x[i];
      start[1][count] = points.y[i];
      start[2][count] = points.z[i];
      origin[count++] = static_cast<std::uint8_t>(i);
    }
    if (count == 0) return;

    const BlockLanes<3> end = frame.lanes<3>();
    float* residual = frame.lane();
    detail::projectToSurface(*surface_, scratch.pointBlock(start, count), end, residual, projection_,
                             scratch);
    const PointBlock surfacePoints = scratch.pointBlock(end, count);

    float* noise = frame.lane();
    float* amplitude = frame.lane();
    noise_->eval(surfacePoints, {noise}, scratch);
    amplitude_->eval(surfacePoints, {amplitude}, scratch);
    for (int i = 0; i < count; ++i) noise[i] *= amplitude[i];
    if (before_.displacement) clearValleys(surfacePoints, noise, scratch);
    for (int i = 0; i < count; ++i) values[0][origin[i]] = noise[i];
  }

  Interval range(const Box& box) const override {
    const Interval level = level_->range(box);
    if (level.max < band_.min || level.min > band_.max) return Interval::of(0);
    return {-bound_, bound_};
  }

  float differenceStep() const override { return *projection_.voxel; }

 private:
  void clearValleys(const PointBlock& points, float* noise, Scratch& scratch) const {
    Scratch::Frame frame(scratch);
    float* height = frame.lane();
    float* full = frame.lane();
    float* billow = frame.lane();
    billow_->eval(points, {billow}, scratch);
    before_.displacement->eval(points, {height}, scratch);
    before_.amplitude->eval(points, {full}, scratch);
    for (int i = 0; i < points.count; ++i) {
      // pow(0, 0) is 1 by the C standard, as the formula asks; a layer of amplitude 0 counts as valley
      // everywhere.
      const float h = std::abs(height[i]), q = billowScale_ * full[i];
      const float share = h >= q ? (h > 0 ? 1.0f : 0.0f) : h / q;
      if (billow[i] == 1)
        noise[i] *= share;
      else
        noise[i] *= std::pow(share, billow[i]);
    }
  }

  NodePtr<float> surface_, level_, noise_, amplitude_, billow_;
  Before before_;
  float billowScale_;
  Interval band_;
  float bound_;
  SurfacePointOptions projection_;
};

float largest(const ScalarField& field, const char* what, std::size_t layer) {
  const float bound = field.range(Box::everywhere()).magnitude();
  require(std::isfinite(bound), "cumulo: the " + std::string(what) + " of layer " +
                                    std::to_string(layer + 1) + " has no finite range");
  return bound;
}

float layerBound(const CumuloLayer& layer, std::size_t index) {
  return largest(layer.amplitude, "amplitude", index) * largest(layer.noise, "noise", index);
}

void check(const CumuloLayer& layer, std::size_t index) {
  static_cast<void>(layerBound(layer, index));
  const std::string name = "cumulo: layer " + std::to_string(index + 1) + ": ";
  require(layer.billowScale > 0 && std::isfinite(layer.billowScale),
          name + "billowScale must be > 0, got " + std::to_string(layer.billowScale));
  require(layer.frequency > 0 && std::isfinite(layer.frequency),
          name + "frequency must be > 0, got " + std::to_string(layer.frequency));
  const float amplitude = layer.amplitude.range(Box::everywhere()).min;
  require(amplitude >= 0, name + "amplitude must be >= 0, got " + std::to_string(amplitude));
  const float billow = layer.billow.range(Box::everywhere()).min;
  require(billow >= 0, name + "billow must be >= 0, got " + std::to_string(billow));
}

}  // namespace

std::vector<CumuloLayer> cumuloLayers(const CumuloFractal& fractal) {
  require(fractal.layers >= 1 && fractal.layers <= kMaxCumuloLayers,
          "cumuloLayers: layers must be 1 to " + std::to_string(kMaxCumuloLayers) + ", got " +
              std::to_string(fractal.layers));
  require(fractal.frequency > 0 && std::isfinite(fractal.frequency),
          "cumuloLayers: frequency must be > 0, got " + std::to_string(fractal.frequency));
  require(fractal.lacunarity > 0 && std::isfinite(fractal.lacunarity),
          "cumuloLayers: lacunarity must be > 0, got " + std::to_string(fractal.lacunarity));
  std::vector<CumuloLayer> layers;
  CumuloLayer layer{.amplitude = fractal.amplitude,
                    .billow = fractal.billow,
                    .billowScale = fractal.billowScale,
                    .frequency = fractal.frequency};
  std::mt19937 seeds(fractal.seed);
  for (int i = 0; i < fractal.layers; ++i) {
    layer.noise = perlin({.frequency = layer.frequency, .seed = static_cast<std::uint32_t>(seeds())});
    check(layer, std::size_t(i));
    layers.push_back(layer);
    layer.amplitude = layer.amplitude * fractal.roughness;
    layer.frequency *= fractal.lacunarity;
  }
  return layers;
}

float displacementBound(const std::vector<CumuloLayer>& layers, std::size_t first) {
  float sum = 0;
  for (std::size_t i = first; i < layers.size(); ++i) sum += layerBound(layers[i], i);
  return sum;
}

ScalarField cumulo(const ScalarField& base, const std::vector<CumuloLayer>& layers,
                   const CumuloOptions& options) {
  require(options.voxelSize > 0 && std::isfinite(options.voxelSize),
          "cumulo: voxelSize must be > 0, got " + std::to_string(options.voxelSize));
  require(options.newtonSteps >= 1 && options.newtonSteps <= 64,
          "cumulo: newtonSteps must be 1 to 64, got " + std::to_string(options.newtonSteps));
  for (std::size_t i = 0; i < layers.size(); ++i) check(layers[i], i);

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
    step.bound = layerBound(layer, i);
    step.reach = displacementBound(layers, i);
    step.margin = options.margin ? options.margin(i) : 4 * options.voxelSize;
    step.displacement = ScalarField(std::make_shared<LayerNode>(step, before, options));
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
