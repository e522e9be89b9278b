// Multiple scattering by discrete ordinates.
//
// Light is swept through the lattice in a few directions (LightSweep); the solver (Anderson) begins on a
// lattice of a few nodes and goes on where the coarser one ended, as the slow part of the error is smooth.
//
// Source: discrete ordinates and short characteristics are textbook transport (Lewis and Miller,
// "Computational Methods of Neutron Transport", 1984); so is the isotropic equivalent, the transport
// correction.
//
// Limits: light spreads by half a cell per slice, so where a cell is nearly opaque too much of it reaches the
// dark side (a fifth, in a core lit from behind only) and 7 % are missing from the lit one, which the marcher
// makes up for. Cells that would hide the light altogether are thinned.
#include "nephele/render/light/scattered_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/detail/anderson.h"
#include "nephele/render/light/detail/light_sweep.h"
#include "nephele/render/light/detail/scattering_lattice.h"
#include "nephele/render/light/exp_of_minus.h"

namespace nephele {

namespace {

constexpr int kCoarsest = 24;
constexpr int kCoarseSweeps = 60;
// Typical optical depth of a cell, beyond which the lattice would show.
constexpr float kDeepestCell = 4.0f;

// Where the lattices of a volume lie: a brick of nothing around it.
struct Placement {
  Vec3i first, bricks;
  int factor = 1;

  Placement(const RenderVolume& volume, int longestSide) {
    const Box box = volume.indexBounds();
    first = Vec3i(box.min * (1.0f / BrickGrid::kBrick)) - Vec3i{1, 1, 1};
    bricks = Vec3i(box.size() * (1.0f / BrickGrid::kBrick)) + Vec3i{2, 2, 2};
    const int longest = std::max({bricks.x, bricks.y, bricks.z}) * BrickGrid::kBrick;
    while (factor < BrickGrid::kBrick && longest / factor > longestSide) factor *= 2;
  }
};

detail::ScatteringLattice finestLattice(const RenderVolume& volume, const Placement& place, float extinction,
                                        const ScatteredSource& source) {
  const BrickGrid& grid = volume.density();
  const int factor = place.factor, perBrick = BrickGrid::kBrick / factor;
  detail::ScatteringLattice lattice(place.bricks * perBrick, factor);
  const std::vector<Vec3i>& occupied = volume.occupiedBricks();
  // The beam varies slowly enough for every other voxel where a cell has many.
  const int stride = factor > 2 ? 2 : 1;
  parallelFor(occupied.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      const Vec3i origin = (occupied[i] - place.first) * perBrick;
      const float* values = grid.brick(grid.poolIndex(occupied[i]));
      for (int z = 0; z < BrickGrid::kBrick; z += stride)
        for (int y = 0; y < BrickGrid::kBrick; y += stride)
          for (int x = 0; x < BrickGrid::kBrick; x += stride) {
            float rho = 0;
            for (int k = 0; k != stride * stride * stride; ++k)
              rho += std::max(
                  values[sampleOffset(x + k % stride, y + k / stride % stride, z + k / (stride * stride))],
                  0.0f);
            if (!(rho > 0)) continue;
            const std::size_t to =
                lattice.index(origin.x + x / factor, origin.y + y / factor, origin.z + z / factor);
            lattice.density[to] += rho;
            if (!source.column) continue;
            const Vec3f voxel = Vec3f(occupied[i] * BrickGrid::kBrick + Vec3i{x, y, z}) +
                                Vec3f{1, 1, 1} * (0.5f * float(stride - 1));
            const Vec3f world = grid.indexToWorld()(voxel);
            const float depth = std::max(extinction * source.shadow * source.column(world), 0.0f);
            lattice.beam[to] +=
                rho * source.irradiance(world) * detail::expOfMinus(std::min(depth, 80.0f)) / (4 * kPi);
          }
    }
  });
  lattice.finish(float(factor * factor * factor));
  return lattice;
}

}  // namespace

Scattering Scattering::isotropic() const {
  const float g = std::max(meanCosine, 0.0f), left = 1 - albedo * g;
  return {extinction * left, albedo * (1 - g) / left, 0.0f};
}

ScatteredSource ScatteredSource::of(const LightVolume& sun) {
  ScatteredSource source;
  source.irradiance = [](const Vec3f&) { return 1.0f; };
  source.column = [&sun](const Vec3f& world) { return sun.columnDensity(world); };
  return source;
}

ScatteredSource ScatteredSource::evenSky() {
  ScatteredSource source;
  source.sky = [](const std::vector<Vec3f>& towards) { return std::vector<float>(towards.size(), 1.0f); };
  return source;
}

ScatteredLight::ScatteredLight(const RenderVolume& volume, const Scattering& scattering,
                               const LightVolume* sun, const Progress& progress)
    : ScatteredLight(volume, scattering, sun, Options{}, progress) {}

ScatteredLight::ScatteredLight(const RenderVolume& volume, const Scattering& scattering,
                               const LightVolume* sun, const Options& options, const Progress& progress)
    : ScatteredLight(volume, scattering, sun ? ScatteredSource::of(*sun) : ScatteredSource::evenSky(),
                     options, progress) {}

