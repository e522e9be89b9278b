// From volumes, lights and a camera to a picture.
//
// Light first: a column density volume for every sun, a visibility volume for the sky. Then tiles of the
// picture in parallel; a pixel is the mean of its rays, so nothing depends on the order of tiles.
//
// Sampling: every pixel uses the same well spread points, warped to a tent filter, so that neighbours differ
// by what they see and not by luck. Where in its step a ray samples is spread over the rays of a pixel too,
// and shifted from pixel to pixel by a rank-1 lattice (the R2 sequence of M. Roberts), whose error is
// high-frequency: steps leave no bands, and no grain.
// Linear interpolation errs in proportion to f (1 - f), f the place within a cell, which would show the
// lattices as faint terraces; four rays that read a quarter of a cell to the sides of theirs cancel it but
// for its constant part.
//
// Limits: one volume; the colours of the albedo do not change the sky's visibility.
#include "render/raymarch.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <optional>

#include "modeling/error.h"
#include "modeling/parallel.h"
#include "render/ambient_volume.h"
#include "render/light_volume.h"
#include "render/march_kernels.h"

namespace nephele {

namespace {

constexpr int kTile = 16;

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double fraction(double x) {
  return x - std::floor(x);
}

// Where in the pixel, in its steps, and beside the nodes of lattices a ray is.
struct SubSample {
  double x = 0.5, y = 0.5;
  double step = 0.5;
  Vec3f lattice{};
};

// Uniform in [0, 1) to a tent over [-1, 1].
double tent(double u) {
  return u < 0.5 ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u);
}

std::vector<SubSample> pixelPattern(int count, std::uint64_t seed) {
  if (count == 1) return {SubSample{}};
  // Powers of the root of x^4 = x + 1: the lattice of R3, even in all three coordinates for every count.
  constexpr double a = 0.8191725133961644, b = 0.6710436067037893, c = 0.5497004779019702;
  const double shift = fraction(double(seed % 65536) * 0.6180339887498949);
  std::vector<SubSample> pattern;
  for (int i = 0; i != count; ++i)
    pattern.push_back({0.5 + tent(fraction(0.5 + shift + a * (i + 1))),
                       0.5 + tent(fraction(0.5 + shift + b * (i + 1))), fraction(shift + c * (i + 1))});
  // Every part of a step once: the order comes from the lattice, the places are even.
  std::vector<int> order(pattern.size());
  for (std::size_t i = 0; i != order.size(); ++i) order[i] = int(i);
  std::sort(order.begin(), order.end(),
            [&](int i, int j) { return pattern[std::size_t(i)].step < pattern[std::size_t(j)].step; });
  for (std::size_t rank = 0; rank != order.size(); ++rank)
    pattern[std::size_t(order[rank])].step = double(rank) / count;
  // Corners of a tetrahedron, a quarter of a cell from the centre.
  constexpr Vec3f corners[] = {
      {0.25f, 0.25f, 0.25f}, {-0.25f, -0.25f, 0.25f}, {-0.25f, 0.25f, -0.25f}, {0.25f, -0.25f, -0.25f}};
  for (std::size_t i = 0; i + 3 < pattern.size(); i += 4)
    for (std::size_t corner = 0; corner != 4; ++corner) pattern[i + corner].lattice = corners[corner];
  return pattern;
}

// How a ray in the world becomes one in a lattice, in double since cameras may stand far away.
struct LatticeMap {
  double m[3][3], t[3];

