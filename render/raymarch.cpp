// From volumes, lights and a camera to a picture.
//
// Light first: a column density volume for every sun, and what all lights scatter on a lattice. Then tiles of
// the picture in parallel; a pixel is the mean of its rays, so nothing depends on the order of tiles.
//
// Sampling: every pixel uses the same well spread points, warped to a tent filter, so that neighbours differ
// by what they see and not by luck. Where in its step a ray samples is spread over the rays of a pixel too,
// and shifted from pixel to pixel by a rank-1 lattice (the R2 sequence of M. Roberts), whose error is
// high-frequency: steps leave no bands, and no grain.
// Linear interpolation errs in proportion to f (1 - f), f the place within a cell, which would show the
// lattices as faint terraces; four rays that read a quarter of a cell to the sides of theirs cancel it but
// for its constant part.
//
// Limits: octaves are split by the mean albedo of the three colours.
#include "render/raymarch.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "modeling/error.h"
#include "modeling/parallel.h"
#include "render/deep_shadow.h"
#include "render/environment.h"
#include "render/film.h"
#include "render/light_volume.h"
#include "render/march_kernels.h"
#include "render/pixel_points.h"
#include "render/projected_light_volume.h"
#include "render/scattered_light.h"
#include "render/surfaces.h"

namespace nephele {

namespace {

constexpr int kTile = 16;

// Corners of a tetrahedron, a quarter of a cell from the centre.
constexpr Vec3f kCorners[] = {
    {0.25f, 0.25f, 0.25f}, {-0.25f, -0.25f, 0.25f}, {-0.25f, 0.25f, -0.25f}, {0.25f, -0.25f, -0.25f}};

// Optical depth of a full shadow.
constexpr float kDark = 40.0f;

// Directions in which the objects of a pixel look for the sky.
constexpr int kSkyRays = 64;

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double fraction(double x) {
  return x - std::floor(x);
}

// Where in the pixel, in its steps, and beside the nodes of lattices a ray is, and where on the lens and
// when.
struct SubSample {
  double x = 0.5, y = 0.5;
  double step = 0.5;
  Vec3f lattice{};
  double lensU = 0.5, lensV = 0.5, time = 0.5;
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
  for (std::size_t i = 0; i + 3 < pattern.size(); i += 4)
    for (std::size_t corner = 0; corner != 4; ++corner) pattern[i + corner].lattice = kCorners[corner];
  // Lens and time: the same lattice in an order that has nothing to do with the place in the pixel.
  std::uint64_t random = 0x9e3779b97f4a7c15u + seed;
  for (std::size_t i = order.size() - 1; i != 0; --i) {
    random = random * 6364136223846793005u + 1442695040888963407u;
    std::swap(order[i], order[std::size_t((random >> 33) % (i + 1))]);
  }
  for (std::size_t i = 0; i != order.size(); ++i) {
    const double n = order[i] + 1;
    pattern[i].lensU = fraction(0.5 + a * n);
    pattern[i].lensV = fraction(0.5 + b * n);
    pattern[i].time = fraction(0.5 + c * n);
  }
  // Times are even as well, for pictures in which nothing else is blurred.
  std::sort(order.begin(), order.end(),
            [&](int i, int j) { return pattern[std::size_t(i)].time < pattern[std::size_t(j)].time; });
  for (std::size_t rank = 0; rank != order.size(); ++rank)
    pattern[std::size_t(order[rank])].time = double(rank) / count;
  return pattern;
}

// The lens and time of a sub-sample in the pixel (x, y): shifted by lattices over the pixels, one for each,
// so that the error of neighbours is not the same and is high in frequency.
SubSample shifted(const SubSample& sub, int x, int y) {
  constexpr double a = 0.7548776662466927, b = 0.5698402909980532;
  SubSample result = sub;
  result.lensU = fraction(sub.lensU + a * x - b * y);
  result.lensV = fraction(sub.lensV + b * x - a * y);
  result.time = fraction(sub.time + b * x + a * y);
  return result;
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

void check(const Medium& medium, const Lights& lights, const Octaves& octaves) {
  require(std::isfinite(medium.extinction) && medium.extinction >= 0,
          fmt::format("extinction: expected a finite number >= 0, got {}", medium.extinction));
  for (int c = 0; c != 3; ++c) {
    require(medium.albedo[c] >= 0 && medium.albedo[c] <= 1,
            fmt::format("albedo: expected three numbers within [0, 1], got {}", medium.albedo[c]));
  }
  for (int c = 0; c != 3; ++c)
    require(std::isfinite(medium.extinctionColour[c]) && medium.extinctionColour[c] >= 0,
            fmt::format("extinction colour: expected three finite numbers >= 0, got {}",
                        medium.extinctionColour[c]));
  lights.check();
  require(octaves.count >= 1 && octaves.count <= MarchScene::kMostOctaves,
          fmt::format("octaves: expected 1 to {}, got {}", MarchScene::kMostOctaves, octaves.count));
}

void check(const RenderOptions& options) {
  require(options.samples >= 1 && options.samples <= 4096,
          fmt::format("samples: expected 1 to 4096, got {}", options.samples));
  require(!options.step || (std::isfinite(*options.step) && *options.step > 0),
          fmt::format("step: expected a length > 0, got {}", options.step.value_or(0)));
  require(std::isfinite(options.shutter.open) && std::isfinite(options.shutter.close) &&
              options.shutter.open <= options.shutter.close,
          fmt::format("shutter: expected an opening not after the closing, got {}, {}", options.shutter.open,
                      options.shutter.close));
}

}  // namespace

// A volume, its medium and the light in it, tied together for the kernels: all that does not depend on the
// camera.
struct detail::BakedLight {
  BakedLight(const RenderVolume& volume, const Medium& itsMedium, const Lights& itsLights,
             const Octaves& itsOctaves, const BakedLight* before, const Progress& progress,
             const Surfaces* surfaces)
      : source(&volume),
        medium(itsMedium),
        lights(itsLights),
        octaves(itsOctaves),
        voxelSize(volume.density().voxelSize),
        toDensity(volume.density().worldToIndex, volume.density().firstBrick) {
    const BrickGrid& grid = volume.density();
    scene.density = {grid.values.data(), grid.table.data(), grid.brickCount};
    scene.ranges = grid.ranges.data();
    scene.emptiness = volume.emptiness().data();
    // The scene's extinction is that of the most opaque colour.
    const float most =
        std::max({medium.extinctionColour.x, medium.extinctionColour.y, medium.extinctionColour.z});
    scene.extinction = medium.extinction * most;
    for (int c = 0; c != 3; ++c) scene.extinctionColour[c] = medium.extinctionColour[c] / most;
    setColours(volume, most);
    const bool grey = medium.albedo.x == medium.albedo.y && medium.albedo.x == medium.albedo.z;
    takeLights();
    scene.colours = grey && !scene.isColoured() && !lights.map ? 1 : 3;
    const Vec3f corner(grid.firstBrick * BrickGrid::kBrick);
    bounds = {volume.indexBounds().min - corner, volume.indexBounds().max - corner};

    suns.reserve(distant.size());
    for (const DistantLight& sun : distant) {
      progress.begin("light " + sun.name);
      LightVolume& light = suns.emplace_back(volume, sun.direction, progress);
      shadowDeeply(volume, sun, light, progress);
      if (surfaces && surfaces->castsShadows()) darken(light, normalize(Vec3d(sun.direction)), *surfaces);
      scene.suns.push_back({{light.values().data(), light.table().data(), light.brickCount()},
                            {sun.shadow.x, sun.shadow.y, sun.shadow.z}});
      toSun.emplace_back(light.worldToLattice(), light.firstBrick());
      directions.push_back(normalize(Vec3d(sun.direction)));
    }
    locals.reserve(lights.locals.size());
    for (const LocalLight& light : lights.locals) {
      progress.begin("light " + light.name);
      shadowDeeply(volume, light, locals.emplace_back(volume, light, progress), progress);
    }
    scatter(volume, before, progress);
    for (std::size_t i = 0; i != locals.size(); ++i) addLocal(lights.locals[i], locals[i]);
  }

