// Several grids on one lattice.
//
// A marcher that walks one lattice is simple and fast, so grids are brought to the finest of their lattices
// once: every brick that any of them reaches is filled with the sum of all, sample by sample. Trilinear
// interpolation on lattices whose cells divide each other gives the same values before and after; on others
// it errs by the square of the finest voxel, most at the foot of edges that are as thin as a voxel. What is
// stored is extinction per colour, that is density times colour and not the colour itself: extinctions add,
// colours do not, and an edge where density and colour both fall to nothing keeps its colour.
//
// Bricks are found through the boxes of the sources' bricks, evaluated in parallel in chunks, and numbered in
// the order of the table. Bricks of one value are stored once.
//
// Motion: a mean over lines through the velocity at their ends. It averages densities and not pictures, so
// that what is opaque and moves far covers a little more than it should.
//
// Limits: a fine volume beside a large coarse one costs the fine voxels in both.
#include "nephele/render/volume/volume_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <type_traits>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/scene/black_body.h"
#include "nephele/render/volume/detail/holdable_density.h"
#include "nephele/render/volume/detail/source_grid.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kChannels = 7;  // density, density times colour, emission
constexpr double kLargestTable = double(1 << 28);
constexpr float kHottest = 1e5f;

struct PartSources {
  const VolumePart* part;
  std::optional<detail::SourceGrid> density, temperature;
  std::vector<detail::SourceGrid> colour, emission, velocity;
  // Farthest way of anything from where the grids have it, in voxels of the target.
  Vec3d motion{};
};

void checkGrid(const BrickGrid& grid, const char* name, bool needsZero) {
  require(
      !needsZero || grid.background() == 0.0f,
      fmt::format("{}: expected 0 outside of the volume, but its background is {}", name, grid.background()));
  const bool isFinite = std::ranges::all_of(grid.ranges(), [](const Interval& range) {
    return std::isfinite(range.min) && std::isfinite(range.max);
  });
  require(isFinite, fmt::format("{}: contains values that are not finite", name));
}

void checkThree(const VolumePart::Grids& grids, const char* name, bool needsZero) {
  for (const auto& grid : grids) {
    require((grid == nullptr) == (grids[0] == nullptr), fmt::format("{}: three grids or none needed", name));
    if (grid) checkGrid(*grid, name, needsZero);
  }
}

float largest(const BrickGrid& grid) {
  float most = 0;
  for (const Interval& range : grid.ranges()) most = std::max(most, range.max);
  return most;
}

// The grid whose voxels all are brought to. Which one does not depend on the order of the parts.
const BrickGrid& finest(const std::vector<VolumePart>& parts) {
  const BrickGrid* best = nullptr;
  const auto key = [](const BrickGrid& grid) {
    const Mat3f& m = grid.indexToWorld().linear;
    const Vec3f& t = grid.indexToWorld().translation;
    return std::tuple(grid.voxelSize(), m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0),
                      m(2, 1), m(2, 2), t.x, t.y, t.z);
  };
  const auto consider = [&](const std::shared_ptr<const BrickGrid>& grid) {
    if (grid && (!best || key(*grid) < key(*best))) best = grid.get();
  };
  for (const VolumePart& part : parts) {
    consider(part.density);
    if (part.density) continue;
    consider(part.emission[0]);
    consider(part.temperature);
  }
  return *best;
}

class Combiner {
 public:
  explicit Combiner(const std::vector<VolumePart>& parts) : lattice_(finest(parts)) {
    for (const VolumePart& part : parts) {
      PartSources& sources = sources_.emplace_back();
      sources.part = &part;
      if (part.density) sources.density.emplace(lattice_, *part.density);
      for (const auto& grid : part.colour)
        if (grid) sources.colour.emplace_back(lattice_, *grid);
      for (const auto& grid : part.emission)
        if (grid) sources.emission.emplace_back(lattice_, *grid);
      for (const auto& grid : part.velocity)
        if (grid) sources.velocity.emplace_back(lattice_, *grid);
      sources.motion = farthest(part);
      if (part.temperature) {
        sources.temperature.emplace(lattice_, *part.temperature);
        incandescence_.emplace_back(largest(*part.temperature) * part.temperatureScale);
      } else {
        incandescence_.emplace_back(0.0f);
      }
      hasColour_ = hasColour_ || part.colour[0] || part.albedo != Vec3f{1, 1, 1};
      hasEmission_ = hasEmission_ || part.emission[0] || part.temperature;
    }
    channels_[0] = true;
    for (int c = 1; c != 4; ++c) channels_[c] = hasColour_, channels_[c + 3] = hasEmission_;
  }

