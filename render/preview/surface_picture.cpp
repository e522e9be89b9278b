// Objects by ray casting: a lamp, a sky and one bounce.
//
// Some rays go through every pixel, and of every other place that they meet one to a random place of the lamp
// and one into the sky, which brings the sky's light or an estimate of what the surface there throws back.
// The random numbers are a low-discrepancy sequence (M. Roberts, The Unreasonable Effectiveness of
// Quasirandom Sequences, in six dimensions), shifted from pixel to pixel. So few of them would be grain: what
// is seen of lamp and sky is smoothed over neighbours on the same surface, colours and the angles to the lamp
// are not (H. Dammertz and others, Edge-Avoiding A-Trous Wavelet Transform, 2010). Ground that sees all of
// the sky gets its mean in place of samples.
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
constexpr int kOpenSamples = 4;
/// Of so many rays through a pixel one looks for lamp and sky.
constexpr int kPerLook = 2;
/// Steps between the pixels that are smoothed over: of the lamp's light, whose shadows have edges, and of the
/// sky's.
constexpr int kLampSteps = 2, kSkySteps = 8;
// Twice all steps, each twice as far as the one before.
constexpr int kSmoothReach = 2 * (2 * kSkySteps - 1);

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

/// What is seen in a pixel, as a mean over its rays.
struct Seen {
  /// Colour of what is in the light, that times the cosine towards the lamp, and the share of the backdrop.
  Vec3f colour{}, facing{};
  float backdrop = 0;
  /// Of the surface; zero where there is only backdrop.
  Vec3f normal{}, place{};
  /// How large a pixel is there.
  float size = 0;
  /// Shares of the lamp that are in sight, and the light of the sky and other surfaces.
  float lamp = 0;
  Vec3f sky{};
};

struct Scene {
  const Surfaces& surfaces;
  const Camera& camera;
  Vec3d centre, towardsLamp;
  /// A pixel is `pixelAngle` times the distance wide, and `pixelWidth` more.
  double size, ground, pixelAngle, pixelWidth;

  Seen look(std::size_t x, std::size_t y, int samples) const {
    Numbers shift, u;
    for (std::uint32_t d = 0; d < 6; ++d)
      shift[d] = scrambled(std::uint32_t(x) * 6 + d + scrambled(std::uint32_t(y))) * 0x1p-32;
    Sums sums;
    int count = 0;
    while (count < samples && !(sums.isOpen && count == kOpenSamples)) {
      ++count;
      for (std::size_t d = 0; d < 6; ++d) u[d] = fraction(shift[d] + kStep[d] * count);
      add(camera.ray(double(x) + u[0], double(y) + u[1]), u, count % kPerLook == 1, sums);
    }
    Seen& seen = sums.seen;
    const float perRay = 1 / float(count), perPlace = sums.places > 0 ? 1 / float(sums.places) : 0.0f,
                perLook = sums.looks > 0 ? 1 / float(sums.looks) : 0.0f;
    seen.colour *= perRay;
    seen.facing *= perRay;
    seen.backdrop *= perRay;
    seen.place *= perPlace;
    seen.size *= perPlace;
    seen.lamp *= perLook;
    seen.sky *= perLook;
    if (const float n = length(seen.normal); n > 0) seen.normal *= 1 / n;
    return seen;
  }

 private:
  struct Sums {
    Seen seen;
    int places = 0, looks = 0;
    bool isOpen = true;
  };
  static const Numbers kStep;

