// Objects in a marched picture: they end rays, and are lit through the volume.
#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/render/march/detail/picture.h"

namespace nephele::detail {

namespace {

// Directions in which the objects of a pixel look for the sky.
constexpr int kSkyRays = 64;

}  // namespace

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

}  // namespace nephele::detail