  std::vector<Vec3i> reachedBricks();
  RenderVolume combined(const Progress& progress);
  double estimateBytes() {
    double grids = 0;
    for (const bool used : channels_) grids += used;
    return grids * (double(reachedBricks().size() + 1) * BrickGrid::kVolume * sizeof(float) +
                    double(box_.size()) * sizeof(std::int32_t));
  }

 private:
  using Samples = std::array<std::vector<float>, kChannels>;

  template <class Visit>
  void forEachCarrier(Visit&& visit) const {
    for (const PartSources& sources : sources_) {
      if (sources.density && sources.part->share > 0) visit(*sources.density, sources.motion);
      for (const detail::SourceGrid& source : sources.emission) visit(source, sources.motion);
      if (sources.temperature) visit(*sources.temperature, sources.motion);
    }
  }
  void evaluate(const Vec3i& brick, float* const (&out)[kChannels]) const;
  static constexpr int kMostTimes = 64;
  Vec3d farthest(const VolumePart& part) const;
  template <class Place>
  void add(const PartSources& sources, const BlackBodyColours& incandescence, const Place& voxel,
           float (&values)[kChannels]) const;
  void addMoving(const PartSources& sources, const BlackBodyColours& incandescence, const Vec3i& voxel,
                 float (&values)[kChannels]) const;

  const BrickGrid& lattice_;
  std::vector<PartSources> sources_;
  std::vector<BlackBodyColours> incandescence_;
  bool hasColour_ = false, hasEmission_ = false;
  bool channels_[kChannels] = {};
  BrickBox box_;
};

Vec3d Combiner::farthest(const VolumePart& part) const {
  Vec3d fastest{}, result{};
  for (std::size_t c = 0; c != 3 && part.velocity[0]; ++c)
    for (const Interval& range : part.velocity[c]->ranges())
      fastest[int(c)] = std::max(fastest[int(c)], double(range.magnitude()));
  const double time = std::max(std::fabs(part.shutter.open), std::fabs(part.shutter.close));
  for (int row = 0; row != 3; ++row)
    for (int c = 0; c != 3; ++c)
      result[row] += std::fabs(double(lattice_.worldToIndex().linear(row, c))) * fastest[c] * time;
  return result;
}

std::vector<Vec3i> Combiner::reachedBricks() {
  Vec3i low{1 << 30, 1 << 30, 1 << 30}, high = -low;
  forEachCarrier([&](const detail::SourceGrid& source, const Vec3d& motion) {
    source.visitBricks(motion, [&](const Vec3i& first, const Vec3i& last) {
      low = min(low, first);
      high = max(high, last);
    });
  });
  if (low.x > high.x) return {};
  const Vec3d size = Vec3d(Vec3f(high)) - Vec3d(Vec3f(low)) + Vec3d{1, 1, 1};
  require(
      size.x * size.y * size.z <= kLargestTable,
      fmt::format("volumes: together they span {:g} x {:g} x {:g} voxels of the finest of them, more than "
                  "can be held; use fewer or larger voxels",
                  size.x * kBrick, size.y * kBrick, size.z * kBrick));
  box_ = {low, high - low + Vec3i{1, 1, 1}};
  std::vector<std::uint8_t> reached(box_.size());
  forEachCarrier([&](const detail::SourceGrid& source, const Vec3d& motion) {
    source.visitBricks(motion, [&](const Vec3i& first, const Vec3i& last) {
      for (int z = first.z; z <= last.z; ++z)
        for (int y = first.y; y <= last.y; ++y)
          for (int x = first.x; x <= last.x; ++x) reached[box_.numberOf({x, y, z})] = 1;
    });
  });
  std::vector<Vec3i> bricks;
  for (std::size_t i = 0; i != reached.size(); ++i)
    if (reached[i]) bricks.push_back(box_.at(i));
  return bricks;
}

