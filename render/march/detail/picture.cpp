// The rays of a camera through a lit volume, pixel by pixel. A pixel is the mean of its rays, so that nothing
// depends on the order of tiles.
#include "nephele/render/march/detail/picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace nephele::detail {

namespace {

// Directions in which the objects of a pixel look for the sky.
constexpr int kSkyRays = 64;

constexpr DepthBounds::Range kAnywhere{0, std::numeric_limits<float>::infinity()};

// Rays that are marched through a field together: enough for long blocks of points, few enough for the cache.
constexpr int kFieldRays = 64;

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

// What is in the way, and nothing of what is seen of it.
MarchScene withoutLight(MarchScene scene) {
  scene.suns.clear();
  scene.locals.clear();
  scene.scattered.clear();
  scene.colour = scene.emission = {};
  return scene;
}

}  // namespace

Picture::Picture(const BakedLight& lit, const RenderScene& scene, const RenderOptions& options,
                 const Film& film)
    : lit_(lit),
      camera_(scene.camera),
      shutter_(scene.shutter),
      motion_(scene.volumeMotion),
      blurred_(scene.isBlurred()),
      pattern_(pixelPattern(options.samples, options.seed)),
      scene_(lit.scene) {
  scene_.step = options.step.value_or(lit.voxelSize);
  scene_.uniformStep = options.step.value_or(4 * lit.voxelSize);
  // Beside a near light what is seen varies where the density does not.
  if (!scene_.locals.empty()) scene_.uniformStep = scene_.step;
  // The rays of a pixel divide each other's steps, so that together they may take longer ones.
  scene_.stepDepth = options.samples == 1 ? 0.25f : 0.5f;
  scene_.leastStep = std::min(scene_.step, lit.voxelSize) / 8;
  scene_.pixelAngle = float(camera_.pixelAngle());
  // The pixels of an orthographic picture are as wide everywhere.
  if (camera_.isOrthographic())
    scene_.step = std::clamp(float(camera_.pixelWidth(0)), scene_.step, 4 * scene_.step);
  if (film.wantsPoints()) preparePoints(film, scene.nextCamera);
  isDeep_ = options.deep.has_value();
  holdout_ = scene.holdout;
  // What deep pictures and holdouts cut is measured by steps, whatever is seen of them.
  if (isDeep_ || holdout_) scene_.mostGrowth = 1, scene_.uniformStep = scene_.step;
  surfaces_ = scene.surfaces;
  if (!blurred_) bounds_.emplace(*lit.source, camera_);
  if ((field_ = lit.source->field())) {
    fieldSteps_.longest = options.step.value_or(0.25f * lit.voxelSize);
    fieldSteps_.pixelAngle = scene_.pixelAngle;
    if (camera_.isOrthographic()) fieldSteps_.pixelWidth = float(camera_.pixelWidth(0));
    fieldSteps_.threshold = options.refinement.threshold;
    fieldSteps_.halvings = options.refinement.halvings;
    // What is lost between two places where the light is read is as the square of their distance.
    const float finer = std::min(std::sqrt(options.refinement.threshold * 128), 1.0f);
    fieldSteps_.lightDepth = scene_.stepDepth * finer;
    fieldSteps_.lightLength = lit.voxelSize * finer;
    fieldSteps_.uniformLength = scene_.locals.empty() ? 4 * lit.voxelSize * finer : fieldSteps_.lightLength;
  }
  shadowScene_ = withoutLight(scene_);
  shadowScene_.pixelAngle = 0;
  gains_.sunCount = lit.gains.size();
  for (std::size_t i = 0; i != gains_.sunCount; ++i) gains_.suns[i] = lit.gains[i];
  gains_.sky = lit.skyGain;
  gains_.isGrey = scene_.colours == 1;
}

void Picture::preparePoints(const Film& film, const Camera* nextCamera) {
  pointScene_ = withoutLight(scene_);
  pointScene_.stepDepth = 0.25f;
  middle_ = camera_.stillAt(0.5);
  if (film.wantsNormals()) normals_.emplace(*lit_.source);
  if (film.wantsPositions()) pixelMotion_.emplace(camera_, shutter_, motion_, nextCamera);
}