  // Numbers 2 to 5 of `u` choose places on the lamp and in the sky. `isOpen` becomes false where an object is
  // met, or stands in the light.
  void add(const Ray& ray, const Numbers& u, bool looks, Sums& sums) const {
    const auto hit = surfaces.hit(ray);
    const bool isGround = meetsGround(ray, hit);
    Seen& seen = sums.seen;
    if (!hit && !isGround) {
      seen.backdrop += 1;
      return;
    }
    if (!isGround) sums.isOpen = false;
    const double distance = isGround ? (ground - ray.origin.y) / ray.direction.y : hit->distance;
    const Vec3d normal = isGround ? Vec3d{0, 1, 0} : Vec3d(hit->normal);
    const Vec3d met = ray.origin + ray.direction * distance,
                place = met + normal * surfaces.clearance() * 4.0;
    float fade = 0;
    if (isGround) {
      const double away = length(place - Vec3d{centre.x, ground, centre.z}) / size;
      const double t = std::clamp((away - kFadeFrom) / (kFadeTo - kFadeFrom), 0.0, 1.0);
      fade = float(t * t * (3 - 2 * t));
    }
    const Vec3f colour = (isGround ? kGround : hit->colour) * (1 - fade);
    const double cosine = std::max(dot(normal, towardsLamp), 0.0);
    seen.colour += colour;
    seen.facing += colour * float(cosine / M_PI);
    seen.backdrop += fade;
    seen.normal += Vec3f(normal);
    seen.place += Vec3f(met - centre);
    seen.size += float(distance * pixelAngle + pixelWidth);
    ++sums.places;
    if (!looks && sums.looks > 0) return;
    ++sums.looks;
    seen.lamp += ofLamp(place, normal, u, sums.isOpen);
    seen.sky += fromSky(place, normal, u, isGround, sums.isOpen);
  }

  bool meetsGround(const Ray& ray, const std::optional<Surfaces::Hit>& hit) const {
    if (!(ray.direction.y < -1e-9) || ray.origin.y <= ground) return false;
    return !hit || (ground - ray.origin.y) / ray.direction.y < hit->distance;
  }