void Combiner::addMoving(const PartSources& sources, const BlackBodyColours& incandescence,
                         const Vec3i& voxel, float (&values)[kChannels]) const {
  const Shutter& shutter = sources.part->shutter;
  Vec3d world{};
  for (int c = 0; c != 3; ++c) world[c] = double(sources.velocity[std::size_t(c)].at(voxel));
  Vec3d velocity{};
  for (int row = 0; row != 3; ++row)
    for (int c = 0; c != 3; ++c) velocity[row] += double(lattice_.worldToIndex().linear(row, c)) * world[c];
  const double open = shutter.close - shutter.open, way = length(velocity) * open;
  const int count = int(std::clamp(std::ceil(way), 1.0, double(kMostTimes)));
  float sum[kChannels] = {};
  for (int i = 0; i != count; ++i) {
    const double time = shutter.open + open * (i + 0.5) / count;
    add(sources, incandescence, Vec3d(Vec3f(voxel)) - velocity * time, sum);
  }
  for (int c = 0; c != kChannels; ++c) values[c] += sum[c] / float(count);
}

template <class Place>
void Combiner::add(const PartSources& sources, const BlackBodyColours& incandescence, const Place& voxel,
                   float (&values)[kChannels]) const {
  const VolumePart& part = *sources.part;
  if (sources.density) {
    float found;
    if constexpr (std::is_same_v<Place, Vec3i>)
      found = sources.density->fitted(voxel);
    else
      found = sources.density->at(voxel);
    const float density = part.share * std::max(found, 0.0f);
    values[0] += density;
    if (hasColour_ && density > 0)
      for (int c = 0; c != 3; ++c) {
        const float colour =
            sources.colour.empty() ? 1.0f : std::clamp(sources.colour[std::size_t(c)].at(voxel), 0.0f, 1.0f);
        values[1 + c] += density * part.albedo[c] * colour;
      }
  }
  for (std::size_t c = 0; c != sources.emission.size(); ++c)
    values[4 + c] += part.emissionScale * std::max(sources.emission[c].at(voxel), 0.0f);
  if (sources.temperature) {
    const Vec3f glow = incandescence(part.temperatureScale * sources.temperature->at(voxel));
    for (int c = 0; c != 3; ++c) values[4 + c] += part.emissionScale * glow[c];
  }
}

void Combiner::evaluate(const Vec3i& brick, float* const (&out)[kChannels]) const {
  const Vec3i low = brick * kBrick - Vec3i{1, 1, 1}, high = brick * kBrick + Vec3i{9, 9, 9};
  std::vector<std::size_t> here;
  for (std::size_t i = 0; i != sources_.size(); ++i) {
    bool reaches = sources_[i].density && sources_[i].density->reaches(low, high, sources_[i].motion);
    for (const detail::SourceGrid& source : sources_[i].emission)
      reaches = reaches || source.reaches(low, high, sources_[i].motion);
    reaches = reaches ||
              (sources_[i].temperature && sources_[i].temperature->reaches(low, high, sources_[i].motion));
    if (reaches) here.push_back(i);
  }
  std::size_t at = 0;
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y)
      for (int x = low.x; x <= high.x; ++x, ++at) {
        float values[kChannels] = {};
        for (const std::size_t i : here)
          if (sources_[i].velocity.empty())
            add(sources_[i], incandescence_[i], Vec3i{x, y, z}, values);
          else
            addMoving(sources_[i], incandescence_[i], {x, y, z}, values);
        for (int c = 0; c != kChannels; ++c)
          if (out[c]) out[c][at] = values[c];
      }
}

RenderVolume Combiner::combined(const Progress& progress) {
  progress.begin("combine");
  const std::vector<Vec3i> bricks = reachedBricks();
  std::array<std::shared_ptr<BrickGrid>, kChannels> grids;
  for (int c = 0; c != kChannels; ++c) {
    if (!channels_[c]) continue;
    grids[c] = std::make_shared<BrickGrid>(lattice_.lattice(), box_, 0.0f);
  }
  std::vector<std::int32_t> table(box_.size(), 0);
  std::map<std::array<float, kChannels>, std::int32_t> constants{{{}, 0}};

  constexpr std::size_t chunk = 2048, volume = BrickGrid::kVolume;
  Samples samples;
  std::array<std::vector<Interval>, kChannels> ranges;
  for (int c = 0; c != kChannels; ++c)
    if (grids[c]) samples[c].resize(chunk * volume), ranges[c].resize(chunk);
  for (std::size_t begin = 0; begin < bricks.size(); begin += chunk) {
    progress.check();
    const std::size_t count = std::min(chunk, bricks.size() - begin);
    parallelFor(count, 8, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first; i != last; ++i) {
        float* out[kChannels];
        for (int c = 0; c != kChannels; ++c) out[c] = grids[c] ? samples[c].data() + i * volume : nullptr;
        evaluate(bricks[begin + i], out);
        for (int c = 0; c != kChannels; ++c)
          if (out[c]) ranges[c][i] = rangeOfBrick(out[c]);
      }
    });
    for (std::size_t i = 0; i != count; ++i) {
      std::array<float, kChannels> constant{};
      bool isConstant = true;
      for (int c = 0; c != kChannels; ++c) {
        if (!grids[c]) continue;
        isConstant = isConstant && ranges[c][i].isPoint();
        constant[c] = ranges[c][i].min;
      }
      std::int32_t& entry = table[box_.numberOf(bricks[begin + i])];
      entry = std::int32_t(grids[0]->poolSize());
      if (isConstant) {
        const auto [known, isNew] = constants.try_emplace(constant, entry);
        entry = known->second;
        if (!isNew) continue;
      }
      for (int c = 0; c != kChannels; ++c) {
        if (!grids[c]) continue;
        const float* from = samples[c].data() + i * volume;
        const std::int32_t pool = grids[c]->append(1);
        std::copy_n(from, volume, grids[c]->brick(pool));
        grids[c]->setRange(pool, ranges[c][i]);
      }
    }
    progress.advance(double(begin + count) / double(bricks.size()));
  }
  VolumeColour colour;
  for (int c = 0; c != kChannels; ++c)
    if (grids[c]) grids[c]->setTable(table);
  for (std::size_t c = 0; c != 3; ++c) {
    colour.scattering[c] = grids[1 + c];
    colour.emission[c] = grids[4 + c];
  }
  return RenderVolume(grids[0], colour);
}

