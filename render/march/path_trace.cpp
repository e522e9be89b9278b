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
//
// Limits: suns that shine through a narrow forward peak make noise that falls slowly, since they are points
// and no direction but the exact one finds them.
#include "nephele/render/march/path_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/scene/environment.h"
#include "nephele/render/volume/brick_walk.h"

namespace nephele {

namespace {

constexpr int kTile = 8;
// Below these shares of light, transmittances and paths play Russian roulette.
constexpr float kLeastTransmittance = 0.1f;
constexpr float kLeastWeight = 0.2f;
constexpr float kInfinite = std::numeric_limits<float>::infinity();

class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t pixel, std::uint64_t path)
      : state_(mixed(mixed(mixed(seed) + pixel) + path)) {}

  /// Uniform in [0, 1).
  float next() { return float(bits() >> 40) * 0x1p-24f; }
  /// Exponential with mean 1.
  float depth() { return -std::log(1.0f - next()); }

 private:
  // The finaliser of SplitMix64 (Steele, Lea, Flood 2014), a bijection.
  static std::uint64_t mixed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  std::uint64_t bits() {
    const std::uint64_t value = mixed(state_);
    state_ += 0x9e3779b97f4a7c15u;
    return value;
  }

  std::uint64_t state_;
};

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

// What the paths of one pixel add up to.
struct Sums {
  std::uint64_t scatterings = 0;
  /// Paths that meet anything; where colours differ in extinction, the share of each that does.
  Vec3d opacity{};
  Vec3d emission{};
  /// As Lights::names.
  std::vector<Vec3d> light;
};

class PathTracer {
 public:
  PathTracer(const RenderVolume& volume, const Medium& medium, const Lights& lights, const Camera& camera,
             const PathOptions& options)
      : medium_(medium), lights_(lights), camera_(camera), options_(options) {
    // The extinction is that of the most opaque colour.
    medium_.extinction *= largest(medium.extinctionColour);
    colour_ = medium.extinctionColour / largest(medium.extinctionColour);
    perEmission_ = medium.extinction;
    const BrickGrid& grid = volume.density();
    scene_.density = {grid.values.data(), grid.table.data(), grid.brickCount};
    scene_.ranges = grid.ranges.data();
    scene_.emptiness = volume.emptiness().data();
    if (volume.hasColour()) {
      const VolumeColour::Grids& colours = volume.colour().scattering;
      for (std::size_t c = 0; c != 3; ++c) scene_.colour.values[c] = colours[c]->values.data();
      scene_.colour.table = colours[0]->table.data();
      scene_.colour.count = colours[0]->brickCount;
    }
    if (volume.hasEmission()) {
      const VolumeColour::Grids& glow = volume.colour().emission;
      for (std::size_t c = 0; c != 3; ++c) scene_.emission.values[c] = glow[c]->values.data();
      scene_.emission.table = glow[0]->table.data();
      scene_.emission.count = glow[0]->brickCount;
      leastBound_ = 1 / (BrickGrid::kBrick * grid.voxelSize);
    }
    isColoured_ = volume.hasEmission() || colour_ != Vec3f{1, 1, 1};
    map_ = grid.worldToIndex;
    leastStep_ = 1e-4f * grid.voxelSize;
    const Vec3f corner(grid.firstBrick * BrickGrid::kBrick);
    shift_ = Vec3d(map_.translation) - Vec3d(corner);
    bounds_ = {volume.indexBounds().min - corner, volume.indexBounds().max - corner};
    for (const DistantLight& sun : lights.suns) {
      const Vec3f towards = normalize(sun.direction);
      suns_.push_back({towards, map_.linear * towards, sun.irradiance, sun.shadow * colour_});
    }
    latticeToWorld_ = {grid.indexToWorld.linear, grid.indexToWorld(corner)};
    hasSky_ = lights.hasSky();
    skyMap_ = lights.map.get();
    blurred_ = camera.hasLens() || camera.isMoving() || options.volumeMotion;
  }

  // Traces the paths of a pixel and adds them to `sums`.
  void pixel(int x, int y, Sums& sums) const {
    const std::uint64_t index = std::uint64_t(y) * std::uint64_t(camera_.width()) + std::uint64_t(x);
    Random offset(options_.seed, index, ~std::uint64_t(0));
    const double u = double(offset.next()), v = double(offset.next());
    for (int i = 0; i != options_.samplesPerPixel; ++i) {
      const std::uint64_t path = options_.firstSample + std::uint64_t(i);
      const double number = double(path + 1);
      Random random(options_.seed, index, path);
      const double px = x + 0.5 + tent(fraction(u + 0.7548776662466927 * number)),
                   py = y + 0.5 + tent(fraction(v + 0.5698402909980532 * number));
      trace(blurred_ ? blurredRay(px, py, random) : camera_.ray(px, py), random, sums);
    }
  }