  float ofLamp(const Vec3d& place, const Vec3d& normal, const Numbers& u, bool& isOpen) const {
    const auto [right, up] = across(towardsLamp);
    const double radius = kLampRadius * std::sqrt(u[2]), turn = 2 * M_PI * u[3];
    const Vec3d towards =
        normalize(towardsLamp + right * (radius * std::cos(turn)) + up * (radius * std::sin(turn)));
    if (dot(normal, towards) <= 0) return 0;
    if (!surfaces.occluded({place, towards}, 1e30)) return 1;
    isOpen = false;
    return 0;
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

// Powers of the real root of x^7 = x + 1.
const Numbers Scene::kStep = [] {
  constexpr double kRoot = 1.1127756842787055;
  Numbers step;
  for (std::size_t d = 0; d < step.size(); ++d) step[d] = fraction(std::pow(1 / kRoot, double(d + 1)));
  return step;
}();

/// How much a pixel counts for one so many steps away: on the same surface, and not turned away.
float likeness(const Seen& own, const Seen& other, int step) {
  const float facing = dot(own.normal, other.normal);
  if (facing <= 0) return 0;
  const float off = dot(own.normal, other.place - own.place) / (own.size * float(step)), near = 1 - off * off;
  if (near <= 0) return 0;
  const float f2 = facing * facing, f4 = f2 * f2, f8 = f4 * f4, f16 = f8 * f8;
  return near * f16 * f16;
}

/// Smooths what is seen of lamp and sky between pixels that are like each other.
void smooth(std::vector<Seen>& pixels, int width, int height, const Progress& progress) {
  constexpr float kShares[5] = {1.0f / 16, 1.0f / 4, 3.0f / 8, 1.0f / 4, 1.0f / 16};
  struct Light {
    float lamp;
    Vec3f sky;
  };
  std::vector<Light> smoothed(pixels.size());
  for (int step = 1; step <= kSkySteps; step *= 2) {
    parallelFor(
        std::size_t(height), 4,
        [&](std::size_t begin, std::size_t end) {
          for (int y = int(begin); y != int(end); ++y)
            for (int x = 0; x != width; ++x) {
              const auto at = std::size_t(y) * std::size_t(width) + std::size_t(x);
              const Seen& own = pixels[at];
              smoothed[at] = {own.lamp, own.sky};
              if (!(own.size > 0)) continue;
              float all = 0;
              Light sum{0, {}};
              for (int j = -2; j <= 2; ++j)
                for (int i = -2; i <= 2; ++i) {
                  const int u = x + i * step, v = y + j * step;
                  if (u < 0 || v < 0 || u >= width || v >= height) continue;
                  const Seen& other = pixels[std::size_t(v) * std::size_t(width) + std::size_t(u)];
                  if (!(other.size > 0)) continue;
                  const float share = kShares[i + 2] * kShares[j + 2] * likeness(own, other, step);
                  all += share;
                  sum.lamp += share * other.lamp;
                  sum.sky += other.sky * share;
                }
              if (step <= kLampSteps) smoothed[at].lamp = sum.lamp / all;
              smoothed[at].sky = sum.sky * (1 / all);
            }
        },
        progress);
    for (std::size_t i = 0; i != pixels.size(); ++i) {
      pixels[i].lamp = smoothed[i].lamp;
      pixels[i].sky = smoothed[i].sky;
    }
  }
}

Camera cameraOf(const std::vector<SurfaceObject>& objects, const SurfacePictureOptions& options) {
  if (options.camera) return *options.camera;
  std::vector<Vec3f> points;
  for (const SurfaceObject& object : objects)
    for (const std::uint32_t v : object.mesh.corners) points.emplace_back(object.mesh.positions[v]);
  Camera::Frame frame;
  frame.width = options.width;
  frame.height = options.height;
  frame.fovDegrees = 26.0f;
  return Camera::framing(points, options.azimuthDegrees, options.elevationDegrees, frame, options.margin);
}

}  // namespace

Image pictureSurfaces(std::vector<SurfaceObject> objects, const SurfacePictureOptions& options,
                      const Progress& progress) {
  require(!objects.empty(), "picture: there are no objects");
  const Camera camera = cameraOf(objects, options);
  progress.begin("picture");
  return pictureSurfaces(Surfaces(std::move(objects)), camera, options.samples, progress);
}

Image pictureSurfaces(const Surfaces& surfaces, const Camera& camera, int samples, const Progress& progress) {
  require(samples >= 1 && samples <= 65536,
          fmt::format("picture: samples must be from 1 to 65536, got {}", samples));
  const Box& box = surfaces.box();
  const double middleX = 0.5 * camera.width(), middleY = 0.5 * camera.height();
  const Ray ahead = camera.ray(middleX, middleY), beside = camera.ray(middleX + 1, middleY);
  // Over the left shoulder of the camera.
  const double azimuth = std::atan2(-ahead.direction.x, -ahead.direction.z) - 52 * M_PI / 180,
               elevation = 0.86;
  const Scene scene{
      surfaces,
      camera,
      Vec3d(box.center()),
      {std::sin(azimuth) * std::cos(elevation), std::sin(elevation), std::cos(azimuth) * std::cos(elevation)},
      double(length(box.size())) / 2,
      double(box.min.y),
      length(beside.direction - ahead.direction),
      length(beside.origin - ahead.origin)};

  // What smoothing mixes into the pixels of a part is the same as in the whole.
  const PixelBox window = camera.window(), seen = window.grownBy(kSmoothReach).sharedWith(camera.picture());
  const auto width = std::size_t(seen.width()), height = std::size_t(seen.height());
  std::vector<Seen> pixels(width * height);
  parallelFor(
      height, 2,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t y = begin; y < end; ++y)
          for (std::size_t x = 0; x < width; ++x)
            pixels[y * width + x] = scene.look(std::size_t(seen.x0) + x, std::size_t(seen.y0) + y, samples);
      },
      progress);
  smooth(pixels, seen.width(), seen.height(), SubProgress(progress, 1, 1));
  Image image;
  image.setWindow(window, camera.width(), camera.height());
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  for (int y = window.y0; y != window.y1; ++y)
    for (int x = window.x0; x != window.x1; ++x) {
      const Seen& pixel = pixels[std::size_t(y - seen.y0) * width + std::size_t(x - seen.x0)];
      const Vec3f light =
          pixel.facing * kLamp * pixel.lamp + pixel.colour * pixel.sky + kBackdrop * pixel.backdrop;
      const std::size_t at =
          std::size_t(y - window.y0) * std::size_t(window.width()) + std::size_t(x - window.x0);
      for (int c = 0; c < 3; ++c) image.channels[std::size_t(c)].values[at] = light[c];
      image.channels[3].values[at] = 1;
    }
  return image;
}

}  // namespace nephele
