// Deep shadow maps.
//
// Along the ray through every pixel of the light's picture the optical depth is summed by trapezoids over
// half voxels. Knots are dropped as long as one straight piece passes all it replaces within a window:
// optical depth t may be off by tolerance * exp(k t) / k, which is the tolerance of exp(-k t) to first order,
// for all k from 0.1, as octaves see, to 1; a piece may have any slope that all windows so far allow
// (Lokovic, Veach 2000). Straight optical depth is what deep images mean by a sample with a front and a back.
//
// Files hold opacities as 16 bit floats. A sample is at most one optical depth, and each makes up for the
// rounding of those before it.
//
// Limits: one picture, so the light must see the volume within a cone; structure finer than a pixel is lost.
#include "nephele/render/light/deep_shadow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/volume/trilinear.h"

namespace nephele {

namespace {

constexpr double kDeepest = 80;
constexpr double kWidestDegrees = 75;
constexpr int kMostPixels = 8192;
// Of crisp clouds, as a mean.
constexpr double kSamplesPerPixel = 30;

// Density at an index-space position, as the marcher interpolates.
double densityAt(const BrickGrid& grid, const Vec3d& p) {
  return double(std::max(sampleGrid(grid, p), 0.0f));
}

// One pixel's curve, simplified as it comes in.
class Curve {
 public:
  Curve(double tolerance, std::vector<DeepSample>& samples) : tolerance_(tolerance), samples_(samples) {}

  void start(double z) { beginZ_ = lastZ_ = z; }

  void add(double z, double depth) {
    if (depth == lastDepth_ && !isOpen_) {
      // Nothing yet.
      beginZ_ = lastZ_ = z;
      return;
    }
    const double k = std::clamp(1 / std::max(depth, 1e-6), 0.1, 1.0);
    const double margin = tolerance_ * std::exp(k * depth) / k, way = z - beginZ_;
    double low = std::max(low_, (depth - margin - beginDepth_) / way),
           high = std::min(high_, (depth + margin - beginDepth_) / way);
    if (isOpen_ && low > high) {
      close();
      const double rest = z - beginZ_;
      low = (depth - margin - beginDepth_) / rest;
      high = (depth + margin - beginDepth_) / rest;
    }
    low_ = std::max(low, 0.0);
    high_ = std::max(high, low_);
    isOpen_ = true;
    lastZ_ = z;
    lastDepth_ = depth;
  }

  void finish() {
    if (isOpen_) close();
  }

 private:
  // Ends the piece at the last point, as near to its depth there as the windows allow. Its samples are even.
  void close() {
    const double way = lastZ_ - beginZ_;
    const double slope = std::clamp((lastDepth_ - beginDepth_) / way, low_, high_);
    const double target = beginDepth_ + slope * way;
    const int count = std::max(1, int(std::ceil(slope * way)));
    for (int i = 0; i != count; ++i) {
      const double depth = std::max((target - beginDepth_) / (count - i), 0.0);
      const float alpha = roundedToHalf(float(-std::expm1(-depth)));
      if (!(alpha > 0)) continue;
      samples_.push_back(
          {float(beginZ_ + way * i / count), float(beginZ_ + way * (i + 1) / count), alpha, {}});
      beginDepth_ -= std::log1p(-double(alpha));
    }
    beginZ_ = lastZ_;
    low_ = 0;
    high_ = INFINITY;
    isOpen_ = false;
  }