  explicit LatticeMap(const Affine& a, const Vec3i& firstBrick = {}) {
    for (int row = 0; row != 3; ++row) {
      for (int column = 0; column != 3; ++column) m[row][column] = a.linear(row, column);
      t[row] = double(a.translation[row]) - 8.0 * firstBrick[row];
    }
  }
  Vec3d vector(const Vec3d& v) const {
    Vec3d r;
    for (int row = 0; row != 3; ++row) r[row] = m[row][0] * v.x + m[row][1] * v.y + m[row][2] * v.z;
    return r;
  }
  Vec3d point(const Vec3d& p) const { return vector(p) + Vec3d{t[0], t[1], t[2]}; }
  LatticeRay ray(const Vec3d& origin, const Vec3d& direction) const {
    return {Vec3f(point(origin)), Vec3f(vector(direction))};
  }
};

// The part of a ray inside a box, as distances; empty if far <= near.
struct Span {
  double near = 0, far = std::numeric_limits<double>::infinity();
};

Span clip(const Vec3d& origin, const Vec3d& direction, const Box& box) {
  Span span;
  for (int axis = 0; axis != 3; ++axis) {
    if (direction[axis] == 0) {
      if (origin[axis] < box.min[axis] || origin[axis] > box.max[axis]) return {0, 0};
      continue;
    }
    const double a = (box.min[axis] - origin[axis]) / direction[axis],
                 b = (box.max[axis] - origin[axis]) / direction[axis];
    span.near = std::max(span.near, std::min(a, b));
    span.far = std::min(span.far, std::max(a, b));
  }
  return span;
}

// What the rays of one pixel add up to.
struct Pixel {
  float alpha = 0;
  float depth = std::numeric_limits<float>::infinity();
  /// Every sun in turn, then the sky.
  Vec3f light[MarchScene::kMostSuns + 1];
};

void check(const Medium& medium, const Lights& lights, const RenderOptions& options) {
  require(std::isfinite(medium.extinction) && medium.extinction >= 0,
          fmt::format("extinction: expected a finite number >= 0, got {}", medium.extinction));
  for (int c = 0; c != 3; ++c) {
    require(medium.albedo[c] >= 0 && medium.albedo[c] <= 1,
            fmt::format("albedo: expected three numbers within [0, 1], got {}", medium.albedo[c]));
    require(std::isfinite(lights.sky[c]) && lights.sky[c] >= 0,
            fmt::format("sky: expected three numbers >= 0, got {}", lights.sky[c]));
  }
  require(int(lights.suns.size()) <= MarchScene::kMostSuns,
          fmt::format("sun: at most {} are possible, got {}", MarchScene::kMostSuns, lights.suns.size()));
  require(options.octaves.count >= 1 && options.octaves.count <= MarchScene::kMostOctaves,
          fmt::format("octaves: expected 1 to {}, got {}", MarchScene::kMostOctaves, options.octaves.count));
  require(options.samples >= 1 && options.samples <= 4096,
          fmt::format("samples: expected 1 to 4096, got {}", options.samples));
  require(!options.step || (std::isfinite(*options.step) && *options.step > 0),
          fmt::format("step: expected a length > 0, got {}", options.step.value_or(0)));
}

// Volumes, lights and options of one picture, tied together for the kernels.
class Picture {
 public:
  Picture(const RenderVolume& volume, const Medium& medium, const Lights& lights, const Camera& camera,
          const RenderOptions& options, const Progress& progress)
      : medium_(medium),
        lights_(lights),
        camera_(camera),
        pattern_(pixelPattern(options.samples, options.seed)),
        toDensity_(volume.density().worldToIndex, volume.density().firstBrick) {
    const BrickGrid& grid = volume.density();
    scene_.density = {grid.values.data(), grid.table.data(), grid.brickCount};
    scene_.ranges = grid.ranges.data();
    scene_.emptiness = volume.emptiness().data();
    scene_.extinction = medium.extinction;
    scene_.octaves = options.octaves.count;
    scene_.step = options.step.value_or(grid.voxelSize);
    scene_.uniformStep = options.step.value_or(4 * grid.voxelSize);
    // The rays of a pixel divide each other's steps, so that together they may take longer ones.
    scene_.stepDepth = options.samples == 1 ? 0.25f : 0.5f;
    scene_.leastStep = std::min(scene_.step, grid.voxelSize) / 8;
    scene_.pixelAngle = float(camera.pixelAngle());
    scene_.colours = medium.albedo.x == medium.albedo.y && medium.albedo.x == medium.albedo.z ? 1 : 3;
    const Vec3f corner(grid.firstBrick * BrickGrid::kBrick);
    bounds_ = {volume.indexBounds().min - corner, volume.indexBounds().max - corner};

    suns_.reserve(lights.suns.size());
    for (const DistantLight& sun : lights.suns) {
      progress.begin("light " + sun.name);
      const LightVolume& light = suns_.emplace_back(volume, sun.direction, progress);
      scene_.suns.push_back({light.values().data(), light.table().data(), light.brickCount()});
      toSun_.emplace_back(light.worldToLattice(), light.firstBrick());
      directions_.push_back(normalize(Vec3d(sun.direction)));
    }
    if (lights.sky != Vec3f{}) {
      progress.begin("light sky");
      sky_.emplace(volume, medium, options.octaves, progress);
      toSky_.emplace(sky_->worldToLattice());
      scene_.sky = sky_->values().data();
      scene_.skySize = sky_->size();
    }
    for (int n = 0; n != options.octaves.count; ++n) {
      phases_.push_back(medium.phase.flattened(std::pow(options.octaves.eccentricity, float(n))));
      for (int c = 0; c != 3; ++c)
        octaveWeight_[c][n] = std::pow(options.octaves.contribution, float(n)) *
                              std::pow(medium.albedo[c], std::ldexp(1.0f, n));
    }
  }