 private:
  struct Sun {
    Vec3f towards, lattice, irradiance, shadow;
  };

  // Tentative collisions along `length` of a ray, by delta tracking: calls meet(s, bound, pool) at each
  // until it returns false; boundOf(pool) is an extinction that none in the brick exceeds.
  template <class BoundOf, class Meet>
  void collide(const LatticeRay& ray, float length, Random& random, BoundOf&& boundOf, Meet&& meet) const {
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

  // Distance to the next collision from the origin of `ray`; infinite if it leaves the volume.
  float freePath(const LatticeRay& ray, Random& random) const {
    float hit = kInfinite;
    collide(
        ray, kInfinite, random,
        [&](std::int32_t pool) { return medium_.extinction * scene_.ranges[pool].max; },
        [&](float s, float, std::int32_t pool) {
          if (!(random.next() * scene_.ranges[pool].max < density(ray.origin + ray.direction * s)))
            return true;
          hit = s;
          return false;
        });
    return hit;
  }

  // The same where colours differ in extinction or something glows. A tentative collision is real by a chance
  // that lies between those of the colours, by their weights, and each weight makes up for it (spectral
  // tracking, Kutz, Habel, Li and Novak 2017); at each one the path sees what glows there per extinction.
  float freePath(const LatticeRay& ray, Vec3f& weight, Vec3d& glow, Random& random) const {
    if (!isColoured_) return freePath(ray, random);
    float hit = kInfinite;
    collide(
        ray, kInfinite, random,
        [&](std::int32_t pool) {
          return std::fmax(medium_.extinction * scene_.ranges[pool].max, leastBound_);
        },
        [&](float s, float bound, std::int32_t) {
          const Vec3f p = ray.origin + ray.direction * s;
          if (scene_.emission.table)
            for (int c = 0; c != 3; ++c)
              glow[c] += double(weight[c] * perEmission_ / bound) *
                         double(valueAt(
                             {scene_.emission.values[c], scene_.emission.table, scene_.emission.count}, p));
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

  // The same in three colours whose shadows are multiplied by `shadow`.
  Vec3f transmittance(const LatticeRay& ray, float length, const Vec3f& shadow, Random& random) const {
    const float red = transmittance(ray, length, shadow.x, random);
    if (shadow.x == shadow.y && shadow.x == shadow.z) return {red, red, red};
    const float green = transmittance(ray, length, shadow.y, random);
    return {red, green, transmittance(ray, length, shadow.z, random)};
  }

  // An unbiased estimate of exp(-shadow * optical depth) along `length` from the origin of `ray` on.
  float transmittance(const LatticeRay& ray, float length, float shadow, Random& random) const {
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

  float density(const Vec3f& p) const { return valueAt(scene_.density, p); }

  // What the albedo is multiplied by.
  Vec3f colour(const Vec3f& p) const {
    if (!scene_.colour.table) return {1, 1, 1};
    const float there = density(p);
    Vec3f result;
    for (int c = 0; c != 3 && there > 0; ++c)
      result[c] = valueAt({scene_.colour.values[c], scene_.colour.table, scene_.colour.count}, p) / there;
    return result;
  }

  // As the marcher interpolates.
  static float valueAt(const MarchScene::Bricks& bricks, const Vec3f& p) {
    int brick[3], cell[3];
    float f[3];
    for (int axis = 0; axis != 3; ++axis) {
      brick[axis] = std::clamp(int(p[axis] * 0.125f), 0, bricks.count[axis] - 1);
      const float local = std::clamp(p[axis] - 8.0f * float(brick[axis]), 0.0f, 7.9999995f);
      cell[axis] = int(local);
      f[axis] = local - float(cell[axis]);
    }
    const std::size_t entry = (std::size_t(brick[2]) * std::size_t(bricks.count.y) + std::size_t(brick[1])) *
                                  std::size_t(bricks.count.x) +
                              std::size_t(brick[0]);
    constexpr int row = BrickGrid::kWidth, plane = row * row;
    const float* at = bricks.values + std::size_t(bricks.table[entry]) * std::size_t(BrickGrid::kVolume) +
                      sampleOffset(cell[0], cell[1], cell[2]);
    const auto edge = [&](int offset) { return at[offset] + f[0] * (at[offset + 1] - at[offset]); };
    const float near0 = edge(0), near1 = edge(row), far0 = edge(plane), far1 = edge(plane + row);
    const float near = near0 + f[1] * (near1 - near0), far = far0 + f[1] * (far1 - far0);
    return std::fmax(0.0f, near + f[2] * (far - near));
  }

  // A ray through any point of the lens at any time, as the volume sees it.
  Ray blurredRay(double x, double y, Random& random) const {
    const double u = double(random.next()), v = double(random.next()), time = double(random.next());
    const Ray ray = camera_.ray(x, y, u, v, time);
    const Shutter& shutter = options_.shutter;
    return options_.volumeMotion
               ? options_.volumeMotion->toBody(ray, shutter.open + time * (shutter.close - shutter.open))
               : ray;
  }

  // Where a ray of the camera enters the volume; false if it misses it.
  bool enter(const Ray& ray, LatticeRay& out) const {
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

  void trace(const Ray& camera, Random& random, Sums& sums) const {
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

  // What a light at a place sends on along a path.
  Vec3d local(const LocalLight& light, const Vec3f& at, const Vec3f& direction, const Vec3f& weight,
              Random& random) const {
    const Vec3f way = light.position - latticeToWorld_(at);
    const float distance = std::fmax(length(way), leastStep_);
    const Vec3f towards = way / distance;
    const float share =
        medium_.phase(dot(direction, towards)) * light.decayAt(distance) * light.coneAt(-towards);
    if (!(share > 0)) return {};
    const Vec3f through =
        transmittance({at, map_.linear * towards}, distance, light.shadow * colour_, random);
    return Vec3d(weight * light.intensity * through) * double(share);
  }

  // The sky in a direction drawn from the map.
  Vec3d drawnSky(const Vec3f& at, const Vec3f& direction, const Vec3f& weight, Random& random) const {
    const float a = random.next(), b = random.next(), c = random.next();
    const Environment::Sample sky = skyMap_->sample(a, b, c, random.next());
    if (!(sky.density > 0)) return {};
    const float phase = medium_.phase(dot(direction, sky.towards));
    const Vec3f through = transmittance({at, map_.linear * sky.towards}, kInfinite, colour_, random);
    return Vec3d(weight * through * skyMap_->radiance(sky.towards)) * double(phase / (sky.density + phase));
  }

  Medium medium_;
  const Lights& lights_;
  const Environment* skyMap_ = nullptr;
  Affine latticeToWorld_;
  const Camera& camera_;
  const PathOptions& options_;
  MarchScene scene_;
  std::vector<Sun> suns_;
  Affine map_;
  Vec3d shift_;
  Box bounds_;
  // Extinction of every colour relative to the largest, and of density 1.
  Vec3f colour_{1, 1, 1};
  float perEmission_ = 0.0f;
  // Of the extinction where something glows, which may have none.
  float leastBound_ = 0.0f;
  bool isColoured_ = false;
  bool hasSky_ = false;
  bool blurred_ = false;
  // Makes walks end whatever the extinction is.
  float leastStep_ = 0.0f;
};

void check(const Medium& medium, const Lights& lights, const PathOptions& options) {
  require(options.samplesPerPixel >= 1 && options.samplesPerPixel <= 1 << 20,
          fmt::format("spp: expected 1 to {}, got {}", 1 << 20, options.samplesPerPixel));
  require(options.maxScatterings >= 0,
          fmt::format("scatterings: expected 0 (no limit) or more, got {}", options.maxScatterings));
  require(std::isfinite(medium.extinction) && medium.extinction >= 0,
          fmt::format("extinction: expected a finite number >= 0, got {}", medium.extinction));
  for (int c = 0; c != 3; ++c) {
    require(medium.albedo[c] >= 0 && medium.albedo[c] <= 1,
            fmt::format("albedo: expected three numbers within [0, 1], got {}", medium.albedo[c]));
    require(std::isfinite(medium.extinctionColour[c]) && medium.extinctionColour[c] >= 0,
            fmt::format("extinction colour: expected three finite numbers >= 0, got {}",
                        medium.extinctionColour[c]));
  }
  lights.check();
  bool deep = lights.deepTolerance.has_value();
  for (const DistantLight& sun : lights.suns) deep = deep || sun.deepShadow;
  for (const LocalLight& light : lights.locals) deep = deep || light.deepShadow;
  require(!deep, "path tracing: deep shadow maps can only be marched");
}

// Adds the layers of `aovs` to `image`; all that is no light comes from a march without light.
void addLayers(Image& image, const RenderVolume& volume, const Medium& medium, const Lights& lights,
               const Camera& camera, const PathOptions& pathOptions) {
  const auto add = [&](const std::string& name) -> Image::Channel& {
    require(!image.find(name), fmt::format("aov: {} is named twice", name));
    return image.add(name, false);
  };
  for (const std::string& layer : pathOptions.aovs) {
    if (layer == "transmittance") {
      for (const char* c : {"R", "G", "B"}) add(std::string("transmittance.") + c);
    } else if (layer == "light") {
      for (const std::string& name : lights.names())
        for (const char* c : {".R", ".G", ".B"}) add("light_" + name + c);
    } else {
      RenderOptions options;
      options.octaves.count = 1;
      options.shutter = pathOptions.shutter;
      options.volumeMotion = pathOptions.volumeMotion;
      options.nextCamera = pathOptions.nextCamera;
      options.aovs = {layer};
      Image marched = renderImage(volume, medium, {}, camera, options).image;
      for (std::size_t i = 4; i != marched.channels.size(); ++i)
        add(marched.channels[i].name).values = std::move(marched.channels[i].values);
    }
  }
}

}  // namespace

RenderResult pathTraceImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                            const Camera& camera, const PathOptions& options, const Progress& progress) {
  check(medium, lights, options);
  require(!volume.field(), "path tracing: needs a density that is a grid; fieldVolume makes one of a field");
  RenderResult result;
  Image& image = result.image;
  const PixelBox window = camera.window();
  image.setWindow(window, camera.width(), camera.height());
  const int width = image.width, height = image.height;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  addLayers(image, volume, medium, lights, camera, options);
  result.rays = std::uint64_t(width) * std::uint64_t(height) * std::uint64_t(options.samplesPerPixel);
  const auto indexOf = [&](const std::string& name) {
    const auto at = std::find_if(image.channels.begin(), image.channels.end(),
                                 [&](const Image::Channel& channel) { return channel.name == name; });
    return at - image.channels.begin();
  };
  const auto end = std::ptrdiff_t(image.channels.size());
  const auto through = indexOf("transmittance.R"), first = indexOf("light_" + lights.names()[0] + ".R");
  if (through != end)
    for (int c = 0; c != 3; ++c)
      std::fill_n(image.channels[std::size_t(through + c)].values.begin(), std::size_t(width) * height, 1.0f);
  if (volume.isEmpty() || medium.extinction * largest(medium.extinctionColour) == 0) return result;

  const auto start = std::chrono::steady_clock::now();
  progress.begin("trace");
  const PathTracer tracer(volume, medium, lights, camera, options);
  const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
  const double share = 1.0 / options.samplesPerPixel;
  std::atomic<std::uint64_t> scatterings{0};
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t tileEnd) {
        Sums sums;
        for (std::size_t tile = begin; tile != tileEnd; ++tile) {
          const int x0 = int(tile % std::size_t(across)) * kTile,
                    y0 = int(tile / std::size_t(across)) * kTile;
          for (int y = y0; y < std::min(y0 + kTile, height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, width); ++x) {
              progress.check();
              sums = {sums.scatterings, {}, {}, std::vector<Vec3d>(lights.names().size())};
              tracer.pixel(window.x0 + x, window.y0 + y, sums);
              const std::size_t at = std::size_t(y) * std::size_t(width) + std::size_t(x);
              const auto set = [&](std::ptrdiff_t channel, double value) {
                image.channels[std::size_t(channel)].values[at] = float(value * share);
              };
              set(3, (sums.opacity.x + sums.opacity.y + sums.opacity.z) / 3);
              for (int c = 0; c != 3; ++c) {
                double total = sums.emission[c];
                for (const Vec3d& light : sums.light) total += light[c];
                set(c, total);
                if (through != end) set(through + c, double(options.samplesPerPixel) - sums.opacity[c]);
                for (std::size_t i = 0; first != end && i != sums.light.size(); ++i)
                  set(first + std::ptrdiff_t(3 * i) + c, sums.light[i][c]);
              }
            }
        }
        scatterings += sums.scatterings;
      },
      progress);
  result.samples = scatterings;
  progress.count("rays", double(result.rays));
  progress.count("samples", double(result.samples));
  result.marchSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace nephele