  // Lays the shadows of objects into a light volume: at every node the share of the sun that is hidden from
  // the points a quarter of a voxel around it, so that edges are as soft as the lattice can show them.
  void darken(LightVolume& light, const Vec3d& towards, const Surfaces& surfaces) const {
    light.add([&](const Vec3f& world) {
      int hidden = 0;
      for (const Vec3f& corner : kCorners)
        hidden += surfaces.occluded({Vec3d(world + corner * voxelSize), towards},
                                    std::numeric_limits<double>::infinity());
      if (hidden == 0) return 0.0f;
      return (hidden == 4 ? kDark : -std::log(1 - 0.25f * float(hidden))) / scene.extinction;
    });
  }

  // Fills the columns of a light from its deep shadow map, if it has one.
  template <class Light, class Columns>
  void shadowDeeply(const RenderVolume& volume, const Light& light, Columns& columns,
                    const Progress& progress) const {
    std::shared_ptr<const DeepShadowMap> map = light.deepShadow;
    if (!map && lights.deepTolerance)
      map = std::make_shared<const DeepShadowMap>(volume, light, scene.extinction,
                                                  DeepShadowMap::Options{*lights.deepTolerance}, progress);
    if (!map || !(scene.extinction > 0)) return;
    columns.replace([&](const Vec3f& world) { return map->opticalDepth(world) / scene.extinction; });
  }

  // Lists the distant lights, those of the sky's map among them, and what becomes of every light's result.
  void takeLights() {
    distant = lights.suns;
    const std::size_t skyLayer = lights.suns.size() + lights.locals.size();
    for (std::size_t i = 0; i != distant.size(); ++i) layers.push_back(i);
    skyGain = lights.sky;
    if (lights.map) {
      Environment map = *lights.map;
      for (DistantLight& spot : map.takeSpots(MarchScene::kMostSuns - int(Lights::kMost))) {
        spot.name = "sky";
        distant.push_back(spot);
        layers.push_back(skyLayer);
      }
      sky = map;
      skyGain = {1, 1, 1};
    }
    for (const DistantLight& sun : distant) gains.push_back(sun.irradiance);
    for (std::size_t i = 0; i != lights.locals.size(); ++i) {
      gains.push_back(lights.locals[i].intensity);
      layers.push_back(lights.suns.size() + i);
    }
    layers.push_back(skyLayer);
    const auto noteShadow = [&](const Vec3f& s) {
      if (s.x != s.y || s.x != s.z) scene.hasColouredShadow = true;
    };
    for (const DistantLight& sun : distant) noteShadow(sun.shadow);
    for (const LocalLight& light : lights.locals) noteShadow(light.shadow);
  }

  // After `scatter`, which makes the phase functions.
  void addLocal(const LocalLight& light, const ProjectedLightVolume& shadows) {
    constexpr int nodes = MarchScene::Local::kPhaseNodes;
    if (phaseTable.empty())
      for (int n = 0; n != scene.octaves; ++n)
        for (int i = 0; i <= nodes; ++i) {
          const float sine = float(i) / float(nodes), cosine = 1 - 2 * sine * sine;
          const float next = n + 1 < scene.octaves ? phases[std::size_t(n + 1)](cosine) : 0.0f;
          phaseTable.push_back(phases[std::size_t(n)](cosine) - next);
        }
    MarchScene::Local& local = scene.locals.emplace_back();
    for (const ProjectedLightVolume::Face& face : shadows.faces())
      local.faces.push_back({{face.values.data(), face.table.data(), face.brickCount},
                             face.axis,
                             face.side,
                             face.perTangent,
                             face.perDepth,
                             Vec3f(face.firstBrick * LightVolume::kBrick)});
    for (int c = 0; c != 3; ++c) {
      local.shadow[c] = light.shadow[c];
      local.albedo[c] = medium.albedo[c];
    }
    local.decay = light.decay == Decay::quadratic ? 2 : light.decay == Decay::linear ? 1 : 0;
    local.decayStart = light.decayStart;
    if (light.cone) {
      local.hasCone = true;
      local.axis = shadows.worldToFrame().linear * normalize(light.cone->direction);
      local.outerCosine = light.outerCosine();
      local.perCosine = 1 / std::max(light.innerCosine() - local.outerCosine, 1e-6f);
    }
    local.phase = phaseTable.data();
    local.least = 1e-3f * voxelSize;
    toLocal.emplace_back(shadows.worldToFrame());
  }

