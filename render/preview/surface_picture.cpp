// Objects by ray casting: a lamp, a sky and one bounce.
//
// Every ray of a pixel that meets an object or the ground sends one ray to a random place of the lamp and one
// into the sky, which brings the sky's light or an estimate of what the surface there throws back. The random
// numbers are a low-discrepancy sequence (M. Roberts, The Unreasonable Effectiveness of Quasirandom
// Sequences, in six dimensions), shifted from pixel to pixel. Ground that sees all of the sky gets its mean
// in place of samples, so that it has no grain.
#include "nephele/render/preview/surface_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/scene/camera.h"

namespace nephele {

namespace {

constexpr Vec3f kGround{0.8f, 0.79f, 0.77f}, kBackdrop{0.74f, 0.76f, 0.8f}, kLamp{2.0f, 1.88f, 1.7f};
/// Of a disc at distance 1.
constexpr double kLampRadius = 0.14;
/// What an unlit surface throws back, as a share of its colour.
constexpr float kBounce = 0.34f;
/// The ground fades over this many sizes of the scene.
constexpr double kFadeFrom = 1.2, kFadeTo = 4.5;
/// Rays after which a pixel is left that shows open ground only.
constexpr int kOpenSamples = 6;

using Numbers = std::array<double, 6>;

double fraction(double x) {
  return x - std::floor(x);
}

std::uint32_t scrambled(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7feb352du;
  x = (x ^ x >> 15) * 0x846ca68bu;
  return x ^ x >> 16;
}

/// Two directions across `n`, of length 1.
std::array<Vec3d, 2> across(const Vec3d& n) {
  const Vec3d u = normalize(std::abs(n.y) < 0.9 ? cross(Vec3d{0, 1, 0}, n) : cross(Vec3d{1, 0, 0}, n));
  return {u, cross(n, u)};
}

Vec3f sky(float up) {
  return Vec3f{0.66f, 0.68f, 0.72f} * (1 - up) + Vec3f{0.88f, 0.94f, 1.05f} * up;
}

struct Scene {
  const Surfaces& surfaces;
  Vec3d centre, towardsLamp;
  double size, ground;

  /// Numbers 2 to 5 of `u` choose places on the lamp and in the sky. `isOpen` becomes false where an object
  /// is met, or stands in the light.
  Vec3f radiance(const Ray& ray, const Numbers& u, bool& isOpen) const {
    const auto hit = surfaces.hit(ray);
    const bool isGround = meetsGround(ray, hit);
    if (!hit && !isGround) return kBackdrop;
    if (!isGround) isOpen = false;
    const double distance = isGround ? (ground - ray.origin.y) / ray.direction.y : hit->distance;
    const Vec3d normal = isGround ? Vec3d{0, 1, 0} : Vec3d(hit->normal);
    const Vec3d place = ray.origin + ray.direction * distance + normal * surfaces.clearance() * 4.0;
    const Vec3f lit = (isGround ? kGround : hit->colour) *
                      (fromLamp(place, normal, u, isOpen) + fromSky(place, normal, u, isGround, isOpen));
    if (!isGround) return lit;
    const double away = length(place - Vec3d{centre.x, ground, centre.z}) / size;
    const double t = std::clamp((away - kFadeFrom) / (kFadeTo - kFadeFrom), 0.0, 1.0);
    const auto fade = float(t * t * (3 - 2 * t));
    return lit * (1 - fade) + kBackdrop * fade;
  }

 private:
  bool meetsGround(const Ray& ray, const std::optional<Surfaces::Hit>& hit) const {
    if (!(ray.direction.y < -1e-9) || ray.origin.y <= ground) return false;
    return !hit || (ground - ray.origin.y) / ray.direction.y < hit->distance;
  }

