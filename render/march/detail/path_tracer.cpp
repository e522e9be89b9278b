// The reference: light transport in a volume by random paths, unbiased.
//
// Free paths: delta tracking (Woodcock 1965). In every brick the extinction is at most extinction * largest
// density of the brick; tentative collisions are drawn for that bound, and each is real with the share that
// the density there has of it. Bricks without density are skipped as the marcher skips them. Sunlight: at
// each scattering towards every sun, its transmittance by ratio tracking (Novak, Selle, Jarosz 2014): the
// same walk, whose tentative collisions multiply by the share that is not real, ended by Russian roulette
// where little is left. So for points and spots, up to where they are. Sky: what a path sees where it leaves
// the volume after scattering; a sky from a map also by a direction drawn from its luminance at every
// scattering, the two weighed by their densities (the balance heuristic of Veach, 1997). Colour: a path
// carries a weight per channel that every scattering multiplies by the albedo, and every tentative collision
// by how much likelier it is to that colour where extinctions differ.
//
// Random numbers are a hash of seed, pixel, path and count, so that neither threads nor the number of paths
// change a path. Points within a pixel follow the R2 sequence of M. Roberts, shifted at random for each
// pixel, through the marcher's tent filter.
#include "nephele/render/march/detail/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/grid/brick_box.h"
#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/render/volume/brick_walk.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele::detail {

namespace {

// Below these shares of light, transmittances and paths play Russian roulette.
constexpr float kLeastTransmittance = 0.1f;
constexpr float kLeastWeight = 0.2f;
constexpr float kInfinite = std::numeric_limits<float>::infinity();

double fraction(double x) {
  return x - std::floor(x);
}

// Uniform in [0, 1) to a tent over [-1, 1].
double tent(double u) {
  return u < 0.5 ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u);
}

// `axis` turned by an angle of cosine `cosine` towards the side that `turn`, in [0, 1), chooses.
Vec3f scattered(const Vec3f& axis, float cosine, float turn) {
  // A vector across the axis, from whichever two components are far from zero.
  const Vec3f across =
      std::fabs(axis.x) > 0.7f ? normalize(Vec3f{-axis.y, axis.x, 0}) : normalize(Vec3f{0, -axis.z, axis.y});
  const float sine = std::sqrt(std::fmax(0.0f, 1 - cosine * cosine)), angle = 2 * kPi * turn;
  return normalize(axis * cosine + across * (sine * std::cos(angle)) +
                   cross(axis, across) * (sine * std::sin(angle)));
}

float largest(const Vec3f& v) {
  return std::max({v.x, v.y, v.z});
}

}  // namespace

PathTracer::PathTracer(const RenderScene& scene, const PathOptions& options)
    : medium_(scene.medium),
      lights_(scene.lights),
      camera_(scene.camera),
      shutter_(scene.shutter),
      motion_(scene.volumeMotion),
      options_(options) {
  const RenderVolume& volume = scene.volume;
  const Medium& medium = scene.medium;
  const Lights& lights = scene.lights;
  // The extinction is that of the most opaque colour.
  medium_.extinction *= largest(medium.extinctionColour);
  colour_ = medium.extinctionColour / largest(medium.extinctionColour);
  perEmission_ = medium.extinction;
  const BrickGrid& grid = volume.density();
  scene_.density = {grid.values().data(), grid.table().data(), grid.brickCount()};
  scene_.ranges = grid.ranges().data();
  scene_.emptiness = volume.emptiness().data();
  if (volume.hasColour()) {
    const VolumeColour::Grids& colours = volume.colour().scattering;
    for (std::size_t c = 0; c != 3; ++c) scene_.colour.values[c] = colours[c]->values().data();
    scene_.colour.table = colours[0]->table().data();
    scene_.colour.count = colours[0]->brickCount();
  }
  if (volume.hasEmission()) {
    const VolumeColour::Grids& glow = volume.colour().emission;
    for (std::size_t c = 0; c != 3; ++c) scene_.emission.values[c] = glow[c]->values().data();
    scene_.emission.table = glow[0]->table().data();
    scene_.emission.count = glow[0]->brickCount();
    leastBound_ = 1 / (BrickGrid::kBrick * grid.voxelSize());
  }
  isColoured_ = volume.hasEmission() || colour_ != Vec3f{1, 1, 1};
  map_ = grid.worldToIndex();
  leastStep_ = 1e-4f * grid.voxelSize();
  const Vec3f corner(grid.firstBrick() * BrickGrid::kBrick);
  shift_ = Vec3d(map_.translation) - Vec3d(corner);
  bounds_ = {volume.indexBounds().min - corner, volume.indexBounds().max - corner};
  for (const DistantLight& sun : lights.suns) {
    const Vec3f towards = normalize(sun.direction);
    suns_.push_back({towards, map_.linear * towards, sun.irradiance, sun.shadow * colour_});
  }
  latticeToWorld_ = {grid.indexToWorld().linear, grid.indexToWorld()(corner)};
  hasSky_ = lights.hasSky();
  skyMap_ = lights.map.get();
  blurred_ = scene.isBlurred();
}