  void setColours(const RenderVolume& volume, float most) {
    const auto set = [](const VolumeColour::Grids& grids, MarchScene::ColourBricks& bricks) {
      if (!grids[0]) return;
      for (std::size_t c = 0; c != 3; ++c) bricks.values[c] = grids[c]->values.data();
      bricks.table = grids[0]->table.data();
      bricks.count = grids[0]->brickCount;
    };
    set(volume.colour().scattering, scene.colour);
    set(volume.colour().emission, scene.emission);
    scene.emissionScale = 1 / most;
    meanAlbedo = medium.albedo * volume.meanColour();
  }

  // Sets what light does after its first scattering; the sky's part is that of `before` where skies are
  // equal.
  void scatter(const RenderVolume& volume, const BakedLight* before, const Progress& progress) {
    const float albedo = (meanAlbedo.x + meanAlbedo.y + meanAlbedo.z) / 3,
                g = std::max(medium.phase.meanCosine(), 0.0f);
    phases = {medium.phase};
    scene.octaves = g > 0 ? octaves.count : 1;
    for (int n = 1; n < scene.octaves; ++n) {
      scene.attenuation[n] = 1 - albedo * std::pow(g, float(octaves.count - n));
      phases.push_back(Phase::henyeyGreenstein(std::min(std::pow(g, float(n) + octaves.bend), 0.99f)));
    }
    const bool once = octaves.count == 1;
    const std::size_t count = suns.size() + locals.size();
    for (std::size_t light = 0; light <= count; ++light)
      for (int c = 0; c != scene.colours; ++c) {
        std::shared_ptr<const ScatteredLight> made;
        if (light < count) {
          if (!once)
            made = scatteredLight(volume, c, meanAlbedo[c], octaves.gain * medium.albedo[c],
                                  sourceOf(light, c), nameOf(light), progress);
        } else if (lights.hasSky()) {
          if (before && before->lights.sky == lights.sky && before->sky == sky &&
              before->scene.colours == scene.colours)
            made = before->scattered[before->scattered.size() - std::size_t(scene.colours - c)];
          else
            made = scatteredLight(volume, c, once ? 0 : meanAlbedo[c], medium.albedo[c],
                                  sky ? sourceOfSky(c) : ScatteredSource::evenSky(), "sky", progress);
        }
        if (made) {
          toScattered.emplace(made->worldToLattice());
          scene.scatteredSize = made->size();
        }
        scattered.push_back(made);
        scene.scattered.push_back(made ? made->values().data() : nullptr);
      }
    if (!toScattered) scene.scattered.clear();
    if (volume.hasEmission() && !once && g < 1) scatterGlow(volume, g, progress);
    // Light that flows outwards is brighter towards the eye than the mean over directions, by as much as the
    // mean is brighter where it comes from: 3 g F, F its flux, is what the mean gains along this way.
    const float typical = volume.typicalDensity() * medium.extinction * (1 - albedo * g);
    lookAhead = once ? 0
                     : std::min(octaves.lookAhead * g / std::max(typical, 1e-30f),
                                volume.worldBounds().longestSide() / 16);
  }

  // What is scattered of the light of what glows: a source of its own per optical depth, wherever there is
  // density.
  void scatterGlow(const RenderVolume& volume, float g, const Progress& progress) {
    if (meanAlbedo == Vec3f{}) return;
    for (int c = 0; c != 3; ++c) {
      const float albedo = std::max(meanAlbedo[c], 1e-3f);
      const float share = 4 * kPi / (albedo * (1 - g) * std::max(medium.extinctionColour[c], 1e-3f));
      ScatteredSource glowing;
      glowing.column = [](const Vec3f&) { return 0.0f; };
      glowing.irradiance = [&volume, c, share](const Vec3f& world) {
        return share * volume.emissionPerDensity(world, c);
      };
      glow.push_back(scatteredLight(volume, c, albedo, medium.albedo[c], glowing, "glow", progress));
      scene.glow[c] = glow.back()->values().data();
      scene.scatteredSize = glow.back()->size();
      toScattered.emplace(glow.back()->worldToLattice());
    }
  }

  const std::string& nameOf(std::size_t light) const {
    return light < distant.size() ? distant[light].name : lights.locals[light - distant.size()].name;
  }

  // Irradiance per gain.
  ScatteredSource sourceOf(std::size_t light, int colour) const {
    if (light < suns.size()) {
      ScatteredSource result = ScatteredSource::of(suns[light]);
      result.shadow = distant[light].shadow[colour];
      return result;
    }
    const LocalLight& local = lights.locals[light - suns.size()];
    const ProjectedLightVolume& shadows = locals[light - suns.size()];
    ScatteredSource result;
    result.shadow = local.shadow[colour];
    result.column = [&shadows](const Vec3f& world) { return shadows.columnDensity(world); };
    // The mean of 1 / r^2 over a ball as large as a voxel, about the light, is that at this distance.
    result.irradiance = [&local, least = 0.36f * voxelSize](const Vec3f& world) {
      const Vec3f way = world - local.position;
      return local.decayAt(std::max(length(way), least)) * local.coneAt(normalize(way));
    };
    return result;
  }