ScatteredLight::ScatteredLight(const RenderVolume& volume, const Scattering& scattering,
                               const ScatteredSource& source, const Options& options,
                               const Progress& progress) {
  require(options.directions >= 6 && options.longestSide >= 8 && options.sweeps >= 1,
          "scattered light: needs at least 6 directions, 8 nodes and a sweep");
  require(
      std::isfinite(scattering.extinction) && scattering.extinction >= 0 && scattering.albedo >= 0 &&
          scattering.albedo <= 1 && std::isfinite(scattering.meanCosine) && scattering.meanCosine < 1,
      fmt::format("scattered light: expected an extinction >= 0, an albedo within [0, 1] and a mean cosine "
                  "below 1, got {}, {} and {}",
                  scattering.extinction, scattering.albedo, scattering.meanCosine));
  // Spirals that are even over the sphere.
  std::vector<Vec3f> ways, towards;
  for (int i = 0; i != options.directions; ++i) {
    const float y = 1 - (2 * float(i) + 1) / float(options.directions), angle = 2.39996323f * float(i);
    const float r = std::sqrt(1 - y * y);
    ways.push_back({r * std::cos(angle), y, r * std::sin(angle)});
    towards.push_back(-ways.back());
  }
  const std::vector<float> inflow =
      source.sky ? source.sky(towards) : std::vector<float>(towards.size(), 0.0f);
  float meanInflow = 0;
  for (const float value : inflow) meanInflow += value;
  meanInflow /= float(inflow.size());
  values_ = {meanInflow};
  if (volume.isEmpty()) return;
  Scattering even = scattering.isotropic();

  const BrickGrid& grid = volume.density();
  const Placement place(volume, options.longestSide);
  std::vector<detail::ScatteringLattice> levels{finestLattice(volume, place, even.extinction, source)};
  while (levels[0].longest() > options.longestSide) levels[0] = detail::halved(levels[0]);
  size_ = levels[0].size;
  const int factor = levels[0].factor;
  const float scale = 1.0f / float(factor);
  const Vec3f middle = Vec3f(place.first * BrickGrid::kBrick) + Vec3f{1, 1, 1} * (0.5f * float(factor - 1));
  worldToLattice_ = {Mat3f::scaling(scale) * grid.worldToIndex().linear,
                     (grid.worldToIndex().translation - middle) * scale};
  const float deepest = grid.voxelSize() * float(factor) * detail::typicalDensity(levels[0]);
  if (deepest * even.extinction > kDeepestCell) even.extinction = kDeepestCell / deepest;
  // Without scattering one sweep tells all.
  if (even.albedo > 0)
    while (levels.back().longest() > kCoarsest) levels.push_back(detail::halved(levels.back()));

  for (std::size_t level = levels.size(); level-- != 0;) {
    const detail::ScatteringLattice& lattice = levels[level];
    std::vector<Vec3f> directions;
    for (const Vec3f& way : ways)
      directions.push_back(grid.worldToIndex().linear * way * (1.0f / float(lattice.factor)));
    detail::LightSweep sweeper(lattice, even.extinction, inflow, directions);
    detail::Anderson anderson(lattice.density);
    std::vector<float> light = level + 1 == levels.size()
                                   ? std::vector<float>(lattice.density.size(), meanInflow)
                                   : detail::refined(values_, levels[level + 1], lattice);
    std::vector<float> own(light.size());
    const int most = level == 0 ? options.sweeps : kCoarseSweeps;
    for (int sweep = 1;; ++sweep) {
      progress.check();
      for (std::size_t i = 0; i != light.size(); ++i) own[i] = even.albedo * (light[i] + lattice.beam[i]);
      sweeper.sweep(own, values_);
      if (sweep == most || even.albedo == 0 || anderson.step(light, values_) < options.tolerance) break;
      if (level == 0) progress.advance(double(sweep) / most);
    }
  }
  if (source.sky) {
    const float most = *std::max_element(inflow.begin(), inflow.end());
    for (float& value : values_) value = std::min(value, most);
  }
}

void ScatteredLight::scale(float factor) {
  for (float& value : values_) value *= factor;
}

float ScatteredLight::at(const Vec3f& world) const {
  const Vec3f p = worldToLattice_(world);
  Vec3i cell;
  Vec3f f;
  for (int axis = 0; axis != 3; ++axis) {
    const float x = std::clamp(p[axis], 0.0f, float(size_[axis] - 1));
    cell[axis] = std::min(int(x), std::max(size_[axis] - 2, 0));
    f[axis] = x - float(cell[axis]);
  }
  float sum = 0;
  for (int corner = 0; corner != 8; ++corner) {
    const Vec3i d{corner & 1, corner >> 1 & 1, corner >> 2};
    const Vec3i node = min(cell + d, size_ - Vec3i{1, 1, 1});
    sum += (d.x ? f.x : 1 - f.x) * (d.y ? f.y : 1 - f.y) * (d.z ? f.z : 1 - f.z) *
           values_[(std::size_t(node.z) * std::size_t(size_.y) + std::size_t(node.y)) * std::size_t(size_.x) +
                   std::size_t(node.x)];
  }
  return sum;
}

ScatteredLight::Bytes ScatteredLight::estimateBytes(const RenderVolume& volume, int longestSide) {
  if (volume.isEmpty()) return {};
  const Placement place(volume, longestSide);
  const double perBrick = double(BrickGrid::kBrick) / place.factor;
  const double nodes =
      double(place.bricks.x) * place.bricks.y * place.bricks.z * perBrick * perBrick * perBrick;
  // Two arrays of the lattice, twelve of the sweeps, twelve of the acceleration, and the light itself.
  return {30.0 * sizeof(float) * nodes, sizeof(float) * nodes};
}

}  // namespace nephele