void PathTracer::pixel(int x, int y, PathSums& sums) const {
  const std::uint64_t index = std::uint64_t(y) * std::uint64_t(camera_.width()) + std::uint64_t(x);
  sums.light.resize(suns_.size() + lights_.locals.size() + 1);
  PathRandom offset(options_.seed, index, ~std::uint64_t(0));
  const double u = double(offset.next()), v = double(offset.next());
  for (int i = 0; i != options_.samplesPerPixel; ++i) {
    const std::uint64_t path = options_.firstSample + std::uint64_t(i);
    const double number = double(path + 1);
    PathRandom random(options_.seed, index, path);
    const double px = x + 0.5 + tent(fraction(u + 0.7548776662466927 * number)),
                 py = y + 0.5 + tent(fraction(v + 0.5698402909980532 * number));
    trace(blurred_ ? blurredRay(px, py, random) : camera_.ray(px, py), random, sums);
  }
}

template <class BoundOf, class Meet>
void PathTracer::collide(const LatticeRay& ray, float length, PathRandom& random, BoundOf&& boundOf,
                         Meet&& meet) const {
  float depth = random.depth();
  detail::walkBricks(scene_, ray, length, [&](float s, float end, std::int32_t pool) {
    const float bound = boundOf(pool);
    for (;;) {
      const float step = std::fmax(depth / bound, leastStep_);
      if (!(s + step < end)) {
        depth = std::fmax(0.0f, depth - (end - s) * bound);
        return true;
      }
      s += step;
      if (!meet(s, bound, pool)) return false;
      depth = random.depth();
    }
  });
}

float PathTracer::freePath(const LatticeRay& ray, PathRandom& random) const {
  float hit = kInfinite;
  collide(
      ray, kInfinite, random, [&](std::int32_t pool) { return medium_.extinction * scene_.ranges[pool].max; },
      [&](float s, float, std::int32_t pool) {
        if (!(random.next() * scene_.ranges[pool].max < density(ray.origin + ray.direction * s))) return true;
        hit = s;
        return false;
      });
  return hit;
}

float PathTracer::freePath(const LatticeRay& ray, Vec3f& weight, Vec3d& glow, PathRandom& random) const {
  if (!isColoured_) return freePath(ray, random);
  float hit = kInfinite;
  collide(
      ray, kInfinite, random,
      [&](std::int32_t pool) { return std::fmax(medium_.extinction * scene_.ranges[pool].max, leastBound_); },
      [&](float s, float bound, std::int32_t) {
        const Vec3f p = ray.origin + ray.direction * s;
        if (scene_.emission.table)
          for (int c = 0; c != 3; ++c)
            glow[c] +=
                double(weight[c] * perEmission_ / bound) *
                double(valueAt({scene_.emission.values[c], scene_.emission.table, scene_.emission.count}, p));
        const Vec3f real = colour_ * std::fmin(medium_.extinction * density(p) / bound, 1.0f);
        const float sum = weight.x + weight.y + weight.z;
        if (!(sum > 0)) return false;
        const float chance = dot(weight, real) / sum;
        if (random.next() < chance) {
          weight = weight * real / chance;
          hit = s;
          return false;
        }
        weight = weight * (Vec3f{1, 1, 1} - real) / (1 - chance);
        return true;
      });
  return hit;
}