  // Marches the rays of a pixel; returns the samples taken. `rays` and `results` are scratch.
  std::uint64_t pixel(int x, int y, Pixel& out, std::vector<MarchRay>& rays,
                      std::vector<MarchResult>& results) const;

 private:
  bool prepare(const Ray& ray, const SubSample& sub, double shift, MarchRay& out) const;

  const Medium& medium_;
  const Lights& lights_;
  const Camera& camera_;
  std::vector<SubSample> pattern_;
  LatticeMap toDensity_;
  std::vector<LatticeMap> toSun_;
  std::optional<LatticeMap> toSky_;
  std::vector<LightVolume> suns_;
  std::optional<AmbientVolume> sky_;
  std::vector<Vec3d> directions_;
  std::vector<Phase> phases_;
  float octaveWeight_[3][MarchScene::kMostOctaves] = {};
  MarchScene scene_;
  Box bounds_;
};

bool Picture::prepare(const Ray& ray, const SubSample& sub, double shift, MarchRay& out) const {
  const Span span = clip(toDensity_.point(ray.origin), toDensity_.vector(ray.direction), bounds_);
  if (!(span.far > span.near)) return false;
  const Vec3d entry = ray.origin + ray.direction * span.near;
  out.density = toDensity_.ray(entry, ray.direction);
  out.start = float(span.near);
  out.length = float(span.far - span.near);
  out.jitter = float(sub.step + shift);
  out.cosine = float(dot(ray.direction, camera_.forward()));
  out.density.origin += sub.lattice;
  if (toSky_) {
    out.sky = toSky_->ray(entry, ray.direction);
    out.sky.origin += sub.lattice;
  }
  for (std::size_t sun = 0; sun != toSun_.size(); ++sun) {
    out.suns[sun] = toSun_[sun].ray(entry, ray.direction);
    out.suns[sun].origin += sub.lattice;
    // Light travels away from the sun, then back along the ray.
    const float cosine = float(dot(directions_[sun], ray.direction));
    for (int n = 0; n != scene_.octaves; ++n) {
      const float phase = phases_[std::size_t(n)](cosine);
      for (int c = 0; c != scene_.colours; ++c) out.weight[sun][c][n] = phase * octaveWeight_[c][n];
    }
  }
  return true;
}

std::uint64_t Picture::pixel(int x, int y, Pixel& out, std::vector<MarchRay>& rays,
                             std::vector<MarchResult>& results) const {
  const std::size_t count = pattern_.size();
  const double shift =
      count > 1 ? fraction(0.7548776662466927 * x + 0.5698402909980532 * y) / double(count) : 0.0;
  rays.resize(count);
  results.resize(count);
  std::size_t live = 0;
  for (const SubSample& sub : pattern_)
    if (prepare(camera_.ray(x + sub.x, y + sub.y), sub, shift, rays[live])) ++live;
  marchRays(scene_, {rays.data(), live}, {results.data(), live});

  out = {};
  std::uint64_t samples = 0;
  const float share = 1.0f / float(count);
  for (std::size_t i = 0; i != live; ++i) {
    const MarchResult& result = results[i];
    samples += result.samples;
    out.alpha += share * -std::expm1(-result.opticalDepth);
    out.depth = std::min(out.depth, result.distance * rays[i].cosine);
    for (std::size_t sun = 0; sun != lights_.suns.size(); ++sun)
      for (int c = 0; c != 3; ++c)
        out.light[sun][c] +=
            share * lights_.suns[sun].irradiance[c] * result.suns[sun][scene_.colours == 1 ? 0 : c];
    out.light[lights_.suns.size()] += share * result.sky * (lights_.sky * medium_.albedo);
  }
  return samples;
}

// Channels of a picture and how a pixel fills them.
class Film {
 public:
  Film(const Camera& camera, const Lights& lights, const RenderOptions& options)
      : lightCount_(lights.suns.size() + 1) {
    image_.width = camera.width();
    image_.height = camera.height();
    for (const char* name : {"R", "G", "B", "A"}) image_.add(name);
    for (const std::string& layer : options.aovs) {
      if (layer == "Z") {
        depth_ = addLayer({"Z"});
      } else if (layer == "transmittance") {
        transmittance_ = addLayer({"transmittance.R", "transmittance.G", "transmittance.B"});
      } else if (layer == "light") {
        light_ = int(image_.channels.size());
        for (const DistantLight& sun : lights.suns) addLight(sun.name);
        addLight("sky");
      } else {
        throw Error(fmt::format("aov: expected Z, transmittance or light, got '{}'", layer));
      }
    }
  }

