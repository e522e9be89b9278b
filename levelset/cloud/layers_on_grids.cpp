// A layer is baked twice: its signed displacement, at 1/16 of its shortest wave, and the sum so far, as the
// next layer finds its surface points on. Both are interpolated with Catmull-Rom cubics, whose exact gradient
// is continuous and whose error at that rate is a few ten-thousandths of the amplitude; trilinear
// interpolation would need four times as many samples per axis for that.
//
// The result is never read from a sum that was sampled: it adds the base, in its full detail, and each
// layer's own grid. Only surface points come from the sampled sums, where an error moves a bump along the
// surface, not the surface.
//
// Source: Tessendorf, Resolution Independent Volumes, 3.3.3, "Selectively sampling the levelset into grids".
// Limits: base features thinner than two voxels of a layer's grid are not seen by the layers after it.
#include "nephele/levelset/cloud/layers_on_grids.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <deque>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "nephele/levelset/cloud/detail/layer_fields.h"
#include "nephele/levelset/cloud/detail/layer_parts.h"
#include "nephele/levelset/cloud/kept_layers.h"
#include "nephele/levelset/cloud/medial_smoothing.h"
#include "nephele/levelset/cloud/renormalise.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/brick_memo.h"
#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/cloud/surface_point.h"
#include "nephele/modeling/field/operations.h"

namespace nephele {

namespace {

using detail::BrickSamples;
using detail::BrickSlab;
using detail::kLeastDilation;
using detail::kMarginVoxels;
using detail::kWholePositions;
using detail::LayerPart;
using detail::LayerParts;
using detail::Packing;

/// Samples per wave of the finest noise: the most of layers that others build on, and of the last one, and
/// the fewest.
constexpr float kSamplesPerWave = 16;
constexpr float kSamplesPerLastWave = 12;
constexpr float kFewestSamplesPerWave = 6;
/// Where the result has fewer voxels to the last wave, so have the layers before it, which are still off by
/// less.
constexpr float kMoreSamples = 1.5f;
/// Largest slope of Perlin noise, in units of its bound times its frequency.
constexpr float kLargestSlope = 3.2f;
/// How far the sampled sum may be off at a crease, in voxels of its grid.
constexpr float kEstimateErrorVoxels = 1.0f;
/// A surface point counts as found within this many voxels.
constexpr float kFoundVoxels = 0.1f;
/// Bricks of a part in which surface points are searched for once more, to count those that were not found,
/// and of how many samples there one is. Misses come in clusters: few samples of many bricks count better.
constexpr std::size_t kSearchedBricks = 512;
constexpr std::size_t kSearchedShare = 4;
/// Of a layer's time, the rest being spent on the sum for the next one.
constexpr double kShareOfBake = 0.85;

/// Width kept on either side of the band of a layer. Displacement ends at three quarters of it.
float marginOf(const std::vector<CumuloLayer>& layers, std::size_t index, const CumuloGridOptions& options) {
  const float voxel = cumuloVoxelSize(layers, index, options.voxelSize);
  return std::max(kMarginVoxels * voxel, options.edge * 4 / 3 + voxel);
}

/// Of the displacement of a layer, where it does not jump.
float largestSlope(const CumuloStep& step) {
  const CumuloLayer& layer = *step.layer;
  if (layer.steepest) return *layer.steepest * layer.amplitude.range(Box::everywhere()).max;
  return kLargestSlope * step.bound * layer.frequency;
}

float coarsestVoxel(const std::vector<CumuloLayer>& layers, float voxelSize) {
  float coarsest = voxelSize;
  for (std::size_t i = 0; i < layers.size(); ++i)
    coarsest = std::max(coarsest, cumuloVoxelSize(layers, i, voxelSize));
  return coarsest;
}

class LayerSampler {
 public:
  LayerSampler(const std::vector<CumuloLayer>& layers, const CumuloGridOptions& options,
               const Progress& progress)
      : layers_(layers),
        options_(options),
        progress_(progress),
        keptCount_(options.kept ? KeptLayers::count(layers, options.box, options.voxelSize) : 0),
        reach_(reachOf(0)) {}

  /// Of a layer and those after it.
  float reachOf(std::size_t index) const {
    return KeptLayers::reach(layers_, index, options_.voxelSize, keptCount_);
  }