Vec3f PathTracer::transmittance(const LatticeRay& ray, float length, const Vec3f& shadow,
                                PathRandom& random) const {
  const float red = transmittance(ray, length, shadow.x, random);
  if (shadow.x == shadow.y && shadow.x == shadow.z) return {red, red, red};
  const float green = transmittance(ray, length, shadow.y, random);
  return {red, green, transmittance(ray, length, shadow.z, random)};
}

float PathTracer::transmittance(const LatticeRay& ray, float length, float shadow, PathRandom& random) const {
  float through = 1.0f;
  collide(
      ray, length, random,
      [&](std::int32_t pool) { return medium_.extinction * shadow * scene_.ranges[pool].max; },
      [&](float s, float, std::int32_t pool) {
        const float there = density(ray.origin + ray.direction * s);
        through *= std::fmax(0.0f, 1.0f - there / scene_.ranges[pool].max);
        if (through >= kLeastTransmittance) return true;
        if (random.next() * kLeastTransmittance >= through) {
          through = 0.0f;
          return false;
        }
        through = kLeastTransmittance;
        return true;
      });
  return through;
}

float PathTracer::density(const Vec3f& p) const {
  return valueAt(scene_.density, p);
}

Vec3f PathTracer::colour(const Vec3f& p) const {
  if (!scene_.colour.table) return {1, 1, 1};
  const float there = density(p);
  Vec3f result;
  for (int c = 0; c != 3 && there > 0; ++c)
    result[c] = valueAt({scene_.colour.values[c], scene_.colour.table, scene_.colour.count}, p) / there;
  return result;
}

float PathTracer::valueAt(const MarchScene::Bricks& bricks, const Vec3f& p) {
  Vec3i brick;
  Vec3f local;
  for (int axis = 0; axis != 3; ++axis) {
    brick[axis] = std::clamp(int(p[axis] * 0.125f), 0, bricks.count[axis] - 1);
    local[axis] = std::clamp(p[axis] - 8.0f * float(brick[axis]), 0.0f, 7.9999995f);
  }
  const Vec3i cell(local);
  const float* samples =
      bricks.values +
      std::size_t(bricks.table[BrickBox{{}, bricks.count}.numberOf(brick)]) * std::size_t(BrickGrid::kVolume);
  return std::fmax(0.0f, trilinear(samples + sampleOffset(cell.x, cell.y, cell.z), local - Vec3f(cell),
                                   BrickGrid::kWidth, BrickGrid::kWidth * BrickGrid::kWidth));
}

Ray PathTracer::blurredRay(double x, double y, PathRandom& random) const {
  const double u = double(random.next()), v = double(random.next()), time = double(random.next());
  const Ray ray = camera_.ray(x, y, u, v, time);
  return motion_ ? motion_->toBody(ray, shutter_.open + time * (shutter_.close - shutter_.open)) : ray;
}

bool PathTracer::enter(const Ray& ray, LatticeRay& out) const {
  Vec3d origin = shift_, direction{};
  for (int row = 0; row != 3; ++row)
    for (int column = 0; column != 3; ++column) {
      const double m = double(map_.linear(row, column));
      origin[row] += m * ray.origin[column];
      direction[row] += m * ray.direction[column];
    }
  double first = 0, last = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis != 3; ++axis) {
    const double low = double(bounds_.min[axis]) - origin[axis],
                 high = double(bounds_.max[axis]) - origin[axis];
    if (direction[axis] == 0) {
      if (low > 0 || high < 0) return false;
      continue;
    }
    const double a = low / direction[axis], b = high / direction[axis];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  out = {Vec3f(origin + direction * first), Vec3f(direction)};
  return last > first;
}

