// Light before the first ray: a column density volume for every sun and light at a place, and what all lights
// scatter on a lattice.
//
// Limits: octaves are split by the mean albedo of the three colours.
#include "nephele/render/light/baked_light.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/deep_shadow.h"
#include "nephele/render/light/detail/beam_samples.h"
#include "nephele/render/light/detail/sky_parts.h"
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
                       const Octaves& itsOctaves, std::shared_ptr<const SkyPart>* before,
                       const Progress& progress, const Surfaces* surfaces)
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
  scene.colours = grey && !scene.isColoured() ? 1 : 3;
  const Vec3f corner(grid.firstBrick() * BrickGrid::kBrick);
  bounds = {volume.indexBounds().min - corner, volume.indexBounds().max - corner};

  solver_ = {.longestSide = octaves.longestSide(), .order = octaves.order};
  if (octaves.count > 1) {
    moments_ = legendreMoments(medium.phase);
    // All colours are solved for on the same lattice.
    const float albedo = std::max({meanAlbedo.x, meanAlbedo.y, meanAlbedo.z});
    solver_ = solver_.suitedTo(volume, {scene.extinction, albedo, moments_});
  }
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
    isOfVolume_.push_back(!changes);
    LightVolume& light =
        suns.emplace_back(shading, sun.direction,
                          LightVolume::Options{.dark = darkColumn(sun.shadow), .coded = !changes}, progress);
    shadowDeeply(volume, sun, light, progress);
    if (surfaces) light.addShade(toShade, surfaces->shadeBox(), sun.direction, columnPerDepth(sun.shadow));
    scene.suns.push_back({{nullptr, light.table().data(), light.brickCount()},
                          {sun.shadow.x, sun.shadow.y, sun.shadow.z},
                          light.bend()});
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

SkyPart BakedLight::skyPart() const {
  return {
      lights.sky, sky, scene.skyParts, scene.colours, {scattered.end() - scene.skyParts, scattered.end()}};
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
  const float albedo = std::max({meanAlbedo.x, meanAlbedo.y, meanAlbedo.z});
  float least = 1;
  for (int c = 0; c != 3; ++c) least = std::min(least, shadow[c] * scene.extinctionColour[c]);
  // So is the rest where cells are thinned.
  const float seen = std::min(scene.extinction * least * (1 - albedo * largestMoment(medium.phase)),
                              least * ScatteredLight::leastExtinction(*source, solver_));
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
  if (lights.map) {
    Environment map = *lights.map;
    for (DistantLight& spot : map.takeSpots(MarchScene::kMostSuns - int(Lights::kMost))) {
      spot.name = "sky";
      distant.push_back(spot);
      layers.push_back(skyLayer);
    }
    sky = map;
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
void BakedLight::scatter(std::shared_ptr<const SkyPart>* before, const Progress& progress) {
  const float albedo = (meanAlbedo.x + meanAlbedo.y + meanAlbedo.z) / 3;
  const bool once = octaves.count == 1;
  forward = once ? ForwardLight(medium.phase)
                 : ForwardLight(medium.phase, moments_, albedo, solver_.degree(moments_), octaves.count);
  scene.octaves = forward.count();
  for (int n = 0; n != scene.octaves; ++n) scene.attenuation[n] = forward.attenuation(n);
  const std::size_t lightCount = suns.size() + locals.size(), colours = std::size_t(scene.colours);
  const auto shadowOf = [&](std::size_t light) {
    return light < suns.size() ? distant[light].shadow : lights.locals[light - suns.size()].shadow;
  };
  std::vector<Solve> solves;
  // For every light and colour that of `solves` which gives its part.
  std::vector<std::optional<std::size_t>> from(lightCount * colours);
  for (std::size_t light = 0; light != lightCount && !once; ++light)
    for (std::size_t c = 0; c != colours; ++c) {
      const auto like = std::size_t(colourLike(int(c), shadowOf(light)));
      from[light * colours + c] = like == c ? solves.size() : from[light * colours + like];
      if (like == c) solves.push_back({int(c), meanAlbedo[int(c)], sourceOf(light, int(c))});
    }
  const std::vector<ScatteredSource> skies = partsOfSky();
  scene.skyParts = int(skies.size());
  const SkyPart* left = before ? before->get() : nullptr;
  const bool isSkyAsBefore = left && left->radiance == lights.sky && left->map == sky &&
                             left->parts == scene.skyParts && left->colours == scene.colours;
  if (before && !isSkyAsBefore) before->reset();
  for (std::size_t part = 0; part != skies.size(); ++part) {
    from.emplace_back();
    const int colour = colours == 1 ? 0 : int(part), like = sky ? colour : colourLike(colour, {1, 1, 1});
    if (!lights.hasSky() || isSkyAsBefore) continue;
    from.back() = like == colour ? solves.size() : from[lightCount * colours + std::size_t(like)];
    if (like == colour) solves.push_back({colour, once ? 0 : meanAlbedo[colour], skies[part]});
  }
  scattered.assign(from.size(), nullptr);
  if (isSkyAsBefore) std::ranges::copy(left->scattered, scattered.end() - scene.skyParts);
  const std::size_t glowsFrom = solves.size();
  if (source->hasEmission() && !once && meanAlbedo != Vec3f{})
    for (int c = 0; c != scene.colours; ++c) solves.push_back({c, meanAlbedo[c], sourceOfGlow(c)});
  solve(solves, progress);
  for (std::size_t place = 0; place != from.size(); ++place)
    if (from[place]) scattered[place] = solves[*from[place]].light;
  for (std::size_t i = glowsFrom; i != solves.size(); ++i) glow.push_back(solves[i].light);
  for (const auto* kept : {&scattered, &glow})
    for (const auto& light : *kept)
      if (light) {
        toScattered.emplace(light->worldToLattice());
        scene.scatteredSize = light->size();
      }
}

// Some at the same time: threads of one would often wait for each other.
void BakedLight::solve(std::vector<Solve>& solves, const Progress& progress) const {
  if (solves.empty()) return;
  progress.begin("scatter");
  constexpr std::size_t kTogether = ScatteredLight::kMadeTogether;
  const double share = 1 / double(solves.size());
  for (std::size_t first = 0; first < solves.size(); first += kTogether)
    parallelFor(std::min(kTogether, solves.size() - first), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = first + begin; i != first + end; ++i)
        solves[i].light = std::make_shared<ScatteredLight>(
            *source,
            Scattering{scene.extinction * scene.extinctionColour[solves[i].colour], solves[i].albedo,
                       moments_},
            solves[i].from, solver_, SubProgress(progress, share * double(i), share * double(i + 1)));
    });
  int sweeps = 0;
  float residual = 0;
  for (const Solve& solved : solves) {
    sweeps = std::max(sweeps, solved.light->sweeps());
    residual = std::max(residual, solved.light->residual());
  }
  progress.count("sweeps", double(sweeps));
  progress.count("light_residual", double(residual));
}

