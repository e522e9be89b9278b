// From a field to what is marched, at the resolution of the picture.
//
// The march itself reads bricks, since light has to be known everywhere before the first ray and a grid is
// read faster than most fields are evaluated. What a grid would cost is the choice of its voxel size, which
// the camera makes: an octree of ranges finds the density that the picture shows and the depth at which a
// pixel is narrowest, and the voxels become as wide as that. A second walk counts the bricks that such voxels
// need; where there are too many, voxels grow.
//
// Limits: one voxel size for the whole volume, that of its nearest part.
#include "nephele/render/volume/field_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "nephele/levelset/grid/bake.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/octant.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/render/scene/black_body.h"
#include "nephele/render/volume/field_density.h"
#include "nephele/render/volume/field_glow.h"
#include "nephele/render/volume/moved_field.h"
#include "nephele/render/volume/volume_parts.h"

namespace nephele {

namespace {

constexpr int kLevels = 6;
constexpr float kFinest = 1e-5f;
// Along the box at most, of what changes slowly.
constexpr float kVelocityVoxels = 128;
// Along the box, where it is only looked whether a velocity is known.
constexpr float kVelocityChecks = 32;

// The smallest width that a pixel has in the part of `box` that the picture may show; infinite where it shows
// none of it. The whole picture, so that its parts are of the same volume.
double narrowestPixel(const Camera& camera, const Box& box) {
  const PixelBox window = camera.picture();
  double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
  double low[2] = {nearest, nearest}, high[2] = {farthest, farthest};
  for (int corner = 0; corner != 8; ++corner) {
    const Vec3d p{double(corner & 1 ? box.max.x : box.min.x), double(corner & 2 ? box.max.y : box.min.y),
                  double(corner & 4 ? box.max.z : box.min.z)};
    const Vec3d seen = camera.project(p);
    nearest = std::min(nearest, seen.z);
    farthest = std::max(farthest, seen.z);
    if (!(seen.z > 0)) continue;
    for (int axis = 0; axis != 2; ++axis) {
      low[axis] = std::min(low[axis], seen[axis]);
      high[axis] = std::max(high[axis], seen[axis]);
    }
  }
  if (!(farthest > 0)) return std::numeric_limits<double>::infinity();
  // Corners behind the camera have no place in the picture, so boxes around it count as shown.
  const bool isShown = nearest <= 0 || (high[0] >= window.x0 - 1 && low[0] <= window.x1 + 1 &&
                                        high[1] >= window.y0 - 1 && low[1] <= window.y1 + 1);
  return isShown ? camera.pixelWidth(std::max(nearest, 0.0)) : std::numeric_limits<double>::infinity();
}

// Boxes that may hold density, so many levels of octants down.
void findDense(const ScalarField& density, const Box& box, int level, std::vector<Box>& found,
               const Progress& progress) {
  if (!(density.range(box).max > 0)) return;
  if (level == 0) return found.push_back(box);
  progress.check();
  const ScalarField here = density.restrictedTo(box);
  for (int i = 0; i != 8; ++i) findDense(here, octant(box, i), level - 1, found, progress);
}

// Bricks with values of their own that voxels of this size need, up to a little more than `most`.
double brickCount(const ScalarField& density, const Box& box, float voxelSize, double most,
                  const Progress& progress) {
  const Interval range = density.range(box);
  if (!(range.max > 0) || range.isPoint()) return 0;
  const float brick = voxelSize * BrickGrid::kBrick;
  if (box.longestSide() <= brick) return 1;
  progress.check();
  const ScalarField here = density.restrictedTo(box);
  double sum = 0;
  for (int i = 0; i != 8 && sum <= most; ++i)
    sum += brickCount(here, octant(box, i), voxelSize, most - sum, progress);
  return sum;
}

void check(const FieldVolumeOptions& options) {
  require(!options.box.isEmpty() && isFinite(options.box.min) && isFinite(options.box.max) &&
              options.box.longestSide() > 0,
          "field volume: expected a box that is bounded and not empty");
  require(std::isfinite(options.voxelsPerPixel) && options.voxelsPerPixel > 0,
          fmt::format("voxels per pixel: expected a finite number > 0, got {}", options.voxelsPerPixel));
  require(options.sizesPerOctave >= 0, "sizes per octave: expected 0 or more");
  require(options.mostBytes > 0, fmt::format("most bytes: expected a number > 0, got {}", options.mostBytes));
}

VolumePart::Grids threeGrids(const VectorField& field, const BakeOptions& baking, const Progress& progress) {
  VolumePart::Grids grids;
  for (std::size_t c = 0; c < 3; ++c) grids[c] = bakeGrid(component(field, int(c)), baking, progress);
  return grids;
}

VectorField notNegative(const VectorField& field) {
  return vectorField(max(component(field, 0), 0.0f), max(component(field, 1), 0.0f),
                     max(component(field, 2), 0.0f));
}

// The mean of 8 places in every voxel.
ScalarField meanOfVoxels(const ScalarField& field, float voxelSize) {
  ScalarField sum(0.0f);
  for (int corner = 0; corner != 8; ++corner) {
    const Vec3f way{corner & 1 ? 0.25f : -0.25f, corner & 2 ? 0.25f : -0.25f, corner & 4 ? 0.25f : -0.25f};
    sum = sum + translate(field, way * voxelSize);
  }
  return sum * 0.125f;
}

// All light that the parts give off.
VectorField emissionOf(const FieldParts& parts, float voxelSize, const Progress& progress) {
  VectorField sum(Vec3f{});
  if (parts.emission) sum = notNegative(*parts.emission);
  if (parts.temperature) {
    const ScalarField kelvin = max(*parts.temperature, 0.0f);
    VolumePart asked;
    asked.temperature =
        bakeGrid(kelvin, {.voxelSize = voxelSize, .box = parts.box, .background = 0.0f}, progress);
    asked.temperatureScale = 1.0f;
    check(asked);
    float hottest = 0;
    for (const Interval& range : asked.temperature->ranges()) hottest = std::max(hottest, range.max);
    // Between the voxels it may be hotter.
    sum = sum + blackBody(kelvin, std::min(kelvin.range(parts.box).max, 2 * hottest));
  }
  require(std::isfinite(parts.emissionScale) && parts.emissionScale >= 0,
          fmt::format("emission scale: expected a finite number >= 0, got {}", parts.emissionScale));
  return parts.emissionScale == 1.0f ? sum : sum * ScalarField(parts.emissionScale);
}

// The mean over the shutter of a density, a colour and an emission.
FieldParts blurred(const FieldParts& parts, const VectorField& velocity, const Shutter& shutter,
                   float voxelSize, const Progress& progress) {
  require(std::isfinite(shutter.open) && std::isfinite(shutter.close) && shutter.open <= shutter.close,
          fmt::format("shutter: expected an opening not after the closing, got {}, {}", shutter.open,
                      shutter.close));
  const float coarse = std::max(voxelSize, parts.box.longestSide() / kVelocityChecks);
  for (const auto& grid : threeGrids(velocity, {.voxelSize = coarse, .box = parts.box}, progress))
    for (const Interval& range : grid->ranges())
      require(std::isfinite(range.min) && std::isfinite(range.max),
              "velocity: contains values that are not finite");
  constexpr float kLeast = 1e-30f;
  // Copies that stand a sample apart.
  const FieldMotion motion{velocity, shutter, parts.box, 0.5f * voxelSize};
  const ScalarField density = max(parts.density, 0.0f);
  FieldParts result{.density = blurred(density, motion), .box = motion.reached()};
  if (parts.colour) {
    const auto share = [&](int c) { return clamp(component(*parts.colour, c), 0.0f, 1.0f); };
    result.colour =
        blurred(vectorField(share(0), share(1), share(2)) * density, motion) / max(result.density, kLeast);
  }
  if (parts.emission) result.emission = blurred(*parts.emission, motion);
  return result;
}

}  // namespace

FieldResolution::FieldResolution(const ScalarField& density, const FieldVolumeOptions& options,
                                 const Progress& progress)
    : density_(density), options_(options) {
  check(options_);
  findDense(density_, options_.box, kLevels, dense_, progress);
}

float FieldResolution::voxelSize(const Camera& camera, const Progress& progress) {
  std::vector<Camera> cameras{camera};
  if (camera.isMoving()) cameras = {camera.stillAt(0), camera.stillAt(0.5), camera.stillAt(1)};
  double pixel = std::numeric_limits<double>::infinity();
  for (const Camera& each : cameras)
    for (const Box& box : dense_) pixel = std::min(pixel, narrowestPixel(each, box));
  const float side = options_.box.longestSide();
  float size = std::isinf(pixel) ? side / 64 : float(pixel / double(options_.voxelsPerPixel));
  size = std::max(size, kFinest * side);
  const double perOctave = options_.sizesPerOctave;
  if (perOctave > 0)
    size = side * float(std::exp2(std::floor(std::log2(double(size / side)) * perOctave) / perOctave));
  const float growth = perOctave > 0 ? float(std::exp2(1 / perOctave)) : 1.25f;
  while (size * BrickGrid::kBrick < side && !fits(size, progress)) size *= growth;
  return size;
}

bool FieldResolution::fits(float voxelSize, const Progress& progress) {
  const auto [known, isNew] = fits_.try_emplace(voxelSize, false);
  if (!isNew) return known->second;
  // A cube about the box, so that octants end as cubes; it does not matter how far it reaches beyond.
  const float side = options_.box.longestSide();
  const Box cube{options_.box.min, options_.box.min + Vec3f{side, side, side}};
  const double most = std::max(options_.mostBytes / (BrickGrid::kVolume * sizeof(float)), 1.0);
  return known->second = brickCount(density_, cube, voxelSize, most, progress) <= most;
}

float fieldVoxelSize(const ScalarField& density, const Camera& camera, const FieldVolumeOptions& options,
                     const Progress& progress) {
  return FieldResolution(density, options, progress).voxelSize(camera, progress);
}

RenderVolume fieldVolume(const ScalarField& density, const Camera& camera, const FieldVolumeOptions& options,
                         const Progress& progress) {
  progress.begin("field");
  BakeOptions baking;
  baking.voxelSize = fieldVoxelSize(density, camera, options, progress);
  baking.box = options.box;
  baking.background = 0.0f;
  return RenderVolume(bakeGrid(max(density, 0.0f), baking, progress));
}

RenderVolume sampledVolume(const FieldParts& parts, float voxelSize, const Progress& progress) {
  const BakeOptions baking{.voxelSize = voxelSize, .box = parts.box, .background = 0.0f};
  VolumePart part;
  progress.begin("sample");
  part.density = bakeGrid(max(parts.density, 0.0f), baking, progress);
  // Where there is nothing, nobody asks for its colour.
  if (parts.colour) part.colour = threeGrids(*parts.colour * mask(parts.density), baking, progress);
  if (parts.emission) part.emission = threeGrids(notNegative(*parts.emission), baking, progress);
  if (parts.temperature) part.temperature = bakeGrid(max(*parts.temperature, 0.0f), baking, progress);
  part.temperatureScale = 1.0f;
  part.emissionScale = parts.emissionScale;
  if (parts.velocity) {
    const float side = parts.box.longestSide();
    // Known as far as things move.
    const BakeOptions coarse{.voxelSize = std::max(voxelSize, side / kVelocityVoxels),
                             .box = parts.box.expanded(0.25f * side),
                             .background = 0.0f};
    part.velocity = threeGrids(*parts.velocity, coarse, progress);
    part.shutter = parts.shutter;
  }
  part.share = parts.share;
  check(part);
  return combine({part}, progress);
}

RenderVolume gridlessVolume(const FieldParts& parts, float voxelSize, const Progress& progress) {
  require(std::isfinite(parts.share) && parts.share >= 0,
          fmt::format("share: expected a finite number >= 0, got {}", parts.share));
  FieldParts seen{.density = parts.share == 1.0f ? parts.density : parts.density * parts.share,
                  .box = parts.box,
                  .colour = parts.colour};
  if (parts.emission || parts.temperature) seen.emission = emissionOf(parts, voxelSize, progress);
  if (parts.velocity) seen = blurred(seen, *parts.velocity, parts.shutter, voxelSize, progress);

  auto field = std::make_shared<const FieldDensity>(seen.density, seen.box, voxelSize, progress);
  std::shared_ptr<const FieldGlow> glow;
  if (seen.emission) glow = std::make_shared<const FieldGlow>(*seen.emission, seen.box, voxelSize, progress);
  progress.begin("field");
  const BakeOptions baking{.voxelSize = voxelSize, .box = seen.box, .background = 0.0f};
  const ScalarField mean = meanOfVoxels(max(seen.density, 0.0f), voxelSize);
  VolumePart light;
  light.density = bakeGrid(mean, baking, progress);
  if (seen.colour) light.colour = threeGrids(*seen.colour * mask(mean), baking, progress);
  for (std::size_t c = 0; c != 3 && seen.emission; ++c)
    light.emission[c] =
        bakeGrid(meanOfVoxels(component(*seen.emission, int(c)), voxelSize), baking, progress);
  return RenderVolume::ofField(combine({light}, progress), std::move(field), seen.colour, std::move(glow));
}

RenderVolume gridlessVolume(const ScalarField& density, const Box& box, float voxelSize,
                            const Progress& progress) {
  return gridlessVolume({.density = density, .box = box}, voxelSize, progress);
}

}  // namespace nephele
