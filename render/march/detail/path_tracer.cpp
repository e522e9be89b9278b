// The reference: light transport by random paths through a volume and between objects, unbiased.
//
// A path goes from the camera to its first collision or to an object, and on from there in a direction drawn
// from the phase function, or evenly by cosines. At each meeting it looks at every sun, point and spot
// through the volume. Sky: what a path sees where it leaves; a sky from a map also by a direction drawn from
// its luminance at every meeting, the two weighed by their densities (the balance heuristic of Veach, 1997).
// Colour: a path carries a weight per channel that every meeting multiplies by the albedo.
//
// Many paths go on together, from meeting to meeting, so that a field can be asked for many densities at a
// time. Random numbers are a hash of seed, pixel, path and count, so that neither threads nor the number of
// paths change a path. Points within a pixel follow the R2 sequence of M. Roberts, shifted at random for each
// pixel, through the marcher's tent filter.
#include "nephele/render/march/detail/path_tracer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/render/light/deep_shadow.h"

namespace nephele::detail {

namespace {

// Below this share of light, paths play Russian roulette.
constexpr float kLeastWeight = 0.2f;
// Objects that a path may meet before it goes on by chance only: inside a closed one it would never end.
constexpr int kReflections = 64;
constexpr float kGoesOn = 0.9f;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Paths that go on together: as many as the cache holds, or as make long blocks of points.
constexpr std::size_t kGridPaths = 64, kFieldPaths = 2048;

double fraction(double x) {
  return x - std::floor(x);
}

// Uniform in [0, 1) to a tent over [-1, 1].
double tent(double u) {
  return u < 0.5 ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u);
}

// `axis` turned by an angle of cosine `cosine` towards the side that `turn`, in [0, 1), chooses.
Vec3f turned(const Vec3f& axis, float cosine, float turn) {
  // A vector across the axis, from whichever two components are far from zero.
  const Vec3f across =
      std::fabs(axis.x) > 0.7f ? normalize(Vec3f{-axis.y, axis.x, 0}) : normalize(Vec3f{0, -axis.z, axis.y});
  const float sine = std::sqrt(std::fmax(0.0f, 1 - cosine * cosine)), angle = 2 * kPi * turn;
  return normalize(axis * cosine + across * (sine * std::cos(angle)) +
                   cross(axis, across) * (sine * std::sin(angle)));
}

Vec3f mirrored(const Vec3f& way, const Vec3f& normal) {
  return way - normal * (2 * dot(way, normal));
}

float largest(const Vec3f& v) {
  return std::max({v.x, v.y, v.z});
}

}  // namespace

PathTracer::PathTracer(const RenderScene& scene, const PathOptions& options, bool isDeep,
                       const Progress& progress)
    : scene_(scene),
      options_(options),
      progress_(progress),
      surfaces_(scene.surfaces),
      isDeep_(isDeep),
      volume_(scene.volume, scene.medium),
      skyMap_(scene.lights.map.get()) {
  const Lights& lights = scene.lights;
  const auto mapOf = [&](const auto& light) {
    std::shared_ptr<const DeepShadowMap> map = light.deepShadow;
    if (!map && lights.deepTolerance)
      map = std::make_shared<const DeepShadowMap>(scene.volume, light, volume_.extinction(),
                                                  DeepShadowMap::Options{*lights.deepTolerance}, progress);
    return map;
  };
  for (const DistantLight& sun : lights.suns)
    suns_.push_back({normalize(Vec3d(sun.direction)), sun.irradiance, sun.shadow, mapOf(sun)});
  for (const LocalLight& light : lights.locals) localMaps_.push_back(mapOf(light));
  skyLayer_ = suns_.size() + lights.locals.size();
  layers_ = scene.lightNames().size();
}

void PathTracer::start(int x, int y, std::uint64_t number, Path& path) const {
  const Camera& camera = scene_.camera;
  const std::uint64_t index = std::uint64_t(y) * std::uint64_t(camera.width()) + std::uint64_t(x);
  PathRandom offset(options_.seed, index, ~std::uint64_t(0));
  const double u = double(offset.next()), v = double(offset.next()), place = double(number + 1);
  path = {};
  path.random = PathRandom(options_.seed, index, number);
  const double px = x + 0.5 + tent(fraction(u + 0.7548776662466927 * place)),
               py = y + 0.5 + tent(fraction(v + 0.5698402909980532 * place));
  if (scene_.isBlurred()) {
    const double lensU = double(path.random.next()), lensV = double(path.random.next()),
                 time = double(path.random.next());
    path.ray = camera.ray(px, py, lensU, lensV, time);
    path.frames = scene_.shutter.open + time * (scene_.shutter.close - scene_.shutter.open);
    path.foreground.cosine = dot(path.ray.direction, camera.forwardAt(time));
  } else {
    path.ray = camera.ray(px, py);
    path.foreground.cosine = dot(path.ray.direction, camera.forward());
  }
  if (scene_.holdout) path.foreground.holdout = scene_.holdout->at(x, y);
}