  Vec3f fromLamp(const Vec3d& place, const Vec3d& normal, const Numbers& u, bool& isOpen) const {
    const auto [right, up] = across(towardsLamp);
    const double radius = kLampRadius * std::sqrt(u[2]), turn = 2 * M_PI * u[3];
    const Vec3d towards =
        normalize(towardsLamp + right * (radius * std::cos(turn)) + up * (radius * std::sin(turn)));
    const double cosine = dot(normal, towards);
    if (cosine <= 0) return {};
    if (surfaces.occluded({place, towards}, 1e30)) {
      isOpen = false;
      return {};
    }
    return kLamp * float(cosine / M_PI);
  }

  Vec3f fromSky(const Vec3d& place, const Vec3d& normal, const Numbers& u, bool isGround,
                bool& isOpen) const {
    const auto [right, up] = across(normal);
    const double radius = std::sqrt(u[4]), turn = 2 * M_PI * u[5];
    const Ray ray{place, normalize(right * (radius * std::cos(turn)) + up * (radius * std::sin(turn)) +
                                   normal * std::sqrt(std::max(1 - u[4], 0.0)))};
    const auto hit = surfaces.hit(ray);
    if (hit && !meetsGround(ray, hit)) {
      isOpen = false;
      return hit->colour * kBounce;
    }
    // The mean height over a level place, weighted by its cosine.
    if (isGround) return sky(2.0f / 3);
    return ray.direction.y < 0 ? kGround * (kBounce + 0.2f) : sky(float(std::min(ray.direction.y, 1.0)));
  }
};

}  // namespace

Image pictureSurfaces(std::vector<SurfaceObject> objects, const SurfacePictureOptions& options,
                      const Progress& progress) {
  require(!objects.empty(), "picture: there are no objects");
  require(options.samples >= 1 && options.samples <= 65536,
          fmt::format("picture: samples must be from 1 to 65536, got {}", options.samples));
  std::vector<Vec3f> points;
  for (const SurfaceObject& object : objects)
    for (const std::uint32_t v : object.mesh.corners) points.emplace_back(object.mesh.positions[v]);
  Camera::Frame frame;
  frame.width = options.width;
  frame.height = options.height;
  frame.fovDegrees = 26.0f;
  const Camera camera =
      Camera::framing(points, options.azimuthDegrees, options.elevationDegrees, frame, options.margin);
  progress.begin("picture");
  const Surfaces surfaces(std::move(objects));
  const Box& box = surfaces.box();
  // Over the left shoulder of the camera.
  const double azimuth = (double(options.azimuthDegrees) - 52) * M_PI / 180, elevation = 0.86;
  const Scene scene{
      surfaces,
      Vec3d(box.center()),
      {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)},
      double(length(box.size())) / 2,
      double(box.min.y)};

  Image image;
  image.width = options.width;
  image.height = options.height;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  // Powers of the real root of x^7 = x + 1.
  constexpr double kRoot = 1.1127756842787055;
  Numbers step;
  for (std::size_t d = 0; d < step.size(); ++d) step[d] = fraction(std::pow(1 / kRoot, double(d + 1)));
  parallelFor(
      std::size_t(options.height), 2,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y)
          for (std::size_t x = 0; x < std::size_t(options.width); ++x) {
            Numbers shift, u;
            for (std::uint32_t d = 0; d < 6; ++d)
              shift[d] = scrambled(std::uint32_t(x) * 6 + d + scrambled(std::uint32_t(y))) * 0x1p-32;
            Vec3d sum;
            bool isOpen = true;
            int count = 0;
            while (count < options.samples && !(isOpen && count == kOpenSamples)) {
              ++count;
              for (std::size_t d = 0; d < 6; ++d) u[d] = fraction(shift[d] + step[d] * count);
              sum += Vec3d(scene.radiance(camera.ray(double(x) + u[0], double(y) + u[1]), u, isOpen));
            }
            const std::size_t at = y * std::size_t(options.width) + x;
            for (int c = 0; c < 3; ++c) image.channels[std::size_t(c)].values[at] = float(sum[c] / count);
            image.channels[3].values[at] = 1;
          }
      },
      progress);
  return image;
}

}  // namespace nephele
