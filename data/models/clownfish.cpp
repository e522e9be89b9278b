#include <algorithm>
#include <array>
#include <cmath>

#include "data/models/animals.h"
#include "data/models/implicit_mesh.h"
#include "data/models/sphere_grid.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

constexpr double kFullTurn = 6.283185307179586;

// Half height and half width of the fish across its length, from the end of the tail to the mouth.
struct Section {
  double x, height, width;
};
constexpr std::array<Section, 17> kSections = {{{-1.16, 0.00, 0.000},
                                                {-1.13, 0.20, 0.022},
                                                {-1.04, 0.30, 0.030},
                                                {-0.92, 0.27, 0.036},
                                                {-0.81, 0.19, 0.045},
                                                {-0.70, 0.14, 0.065},
                                                {-0.58, 0.19, 0.100},
                                                {-0.42, 0.29, 0.150},
                                                {-0.20, 0.39, 0.215},
                                                {0.05, 0.44, 0.260},
                                                {0.30, 0.43, 0.275},
                                                {0.55, 0.36, 0.255},
                                                {0.76, 0.27, 0.205},
                                                {0.88, 0.19, 0.150},
                                                {0.96, 0.11, 0.090},
                                                {0.99, 0.05, 0.045},
                                                {1.00, 0.00, 0.000}}};

// Catmull and Rom's curve through the sections; v from 0 to 1.
Section sectionAt(double v) {
  constexpr int kLast = int(kSections.size()) - 1;
  const double along = std::clamp(v, 0.0, 1.0) * kLast;
  const int i = std::min(int(along), kLast - 1);
  const double t = along - i;
  const auto smooth = [&](double Section::*part) {
    const double a = kSections[std::size_t(std::max(i - 1, 0))].*part;
    const double b = kSections[std::size_t(i)].*part;
    const double c = kSections[std::size_t(i + 1)].*part;
    const double d = kSections[std::size_t(std::min(i + 2, kLast))].*part;
    return b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
  };
  return {smooth(&Section::x), std::max(smooth(&Section::height), 0.0),
          std::max(smooth(&Section::width), 0.0)};
}

double square(double x) {
  return x * x;
}

// 0 below `from`, 1 above `to`.
double ramp(double x, double from, double to) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// 1 in the middle of [from, to], 0 at its ends and outside.
double hump(double x, double from, double to) {
  return x > from && x < to ? std::pow(4 * (x - from) * (to - x) / square(to - from), 0.6) : 0;
}

struct FishPoint {
  Vec3d position;
  // How far out on a fin, 0 to 1.
  double fin;
};

// u goes round from the back over the left side to the belly; columns crowd where fins are.
FishPoint fishPoint(double u, double v) {
  const Section section = sectionAt(v);
  const double turn = kFullTurn * u - 0.35 * std::sin(2 * kFullTurn * u);
  Vec3d p{section.x, section.height * std::cos(turn), section.width * std::sin(turn)};
  const double toBack = std::min(turn, kFullTurn - turn);
  const double toBelly = std::abs(turn - kFullTurn / 2);

  const double back =
      std::max(hump(p.x, -0.02, 0.52), 1.15 * hump(p.x, -0.56, 0.12)) * std::exp(-square(toBack / 0.15));
  const double belly = hump(p.x, -0.58, -0.08) * std::exp(-square(toBelly / 0.15));
  p.y += 0.15 * back - 0.14 * belly;
  p.x -= 0.12 * back + 0.14 * belly;

  const double side = p.z < 0 ? -1 : 1;
  const double reach =
      1 - square((section.x - 0.27) / 0.055) - square((std::abs(turn - kFullTurn / 2) - 1.25) / 0.42);
  const double breast = std::max(reach, 0.0);
  p += Vec3d{-0.24, -0.05, 0.22 * side} * breast;

  const double eye = 1 - (square(p.x - 0.74) + square(p.y - 0.075)) / square(0.075);
  p.z += 0.035 * side * std::max(eye, 0.0);
  return {p, std::max({std::min(back, 1.0), belly, breast, ramp(-section.x, 0.78, 1.16)})};
}

Vec3d mixed(const Vec3d& a, const Vec3d& b, double share) {
  return a + (b - a) * share;
}

// Linear light: orange with three white bands, their rims and those of the fins black.
Vec3d fishColor(double u, double v) {
  const FishPoint point = fishPoint(u, v);
  const double x = sectionAt(v).x;
  const double y = point.position.y;
  const Vec3d black{0.012, 0.011, 0.012};
  const Vec3d white{0.88, 0.89, 0.90};
  Vec3d color = mixed({0.95, 0.30, 0.03}, {0.80, 0.13, 0.008}, ramp(y, -0.35, 0.45));
  color = mixed(color, black, ramp(point.fin, 0.72, 0.80));
  const double bands[3] = {std::abs(x - 0.47 + 0.25 * square(y)) - 0.075,
                           std::abs(x + 0.10 - 0.13 * std::exp(-square((y + 0.02) / 0.2))) - 0.085,
                           std::abs(x + 0.66) - 0.05};
  for (const double band : bands) {
    color = mixed(black, color, ramp(band, 0.016, 0.026));
    color = mixed(white, color, ramp(band, -0.005, 0.005));
  }
  const double eye = std::sqrt(square(point.position.x - 0.74) + square(y - 0.075));
  color = mixed(black, color, ramp(eye, 0.062, 0.070));
  color = mixed({0.75, 0.22, 0.02}, color, ramp(eye, 0.050, 0.056));
  color = mixed(black, color, ramp(eye, 0.034, 0.040));
  const double glint = std::sqrt(square(point.position.x - 0.752) + square(y - 0.09));
  color = mixed({1, 1, 1}, color, ramp(glint, 0.009, 0.013));
  // The mouth: a smile that ends below the eye.
  const double mouth = std::abs(y + 0.055 - 0.9 * square(std::max(0.97 - point.position.x, 0.0)));
  return mixed(black, color, std::max(ramp(mouth, 0.006, 0.011), ramp(-point.position.x, -0.86, -0.84)));
}

}  // namespace

Mesh clownfishMesh() {
  return sphereGrid(96, 128, [](double u, double v) { return rounded(fishPoint(u, v).position, 1e6); });
}

Image clownfishTexture(int width, int height) {
  constexpr int kSamples = 3;
  Image image;
  image.width = width;
  image.height = height;
  for (const char* name : {"R", "G", "B", "A"}) image.add(name);
  parallelFor(std::size_t(height), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      for (int column = 0; column < width; ++column) {
        Vec3d sum;
        for (int s = 0; s < kSamples * kSamples; ++s) {
          sum += fishColor((column + (s % kSamples + 0.5) / kSamples) / width,
                           1 - (double(row) + (s / kSamples + 0.5) / kSamples) / height);
        }
        const std::size_t pixel = row * std::size_t(width) + std::size_t(column);
        for (int c = 0; c < 3; ++c)
          image.channels[std::size_t(c)].values[pixel] = float(sum[c] / (kSamples * kSamples));
        image.channels[3].values[pixel] = 1;
      }
    }
  });
  return image;
}

}  // namespace nephele