bool isPlain(const std::vector<VolumePart>& parts) {
  return parts.size() == 1 && parts[0].density && parts[0].share == 1 && parts[0].albedo == Vec3f{1, 1, 1} &&
         !parts[0].colour[0] && !parts[0].emission[0] && !parts[0].temperature && !parts[0].velocity[0];
}

}  // namespace

void check(const VolumePart& part) {
  require(part.density || part.emission[0] || part.temperature,
          "volumes: one of them has neither density nor emission");
  if (part.density) {
    checkGrid(*part.density, "density", true);
    Interval all = Interval::of(0);
    for (const Interval& range : part.density->ranges()) all = all.hull(range);
    detail::requireHoldableDensity({all.min * part.share, all.max * part.share});
  }
  checkThree(part.colour, "colour", false);
  checkThree(part.emission, "emission", true);
  require(std::isfinite(part.share) && part.share >= 0,
          fmt::format("share: expected a finite number >= 0, got {}", part.share));
  require(std::isfinite(part.emissionScale) && part.emissionScale >= 0,
          fmt::format("emission scale: expected a finite number >= 0, got {}", part.emissionScale));
  for (int c = 0; c != 3; ++c)
    require(part.albedo[c] >= 0 && part.albedo[c] <= 1,
            fmt::format("albedo: expected three numbers within [0, 1], got {}", part.albedo[c]));
  checkThree(part.velocity, "velocity", false);
  require(std::isfinite(part.shutter.open) && std::isfinite(part.shutter.close) &&
              part.shutter.open <= part.shutter.close,
          fmt::format("shutter: expected an opening not after the closing, got {}, {}", part.shutter.open,
                      part.shutter.close));
  if (!part.temperature) return;
  checkGrid(*part.temperature, "temperature", true);
  require(std::isfinite(part.temperatureScale) && part.temperatureScale > 0,
          fmt::format("temperature scale: expected a finite number > 0, got {}", part.temperatureScale));
  const float hottest = largest(*part.temperature);
  require(hottest * part.temperatureScale <= kHottest,
          fmt::format("temperature: {:g} times {:g} is more than {:g} K; give a smaller temperature scale, 1 "
                      "if the grid holds kelvins",
                      hottest, part.temperatureScale, kHottest));
}

RenderVolume combine(const std::vector<VolumePart>& parts, const Progress& progress) {
  require(!parts.empty(), "volumes: at least one is needed");
  for (const VolumePart& part : parts) check(part);
  if (isPlain(parts) && parts[0].coded) return RenderVolume(parts[0].density, std::move(*parts[0].coded));
  if (isPlain(parts)) return RenderVolume(parts[0].density);
  for (const VolumePart& part : parts)
    require(!part.coded, "volumes: the samples of what is brought together were given back");
  return Combiner(parts).combined(progress);
}

double estimateCombinedBytes(const std::vector<VolumePart>& parts) {
  if (parts.empty() || isPlain(parts)) return 0;
  for (const VolumePart& part : parts) check(part);
  return Combiner(parts).estimateBytes();
}

}  // namespace nephele