  CumuloSampled operator()(const CumuloStep& step) {
    const bool isKept = step.index < keptCount_;
    if (isKept)
      if (const KeptLayers::Layer* kept = options_.kept->find(step, layers_, numbersOf(step))) {
        level_ = kept->level;
        reports.push_back(kept->report);
        return sampledOf(step, *kept);
      }
    const auto start = std::chrono::steady_clock::now();
    progress_.begin("layer " + std::to_string(step.index + 1));
    const float voxel = cumuloVoxelSize(layers_, step.index, options_.voxelSize);
    KeptLayers::Layer layer{.displacement = bakeLayer(step, voxel)};
    if (step.index + 1 < layers_.size())
      prepareNext(step, layer);
    else
      prepareEstimate(step, layer.displacement);
    reports.back().seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    progress_.count("active_voxels", double(reports.back().activeVoxels));
    const CumuloSampled sampled = sampledOf(step, layer);
    if (isKept) {
      layer.report = reports.back();
      options_.kept->keep(std::move(layer));
    }
    return sampled;
  }

  std::vector<CumuloLayerReport> reports;
  ScalarField estimate{0.0f};
  float estimateVoxelSize = 0;

 private:
  /// All numbers that the result of a step depends on.
  std::string numbersOf(const CumuloStep& step) const {
    return fmt::format("{} {} {} {} {} {} {} {}", cumuloVoxelSize(layers_, step.index, options_.voxelSize),
                       options_.voxelSize, step.bound, step.reach, step.margin,
                       marginOf(layers_, step.index + 1, options_), options_.newtonSteps,
                       options_.medialSmoothing) +
           fmt::format(" {}", int(options_.renormalise));
  }

  static CumuloSampled sampledOf(const CumuloStep& step, const KeptLayers::Layer& layer) {
    const ScalarField displacement = gridField(layer.displacement, Interpolation::tricubic);
    if (layer.renormalised)
      return {displacement, *layer.renormalised, *layer.renormalised, *layer.renormalised};
    CumuloSampled sampled{displacement, step.before + abs(displacement), 0.0f, 0.0f};
    if (!layer.level) return sampled;
    // At the grid's own voxels trilinear interpolation gives the samples.
    sampled.level = gridField(layer.level);
    sampled.surface = gridField(layer.level, Interpolation::tricubic);
    return sampled;
  }

  /// The layer's grid, packed. A large one is made in parts along z, since samples take more memory until
  /// they are packed. A part is smoothed together with as much of its neighbours as can reach it: the parts
  /// do not show.
  std::shared_ptr<PackedGrid> bakeLayer(const CumuloStep& step, float voxel) {
    const Box box = options_.box.expanded(reach_ + step.margin);
    const MedialSmoothingOptions smoothing{.jump = largestSlope(step) * voxel, .dilation = dilation(voxel)};
    const LayerParts cut = detail::partsOf(box, voxel, smoothing.dilation + smoothing.steps);
    const std::shared_ptr<PackedGrid> layer = detail::emptyPackedGrid(detail::noSamples(box, voxel, cut.all));
    const std::span<const CumuloLayer> after = std::span(layers_).subspan(step.index);
    const bool areLaterAsked = step.index >= keptCount_ || KeptLayers::areLaterAsked(after);
    const ScalarField needed =
        areLaterAsked
            ? detail::neededDisplacement(step, after, 0, options_.voxelSize)
            : detail::neededDisplacement(step, after.first(1), step.reach - step.bound, options_.voxelSize);
    const int count = cut.count();
    std::deque<LayerPart> parts;
    const auto bakePart = [&](int part) {
      const SubProgress share(progress_, kShareOfBake * part / count, kShareOfBake * (part + 1) / count);
      parts.push_back({cut[part], bakeSlab(needed, cut[part], box, voxel, share)});
    };
    // The only part, or a part with what is around it.
    const auto takeWindow = [&](int part) {
      if (count > 1) return detail::windowOf(parts, cut.around(part), box, voxel);
      BrickSamples all = std::move(parts[0].samples);
      all.separate();
      return all;
    };
    Count total;
    bakePart(0);
    for (int part = 0; part < count; ++part) {
      if (part + 1 < count) bakePart(part + 1);
      BrickSamples window = takeWindow(part);
      const double done = kShareOfBake * std::min(part + 2, count) / count;
      MedialSmoothing smooth{0, std::vector<bool>(window.pool.size())};
      if (step.bound > 0) smooth = smoothMedialJumps(window, smoothing, SubProgress(progress_, done, done));
      std::vector<Packing> packing = judged(step, window, cut[part], total);
      for (std::size_t b = 0; b < packing.size(); ++b)
        if (packing[b] == Packing::whole && smooth.signless[b]) packing[b] = Packing::absolute;
      detail::appendPacked(*layer, std::move(window), packing);
      // The next window needs this part and all of the next one.
      if (part > 0) parts.pop_front();
      detail::releaseFreed();
    }
    report(step, total, voxel);
    return layer;
  }

