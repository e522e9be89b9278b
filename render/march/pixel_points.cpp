#include "nephele/render/march/pixel_points.h"

#include <vector>

#include "nephele/levelset/grid/grid_field.h"

namespace nephele {

std::optional<OpacityDistances> opacityDistances(const MarchRecord& record) {
  if (record.steps.empty() || !(record.steps.back().opacity > 0)) return std::nullopt;
  const double whole = record.steps.back().opacity;
  OpacityDistances result;
  bool found = false;
  double before = 0, sum = 0;
  for (const MarchRecord::Step& step : record.steps) {
    const double gain = step.opacity - before;
    sum += gain * 0.5 * (double(step.begin) + step.end);
    if (!found && step.opacity >= 0.5 * whole) {
      const double share = gain > 0 ? (0.5 * whole - before) / gain : 1;
      result.median = float(step.begin + share * (double(step.end) - step.begin));
      found = true;
    }
    before = step.opacity;
  }
  result.mean = float(sum / whole);
  return result;
}

PixelMotion::PixelMotion(const Camera& camera, const Shutter& shutter, const RigidMotion* volumeMotion,
                         const Camera* nextCamera)
    : from_(camera.stillAt(0)), to_(camera.stillAt(1)) {
  if (volumeMotion) motion_ = *volumeMotion;
  if (!shutter.isInstant()) {
    fromFrames_ = shutter.open;
    toFrames_ = shutter.close;
    isStill_ = !camera.isMoving() && !motion_;
  } else if (nextCamera) {
    to_ = nextCamera->stillAt(0);
    toFrames_ = 1;
    isStill_ = false;
  }
}

void PixelMotion::evaluate(const Vec3d& inVolume, float (&motion)[2], bool isStill) const {
  motion[0] = motion[1] = 0;
  if (isStill_) return;
  const auto placed = [&](double frames) {
    return motion_ && !isStill ? motion_->toWorld({inVolume, {}}, frames).origin : inVolume;
  };
  const Vec3d from = from_.project(placed(fromFrames_)), to = to_.project(placed(toFrames_));
  if (!(from.z > 0 && to.z > 0)) return;
  for (int axis = 0; axis != 2; ++axis)
    motion[axis] = float((to[axis] - from[axis]) / (toFrames_ - fromFrames_));
}

DensityNormals::DensityNormals(const RenderVolume& volume)
    : density_(gridField(std::shared_ptr<const BrickGrid>(std::shared_ptr<void>(), &volume.density()))),
      voxelSize_(volume.density().voxelSize()) {}

void DensityNormals::gradients(std::span<const Vec3f> points, float step, std::span<Vec3f> results) const {
  std::vector<float> x[3], low(points.size()), high(points.size());
  for (int axis = 0; axis != 3; ++axis)
    for (const Vec3f& p : points) x[axis].push_back(p[axis]);
  for (int axis = 0; axis != 3; ++axis) {
    const auto valuesAt = [&](float offset, std::vector<float>& values) {
      for (std::size_t i = 0; i != points.size(); ++i) x[axis][i] = points[i][axis] + offset;
      density_.eval({x[0], x[1], x[2]}, values);
    };
    valuesAt(-step, low);
    valuesAt(step, high);
    for (std::size_t i = 0; i != points.size(); ++i) {
      x[axis][i] = points[i][axis];
      results[i][axis] = high[i] - low[i];
    }
  }
}

void DensityNormals::evaluate(std::span<const Vec3f> points, std::span<Vec3f> normals) const {
  if (points.empty()) return;
  gradients(points, voxelSize_, normals);
  std::vector<std::size_t> flat;
  std::vector<Vec3f> flatPoints;
  for (std::size_t i = 0; i != points.size(); ++i)
    if (normals[i] == Vec3f{}) {
      flat.push_back(i);
      flatPoints.push_back(points[i]);
    }
  if (!flat.empty()) {
    std::vector<Vec3f> wide(flat.size());
    gradients(flatPoints, 4 * voxelSize_, wide);
    for (std::size_t i = 0; i != flat.size(); ++i) normals[flat[i]] = wide[i];
  }
  for (Vec3f& normal : normals)
    if (normal != Vec3f{}) normal = -normalize(normal);
}

}  // namespace nephele
