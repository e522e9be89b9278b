// Optical depth in front of every depth, pixel by pixel, from deep samples.
//
// A sample's optical depth -log(1 - alpha) is spread evenly from its front to its back; those of all samples
// add up, so that overlaps need no splitting. A sample without thickness is a jump: two knots at one depth.
#include "nephele/render/scene/holdout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"

namespace nephele {

namespace {

// More than any float can tell from opaque.
constexpr float kOpaque = 200.0f;

struct Change {
  float depth;
  double slope, jump;
};

void addKnots(const std::vector<DeepSample>& samples, std::vector<Change>& changes,
              std::vector<HoldoutCurve::Knot>& knots) {
  changes.clear();
  for (const DeepSample& sample : samples) {
    const float alpha = std::clamp(sample.alpha, 0.0f, 1.0f);
    if (!(alpha > 0) || !std::isfinite(sample.z)) continue;
    const double depth = alpha == 1 ? kOpaque : -std::log1p(-double(alpha));
    const bool thick = sample.zBack > sample.z && std::isfinite(sample.zBack) && alpha < 1;
    if (thick) {
      const double slope = depth / (double(sample.zBack) - sample.z);
      changes.push_back({sample.z, slope, 0});
      changes.push_back({sample.zBack, -slope, 0});
    } else {
      changes.push_back({sample.z, 0, depth});
    }
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const Change& a, const Change& b) { return a.depth < b.depth; });
  double depth = 0, slope = 0, at = changes.empty() ? 0 : changes.front().depth;
  for (std::size_t i = 0; i != changes.size();) {
    const float z = changes[i].depth;
    depth += std::max(slope, 0.0) * (z - at);
    at = z;
    knots.push_back({z, float(depth)});
    double jump = 0;
    for (; i != changes.size() && changes[i].depth == z; ++i) {
      slope += changes[i].slope;
      jump += changes[i].jump;
    }
    if (jump > 0) knots.push_back({z, float(depth += jump)});
  }
}

/// Cameras as files have them, x right, y up.
struct View {
  Vec3d position, forward;
};

View viewOf(const Mat44& m) {
  const auto row = [&](std::size_t r) { return Vec3d{m[4 * r], m[4 * r + 1], m[4 * r + 2]}; };
  const Vec3d shift = row(3);
  View view;
  for (int axis = 0; axis != 3; ++axis) {
    view.position[axis] = -dot(row(std::size_t(axis)), shift);
    view.forward[axis] = row(std::size_t(axis)).z;
  }
  return view;
}

/// Whether `a`, or it looking along its -z, is `b`.
bool isSame(const Mat44& a, const Mat44& b) {
  constexpr double kNearly = 1e-4;
  const double far = std::max({std::fabs(double(b[12])), std::fabs(double(b[13])), std::fabs(double(b[14]))});
  const auto isWithin = [&](double sign) {
    for (std::size_t i = 0; i != 16; ++i) {
      const double factor = i % 4 == 2 ? sign : 1.0, most = kNearly * (i < 12 ? 1.0 : std::max(far, 1e-30));
      if (std::fabs(factor * double(a[i]) - double(b[i])) > most && i % 4 != 3) return false;
    }
    return true;
  };
  return isWithin(1) || isWithin(-1);
}

void requireSameCamera(const std::string& path, const Camera& camera) {
  const std::optional<ImageCamera> file = readImageCamera(path);
  if (!file) return;
  const ImageCamera wanted = camera;
  if (!isSame(file->worldToCamera, wanted.worldToCamera)) {
    const View theirs = viewOf(file->worldToCamera), ours = viewOf(wanted.worldToCamera);
    throw Error(
        fmt::format("{}: was made by another camera: at ({:.4g}, {:.4g}, {:.4g}), looking along "
                    "({:.3g}, {:.3g}, {:.3g}); this one is at ({:.4g}, {:.4g}, {:.4g}), looking "
                    "along ({:.3g}, {:.3g}, {:.3g})",
                    path, theirs.position.x, theirs.position.y, theirs.position.z, theirs.forward.x,
                    theirs.forward.y, theirs.forward.z, ours.position.x, ours.position.y, ours.position.z,
                    ours.forward.x, ours.forward.y, ours.forward.z));
  }
  if (file->screenWidth != 1.0f && std::fabs(file->screenWidth / wanted.screenWidth - 1) > 1e-4f)
    throw Error(
        fmt::format("{}: was made by another camera: its picture is {:.4g} wide at distance 1, this "
                    "one {:.4g}",
                    path, file->screenWidth, wanted.screenWidth));
}

}  // namespace

Holdout::Holdout(const DeepImage& image)
    : display_(image.display.value_or(Image::Display{0, 0, image.width, image.height})),
      width_(image.width),
      height_(image.height) {
  image.check();
  std::vector<Change> changes;
  start_.reserve(image.pixels.size() + 1);
  for (const auto& samples : image.pixels) {
    start_.push_back(knots_.size());
    addKnots(samples, changes, knots_);
  }
  start_.push_back(knots_.size());
}

HoldoutCurve Holdout::at(int x, int y) const {
  x -= display_.x;
  y -= display_.y;
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return {};
  const std::size_t pixel = std::size_t(y) * width_ + x;
  return {knots_.data() + start_[pixel], start_[pixel + 1] - start_[pixel]};
}

std::size_t Holdout::memoryBytes() const {
  return start_.size() * sizeof(std::size_t) + knots_.size() * sizeof(HoldoutCurve::Knot);
}

std::shared_ptr<const Holdout> readHoldout(const std::string& path, const Camera& camera, double mostBytes) {
  auto holdout = std::make_shared<const Holdout>(readDeepExr(path, mostBytes));
  if (holdout->width() != camera.width() || holdout->height() != camera.height())
    throw Error(fmt::format("{}: is for pictures of {}x{}, but this one has {}x{}", path, holdout->width(),
                            holdout->height(), camera.width(), camera.height()));
  requireSameCamera(path, camera);
  return holdout;
}

}  // namespace nephele