void PathTracer::trace(const Ray& camera, PathRandom& random, PathSums& sums) const {
  LatticeRay ray;
  if (!enter(camera, ray)) return;
  Vec3f direction(camera.direction), weight{1, 1, 1};
  float s = freePath(ray, weight, sums.emission, random);
  if (s == kInfinite) {
    sums.opacity += Vec3d{1, 1, 1} - Vec3d(weight);
    return;
  }
  sums.opacity += Vec3d{1, 1, 1};
  for (int scattering = 1;; ++scattering) {
    ++sums.scatterings;
    ray.origin += ray.direction * s;
    weight = weight * medium_.albedo * colour(ray.origin);
    if (largest(weight) < kLeastWeight) {
      if (random.next() * kLeastWeight >= largest(weight)) return;
      weight *= kLeastWeight / largest(weight);
    }
    for (std::size_t i = 0; i != suns_.size(); ++i) {
      const Sun& sun = suns_[i];
      const float phase = medium_.phase(dot(direction, sun.towards));
      const Vec3f through = transmittance({ray.origin, sun.lattice}, kInfinite, sun.shadow, random);
      sums.light[i] += Vec3d(weight * sun.irradiance * through) * double(phase);
    }
    for (std::size_t i = 0; i != lights_.locals.size(); ++i)
      sums.light[suns_.size() + i] += local(lights_.locals[i], ray.origin, direction, weight, random);
    if (skyMap_) sums.light.back() += drawnSky(ray.origin, direction, weight, random);
    const bool isLast = scattering == options_.maxScatterings;
    if (isLast && !hasSky_ && !scene_.emission.table) return;
    const float lobe = random.next(), turn = random.next();
    const Vec3f before = direction;
    direction = scattered(direction, medium_.phase.sampleCosine(lobe, random.next()), turn);
    ray.direction = map_.linear * direction;
    s = freePath(ray, weight, sums.emission, random);
    if (s == kInfinite) {
      if (!skyMap_) {
        sums.light.back() += Vec3d(weight * lights_.sky);
        return;
      }
      const float own = medium_.phase(dot(before, direction)), drawn = skyMap_->density(direction);
      sums.light.back() += Vec3d(weight * skyMap_->radiance(direction)) * double(own / (own + drawn));
      return;
    }
    if (isLast) return;
  }
}

Vec3d PathTracer::local(const LocalLight& light, const Vec3f& at, const Vec3f& direction, const Vec3f& weight,
                        PathRandom& random) const {
  const Vec3f way = light.position - latticeToWorld_(at);
  const float distance = std::fmax(length(way), leastStep_);
  const Vec3f towards = way / distance;
  const float share =
      medium_.phase(dot(direction, towards)) * light.decayAt(distance) * light.coneAt(-towards);
  if (!(share > 0)) return {};
  const Vec3f through = transmittance({at, map_.linear * towards}, distance, light.shadow * colour_, random);
  return Vec3d(weight * light.intensity * through) * double(share);
}

Vec3d PathTracer::drawnSky(const Vec3f& at, const Vec3f& direction, const Vec3f& weight,
                           PathRandom& random) const {
  const float a = random.next(), b = random.next(), c = random.next();
  const Environment::Sample sky = skyMap_->sample(a, b, c, random.next());
  if (!(sky.density > 0)) return {};
  const float phase = medium_.phase(dot(direction, sky.towards));
  const Vec3f through = transmittance({at, map_.linear * sky.towards}, kInfinite, colour_, random);
  return Vec3d(weight * through * skyMap_->radiance(sky.towards)) * double(phase / (sky.density + phase));
}

}  // namespace nephele::detail