  ScatteredSource sourceOfSky(int colour) const {
    ScatteredSource result;
    result.sky = [this, colour](const std::vector<Vec3f>& towards) {
      std::vector<float> inflow;
      for (const Vec3f& radiance : sky->around(towards)) inflow.push_back(radiance[colour]);
      return inflow;
    };
    return result;
  }

  // The light `from` somewhere in one colour, times `share`.
  std::shared_ptr<const ScatteredLight> scatteredLight(const RenderVolume& volume, int colour, float albedo,
                                                       float share, const ScatteredSource& from,
                                                       const std::string& name,
                                                       const Progress& progress) const {
    progress.begin("scatter " + name);
    const auto made =
        std::make_shared<ScatteredLight>(volume,
                                         Scattering{scene.extinction * scene.extinctionColour[colour], albedo,
                                                    albedo > 0 ? medium.phase.meanCosine() : 0},
                                         from, ScatteredLight::Options{}, progress);
    made->scale(share);
    return made;
  }

  BakedLight(const BakedLight&) = delete;
  BakedLight& operator=(const BakedLight&) = delete;

  const RenderVolume* source;
  Medium medium;
  Lights lights;
  Octaves octaves;
  float voxelSize;
  LatticeMap toDensity;
  std::vector<LatticeMap> toSun;
  std::optional<LatticeMap> toScattered;
  std::vector<LightVolume> suns;
  /// The suns of `lights`, then those of its map; what is left of that.
  std::vector<DistantLight> distant;
  std::optional<Environment> sky;
  std::vector<LatticeMap> toLocal;
  std::vector<ProjectedLightVolume> locals;
  std::vector<float> phaseTable;
  /// Of every result, suns, locals and sky: what multiplies it, and its place in Lights::names.
  std::vector<Vec3f> gains;
  Vec3f skyGain;
  std::vector<std::size_t> layers;
  /// As scene.scattered.
  std::vector<std::shared_ptr<const ScatteredLight>> scattered;
  /// As scene.glow.
  std::vector<std::shared_ptr<const ScatteredLight>> glow;
  /// Along a ray, to where its scattered light is read.
  float lookAhead = 0;
  std::vector<Vec3d> directions;
  std::vector<Phase> phases;
  MarchScene scene;
  Box bounds;
  /// Of the medium, times the mean colour of the volume.
  Vec3f meanAlbedo;
};

namespace {

// One look at a lit volume.
class Picture {
 public:
  // What a thread needs to work on pixels.
  struct Scratch {
    explicit Scratch(const RenderOptions& options) : deep(options.deep.value_or(DeepOptions{})) {}

    std::vector<MarchRay> rays;
    std::vector<MarchResult> results;
    std::vector<MarchRecord> records;
    std::vector<std::optional<Surfaces::Hit>> hits;
    // The camera's rays that met objects, and which of the pattern they are.
    std::vector<std::pair<Ray, std::size_t>> seen;
    PixelSum sum;
    DeepPixel deep;
    std::vector<DeepSample> samples;
    std::vector<PixelPoint> points;
  };

  Picture(const detail::BakedLight& lit, const Camera& camera, const RenderOptions& options, const Film& film)
      : lit_(lit),
        camera_(camera),
        shutter_(options.shutter),
        motion_(options.volumeMotion),
        blurred_(camera.hasLens() || camera.isMoving() || motion_),
        pattern_(pixelPattern(options.samples, options.seed)),
        scene_(lit.scene) {
    scene_.step = options.step.value_or(lit.voxelSize);
    scene_.uniformStep = options.step.value_or(4 * lit.voxelSize);
    // Beside a near light what is seen varies where the density does not.
    if (!scene_.locals.empty()) scene_.uniformStep = scene_.step;
    // The rays of a pixel divide each other's steps, so that together they may take longer ones.
    scene_.stepDepth = options.samples == 1 ? 0.25f : 0.5f;
    scene_.leastStep = std::min(scene_.step, lit.voxelSize) / 8;
    scene_.pixelAngle = float(camera.pixelAngle());
    // The pixels of an orthographic picture are as wide everywhere.
    if (camera.isOrthographic())
      scene_.step = std::clamp(float(camera.pixelWidth(0)), scene_.step, 4 * scene_.step);
    if (film.wantsPoints()) preparePoints(film, options);
    isDeep_ = options.deep.has_value();
    holdout_ = options.holdout.get();
    surfaces_ = options.surfaces.get();
    shadowScene_ = scene_;
    shadowScene_.suns.clear();
    shadowScene_.locals.clear();
    shadowScene_.scattered.clear();
    shadowScene_.colour = shadowScene_.emission = {};
    shadowScene_.pixelAngle = 0;
    gains_.sunCount = lit.gains.size();
    for (std::size_t i = 0; i != gains_.sunCount; ++i) gains_.suns[i] = lit.gains[i];
    gains_.sky = lit.skyGain;
    gains_.isGrey = scene_.colours == 1;
  }

  // Marches the rays of a pixel into scratch.sum and, for deep pictures, scratch.samples; returns the samples
  // taken.
  std::uint64_t pixel(int x, int y, Scratch& scratch) const;

  // What the centres of the pixels meet, row by row, into scratch.points.
  void points(const PixelBox& box, Scratch& scratch) const;

 private:
  void preparePoints(const Film& film, const RenderOptions& options);
  bool centreRay(int x, int y, Ray& world, MarchRay& out, std::optional<Surfaces::Hit>& hit) const;
  Ray worldRay(int x, int y, const SubSample& sub) const;
  bool meet(const Ray& world, double cosine, bool isInside, MarchRay& ray,
            std::optional<Surfaces::Hit>& hit) const;
  Vec3f through(const Vec3d& from, const Vec3d& towards, double distance, const Vec3f& shadow) const;
  Vec3f lightOn(const Surfaces::Hit& hit, const Vec3d& place, std::size_t sample) const;
  float addSurface(const Surfaces::Hit& hit, const MarchRay& ray, const MarchResult& result, const Ray& world,
                   std::size_t sample, PixelSum& out, Vec3f& colour) const;
  bool enter(const Ray& ray, MarchRay& out) const;
  bool prepare(const Ray& ray, const SubSample& sub, double shift, MarchRay& out) const;
  bool prepareBlurred(int x, int y, const SubSample& sub, double shift, MarchRay& out) const;