void PathTracer::trace(const PixelBox& tile, Wave& wave, std::vector<PathSums>& sums) const {
  const std::size_t perPixel = std::size_t(options_.samplesPerPixel), width = std::size_t(tile.width()),
                    count = width * std::size_t(tile.height()) * perPixel,
                    together = volume_.isField() ? kFieldPaths : kGridPaths;
  sums.assign(width * std::size_t(tile.height()), {});
  for (PathSums& sum : sums) sum.light.resize(layers_);
  for (std::size_t begin = 0; begin < count; begin += together) {
    const std::size_t end = std::min(begin + together, count);
    wave.paths.resize(end - begin);
    wave.light.assign(wave.paths.size() * layers_, {});
    for (std::size_t i = begin; i != end; ++i) {
      Path& path = wave.paths[i - begin];
      const std::size_t pixel = i / perPixel;
      start(tile.x0 + int(pixel % width), tile.y0 + int(pixel / width), options_.firstSample + i % perPixel,
            path);
      path.pixel = std::uint32_t(pixel);
      if (isDeep_) path.foreground.glow = &sums[pixel].events;
    }
    follow(wave);
    finish(wave, sums);
  }
}

// Lets all paths go on from meeting to meeting until they end.
void PathTracer::follow(Wave& wave) const {
  wave.live.resize(wave.paths.size());
  for (std::size_t i = 0; i != wave.live.size(); ++i) wave.live[i] = std::uint32_t(i);
  while (!wave.live.empty()) {
    progress_.check();
    wave.hits.resize(wave.live.size());
    wave.flights.resize(wave.live.size());
    for (std::size_t i = 0; i != wave.live.size(); ++i)
      prepareFlight(wave.paths[wave.live[i]], wave.hits[i], wave.flights[i]);
    volume_.fly(wave.flights, wave.volume);
    wave.ways.clear();
    wave.looks.clear();
    std::size_t next = 0;
    for (std::size_t i = 0; i != wave.live.size(); ++i)
      if (arrive(wave.live[i], wave.flights[i], wave.hits[i], wave)) wave.live[next++] = wave.live[i];
    wave.live.resize(next);
    volume_.look(wave.ways, wave.volume);
    for (std::size_t i = 0; i != wave.looks.size(); ++i)
      add(wave.looks[i].path, wave.looks[i].light, wave.looks[i].radiance * wave.ways[i].left, wave);
  }
}

Ray PathTracer::inVolume(const Path& path, const Ray& ray) const {
  return path.isInWorld && scene_.volumeMotion ? scene_.volumeMotion->toBody(ray, path.frames) : ray;
}

void PathTracer::prepareFlight(Path& path, std::optional<Surfaces::Hit>& hit, Flight& flight) const {
  hit.reset();
  const bool isOfCamera = path.scatterings == 0;
  if (surfaces_ && (isOfCamera || options_.objectsScatter)) hit = surfaces_->hit(path.ray);
  flight = {inVolume(path, path.ray), hit ? hit->distance : kInfinite, path.random.fork()};
  if (isOfCamera) flight.foreground = &path.foreground;
  flight.weight = flight.arriving = path.weight;
}