  double tolerance_;
  std::vector<DeepSample>& samples_;
  double beginZ_ = 0, beginDepth_ = 0, lastZ_ = 0, lastDepth_ = 0, low_ = 0, high_ = INFINITY;
  bool isOpen_ = false;
};

// Two directions across `way`.
std::pair<Vec3d, Vec3d> axesAcross(const Vec3d& way) {
  const Vec3d right =
      std::fabs(way.y) > 0.9 ? normalize(cross(way, Vec3d{1, 0, 0})) : normalize(cross(way, Vec3d{0, 1, 0}));
  return {right, cross(right, way)};
}

std::vector<Vec3d> outlineOf(const RenderVolume& volume) {
  std::vector<Vec3d> points;
  for (const Vec3f& p : volume.outline()) points.emplace_back(p);
  if (points.empty()) points.emplace_back();
  return points;
}

int pixelCount(double pixels) {
  return std::clamp(int(std::ceil(pixels)), 4, kMostPixels);
}

Vec3d transformed(const Mat44& m, const Vec3d& p, double& w) {
  Vec3d result;
  for (int c = 0; c != 3; ++c) {
    const auto at = [&](int row) { return double(m[std::size_t(row * 4 + c)]); };
    result[c] = p.x * at(0) + p.y * at(1) + p.z * at(2) + at(3);
  }
  w = p.x * double(m[3]) + p.y * double(m[7]) + p.z * double(m[11]) + double(m[15]);
  return result;
}

// The camera of a light's picture.
Camera cameraOf(const RenderVolume& volume, const DistantLight& light) {
  require(isFinite(light.direction) && length(light.direction) > 0,
          light.name + ": the direction towards it must be finite and not zero");
  const double voxel = double(volume.density().voxelSize());
  const Vec3d way = -normalize(Vec3d(light.direction));
  const auto [right, up] = axesAcross(way);
  Vec3d low{INFINITY, INFINITY, INFINITY}, high = -low;
  for (const Vec3d& p : outlineOf(volume)) {
    const Vec3d q{dot(p, right), dot(p, up), dot(p, way)};
    low = min(low, q);
    high = max(high, q);
  }
  const Vec3d middle = (low + high) * 0.5;
  const double across = std::max(high.x - low.x, high.y - low.y) + 4 * voxel;
  const int pixels = pixelCount(across / voxel);
  Camera::Frame frame{pixels, pixels};
  frame.projection = Camera::Projection::orthographic;
  frame.orthographicWidth = float(across);
  const Vec3d position = right * middle.x + up * middle.y + way * (low.z - 2 * voxel);
  return Camera::facing(position, right, up, frame);
}

Camera cameraOf(const RenderVolume& volume, const LocalLight& light) {
  const double voxel = double(volume.density().voxelSize());
  const std::vector<Vec3d> points = outlineOf(volume);
  Vec3d low{INFINITY, INFINITY, INFINITY}, high = -low;
  for (const Vec3d& p : points) low = min(low, p), high = max(high, p);
  const Vec3d from(light.position);
  Vec3d way = normalize((low + high) * 0.5 - from);
  double widest = 0, farthest = voxel;
  for (const Vec3d& p : points) {
    const double angle = std::acos(std::clamp(dot(way, normalize(p - from)), -1.0, 1.0)) * 180 / double(kPi);
    widest = std::max(widest, way == Vec3d{} ? 180 : angle);
    farthest = std::max(farthest, length(p - from));
  }
  widest += 1;
  if (light.cone && double(light.cone->angleDegrees) + 1 < widest) {
    way = normalize(Vec3d(light.cone->direction));
    widest = double(light.cone->angleDegrees) + 1;
  }
  require(widest <= kWidestDegrees,
          fmt::format("{}: sees the volume up to {:g} degrees from the middle, and a deep shadow map reaches "
                      "{:g}; choose shadows from a volume, or a spot",
                      light.name, widest, kWidestDegrees));
  const auto [right, up] = axesAcross(way);
  const double tangent = std::tan(widest * double(kPi) / 180);
  const int pixels = pixelCount(2 * tangent * 0.75 * farthest / voxel);
  Camera::Frame frame{pixels, pixels};
  frame.fovDegrees = float(2 * widest);
  return Camera::facing(from, right, up, frame);
}

// Lists grow by halves, and every sample ends in some two knots.
double bytesOf(const Camera& camera) {
  constexpr double perSample = 1.5 * sizeof(DeepSample) + 2 * sizeof(HoldoutCurve::Knot);
  return double(camera.width()) * camera.height() *
         (sizeof(std::vector<DeepSample>) + sizeof(std::size_t) + kSamplesPerPixel * perSample);
}

}  // namespace

DeepShadowMap::DeepShadowMap(const RenderVolume& volume, const DistantLight& light, float extinction,
                             const Options& options, const Progress& progress) {
  make(volume, cameraOf(volume, light), extinction, options, progress);
}

DeepShadowMap::DeepShadowMap(const RenderVolume& volume, const LocalLight& light, float extinction,
                             const Options& options, const Progress& progress) {
  make(volume, cameraOf(volume, light), extinction, options, progress);
}

double DeepShadowMap::estimateBytes(const RenderVolume& volume, const DistantLight& light) {
  return bytesOf(cameraOf(volume, light));
}

double DeepShadowMap::estimateBytes(const RenderVolume& volume, const LocalLight& light) {
  return bytesOf(cameraOf(volume, light));
}

void DeepShadowMap::make(const RenderVolume& volume, const Camera& camera, float extinction,
                         const Options& options, const Progress& progress) {
  require(options.tolerance > 0 && options.tolerance <= 0.5f,
          fmt::format("deep shadow: expected a tolerance within (0, 0.5], got {}", options.tolerance));
  require(
      std::isfinite(extinction) && extinction >= 0,
      fmt::format("deep shadow: expected an extinction that is finite and at least 0, got {}", extinction));
  const BrickGrid& grid = volume.density();
  auto image = std::make_shared<DeepImage>();
  image->width = camera.width();
  image->height = camera.height();
  image->pixels.resize(std::size_t(image->width) * std::size_t(image->height));
  const Box bounds = volume.worldBounds();
  const Affine& toIndex = grid.worldToIndex();
  const auto index = [&](const Vec3d& p) {
    Vec3d q;
    for (int row = 0; row != 3; ++row)
      q[row] = double(toIndex.linear(row, 0)) * p.x + double(toIndex.linear(row, 1)) * p.y +
               double(toIndex.linear(row, 2)) * p.z + double(toIndex.translation[row]);
    return q;
  };
  parallelFor(
      std::size_t(volume.isEmpty() ? 0 : image->height), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y != end; ++y)
          for (int x = 0; x != image->width; ++x) {
            const Ray ray = camera.ray(x + 0.5, double(y) + 0.5);
            double near = 0, far = INFINITY;
            for (int axis = 0; axis != 3; ++axis) {
              const double a = (double(bounds.min[axis]) - ray.origin[axis]) / ray.direction[axis],
                           b = (double(bounds.max[axis]) - ray.origin[axis]) / ray.direction[axis];
              if (ray.direction[axis] == 0) continue;
              near = std::max(near, std::min(a, b));
              far = std::min(far, std::max(a, b));
            }
            if (!(far > near) || std::isinf(far)) continue;
            const int steps = std::max(1, int(std::ceil((far - near) / (0.5 * double(grid.voxelSize())))));
            const double step = (far - near) / steps, cosine = dot(ray.direction, camera.forward());
            Curve curve(double(options.tolerance),
                        image->pixels[y * std::size_t(image->width) + std::size_t(x)]);
            const Vec3d first = index(ray.origin + ray.direction * near),
                        stride = (index(ray.origin + ray.direction * far) - first) * (1.0 / steps);
            curve.start(near * cosine);
            double depth = 0, before = densityAt(grid, first);
            for (int i = 1; i <= steps && depth < kDeepest; ++i) {
              const double here = densityAt(grid, first + stride * double(i));
              depth += double(extinction) * step * (before + here) / 2;
              before = here;
              curve.add((near + step * i) * cosine, depth);
            }
            curve.finish();
          }
      },
      progress);
  camera_ = camera;
  curves_ = std::make_shared<const Holdout>(*image);
  image_ = std::move(image);
}