  const detail::BakedLight& lit_;
  const Camera& camera_;
  Shutter shutter_;
  std::optional<RigidMotion> motion_;
  bool blurred_;
  std::vector<SubSample> pattern_;
  MarchScene scene_;
  bool isDeep_ = false;
  const Holdout* holdout_ = nullptr;
  const Surfaces* surfaces_ = nullptr;
  MarchScene shadowScene_;
  DeepPixel::Gains gains_;

  // For the centres of pixels: the density alone, seen in the middle of the shutter.
  MarchScene pointScene_;
  std::optional<Camera> middle_;
  std::optional<DensityNormals> normals_;
  std::optional<PixelMotion> pixelMotion_;
};

void Picture::preparePoints(const Film& film, const RenderOptions& options) {
  pointScene_ = scene_;
  pointScene_.suns.clear();
  pointScene_.locals.clear();
  pointScene_.scattered.clear();
  pointScene_.colour = pointScene_.emission = {};
  pointScene_.stepDepth = 0.25f;
  middle_ = camera_.stillAt(0.5);
  if (film.wantsNormals()) normals_.emplace(*lit_.source);
  if (film.wantsPositions()) pixelMotion_.emplace(camera_, shutter_, motion_, options.nextCamera);
}

bool Picture::centreRay(int x, int y, Ray& world, MarchRay& out, std::optional<Surfaces::Hit>& hit) const {
  world = middle_->ray(x + 0.5, y + 0.5);
  const double frames = 0.5 * (shutter_.open + shutter_.close),
               cosine = dot(world.direction, middle_->forward());
  const bool isInside = prepare(motion_ ? motion_->toBody(world, frames) : world, SubSample{}, 0.0, out);
  out.cosine = float(cosine);
  if (!meet(world, cosine, isInside, out, hit)) return false;
  if (holdout_) out.holdout = holdout_->at(x, y);
  return true;
}

void Picture::points(const PixelBox& box, Scratch& scratch) const {
  const std::size_t count = std::size_t(box.width()) * std::size_t(box.height());
  scratch.points.assign(count, {});
  std::vector<std::size_t> pixels;
  std::vector<Ray> world;
  scratch.rays.resize(count);
  scratch.hits.resize(count);
  for (std::size_t i = 0; i != count; ++i) {
    Ray ray;
    if (!centreRay(box.x0 + int(i % std::size_t(box.width())), box.y0 + int(i / std::size_t(box.width())),
                   ray, scratch.rays[pixels.size()], scratch.hits[pixels.size()]))
      continue;
    pixels.push_back(i);
    world.push_back(ray);
  }
  const std::size_t live = pixels.size();
  scratch.results.resize(live);
  scratch.records.resize(std::max(scratch.records.size(), live));
  marchRays(pointScene_, {scratch.rays.data(), live}, scratch.results, {scratch.records.data(), live});

  const double frames = 0.5 * (shutter_.open + shutter_.close);
  std::vector<Vec3f> positions, normals;
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i != live; ++i) {
    const MarchRay& ray = scratch.rays[i];
    const std::optional<Surfaces::Hit>& hit = scratch.hits[i];
    if (hit && !hit->isHoldout) {
      const float at = float(hit->distance) - ray.start;
      std::size_t cursor = 0;
      const float left = std::exp(-scratch.results[i].opticalDepth) *
                         ray.holdout.transmittance(float(hit->distance) * ray.cosine, cursor);
      std::vector<MarchRecord::Step>& steps = scratch.records[i].steps;
      steps.push_back({at, at, (steps.empty() ? 0.0f : steps.back().opacity) + left});
    }
    const auto distances = opacityDistances(scratch.records[i]);
    if (!distances) continue;
    PixelPoint& point = scratch.points[pixels[i]];
    point.medianDepth = (ray.start + distances->median) * ray.cosine;
    point.meanDepth = (ray.start + distances->mean) * ray.cosine;
    if (!pixelMotion_) continue;
    const Vec3d at = world[i].origin + world[i].direction * double(ray.start + distances->median);
    const Vec3d inBody = motion_ ? motion_->toBody({at, {}}, frames).origin : at;
    point.position = Vec3f(at);
    const bool isObject = hit && !hit->isHoldout && distances->median >= float(hit->distance) - ray.start;
    pixelMotion_->evaluate(isObject ? at : inBody, point.motion, isObject);
    if (isObject) {
      point.normal = hit->normal;
      continue;
    }
    positions.push_back(Vec3f(inBody));
    found.push_back(pixels[i]);
  }
  if (!normals_) return;
  normals.resize(positions.size());
  normals_->evaluate(positions, normals);
  for (std::size_t i = 0; i != found.size(); ++i)
    scratch.points[found[i]].normal =
        motion_ ? Vec3f(motion_->toWorld({Vec3d{}, Vec3d(normals[i])}, frames).direction) : normals[i];
}

// What a camera's ray meets of objects: the march ends there. False if there is neither volume nor object.
bool Picture::meet(const Ray& world, double cosine, bool isInside, MarchRay& ray,
                   std::optional<Surfaces::Hit>& hit) const {
  hit.reset();
  ray.isCut = false;
  if (!surfaces_) return isInside;
  hit = surfaces_->hit(world);
  if (!hit) return isInside;
  if (isInside && hit->distance > double(ray.start)) {
    const float end = float(hit->distance - double(ray.start));
    ray.isCut = end < ray.length;
    ray.length = std::min(ray.length, end);
    return true;
  }
  // A march of no length.
  ray.density = {{}, {1, 0, 0}};
  ray.start = float(hit->distance);
  ray.length = 0;
  ray.cosine = float(cosine);
  return true;
}

// What the volume lets through of light from a distance.
Vec3f Picture::through(const Vec3d& from, const Vec3d& towards, double distance, const Vec3f& shadow) const {
  const Ray world{from, towards};
  MarchRay ray;
  if (!enter(motion_ ? motion_->toBody(world, 0.5 * (shutter_.open + shutter_.close)) : world, ray) ||
      double(ray.start) >= distance)
    return {1, 1, 1};
  ray.length = std::min(ray.length, float(distance - double(ray.start)));
  MarchResult result;
  marchRays(shadowScene_, {&ray, 1}, {&result, 1});
  Vec3f left;
  for (int c = 0; c != 3; ++c)
    left[c] = std::exp(-result.opticalDepth * shadowScene_.extinctionColour[c] * shadow[c]);
  return left;
}

// What a white diffuse surface sends back of the light that falls on it.
Vec3f Picture::lightOn(const Surfaces::Hit& hit, const Vec3d& place, std::size_t sample) const {
  const Vec3d normal(hit.normal), start = place + normal * surfaces_->clearance();
  const double infinite = std::numeric_limits<double>::infinity();
  Vec3f sum;
  const auto add = [&](const Vec3d& towards, double distance, const Vec3f& irradiance, const Vec3f& shadow) {
    const double cosine = dot(towards, normal);
    if (!(cosine > 0) || irradiance == Vec3f{} || surfaces_->occluded({start, towards}, distance)) return;
    sum += irradiance * through(start, towards, distance, shadow) * float(cosine / kPi);
  };
  for (std::size_t i = 0; i != lit_.distant.size(); ++i)
    add(lit_.directions[i], infinite, lit_.distant[i].irradiance, lit_.distant[i].shadow);
  for (const LocalLight& light : lit_.lights.locals) {
    const Vec3d way = Vec3d(light.position) - start, towards = normalize(way);
    const float r = float(length(way));
    if (r > 0)
      add(towards, r, light.intensity * (light.decayAt(r) * light.coneAt(-Vec3f(towards))), light.shadow);
  }
  // The sky in directions as frequent as their cosines, which the samples of a pixel share out.
  const int count = std::max(4, kSkyRays / int(pattern_.size()));
  const Vec3d across = normalize(std::fabs(normal.x) < 0.5 ? cross(normal, Vec3d{1, 0, 0})
                                                           : cross(normal, Vec3d{0, 1, 0})),
              along = cross(normal, across);
  Vec3f sky;
  for (int i = 0; i != count; ++i) {
    // A sunflower's seeds, every sample a share of them from the middle to the rim.
    const double n = double(sample) + double(pattern_.size()) * i;
    const double r = std::sqrt((n + 0.5) / (double(pattern_.size()) * count)),
                 a = 2 * double(kPi) * fraction(0.6180339887498949 * n);
    const Vec3d towards =
        across * (r * std::cos(a)) + along * (r * std::sin(a)) + normal * std::sqrt(std::max(0.0, 1 - r * r));
    const Vec3f radiance = lit_.sky ? lit_.sky->radiance(Vec3f(towards)) : lit_.lights.sky;
    if (radiance == Vec3f{} || surfaces_->occluded({start, towards}, infinite)) continue;
    sky += radiance * through(start, towards, infinite, {1, 1, 1});
  }
  return sum + sky / float(count);
}

// Adds the object behind a ray's march; returns the share that is seen of it, and its colour times that.
float Picture::addSurface(const Surfaces::Hit& hit, const MarchRay& ray, const MarchResult& result,
                          const Ray& world, std::size_t sample, PixelSum& out, Vec3f& colour) const {
  if (hit.isHoldout) return 0;
  std::size_t cursor = 0;
  const float depth = float(hit.distance) * ray.cosine, held = ray.holdout.transmittance(depth, cursor);
  Vec3f seen;
  for (int c = 0; c != 3; ++c) seen[c] = held * std::exp(-result.opticalDepth * scene_.extinctionColour[c]);
  const float opacity = (seen.x + seen.y + seen.z) / 3;
  if (opacity <= scene_.cutoff) return 0;
  colour = seen * hit.colour * lightOn(hit, world.origin + world.direction * hit.distance, sample);
  const float share = 1.0f / float(pattern_.size());
  out.light[lit_.layers.back() + 1] += colour * share;
  out.opacity += seen * share;
  out.alpha += opacity * share;
  out.albedo += seen * hit.colour * share;
  if (opacity > 0.005f) out.depth = std::min(out.depth, depth);
  return opacity;
}

bool Picture::enter(const Ray& ray, MarchRay& out) const {
  const Span span = clip(lit_.toDensity.point(ray.origin), lit_.toDensity.vector(ray.direction), lit_.bounds);
  if (!(span.far > span.near)) return false;
  const Vec3d entry = ray.origin + ray.direction * span.near;
  out.density = lit_.toDensity.ray(entry, ray.direction);
  out.start = float(span.near);
  out.length = float(span.far - span.near);
  return true;
}

bool Picture::prepare(const Ray& ray, const SubSample& sub, double shift, MarchRay& out) const {
  if (!enter(ray, out)) return false;
  const Vec3d entry = ray.origin + ray.direction * double(out.start);
  out.jitter = float(sub.step + shift);
  out.cosine = float(dot(ray.direction, camera_.forward()));
  out.density.origin += sub.lattice;
  if (lit_.toScattered) {
    out.scattered = lit_.toScattered->ray(entry + ray.direction * double(lit_.lookAhead), ray.direction);
    out.scattered.origin += sub.lattice;
  }
  for (std::size_t sun = 0; sun != lit_.toSun.size(); ++sun) {
    out.suns[sun] = lit_.toSun[sun].ray(entry, ray.direction);
    out.suns[sun].origin += sub.lattice;
    // Light travels away from the sun, then back along the ray.
    const float cosine = float(dot(lit_.directions[sun], ray.direction));
    // Every octave less what the one before it sees.
    float phase = lit_.phases[0](cosine);
    for (int n = 0; n != scene_.octaves; ++n) {
      const float next = n + 1 < scene_.octaves ? lit_.phases[std::size_t(n + 1)](cosine) : 0.0f;
      for (int c = 0; c != scene_.colours; ++c)
        out.weight[sun][c][n] = lit_.medium.albedo[c] * (phase - next);
      phase = next;
    }
  }
  for (std::size_t i = 0; i != lit_.toLocal.size(); ++i) {
    MarchRay::Local& local = out.locals[i];
    const Vec3d origin = lit_.toLocal[i].point(entry), direction = lit_.toLocal[i].vector(ray.direction);
    local.frame = {Vec3f(origin), Vec3f(direction)};
    const double closest = -dot(origin, direction), least = double(scene_.locals[i].least);
    const Vec3d foot = origin + direction * closest;
    local.closest = float(closest);
    local.distance2 = float(std::max(dot(foot, foot), least * least));
    local.shift = sub.lattice;
  }
  return true;
}

Ray Picture::worldRay(int x, int y, const SubSample& sub) const {
  if (!blurred_) return camera_.ray(x + sub.x, y + sub.y);
  const SubSample at = shifted(sub, x, y);
  return camera_.ray(x + at.x, y + at.y, at.lensU, at.lensV, at.time);
}

// The same for a ray through the lens, or at a time, with the volume where it then is.
bool Picture::prepareBlurred(int x, int y, const SubSample& sub, double shift, MarchRay& out) const {
  const SubSample at = shifted(sub, x, y);
  const Ray ray = worldRay(x, y, sub);
  const double frames = shutter_.open + at.time * (shutter_.close - shutter_.open);
  if (!prepare(motion_ ? motion_->toBody(ray, frames) : ray, at, shift, out)) return false;
  out.cosine = float(dot(ray.direction, camera_.forwardAt(at.time)));
  return true;
}

std::uint64_t Picture::pixel(int x, int y, Scratch& scratch) const {
  std::vector<MarchRay>& rays = scratch.rays;
  std::vector<MarchResult>& results = scratch.results;
  const std::size_t count = pattern_.size();
  const double shift =
      count > 1 ? fraction(0.7548776662466927 * x + 0.5698402909980532 * y) / double(count) : 0.0;
  rays.resize(count);
  results.resize(count);
  scratch.hits.resize(count);
  scratch.seen.resize(count);
  std::size_t live = 0;
  for (const SubSample& sub : pattern_) {
    bool isInside = blurred_ ? prepareBlurred(x, y, sub, shift, rays[live])
                             : prepare(camera_.ray(x + sub.x, y + sub.y), sub, shift, rays[live]);
    if (surfaces_) {
      const Ray world = worldRay(x, y, sub);
      const Vec3d forward = blurred_ ? camera_.forwardAt(shifted(sub, x, y).time) : camera_.forward();
      isInside = meet(world, dot(world.direction, forward), isInside, rays[live], scratch.hits[live]);
      if (isInside && scratch.hits[live]) scratch.seen[live] = {world, std::size_t(&sub - pattern_.data())};
    }
    if (isInside) ++live;
  }
  if (holdout_) {
    const HoldoutCurve curve = holdout_->at(x, y);
    for (std::size_t i = 0; i != live; ++i) rays[i].holdout = curve;
  }
  if (isDeep_) {
    scratch.records.resize(std::max(scratch.records.size(), live));
    marchRays(scene_, {rays.data(), live}, {results.data(), live}, {scratch.records.data(), live});
    scratch.deep.begin(count);
  } else {
    marchRays(scene_, {rays.data(), live}, {results.data(), live});
  }

  PixelSum& out = scratch.sum;
  out = {};
  std::uint64_t samples = 0;
  const float share = 1.0f / float(count);
  for (std::size_t i = 0; i != live; ++i) {
    const MarchResult& result = results[i];
    samples += result.samples;
    Vec3f opacity = Vec3f{1, 1, 1} * -std::expm1(-result.opticalDepth);
    if (scene_.hasExtinctionColour())
      for (int c = 0; c != 3; ++c)
        opacity[c] = -std::expm1(-result.opticalDepth * scene_.extinctionColour[c]);
    if (!rays[i].holdout.empty())
      opacity = {result.heldOpacity[0], result.heldOpacity[1], result.heldOpacity[2]};
    out.alpha += share * (scene_.hasExtinctionColour() ? (opacity.x + opacity.y + opacity.z) / 3 : opacity.x);
    out.opacity += opacity * share;
    out.albedo += opacity * lit_.medium.albedo * share;
    for (int c = 0; c != 3; ++c) out.emission[c] += share * result.emission[c];
    out.depth = std::min(out.depth, result.distance * rays[i].cosine);
    for (std::size_t light = 0; light != lit_.gains.size(); ++light)
      for (int c = 0; c != 3; ++c)
        out.light[lit_.layers[light]][c] +=
            share * lit_.gains[light][c] * result.suns[light][scene_.colours == 1 ? 0 : c];
    for (int c = 0; c != 3; ++c)
      out.light[lit_.layers.back()][c] += share * lit_.skyGain[c] * result.sky[scene_.colours == 1 ? 0 : c];
    if (isDeep_) scratch.deep.add(rays[i], scratch.records[i], gains_);
    if (!surfaces_ || !scratch.hits[i]) continue;
    const auto& [world, sample] = scratch.seen[i];
    Vec3f colour;
    const float seen = addSurface(*scratch.hits[i], rays[i], result, world, sample, out, colour);
    if (isDeep_ && seen > 0)
      scratch.deep.addSurface(float(scratch.hits[i]->distance) * rays[i].cosine, seen, colour);
  }
  if (isDeep_) scratch.samples = scratch.deep.samples();
  return samples;
}

// In the order of PixelSum::light.
std::vector<std::string> lightNames(const Lights& lights, const RenderOptions& options) {
  std::vector<std::string> names = lights.names();
  if (options.surfaces) names.push_back("objects");
  return names;
}

// Null where there is nothing to see.
std::shared_ptr<const detail::BakedLight> bake(const RenderVolume& volume, const Medium& medium,
                                               const Lights& lights, const Octaves& octaves,
                                               const detail::BakedLight* before, const Progress& progress,
                                               const Surfaces* surfaces = nullptr) {
  check(medium, lights, octaves);
  if (volume.isEmpty() || medium.extinction == 0 || medium.extinctionColour == Vec3f{}) return nullptr;
  return std::make_shared<const detail::BakedLight>(volume, medium, lights, octaves, before, progress,
                                                    surfaces);
}

RenderResult look(const detail::BakedLight* lit, const Camera& camera, const RenderOptions& options,
                  Film& film, const Progress& progress) {
  RenderResult result;
  const PixelBox window = camera.window();
  const int width = window.width(), height = window.height();
  result.rays = std::uint64_t(width) * std::uint64_t(height) * std::uint64_t(options.samples);
  if (options.deep)
    result.deep = DeepImage{width, height, film.image().display,
                            std::vector<std::vector<DeepSample>>(std::size_t(width) * std::size_t(height))};
  if (!lit) {
    for (std::size_t i = 0; i != std::size_t(width) * height; ++i) {
      film.set(i, PixelSum{});
      film.set(i, PixelPoint{});
    }
    result.image = std::move(film.image());
    return result;
  }

  const auto start = std::chrono::steady_clock::now();
  const Picture picture(*lit, camera, options, film);
  progress.begin("march");
  const int across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
  std::atomic<std::uint64_t> samples{0};
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t end) {
        Picture::Scratch scratch(options);
        for (std::size_t tile = begin; tile != end; ++tile) {
          const int x0 = int(tile % std::size_t(across)) * kTile,
                    y0 = int(tile / std::size_t(across)) * kTile;
          const int x1 = std::min(x0 + kTile, width), y1 = std::min(y0 + kTile, height);
          std::uint64_t taken = 0;
          for (int y = y0; y < y1; ++y)
            for (int x = x0; x < x1; ++x) {
              const std::size_t at = std::size_t(y) * width + x;
              taken += picture.pixel(window.x0 + x, window.y0 + y, scratch);
              film.set(at, scratch.sum);
              if (result.deep) result.deep->pixels[at] = std::move(scratch.samples);
            }
          if (film.wantsPoints()) {
            picture.points({window.x0 + x0, window.y0 + y0, window.x0 + x1, window.y0 + y1}, scratch);
            const PixelPoint* point = scratch.points.data();
            for (int y = y0; y < y1; ++y)
              for (int x = x0; x < x1; ++x) film.set(std::size_t(y) * width + x, *point++);
          }
          samples += taken;
        }
      },
      progress);
  result.samples = samples;
  progress.count("rays", double(result.rays));
  progress.count("samples", double(result.samples));
  result.marchSeconds = secondsSince(start);
  result.image = std::move(film.image());
  return result;
}

}  // namespace