// What becomes of a path at the end of a flight: whether it goes on.
bool PathTracer::arrive(std::uint32_t index, Flight& flight, const std::optional<Surfaces::Hit>& hit,
                        Wave& wave) const {
  Path& path = wave.paths[index];
  // Objects that scatter nothing into the volume see nothing of what it scatters or sends out either.
  const bool seesSkyOnly = path.isFromSurface && !options_.objectsScatter;
  path.weight = flight.weight;
  if (path.scatterings == 0)
    path.emission = flight.glow;
  else if (path.isOfObject && !seesSkyOnly)
    add(index, layers_ - 1, Vec3f(flight.glow), wave);
  else if (!seesSkyOnly)
    path.laterEmission += flight.glow * double(path.held);

  const bool isMet = std::isfinite(flight.distance);
  if (!isMet && !hit) {
    if (path.scatterings > 0) leave(index, wave);
    return false;
  }
  if (seesSkyOnly || (path.scatterings > 0 && path.scatterings == options_.maxScatterings)) return false;
  if (isMet) {
    const Vec3d place = flight.ray.origin + flight.ray.direction * flight.distance;
    const Vec3f albedo = volume_.albedoAt(place);
    if (path.scatterings == 0 && !meetFirst(path, flight.arriving, flight.distance, albedo, false))
      return false;
    path.isInWorld = false;
    path.weight = path.weight * albedo;
    return scatter(index, {place, Vec3f(flight.ray.direction), {}, {}, false}, wave);
  }
  if (path.scatterings == 0 &&
      (hit->isHoldout || !meetFirst(path, flight.arriving, hit->distance, hit->colour, true)))
    return false;
  path.weight = path.weight * hit->colour;
  ++path.reflections;
  const Vec3d place =
      path.ray.origin + path.ray.direction * hit->distance + Vec3d(hit->faceNormal) * surfaces_->clearance();
  return scatter(index, {place, Vec3f(path.ray.direction), hit->normal, hit->faceNormal, true}, wave);
}

// Notes what the camera sees first. False if none of it is seen.
bool PathTracer::meetFirst(Path& path, const Vec3f& weight, double distance, const Vec3f& albedo,
                           bool isOfObject) {
  path.held = path.foreground.heldAt(distance);
  const Vec3f opacity = weight * path.held;
  path.event = {float(distance * path.foreground.cosine), (opacity.x + opacity.y + opacity.z) / 3, {}};
  path.foreground.albedo += opacity * albedo;
  path.foreground.opacity += opacity;
  path.isOfObject = isOfObject;
  return path.held > 0;
}

bool PathTracer::survives(Path& path) const {
  if (path.reflections > kReflections) {
    if (path.random.next() >= kGoesOn) return false;
    path.weight = path.weight / kGoesOn;
  }
  const float most = largest(path.weight);
  if (most >= kLeastWeight) return true;
  if (path.random.next() * kLeastWeight >= most) return false;
  path.weight *= kLeastWeight / most;
  return true;
}

// Looks at the lights from a meeting, and draws where the path goes on; false if it ends.
bool PathTracer::scatter(std::uint32_t index, const Meeting& meeting, Wave& wave) const {
  Path& path = wave.paths[index];
  ++path.scatterings;
  ++wave.scatterings;
  if (!survives(path)) return false;
  lookAtLights(index, meeting, wave);
  if (path.scatterings == options_.maxScatterings && !scene_.lights.hasSky() && !volume_.glows())
    return false;
  const float first = path.random.next(), turn = path.random.next();
  Vec3f direction;
  if (meeting.isSurface) {
    direction = turned(meeting.normal, std::sqrt(first), turn);
    // What a smooth normal would send into the object goes out of its face.
    if (dot(direction, meeting.faceNormal) < 0) direction = mirrored(direction, meeting.faceNormal);
  } else {
    direction = turned(meeting.incoming, scene_.medium.phase.sampleCosine(first, path.random.next()), turn);
  }
  path.chance = shareOf(meeting, direction);
  path.isFromSurface = meeting.isSurface;
  path.ray = {meeting.place, Vec3d(direction)};
  return options_.objectsScatter || !meeting.isSurface || !surfaces_->occluded(path.ray, kInfinite);
}

// Per steradian, what of the light from a direction goes back along the path.
float PathTracer::shareOf(const Meeting& meeting, const Vec3f& towards) const {
  if (!meeting.isSurface) return scene_.medium.phase(dot(meeting.incoming, towards));
  if (!(dot(towards, meeting.faceNormal) > 0)) return 0;
  return (std::fmax(dot(towards, meeting.normal), 0.0f) +
          std::fmax(dot(mirrored(towards, meeting.faceNormal), meeting.normal), 0.0f)) /
         kPi;
}