  /// The samples of the bricks of a slab.
  BrickSamples bakeSlab(const ScalarField& displacement, const BrickSlab& slab, const Box& box, float voxel,
                        const Progress& progress) const {
    // All that interpolation in the slab's bricks reads, so that bricks are kept or dropped as in one piece.
    const float first = float(slab.begin * BrickGrid::kBrick - BrickGrid::kBefore) + 0.5f;
    const float last = float(slab.end * BrickGrid::kBrick - 1 + BrickGrid::kAfter) - 0.5f;
    const Box around{{box.min.x, box.min.y, first * voxel}, {box.max.x, box.max.y, last * voxel}};
    const Box inside = box.intersection(around);
    if (inside.isEmpty()) return detail::noSamples(box, voxel, slab);
    return detail::bakeSamples(displacement,
                               {.voxelSize = voxel, .box = inside, .interpolation = Interpolation::tricubic},
                               progress);
  }

  int dilation(float voxel) const {
    if (options_.medialSmoothing == 0) return 0;
    const float voxels = float(options_.medialSmoothing) * options_.voxelSize / voxel;
    return std::max(kLeastDilation, int(std::ceil(voxels)));
  }

  /// After the last layer the estimate of the result.
  void prepareEstimate(const CumuloStep& step, const std::shared_ptr<PackedGrid>& grid) {
    estimate = (level_ ? withRangesOf(*level_, step.before) : step.before) + abs(gridField(grid));
    estimateVoxelSize = grid->voxelSize();
  }

  /// l_i for the next layer to find its surface points on.
  void prepareNext(const CumuloStep& step, KeptLayers::Layer& layer) {
    const float voxel = layer.displacement->voxelSize();
    const float margin = marginOf(layers_, step.index + 1, options_);
    const float further = step.reach - step.bound;
    BakeOptions spec{.voxelSize = voxel,
                     .box = options_.box.expanded(reach_ + margin),
                     .band = {-further - margin - voxel, margin + voxel},
                     .interpolation = Interpolation::tricubic};
    if (options_.renormalise != CumuloGridOptions::Renormalise::off) {
      const bool exact = options_.renormalise == CumuloGridOptions::Renormalise::rebuild;
      const DistanceBand band{.exterior = further + 2 * margin, .interior = 2 * margin};
      spec.voxelSize = std::max(options_.voxelSize, voxel / 2);
      const ScalarField sum = step.before + abs(gridField(layer.displacement, Interpolation::tricubic));
      layer.renormalised =
          exact ? rebuiltDistance(sum, spec, band, progress_) : sweptDistance(sum, spec, band, progress_);
      return;
    }
    const ScalarField level = detail::grownLevel(step.before, step.level, gridField(layer.displacement));
    level_ = detail::packed(detail::bakeSamples(level, spec, SubProgress(progress_, kShareOfBake, 1)));
    layer.level = level_;
  }

  /// The samples of one brick. Where the displacement is 0 the layer was not evaluated.
  struct Samples {
    std::array<float, kBrickSamples> x, y, z, displacement;

    Samples(const BrickSamples& samples, const PlacedBrick& brick) {
      const float* own = samples.pool[std::size_t(brick.pool)];
      for (int s = 0; s < kBrickSamples; ++s) {
        const Vec3i at{s & 7, s >> 3 & 7, s >> 6};
        const Vec3f p = Vec3f(brick.brick * BrickGrid::kBrick + at) * samples.voxelSize;
        x[std::size_t(s)] = p.x;
        y[std::size_t(s)] = p.y;
        z[std::size_t(s)] = p.z;
        displacement[std::size_t(s)] = std::abs(own[s]);
      }
    }
    PointSpans points() const { return {x, y, z}; }
    /// Moves the samples at which the layer was evaluated to the front and returns their number.
    std::size_t keepEvaluated() {
      std::size_t count = 0;
      for (std::size_t i = 0; i < kBrickSamples; ++i) {
        if (displacement[i] == 0) continue;
        x[count] = x[i];
        y[count] = y[i];
        z[count] = z[i];
        displacement[count++] = displacement[i];
      }
      return count;
    }
  };