float defaultExtinction(const RenderVolume& volume) {
  const float side = volume.worldBounds().longestSide();
  return side > 0 ? 150.0f / (side * std::max(volume.typicalDensity(), 1.0f)) : 1.0f;
}

double estimateRenderBytes(const RenderVolume& volume, const Lights& lights, const Camera& camera,
                           const RenderOptions& options) {
  double floats = double(Film::channelCount(options.aovs, lights.names().size()));
  // A dozen samples where there is something.
  if (options.deep) floats += 12 * sizeof(DeepSample) / sizeof(float);
  const ScatteredLight::Bytes scattered = ScatteredLight::estimateBytes(volume);
  // The sky's map may hold suns of its own.
  const int spots = lights.map ? MarchScene::kMostSuns - int(Lights::kMost) : 0;
  return double(lights.suns.size() + std::size_t(spots)) * LightVolume::estimateBytes(volume) +
         double(lights.locals.size()) * ProjectedLightVolume::estimateBytes(volume) + scattered.working +
         3.0 * double(lights.names().size() + std::size_t(spots) + volume.hasEmission()) * scattered.kept +
         double(camera.window().width()) * camera.window().height() * floats * sizeof(float);
}

LitVolume::LitVolume(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                     const Octaves& octaves, const Progress& progress)
    : volume_(&volume), medium_(medium), lights_(lights), octaves_(octaves) {
  const auto start = std::chrono::steady_clock::now();
  light_ = bake(volume, medium, lights, octaves, nullptr, progress);
  lightSeconds_ = secondsSince(start);
}