void PathTracer::lookAtLights(std::uint32_t index, const Meeting& meeting, Wave& wave) const {
  Path& path = wave.paths[index];
  const auto look = [&](std::size_t light, const Ray& ray, double distance, const Vec3f& radiance,
                        const Vec3f& extinction) {
    wave.looks.push_back({index, light, radiance});
    wave.ways.push_back({inVolume(path, ray), distance, path.random.fork(), extinction});
  };
  const auto lookAtLight = [&](std::size_t light, const Vec3d& towards, double distance, Vec3f radiance,
                               const Vec3f& shadow, const DeepShadowMap* map) {
    radiance = radiance * path.weight * shareOf(meeting, Vec3f(towards));
    const Vec3f extinction = shadow * volume_.colour();
    const Ray ray{meeting.place, towards};
    if (radiance == Vec3f{}) return;
    if (surfaces_ && surfaces_->occluded(ray, distance))
      // A light whose shadow lets a colour through is not stopped by objects in the volume.
      for (int c = 0; c != 3; ++c)
        if (meeting.isSurface || extinction[c] > 0) radiance[c] = 0;
    if (radiance == Vec3f{}) return;
    if (!map || meeting.isSurface) return look(light, ray, distance, radiance, extinction);
    const float depth = map->opticalDepth(Vec3f(meeting.place));
    for (int c = 0; c != 3; ++c) radiance[c] *= std::exp(-depth * extinction[c]);
    add(index, light, radiance, wave);
  };
  for (std::size_t i = 0; i != suns_.size(); ++i)
    lookAtLight(i, suns_[i].towards, kInfinite, suns_[i].irradiance, suns_[i].shadow, suns_[i].map.get());
  for (std::size_t i = 0; i != scene_.lights.locals.size(); ++i) {
    const LocalLight& light = scene_.lights.locals[i];
    const Vec3d way = Vec3d(light.position) - meeting.place;
    const double distance = std::max(length(way), double(volume_.least()));
    const Vec3d towards = way / distance;
    lookAtLight(suns_.size() + i, towards, distance,
                light.intensity * (light.decayAt(float(distance)) * light.coneAt(-Vec3f(towards))),
                light.shadow, localMaps_[i].get());
  }
  if (!skyMap_) return;
  const float a = path.random.next(), b = path.random.next(), c = path.random.next();
  const Environment::Sample sky = skyMap_->sample(a, b, c, path.random.next());
  const float share = shareOf(meeting, sky.towards);
  if (!(sky.density > 0) || !(share > 0)) return;
  const Ray ray{meeting.place, Vec3d(sky.towards)};
  if (surfaces_ && (options_.objectsScatter ? surfaces_->hit(ray).has_value()
                                            : meeting.isSurface && surfaces_->occluded(ray, kInfinite)))
    return;
  look(skyLayer_, ray, kInfinite,
       path.weight * skyMap_->radiance(sky.towards) * (share / (sky.density + share)), volume_.colour());
}

// The sky where a path leaves.
void PathTracer::leave(std::uint32_t index, Wave& wave) const {
  const Path& path = wave.paths[index];
  if (!skyMap_) return add(index, skyLayer_, path.weight * scene_.lights.sky, wave);
  const Vec3f direction(path.ray.direction);
  const float drawn = skyMap_->density(direction);
  add(index, skyLayer_, path.weight * skyMap_->radiance(direction) * (path.chance / (path.chance + drawn)),
      wave);
}

void PathTracer::add(std::uint32_t index, std::size_t light, const Vec3f& radiance, Wave& wave) const {
  const Path& path = wave.paths[index];
  wave.light[index * layers_ + (path.isOfObject ? layers_ - 1 : light)] += Vec3d(radiance * path.held);
}

// In the order of the paths, so that no pixel depends on others.
void PathTracer::finish(Wave& wave, std::vector<PathSums>& sums) const {
  for (std::size_t i = 0; i != wave.paths.size(); ++i) {
    Path& path = wave.paths[i];
    PathSums& sum = sums[path.pixel];
    const bool isMet = path.scatterings > 0;
    sum.opacity += Vec3d(path.foreground.opacity);
    sum.albedo += Vec3d(path.foreground.albedo);
    sum.emission += path.emission + path.laterEmission;
    Vec3d colour = path.laterEmission;
    for (std::size_t light = 0; light != layers_; ++light) {
      sum.light[light] += wave.light[i * layers_ + light];
      colour += wave.light[i * layers_ + light];
    }
    if (!isDeep_ || !isMet) continue;
    path.event.colour = Vec3f(colour);
    sum.events.push_back(path.event);
  }
}

}  // namespace nephele::detail