  /// What bricks add to the report. Kept per brick and added up in order, so that threads do not show.
  struct Count {
    double displacement = 0;
    std::uint64_t active = 0, near = 0, searched = 0, missed = 0;

    Count& operator+=(const Count& other) {
      displacement += other.displacement;
      active += other.active;
      near += other.near;
      searched += other.searched;
      missed += other.missed;
      return *this;
    }
  };

  /// Adds what the part of a layer inside `slab` comes to, and leaves out the bricks that do not matter:
  /// keeps those whose sums are such that the layers after this one can bring them to the surface, and those
  /// that interpolation around such samples reads.
  std::vector<Packing> judged(const CumuloStep& step, const BrickSamples& part, const BrickSlab& slab,
                              Count& total) const {
    std::vector<PlacedBrick> bricks = part.placed;
    const BrickSlab beside{slab.begin - 1, slab.end + 1};
    std::erase_if(bricks, [&](const PlacedBrick& b) { return !beside.contains(b.brick.z); });
    const std::size_t stride = std::max<std::size_t>(1, bricks.size() / kSearchedBricks);
    const VectorField foot =
        surfacePoint(step.surface, {.steps = options_.newtonSteps, .voxel = options_.voxelSize});
    const float least = step.bound - step.reach - step.margin;
    std::vector<Count> counts(bricks.size());
    std::vector<std::uint32_t> sides(bricks.size());
    parallelFor(bricks.size(), 16, [&](std::size_t begin, std::size_t end) {
      std::array<float, kBrickSamples> level;
      for (std::size_t b = begin; b < end; ++b) {
        // Wholly outside the band.
        if (part.ranges[std::size_t(bricks[b].pool)] == Interval::of(0)) continue;
        Samples samples(part, bricks[b]);
        // All of a brick, though not all matter: in blocks that are known from the bake.
        step.level.eval(samples.points(), std::span<float>(level));
        for (std::size_t i = 0; i < kBrickSamples; ++i) {
          if (samples.displacement[i] == 0) continue;
          ++counts[b].active;
          if (level[i] + samples.displacement[i] >= least) sides[b] |= detail::neighboursReadAround(int(i));
          if (!(std::abs(level[i]) <= part.voxelSize)) continue;
          counts[b].displacement += samples.displacement[i];
          ++counts[b].near;
        }
        if (b % stride == 0) countMissed(step, foot, samples, counts[b]);
      }
    });
    std::vector<Packing> result(part.pool.size(), Packing::leaveOut);
    for (std::size_t b = 0; b < bricks.size(); ++b) {
      if (slab.contains(bricks[b].brick.z)) total += counts[b];
      for (std::uint32_t rest = sides[b]; rest != 0; rest &= rest - 1) {
        const Vec3i read = bricks[b].brick + detail::neighbour(std::countr_zero(rest));
        const std::int32_t pool = part.table.at(read);
        if (pool > 0 && slab.contains(read.z)) result[std::size_t(pool)] = Packing::whole;
      }
    }
    return result;
  }

  void report(const CumuloStep& step, const Count& all, float voxel) {
    CumuloLayerReport r;
    r.amplitude = step.layer->amplitude.range(Box::everywhere()).max;
    r.frequency = step.layer->frequency;
    r.voxelSize = voxel;
    r.activeVoxels = all.active;
    r.unconvergedFraction = all.searched > 0 ? double(all.missed) / double(all.searched) : 0.0;
    r.meanDisplacement = all.near > 0 ? all.displacement / double(all.near) : 0.0;
    reports.push_back(r);
  }