DeepShadowMap DeepShadowMap::read(const std::string& path, double mostBytes) {
  DeepShadowMap map;
  map.curves_ = std::make_shared<const Holdout>(readDeepExr(path, mostBytes));
  const std::optional<ImageCamera> camera = readImageCamera(path);
  require(camera.has_value(), path + ": does not say where the light stood (worldToCamera, worldToNDC)");
  map.camera_ = *camera;
  return map;
}

namespace {

constexpr double kNearly = 1e-4;

void requireSame(const std::string& path, const std::string& light, const char* what, const Vec3d& its,
                 const Vec3d& ours, double most) {
  require(
      length(its - ours) <= most,
      fmt::format("{}: was made for another light: one that {} ({:.4g}, {:.4g}, {:.4g}); '{}' {} ({:.4g}, "
                  "{:.4g}, {:.4g})",
                  path, what, its.x, its.y, its.z, light, what, ours.x, ours.y, ours.z));
}

}  // namespace

void DeepShadowMap::requireMadeFor(const DistantLight& light, const std::string& path) const {
  const Mat44& m = camera_.worldToCamera;
  requireSame(path, light.name, "shines along", normalize(Vec3d{m[2], m[6], m[10]}),
              -normalize(Vec3d(light.direction)), kNearly);
}