bool Picture::centreRay(int x, int y, Ray& world, MarchRay& out, std::optional<Surfaces::Hit>& hit) const {
  world = middle_->ray(x + 0.5, y + 0.5);
  const double frames = 0.5 * (shutter_.open + shutter_.close),
               cosine = dot(world.direction, middle_->forward());
  const bool isInside =
      prepare(motion_ ? motion_->toBody(world, frames) : world, kAnywhere, SubSample{}, 0.0, out);
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
  marchAll(pointScene_, live, true, scratch);

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
  if (!enter(motion_ ? motion_->toBody(world, 0.5 * (shutter_.open + shutter_.close)) : world, kAnywhere,
             ray) ||
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
                 a = 2 * double(kPi) * (0.6180339887498949 * n - std::floor(0.6180339887498949 * n));
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

// `reach`: depths along the line of sight beyond which nothing needs to be looked for.
bool Picture::enter(const Ray& ray, const DepthBounds::Range& reach, MarchRay& out) const {
  Span span = field_
                  ? clip(ray.origin, ray.direction, field_->box())
                  : clip(lit_.toDensity.point(ray.origin), lit_.toDensity.vector(ray.direction), lit_.bounds);
  if (reach.near > 0) {
    const double perDepth = 1 / dot(ray.direction, camera_.forward());
    span = {std::max(span.near, double(reach.near) * perDepth),
            std::min(span.far, double(reach.far) * perDepth)};
  }
  if (!(span.far > span.near)) return false;
  const Vec3d entry = ray.origin + ray.direction * span.near;
  out.density = lit_.toDensity.ray(entry, ray.direction);
  out.world = {Vec3f(entry), Vec3f(ray.direction)};
  out.start = float(span.near);
  out.length = float(span.far - span.near);
  return true;
}

bool Picture::prepare(const Ray& ray, const DepthBounds::Range& reach, const SubSample& sub, double shift,
                      MarchRay& out) const {
  if (!enter(ray, reach, out)) return false;
  const Vec3d entry = ray.origin + ray.direction * double(out.start);
  out.jitter = float(sub.step + shift);
  out.cosine = float(dot(ray.direction, camera_.forward()));
  // Density and suns are looked up at the same place beside the ray: what a place receives is not mixed with
  // what its neighbours hide. Terraces less than a pixel wide need no hiding.
  const Vec3f beside =
      sub.lattice * std::min(1.0f, lit_.voxelSize / (4 * float(camera_.pixelWidth(double(out.start)))));
  const Vec3d besideEntry = entry + Vec3d(lit_.source->density().indexToWorld().linear * beside);
  out.density.origin += beside;
  if (lit_.toScattered) {
    out.scattered = lit_.toScattered->ray(entry + ray.direction * double(lit_.lookAhead), ray.direction);
    out.scattered.origin += sub.lattice;
  }
  for (std::size_t sun = 0; sun != lit_.toSun.size(); ++sun) {
    out.suns[sun] = lit_.toSun[sun].ray(besideEntry, ray.direction);
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
  if (!prepare(motion_ ? motion_->toBody(ray, frames) : ray, kAnywhere, at, shift, out)) return false;
  out.cosine = float(dot(ray.direction, camera_.forwardAt(at.time)));
  return true;
}

int Picture::pixelsTogether() const {
  return field_ ? std::clamp(kFieldRays / int(pattern_.size()), 1, kFieldRays) : 1;
}

void Picture::march(int x, int y, int count, Scratch& scratch) const {
  scratch.begins.assign(1, 0);
  for (int i = 0; i != count; ++i) addRays(x + i, y, scratch);
  marchAll(scene_, scratch.begins.back(), isDeep_, scratch);
}

// The first `count` rays.
void Picture::marchAll(const MarchScene& scene, std::size_t count, bool isRecorded, Scratch& scratch) const {
  scratch.results.resize(std::max(scratch.results.size(), count));
  if (isRecorded) scratch.records.resize(std::max(scratch.records.size(), count));
  const std::span<const MarchRay> rays{scratch.rays.data(), count};
  const std::span<MarchResult> results{scratch.results.data(), count};
  const std::span<MarchRecord> records{scratch.records.data(), isRecorded ? count : 0};
  if (field_) {
    if (!scratch.field) scratch.field.emplace(*field_, fieldSteps_);
    scratch.field->march(scene, rays, results, records);
  } else {
    marchRays(scene, rays, results, records);
  }
}

// Adds the rays of a pixel that may meet anything.
void Picture::addRays(int x, int y, Scratch& scratch) const {
  std::vector<MarchRay>& rays = scratch.rays;
  const std::size_t count = pattern_.size(), first = scratch.begins.back();
  const double shift = count > 1 ? stepShift(x, y) / double(count) : 0.0;
  rays.resize(std::max(rays.size(), first + count));
  scratch.hits.resize(rays.size());
  scratch.seen.resize(rays.size());
  std::size_t live = first;
  const DepthBounds::Range reach = bounds_ ? bounds_->at(x, y) : kAnywhere;
  if (reach.isEmpty() && !surfaces_) {
    scratch.begins.push_back(live);
    return;
  }
  for (const SubSample& sub : pattern_) {
    bool isInside = blurred_ ? prepareBlurred(x, y, sub, shift, rays[live])
                             : !reach.isEmpty() &&
                                   prepare(camera_.ray(x + sub.x, y + sub.y), reach, sub, shift, rays[live]);
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
    for (std::size_t i = first; i != live; ++i) rays[i].holdout = curve;
  }
  scratch.begins.push_back(live);
}

std::uint64_t Picture::gather(int index, Scratch& scratch) const {
  const std::vector<MarchRay>& rays = scratch.rays;
  const std::size_t count = pattern_.size();
  if (isDeep_) scratch.deep.begin(count);
  PixelSum& out = scratch.sum;
  out = {};
  std::uint64_t samples = 0;
  const float share = 1.0f / float(count);
  for (std::size_t i = scratch.begins[std::size_t(index)]; i != scratch.begins[std::size_t(index) + 1]; ++i) {
    const MarchResult& result = scratch.results[i];
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

}  // namespace nephele::detail
