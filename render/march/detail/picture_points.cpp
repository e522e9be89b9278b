// What the rays through the centres of pixels meet: the density alone, seen in the middle of the shutter.
#include <cmath>

#include "nephele/render/march/detail/picture.h"

namespace nephele::detail {

void Picture::preparePoints(const Film& film, const Camera* nextCamera) {
  pointScene_ = withoutLight(scene_);
  pointScene_.stepDepth = 0.25f, pointScene_.divided = 1;
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

}  // namespace nephele::detail