void DeepShadowMap::requireMadeFor(const LocalLight& light, const std::string& path) const {
  const Mat44& m = camera_.worldToCamera;
  Vec3d place;
  for (std::size_t axis = 0; axis != 3; ++axis)
    place[int(axis)] = -dot(Vec3d{m[4 * axis], m[4 * axis + 1], m[4 * axis + 2]}, Vec3d{m[12], m[13], m[14]});
  const Vec3d ours(light.position);
  requireSame(path, light.name, "stands at", place, ours, kNearly * std::max(length(ours), length(place)));
}

void DeepShadowMap::write(const std::string& path, const std::map<std::string, std::string>& metadata) const {
  require(image_ != nullptr, path + ": a deep shadow map that was read is not written again");
  writeDeepExr(path, *image_, camera_, metadata);
}

std::size_t DeepShadowMap::memoryBytes() const {
  std::size_t bytes = curves_->memoryBytes();
  if (image_) bytes += image_->pixels.size() * sizeof(image_->pixels[0]) + sampleCount() * sizeof(DeepSample);
  return bytes;
}

float DeepShadowMap::depthAt(int x, int y, float depth) const {
  const HoldoutCurve curve =
      curves_->at(std::clamp(x, 0, curves_->width() - 1), std::clamp(y, 0, curves_->height() - 1));
  const HoldoutCurve::Knot* end = curve.knots + curve.count;
  const HoldoutCurve::Knot* behind = std::upper_bound(
      curve.knots, end, depth, [](float z, const HoldoutCurve::Knot& knot) { return z < knot.depth; });
  if (behind == curve.knots) return 0.0f;
  const HoldoutCurve::Knot& a = behind[-1];
  if (behind == end) return a.opticalDepth;
  return a.opticalDepth +
         (behind->opticalDepth - a.opticalDepth) * (depth - a.depth) / (behind->depth - a.depth);
}

float DeepShadowMap::opticalDepth(const Vec3f& world) const {
  double w = 1, one = 1;
  const Vec3d p(world), ndc = transformed(camera_.worldToNdc, p, w),
                        camera = transformed(camera_.worldToCamera, p, one);
  if (!(camera.z > 0) || !(w > 0)) return 0.0f;
  const double x = ndc.x / w * curves_->width() - 0.5, y = ndc.y / w * curves_->height() - 0.5;
  if (!(x > -1 && y > -1 && x < curves_->width() && y < curves_->height())) return 0.0f;
  const int ix = int(std::floor(x)), iy = int(std::floor(y));
  const float fx = float(x - ix), fy = float(y - iy), z = float(camera.z);
  const auto row = [&](int j) { return depthAt(ix, j, z) * (1 - fx) + depthAt(ix + 1, j, z) * fx; };
  return row(iy) * (1 - fy) + row(iy + 1) * fy;
}

}  // namespace nephele