  void set(std::size_t at, const Pixel& pixel) {
    Vec3f colour;
    for (std::size_t i = 0; i != lightCount_; ++i) colour += pixel.light[i];
    for (int c = 0; c != 3; ++c) {
      value(c, at) = colour[c];
      if (transmittance_ >= 0) value(transmittance_ + c, at) = 1.0f - pixel.alpha;
      if (light_ >= 0)
        for (std::size_t i = 0; i != lightCount_; ++i) value(light_ + int(i) * 3 + c, at) = pixel.light[i][c];
    }
    value(3, at) = pixel.alpha;
    if (depth_ >= 0) value(depth_, at) = pixel.depth;
  }

  Image& image() { return image_; }

 private:
  int addLayer(std::initializer_list<std::string> names) {
    const int first = int(image_.channels.size());
    for (const std::string& name : names) {
      require(!image_.find(name), fmt::format("aov: {} is named twice", name));
      image_.add(name, false);
    }
    return first;
  }
  void addLight(const std::string& name) {
    addLayer({"light_" + name + ".R", "light_" + name + ".G", "light_" + name + ".B"});
  }
  float& value(int channel, std::size_t at) { return image_.channels[std::size_t(channel)].values[at]; }

  Image image_;
  std::size_t lightCount_;
  int depth_ = -1, transmittance_ = -1, light_ = -1;
};

}  // namespace

float defaultExtinction(const RenderVolume& volume) {
  const float side = volume.worldBounds().longestSide();
  return side > 0 ? 150.0f / (side * std::max(volume.typicalDensity(), 1.0f)) : 1.0f;
}

double estimateRenderBytes(const RenderVolume& volume, const Lights& lights, const Camera& camera,
                           const RenderOptions& options) {
  double channels = 4;
  for (const std::string& layer : options.aovs)
    channels += layer == "Z" ? 1 : layer == "light" ? 3.0 * double(lights.suns.size() + 1) : 3;
  return double(lights.suns.size()) * LightVolume::estimateBytes(volume) +
         (lights.sky != Vec3f{} ? AmbientVolume::estimateBytes(volume) : 0.0) +
         double(camera.width()) * camera.height() * channels * sizeof(float);
}

RenderResult renderImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                         const Camera& camera, const RenderOptions& options, const Progress& progress) {
  check(medium, lights, options);
  Film film(camera, lights, options);
  RenderResult result;
  const int width = camera.width(), height = camera.height();
  result.rays = std::uint64_t(width) * std::uint64_t(height) * std::uint64_t(options.samples);
  if (volume.isEmpty() || medium.extinction == 0) {
    for (std::size_t i = 0; i != std::size_t(width) * height; ++i) film.set(i, {});
    result.image = std::move(film.image());
    return result;
  }

  const auto lightStart = std::chrono::steady_clock::now();
  const Picture picture(volume, medium, lights, camera, options, progress);
  result.lightSeconds = secondsSince(lightStart);

  const auto marchStart = std::chrono::steady_clock::now();
  progress.begin("march");
  const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
  std::atomic<std::uint64_t> samples{0};
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t end) {
        std::vector<MarchRay> rays;
        std::vector<MarchResult> results;
        Pixel pixel;
        for (std::size_t tile = begin; tile != end; ++tile) {
          const int x0 = int(tile % std::size_t(across)) * kTile,
                    y0 = int(tile / std::size_t(across)) * kTile;
          std::uint64_t taken = 0;
          for (int y = y0; y < std::min(y0 + kTile, height); ++y)
            for (int x = x0; x < std::min(x0 + kTile, width); ++x) {
              taken += picture.pixel(x, y, pixel, rays, results);
              film.set(std::size_t(y) * width + x, pixel);
            }
          samples += taken;
        }
      },
      progress);
  result.samples = samples;
  progress.count("rays", double(result.rays));
  progress.count("samples", double(result.samples));
  result.marchSeconds = secondsSince(marchStart);
  result.image = std::move(film.image());
  return result;
}

}  // namespace nephele