LitVolume LitVolume::underOther(const Lights& lights, const Progress& progress) const {
  LitVolume other = *this;
  const auto start = std::chrono::steady_clock::now();
  other.lights_ = lights;
  other.light_ = bake(*volume_, medium_, lights, octaves_, light_.get(), progress);
  other.lightSeconds_ = secondsSince(start);
  return other;
}

RenderResult LitVolume::render(const Camera& camera, const RenderOptions& options,
                               const Progress& progress) const {
  check(options);
  require(options.octaves == octaves_, "octaves: differ from those that the light was made with");
  require(!options.surfaces, "objects: are not possible where the light is made beforehand");
  Film film(camera, lightNames(lights_, options), options.aovs);
  return look(light_.get(), camera, options, film, progress);
}

RenderResult renderImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                         const Camera& camera, const RenderOptions& options, const Progress& progress) {
  check(medium, lights, options.octaves);
  check(options);
  // First of all, since it refuses unknown layers.
  Film film(camera, lightNames(lights, options), options.aovs);
  const auto start = std::chrono::steady_clock::now();
  const auto light = bake(volume, medium, lights, options.octaves, nullptr, progress, options.surfaces.get());
  require(light || !options.surfaces, "objects: need a volume that is not empty and has an extinction");
  const double lightSeconds = secondsSince(start);
  RenderResult result = look(light.get(), camera, options, film, progress);
  if (light) result.lightSeconds = lightSeconds;
  return result;
}

}  // namespace nephele