// The first colour in which light is scattered as in this one.
int BakedLight::colourLike(int colour, const Vec3f& shadow) const {
  int like = 0;
  while (meanAlbedo[like] != meanAlbedo[colour] || shadow[like] != shadow[colour] ||
         medium.extinctionColour[like] != medium.extinctionColour[colour])
    ++like;
  return like;
}

// Of what glows: a source of its own per optical depth, wherever there is density.
ScatteredSource BakedLight::sourceOfGlow(int colour) const {
  ScatteredSource result;
  result.glow = [this, colour, share = 1 / std::max(medium.extinctionColour[colour], 1e-3f)](
                    const Vec3f& world) { return share * source->emissionPerDensity(world, colour); };
  return result;
}

// Irradiance per gain.
ScatteredSource BakedLight::sourceOf(std::size_t light, int colour) const {
  if (light < suns.size()) {
    ScatteredSource result = ScatteredSource::of(suns[light], distant[light].direction);
    result.shadow = distant[light].shadow[colour];
    if (isOfVolume_[light])
      result.thinned = [this, towards = distant[light].direction](float most, float dark) {
        return std::make_shared<const LightVolume>(
            *source, towards, LightVolume::Options{.dark = dark, .most = most, .coded = true});
      };
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

// Of the sky, and what multiplies them: its colours, or fewer where a grey medium does the same to all of
// them.
std::vector<ScatteredSource> BakedLight::partsOfSky() {
  std::vector<ScatteredSource> result(std::size_t(scene.colours), ScatteredSource::evenSky());
  if (!sky) {
    skyGains = {lights.sky};
    if (scene.colours == 3) skyGains = {{lights.sky.x, 0, 0}, {0, lights.sky.y, 0}, {0, 0, lights.sky.z}};
    return result;
  }
  const std::vector<Vec3f> radiance = sky->around(ScatteredLight::skyDirections(*source, solver_));
  const SkyParts parts = scene.colours == 3 ? coloursOfSky(radiance) : detail::partsOfSky(radiance);
  skyGains = parts.colours;
  result.resize(parts.values.size());
  for (std::size_t part = 0; part != result.size(); ++part) {
    result[part].sky = [values = parts.values[part]](const std::vector<Vec3f>&) { return values; };
  }
  return result;
}

}  // namespace nephele::detail
