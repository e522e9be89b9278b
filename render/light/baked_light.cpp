// Light before the first ray: a column density volume for every sun and light at a place, and what all lights
// scatter on a lattice.
//
// Limits: octaves are split by the mean albedo of the three colours.
#include "nephele/render/light/baked_light.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/render/light/deep_shadow.h"
#include "nephele/render/volume/finer_density.h"

namespace nephele::detail {

namespace {

// Of Legendre's moments of a phase function but the 0th, the largest.
float largestMoment(const Phase& phase) {
  float largest = 0;
  const std::vector<float> moments = legendreMoments(phase, 5);
  for (std::size_t l = 1; l < moments.size(); ++l) largest = std::max(largest, std::fabs(moments[l]));
  return std::min(largest, 1.0f);
}

}  // namespace

BakedLight::BakedLight(const RenderVolume& volume, const Medium& itsMedium, const Lights& itsLights,
                       const Octaves& itsOctaves, const BakedLight* before, const Progress& progress,
                       const Surfaces* surfaces)
    : source(&volume),
      medium(itsMedium),
      lights(itsLights),
      octaves(itsOctaves),
      voxelSize(volume.density().voxelSize()),
      toDensity(volume.density().worldToIndex(), volume.density().firstBrick()) {
  const BrickGrid& grid = volume.density();
  scene.density = {grid.values().data(), grid.table().data(), grid.brickCount()};
  scene.ranges = grid.ranges().data();
  scene.emptiness = volume.emptiness().data();
  scene.uniformity = volume.uniformity().data();
  // The scene's extinction is that of the most opaque colour.
  const float most =
      std::max({medium.extinctionColour.x, medium.extinctionColour.y, medium.extinctionColour.z});
  scene.extinction = medium.extinction * most;
  for (int c = 0; c != 3; ++c) scene.extinctionColour[c] = medium.extinctionColour[c] / most;
  setColours(volume, most);
  const bool grey = medium.albedo.x == medium.albedo.y && medium.albedo.x == medium.albedo.z;
  takeLights();
  scene.colours = grey && !scene.isColoured() && !lights.map ? 1 : 3;
  const Vec3f corner(grid.firstBrick() * BrickGrid::kBrick);
  bounds = {volume.indexBounds().min - corner, volume.indexBounds().max - corner};

  // Samples that are to be given back are, before the light takes its memory.
  if (readsCodes()) volume.coded();
  require(volume.hasSamples() || readsCodes(),
          "light: the samples of the density were given back, which this light needs");
  const auto toShade = [surfaces](const Ray& ray) { return surfaces->distanceToShade(ray); };
  std::optional<RenderVolume> finer;
  if (lights.shadowDetail > 1 && (!distant.empty() || !lights.locals.empty()))
    finer.emplace(finerDensity(grid, lights.shadowDetail));
  const RenderVolume& shading = finer ? *finer : volume;
  suns.reserve(distant.size());
  for (const DistantLight& sun : distant) {
    progress.begin("light " + sun.name);
    const bool changes = surfaces || sun.deepShadow || lights.deepTolerance;
    LightVolume& light =
        suns.emplace_back(shading, sun.direction,
                          LightVolume::Options{.dark = darkColumn(sun.shadow), .coded = !changes}, progress);
    shadowDeeply(volume, sun, light, progress);
    if (surfaces) light.addShade(toShade, surfaces->shadeBox(), sun.direction, columnPerDepth(sun.shadow));
    scene.suns.push_back(
        {{nullptr, light.table().data(), light.brickCount()}, {sun.shadow.x, sun.shadow.y, sun.shadow.z}});
    toSun.emplace_back(light.worldToLattice(), light.firstBrick());
    directions.push_back(normalize(Vec3d(sun.direction)));
  }
  locals.reserve(lights.locals.size());
  for (const LocalLight& light : lights.locals) {
    progress.begin("light " + light.name);
    ProjectedLightVolume& shadows = locals.emplace_back(shading, light, progress);
    shadowDeeply(volume, light, shadows, progress);
    if (surfaces && surfaces->castsShadows()) shadows.addShade(toShade, columnPerDepth(light.shadow));
  }
  scatter(before, progress);
  for (std::size_t i = 0; i != locals.size(); ++i) addLocal(lights.locals[i], locals[i]);
  code();
}

// Whether all light can be made of a density that is coded.
bool BakedLight::readsCodes() const {
  const bool hasDeep = lights.deepTolerance || std::ranges::any_of(lights.suns, [](const DistantLight& sun) {
                         return bool(sun.deepShadow);
                       });
  return lights.locals.empty() && !hasDeep && lights.shadowDetail <= 1 && !source->hasEmission();
}

// Last, when the floats have been read and what the light needed while it was made is given back.
void BakedLight::code() {
  scene.density.codes = source->coded().codes();
  scene.density.entries = source->coded().entries();
  for (std::size_t i = 0; i != suns.size(); ++i) {
    suns[i].code();
    scene.suns[i].codes = suns[i].coded().codes();
    scene.suns[i].entries = suns[i].coded().entries();
  }
}

// The column of an optical depth of 1 in the colour that a light's shadow is least opaque in; a light whose
// shadow lets a colour through is not stopped by objects in it either.
float BakedLight::columnPerDepth(const Vec3f& shadow) const {
  float least = 1;
  for (int c = 0; c != 3; ++c)
    if (const float share = shadow[c] * scene.extinctionColour[c]; share > 0) least = std::min(least, share);
  return 1 / (scene.extinction * std::max(least, 0.01f));
}

// Behind which no part of a sun's light is seen, e^-12 of it, in no colour: what goes straight on counts in
// part as light that has not met anything, so that the slowest part of it is stopped by a share of the
// extinction.
float BakedLight::darkColumn(const Vec3f& shadow) const {
  constexpr float kDarkDepth = 12;
  const float albedo = std::max({meanAlbedo.x, meanAlbedo.y, meanAlbedo.z});
  float least = 1;
  for (int c = 0; c != 3; ++c) least = std::min(least, shadow[c] * scene.extinctionColour[c]);
  // So is the rest where cells are thinned.
  const float seen = std::min(scene.extinction * least * (1 - albedo * largestMoment(medium.phase)),
                              least * ScatteredLight::leastExtinction(*source, solverOptions()));
  return seen > 0 ? kDarkDepth / seen : std::numeric_limits<float>::infinity();
}

// Fills the columns of a light from its deep shadow map, if it has one.
template <class Light, class Columns>
void BakedLight::shadowDeeply(const RenderVolume& volume, const Light& light, Columns& columns,
                              const Progress& progress) const {
  std::shared_ptr<const DeepShadowMap> map = light.deepShadow;
  if (!map && lights.deepTolerance)
    map = std::make_shared<const DeepShadowMap>(volume, light, scene.extinction,
                                                DeepShadowMap::Options{*lights.deepTolerance}, progress);
  if (!map || !(scene.extinction > 0)) return;
  columns.replace([&](const Vec3f& world) { return map->opticalDepth(world) / scene.extinction; });
}

// Lists the distant lights, those of the sky's map among them, and what becomes of every light's result.
void BakedLight::takeLights() {
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
void BakedLight::addLocal(const LocalLight& light, const ProjectedLightVolume& shadows) {
  constexpr int nodes = MarchScene::Local::kPhaseNodes;
  if (phaseTable.empty())
    for (int n = 0; n != scene.octaves; ++n)
      for (int i = 0; i <= nodes; ++i) {
        const float sine = float(i) / float(nodes);
        phaseTable.push_back(forward.weight(n, 1 - 2 * sine * sine));
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

void BakedLight::setColours(const RenderVolume& volume, float most) {
  const auto set = [](const VolumeColour::Grids& grids, MarchScene::ColourBricks& bricks) {
    if (!grids[0]) return;
    for (std::size_t c = 0; c != 3; ++c) bricks.values[c] = grids[c]->values().data();
    bricks.table = grids[0]->table().data();
    bricks.count = grids[0]->brickCount();
  };
  set(volume.colour().scattering, scene.colour);
  set(volume.colour().emission, scene.emission);
  scene.emissionScale = 1 / most;
  meanAlbedo = medium.albedo * volume.meanColour();
}

// Sets what light does after its first scattering; the sky's part is that of `before` where skies are
// equal.
void BakedLight::scatter(const BakedLight* before, const Progress& progress) {
  const float albedo = (meanAlbedo.x + meanAlbedo.y + meanAlbedo.z) / 3;
  const bool once = octaves.count == 1;
  moments_ = once ? std::vector<float>{1.0f} : legendreMoments(medium.phase);
  forward =
      once ? ForwardLight(medium.phase)
           : ForwardLight(medium.phase, moments_, albedo, solverOptions().degree(moments_), octaves.count);
  scene.octaves = forward.count();
  for (int n = 0; n != scene.octaves; ++n) scene.attenuation[n] = forward.attenuation(n);
  const std::size_t count = suns.size() + locals.size();
  for (std::size_t light = 0; light <= count; ++light)
    for (int c = 0; c != scene.colours; ++c) {
      std::shared_ptr<const ScatteredLight> made;
      if (light < count) {
        if (!once) {
          const Vec3f shadow =
              light < suns.size() ? distant[light].shadow : lights.locals[light - suns.size()].shadow;
          if (const int like = colourLike(c, shadow); like != c)
            made = scattered[scattered.size() - std::size_t(c - like)];
          else
            made = scatteredLight(c, meanAlbedo[c], sourceOf(light, c), nameOf(light), progress);
        }
      } else if (lights.hasSky()) {
        if (before && before->lights.sky == lights.sky && before->sky == sky &&
            before->scene.colours == scene.colours)
          made = before->scattered[before->scattered.size() - std::size_t(scene.colours - c)];
        else if (const int like = colourLike(c, {1, 1, 1}); like != c && !sky)
          made = scattered[scattered.size() - std::size_t(c - like)];
        else
          made = scatteredLight(c, once ? 0 : meanAlbedo[c],
                                sky ? sourceOfSky(c) : ScatteredSource::evenSky(), "sky", progress);
      }
      keep(scattered, made);
    }
  if (source->hasEmission() && !once) scatterGlow(progress);
}

ScatteredLight::Options BakedLight::solverOptions() const {
  return {.longestSide = octaves.longestSide(), .order = octaves.order};
}

// The first colour in which light is scattered as in this one.
int BakedLight::colourLike(int colour, const Vec3f& shadow) const {
  int like = 0;
  while (meanAlbedo[like] != meanAlbedo[colour] || shadow[like] != shadow[colour] ||
         medium.extinctionColour[like] != medium.extinctionColour[colour])
    ++like;
  return like;
}

void BakedLight::keep(std::vector<std::shared_ptr<const ScatteredLight>>& kept,
                      std::shared_ptr<const ScatteredLight> light) {
  if (light) {
    toScattered.emplace(light->worldToLattice());
    scene.scatteredSize = light->size();
  }
  kept.push_back(std::move(light));
}

// What is scattered of the light of what glows: a source of its own per optical depth, wherever there is
// density.
void BakedLight::scatterGlow(const Progress& progress) {
  if (meanAlbedo == Vec3f{}) return;
  for (int c = 0; c != 3; ++c) {
    ScatteredSource glowing;
    glowing.glow = [this, c, share = 1 / std::max(medium.extinctionColour[c], 1e-3f)](const Vec3f& world) {
      return share * source->emissionPerDensity(world, c);
    };
    keep(glow, scatteredLight(c, meanAlbedo[c], glowing, "glow", progress));
  }
}

const std::string& BakedLight::nameOf(std::size_t light) const {
  return light < distant.size() ? distant[light].name : lights.locals[light - distant.size()].name;
}

// Irradiance per gain.
ScatteredSource BakedLight::sourceOf(std::size_t light, int colour) const {
  if (light < suns.size()) {
    ScatteredSource result = ScatteredSource::of(suns[light], distant[light].direction);
    result.shadow = distant[light].shadow[colour];
    return result;
  }
  const LocalLight& local = lights.locals[light - suns.size()];
  const ProjectedLightVolume& shadows = locals[light - suns.size()];
  ScatteredSource result;
  result.shadow = local.shadow[colour];
  result.place = local.position;
  result.columns = [&shadows](std::span<const Vec3f> world, std::span<float> columns) {
    std::transform(world.begin(), world.end(), columns.begin(),
                   [&](const Vec3f& point) { return shadows.columnDensity(point); });
  };
  // The mean of 1 / r^2 over a ball as large as a voxel, about the light, is that at this distance.
  result.irradiance = [&local, least = 0.36f * voxelSize](const Vec3f& world) {
    const Vec3f way = world - local.position;
    return local.decayAt(std::max(length(way), least)) * local.coneAt(normalize(way));
  };
  return result;
}

ScatteredSource BakedLight::sourceOfSky(int colour) const {
  ScatteredSource result;
  result.sky = [this, colour](const std::vector<Vec3f>& towards) {
    std::vector<float> inflow;
    for (const Vec3f& radiance : sky->around(towards)) inflow.push_back(radiance[colour]);
    return inflow;
  };
  return result;
}

// The light `from` somewhere in one colour.
std::shared_ptr<const ScatteredLight> BakedLight::scatteredLight(int colour, float albedo,
                                                                 const ScatteredSource& from,
                                                                 const std::string& name,
                                                                 const Progress& progress) const {
  progress.begin("scatter " + name);
  auto made = std::make_shared<ScatteredLight>(
      *source, Scattering{scene.extinction * scene.extinctionColour[colour], albedo, moments_}, from,
      solverOptions(), progress);
  progress.count("sweeps", double(made->sweeps()));
  progress.count("light_residual", double(made->residual()));
  return made;
}

}  // namespace nephele::detail