  /// Of some points, those whose surface point is not on the surface.
  void countMissed(const CumuloStep& step, const VectorField& foot, Samples& samples, Count& count) const {
    std::array<float, kBrickSamples> x, y, z, residual;
    const std::size_t evaluated = samples.keepEvaluated();
    std::size_t n = 0;
    for (std::size_t i = 0; i < evaluated; i += kSearchedShare, ++n) {
      samples.x[n] = samples.x[i];
      samples.y[n] = samples.y[i];
      samples.z[n] = samples.z[i];
    }
    if (n == 0) return;
    const auto first = [&](auto& lane) { return std::span(lane).first(n); };
    foot.eval({first(samples.x), first(samples.y), first(samples.z)},
              Spans<3>{{first(x), first(y), first(z)}});
    step.surface.eval({first(x), first(y), first(z)}, first(residual));
    count.searched = n;
    for (std::size_t i = 0; i < n; ++i)
      count.missed += !(std::abs(residual[i]) <= kFoundVoxels * options_.voxelSize);
  }

  const std::vector<CumuloLayer>& layers_;
  const CumuloGridOptions& options_;
  const Progress& progress_;
  std::size_t keptCount_;
  float reach_;
  /// The sampled l_i that the next layer reads, if there is one.
  std::shared_ptr<PackedGrid> level_;
};

}  // namespace

float cumuloVoxelSize(const std::vector<CumuloLayer>& layers, std::size_t index, float resultVoxelSize) {
  const float wave = 1 / (layers[index].frequency * layers[index].detail);
  const float ofLast =
      std::clamp(1 / (layers.back().frequency * resultVoxelSize), kFewestSamplesPerWave, kSamplesPerLastWave);
  const float aimed =
      index + 1 < layers.size() ? std::min(kMoreSamples * ofLast, kSamplesPerWave) : kSamplesPerLastWave;
  return std::min(wave / kFewestSamplesPerWave, std::max(wave / aimed, resultVoxelSize));
}

float cumuloExteriorBand(const std::vector<CumuloLayer>& layers, float voxelSize, float edge,
                         std::size_t keptCount) {
  return KeptLayers::reach(layers, 0, voxelSize, keptCount) + cumuloInteriorBand(layers, voxelSize, edge);
}

float cumuloInteriorBand(const std::vector<CumuloLayer>& layers, float voxelSize, float edge) {
  const float voxel = coarsestVoxel(layers, voxelSize);
  return std::max(6 * voxel, edge * 4 / 3 + 3 * voxel);
}

GriddedCumulo griddedCumulo(const ScalarField& base, const std::vector<CumuloLayer>& layers,
                            CumuloGridOptions options, const Progress& progress) {
  require(!options.box.isEmpty() && isFinite(options.box.min) && isFinite(options.box.max),
          "griddedCumulo: the box of the base must be finite and not empty");
  require(options.medialSmoothing >= 0 && options.medialSmoothing <= kMaxMedialSmoothing,
          "griddedCumulo: medialSmoothing must be 0 to " + std::to_string(kMaxMedialSmoothing) + ", got " +
              std::to_string(options.medialSmoothing));
  require(options.edge >= 0 && std::isfinite(options.edge),
          "griddedCumulo: edge must be >= 0 and finite, got " + numberText(options.edge));
  require(!layers.empty(), "griddedCumulo: there must be at least one layer");

  LayerSampler sampler(layers, options, progress);
  CumuloOptions form{.voxelSize = options.voxelSize,
                     .newtonSteps = options.newtonSteps,
                     .closestPoint = std::move(options.closestPoint)};
  options.closestPoint.reset();
  // The first layer's passes all read the base at the same voxels; each level of a distance takes its time.
  const float margin = marginOf(layers, 0, options);
  detail::BrickMemo memo(base, cumuloVoxelSize(layers, 0, options.voxelSize),
                         options.box.expanded(sampler.reachOf(0) + margin), kWholePositions);
  form.bake = [&](const CumuloStep& step) {
    CumuloSampled sampled = sampler(step);
    memo.clear();
    return sampled;
  };
  form.margin = [&](std::size_t layer) { return marginOf(layers, layer, options); };
  form.reach = [&](std::size_t layer) { return sampler.reachOf(layer); };
  GriddedCumulo result;
  result.surface = cumulo(memo.field(), layers, std::move(form));
  result.estimate = sampler.estimate;
  result.estimateVoxelSize = sampler.estimateVoxelSize;
  result.estimateError = kEstimateErrorVoxels * sampler.estimateVoxelSize;
  result.box = options.box.expanded(displacementBound(layers));
  result.layers = std::move(sampler.reports);
  return result;
}

}  // namespace nephele
