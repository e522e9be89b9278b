// Lengths in kilometres. A ray sees on its way what air and haze scatter towards it of the sun's light, which
// has come through the air itself (a table over height and the sun's place), and of light that has been
// scattered before. For the latter all scatterings but the last are taken to be alike in all directions
// (Hillaire 2020, section 5): a place sends on a share f of what it gets, so that the second scattering L
// becomes L (1 + f + f^2 + ...) = L / (1 - f), a second table.
//
// Limits: three wavelengths stand for colours; light is not polarised; the ground is flat grey.
#include "nephele/render/scene/clear_sky.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr double kGround = 6360, kTop = 6460;
// Extinction of air and of ozone per kilometre where they are densest, and how high they reach.
constexpr double kAir[3] = {5.802e-3, 13.558e-3, 33.1e-3}, kOzone[3] = {0.650e-3, 1.881e-3, 0.085e-3};
constexpr double kAirHeight = 8, kHazeHeight = 1.2, kOzoneMiddle = 25, kOzoneHalf = 15;
// What haze scatters of what it takes, and how much more it takes at 680 and 440 nanometres than at 550
// (Angstrom's exponent of 1.3).
constexpr double kHazeAlbedo = 0.9, kHazeColour[3] = {0.759, 1, 1.337};
// Of Cornette's and Shanks' phase function for haze.
constexpr double kHazeCosine = 0.76;
// The sun's light outside of the atmosphere, to a camera that is set to daylight: for a sun at 38 degrees, of
// the standard turbidity and height, level ground gets grey light of sun and sky together, and of the sun
// alone the luminance that ClearSky::sunlight states.
constexpr double kSun[3] = {4.4178, 4.7231, 4.9358};
constexpr double kSunRadius = 0.00466;

using Colour = std::array<double, 3>;

double square(double x) {
  return x * x;
}
double cube(double x) {
  return x * x * x;
}

// What is at a height.
struct AirThere {
  Colour air, haze, taken;
};

struct Atmosphere {
  double hazeExtinction;

  AirThere at(double radius) const {
    const double height = std::max(radius - kGround, 0.0);
    const double air = std::exp(-height / kAirHeight),
                 haze = std::exp(-height / kHazeHeight) * hazeExtinction,
                 ozone = std::max(0.0, 1 - std::fabs(height - kOzoneMiddle) / kOzoneHalf);
    AirThere result;
    for (std::size_t c = 0; c != 3; ++c) {
      result.air[c] = kAir[c] * air;
      result.haze[c] = kHazeAlbedo * kHazeColour[c] * haze;
      result.taken[c] = result.air[c] + kHazeColour[c] * haze + kOzone[c] * ozone;
    }
    return result;
  }
};

// Along a ray from `radius` upwards by the cosine `rise`.
double radiusAfter(double radius, double rise, double way) {
  return std::sqrt(std::max(square(way) + 2 * radius * rise * way + square(radius), 0.0));
}
double wayToTop(double radius, double rise) {
  return -radius * rise + std::sqrt(std::max(square(radius * rise) - square(radius) + square(kTop), 0.0));
}
// Negative if it passes the ground by.
double wayToGround(double radius, double rise) {
  const double within = square(radius * rise) - square(radius) + square(kGround);
  return rise < 0 && within >= 0 ? std::max(-radius * rise - std::sqrt(within), 0.0) : -1.0;
}
double horizonRise(double radius) {
  return -std::sqrt(std::max(1 - square(kGround / radius), 0.0));
}

// A table of colours over [0, 1]^2, interpolated.
template <int kWidth, int kHeight>
struct Table {
  std::vector<Colour> values = std::vector<Colour>(std::size_t(kWidth * kHeight));

  template <class Value>
  void fill(const Value& value) {
    parallelFor(std::size_t(kHeight), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y != end; ++y)
        for (std::size_t x = 0; x != kWidth; ++x)
          values[y * kWidth + x] = value(double(x) / (kWidth - 1), double(y) / (kHeight - 1));
    });
  }
  Colour operator()(double u, double v) const {
    const double x = std::clamp(u, 0.0, 1.0) * (kWidth - 1), y = std::clamp(v, 0.0, 1.0) * (kHeight - 1);
    const auto x0 = std::min(std::size_t(x), std::size_t(kWidth - 2)),
               y0 = std::min(std::size_t(y), std::size_t(kHeight - 2));
    const double fx = x - double(x0), fy = y - double(y0);
    const Colour* at = values.data() + y0 * kWidth + x0;
    Colour result;
    for (std::size_t c = 0; c != 3; ++c)
      result[c] = (1 - fy) * ((1 - fx) * at[0][c] + fx * at[1][c]) +
                  fy * ((1 - fx) * at[kWidth][c] + fx * at[kWidth + 1][c]);
    return result;
  }
};

// What a beam from outside keeps down to a place, for beams that do not meet the ground. Places in the table
// are those of Bruneton and Neyret, fine about the horizon.
class Transmittance {
 public:
  explicit Transmittance(const Atmosphere& atmosphere) {
    table_.fill([&](double u, double v) {
      const double toHorizon = v * kMost, radius = std::sqrt(square(toHorizon) + square(kGround));
      const double least = kTop - radius, most = toHorizon + kMost, way = least + u * (most - least);
      const double rise =
          way > 0 ? std::clamp((square(kTop) - square(radius) - square(way)) / (2 * radius * way), -1.0, 1.0)
                  : 1.0;
      // From where the ray is lowest to both of its ends, in steps that grow.
      const double lowest = std::clamp(-radius * rise, 0.0, way);
      constexpr int kSteps = 12;
      // Gauss' rule of two points in each.
      constexpr double kPoints[2] = {0.5 - 0.28867513, 0.5 + 0.28867513};
      Colour depth{};
      for (const double part : {-lowest, way - lowest})
        for (int i = 0; i != kSteps; ++i) {
          const double from = cube(double(i) / kSteps), to = cube((i + 1.0) / kSteps);
          for (const double point : kPoints) {
            const AirThere air =
                atmosphere.at(radiusAfter(radius, rise, lowest + part * (from + point * (to - from))));
            for (std::size_t c = 0; c != 3; ++c) depth[c] += air.taken[c] * std::fabs(part) * (to - from) / 2;
          }
        }
      return Colour{std::exp(-depth[0]), std::exp(-depth[1]), std::exp(-depth[2])};
    });
  }

  // Of the sun, whose disc the ground may hide.
  Colour ofSun(double radius, double rise) const {
    const double horizon = horizonRise(radius), shown = (rise - horizon) / (2 * kSunRadius) + 0.5;
    if (shown <= 0) return {};
    const double above = std::max(rise, horizon);
    const double toHorizon = std::sqrt(std::max(square(radius) - square(kGround), 0.0));
    const double least = kTop - radius, most = toHorizon + kMost;
    Colour result = table_((wayToTop(radius, above) - least) / (most - least), toHorizon / kMost);
    for (double& value : result) value *= std::min(shown, 1.0);
    return result;
  }

 private:
  inline static const double kMost = std::sqrt(square(kTop) - square(kGround));
  Table<128, 64> table_;
};

// The way of a ray through the air, the same for all that are as steep; no farther than `most` and through
// the ground, if that is given.
struct Path {
  struct Step {
    double radius, way;
    AirThere air;
    // What arrives of light that is sent along the step, as a length.
    Colour counts;
  };
  static constexpr int kMostSteps = 24;

  Path(const Atmosphere& atmosphere, double radius, double rise, int count,
       double most = std::numeric_limits<double>::infinity())
      : stepCount(count) {
    const double toGround = std::isinf(most) ? wayToGround(radius, rise) : -1;
    isGround = toGround >= 0;
    way = std::min(isGround ? toGround : wayToTop(radius, rise), most);
    double before = 0;
    for (int i = 0; i != count; ++i) {
      // Shorter near the eye, where the air is densest.
      const double end = way * square((i + 1.0) / count), length = end - before;
      Step& step = steps[std::size_t(i)];
      step.way = before + 0.5 * length;
      step.radius = radiusAfter(radius, rise, step.way);
      step.air = atmosphere.at(step.radius);
      for (std::size_t c = 0; c != 3; ++c) {
        const double taken = step.air.taken[c], passed = std::exp(-taken * length);
        step.counts[c] = left[c] * (taken > 1e-12 ? (1 - passed) / taken : length);
        left[c] *= passed;
      }
      before = end;
    }
  }

  // Sums of one or two kinds of light, `sourcesAt(step)` per length.
  template <std::size_t kKinds, class Sources>
  std::array<Colour, kKinds> light(const Sources& sourcesAt) const {
    std::array<Colour, kKinds> sums{};
    for (int i = 0; i != stepCount; ++i) {
      const Step& step = steps[std::size_t(i)];
      const std::array<Colour, kKinds> sources = sourcesAt(step);
      for (std::size_t k = 0; k != kKinds; ++k)
        for (std::size_t c = 0; c != 3; ++c) sums[k][c] += step.counts[c] * sources[k][c];
    }
    return sums;
  }

  std::array<Step, kMostSteps> steps;
  int stepCount;
  // Of what comes from its end.
  Colour left{1, 1, 1};
  double way;
  bool isGround;
};

// The cosine between a direction and up after a way, both given at its begin: `along` is that between the
// direction and the ray.
double riseAfter(double radius, double rise, double along, double way, double radiusThere) {
  return std::clamp((radius * rise + way * along) / radiusThere, -1.0, 1.0);
}

}  // namespace

struct ClearSky::Data {
  Atmosphere atmosphere;
  Transmittance transmittance;
  Colour ground;
  double radius;
  Vec3d sun;
  // Light that was scattered before, over what the sun sends, by the sun's rise and the height.
  Table<32, 16> scattered;
  // Irradiance of the ground by the sky, over that of the sun outside.
  Colour skyOnGround{};

  explicit Data(const Options& options)
      : atmosphere{(double(options.turbidity) - 1) * kAir[1] * kAirHeight / kHazeHeight},
        transmittance(atmosphere),
        ground{double(options.groundAlbedo.x), double(options.groundAlbedo.y),
               double(options.groundAlbedo.z)},
        radius(kGround + std::max(double(options.height) * 1e-3, 1e-3)),
        sun(normalize(Vec3d(options.sun))) {
    scattered.fill([&](double u, double v) { return scatteredAt(heightAt(v), 2 * u - 1); });
    // By Gauss' rule of three points in the square of the sine, which integrates the cosine.
    constexpr double kNodes[3] = {0.112702, 0.5, 0.887298}, kWeights[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    constexpr int kTurns = 16;
    constexpr double from = kGround + 1e-3;
    for (int i = 0; i != 3; ++i) {
      const double rise = std::sqrt(kNodes[i]), flat = std::sqrt(1 - kNodes[i]);
      const Path path = pathFrom(from, rise);
      for (int turn = 0; turn != kTurns; ++turn) {
        const double angle = 2 * double(kPi) * (turn + 0.5) / kTurns;
        const Colour light = lightAlong(path, from, {flat * std::cos(angle), rise, flat * std::sin(angle)});
        for (std::size_t c = 0; c != 3; ++c) skyOnGround[c] += double(kPi) * kWeights[i] / kTurns * light[c];
      }
    }
  }

  static double heightAt(double v) { return kGround + 1e-3 + square(v) * (kTop - kGround - 2e-3); }

  Colour scatteredBefore(double there, double sunRise) const {
    return scattered(0.5 * (sunRise + 1), std::sqrt(std::max((there - kGround) / (kTop - kGround), 0.0)));
  }

  Colour scatteredAt(double there, double sunRise) const {
    // One side of the sun's plane is like the other.
    constexpr int kRises = 8, kTurns = 4, kSteps = 14;
    Colour second{}, share{};
    const double sunFlat = std::sqrt(std::max(1 - square(sunRise), 0.0));
    for (int i = 0; i != kRises; ++i) {
      const double rise = (i + 0.5) * 2 / kRises - 1, flat = std::sqrt(1 - square(rise));
      const Path path(atmosphere, there, rise, kSteps);
      for (int turn = 0; turn != kTurns; ++turn) {
        const double along = rise * sunRise + flat * sunFlat * std::cos(double(kPi) * (turn + 0.5) / kTurns);
        // What is scattered of the sun's light, and of light that is 1 everywhere.
        const auto light = path.light<2>([&](const Path::Step& step) {
          const Colour lit =
              transmittance.ofSun(step.radius, riseAfter(there, sunRise, along, step.way, step.radius));
          std::array<Colour, 2> sources;
          for (std::size_t c = 0; c != 3; ++c) {
            sources[1][c] = step.air.air[c] + step.air.haze[c];
            sources[0][c] = sources[1][c] * lit[c] / (4 * double(kPi));
          }
          return sources;
        });
        Colour sent = light[0];
        if (path.isGround) {
          const double onGround = riseAfter(there, sunRise, along, path.way, kGround);
          const Colour lit = transmittance.ofSun(kGround + 1e-3, onGround);
          for (std::size_t c = 0; c != 3; ++c)
            sent[c] += path.left[c] * ground[c] / double(kPi) * lit[c] * std::max(onGround, 0.0);
        }
        for (std::size_t c = 0; c != 3; ++c) {
          second[c] += sent[c] / (kRises * kTurns);
          share[c] += light[1][c] / (kRises * kTurns);
        }
      }
    }
    for (std::size_t c = 0; c != 3; ++c) second[c] /= 1 - std::min(share[c], 0.999);
    return second;
  }

  Path pathFrom(double from, double rise, double most = std::numeric_limits<double>::infinity()) const {
    return {atmosphere, from, rise, Path::kMostSteps, most};
  }

  // Of a path from a height in a direction that is as steep, over what the sun sends outside.
  Colour lightAlong(const Path& path, double from, const Vec3d& towards) const {
    const double along = dot(towards, sun), square1 = square(along);
    const double air = 3 / (16 * double(kPi)) * (1 + square1);
    constexpr double g = kHazeCosine;
    const double haze = 3 / (8 * double(kPi)) * (1 - g * g) * (1 + square1) /
                        ((2 + g * g) * std::pow(1 + g * g - 2 * g * along, 1.5));
    return path.light<1>([&](const Path::Step& step) {
      const double sunRise = riseAfter(from, sun.y, along, step.way, step.radius);
      const Colour lit = transmittance.ofSun(step.radius, sunRise),
                   before = scatteredBefore(step.radius, sunRise);
      Colour source;
      for (std::size_t c = 0; c != 3; ++c)
        source[c] = (step.air.air[c] * air + step.air.haze[c] * haze) * lit[c] +
                    (step.air.air[c] + step.air.haze[c]) * before[c];
      return std::array<Colour, 1>{source};
    })[0];
  }

  // Of the sky, or the ground behind its air.
  Vec3f radianceAlong(const Path& path, const Vec3d& towards) const {
    Colour light = lightAlong(path, radius, towards);
    if (path.isGround) {
      const double sunRise = riseAfter(radius, sun.y, dot(towards, sun), path.way, kGround);
      const Colour lit = transmittance.ofSun(kGround + 1e-3, sunRise);
      for (std::size_t c = 0; c != 3; ++c)
        light[c] +=
            path.left[c] * ground[c] / double(kPi) * (lit[c] * std::max(sunRise, 0.0) + skyOnGround[c]);
    }
    return {float(kSun[0] * light[0]), float(kSun[1] * light[1]), float(kSun[2] * light[2])};
  }
};

ClearSky::ClearSky(const Options& options) {
  require(isFinite(options.sun) && length(options.sun) > 0,
          "sky: the direction towards the sun must be finite and not zero");
  require(options.turbidity >= 1 && options.turbidity <= 10,
          fmt::format("sky: expected a turbidity within [1, 10], got {}", options.turbidity));
  require(options.height >= 0 && options.height <= 20000,
          fmt::format("sky: expected a height within [0, 20000] metres, got {}", options.height));
  for (int c = 0; c != 3; ++c)
    require(
        options.groundAlbedo[c] >= 0 && options.groundAlbedo[c] <= 1,
        fmt::format("sky: expected an albedo of the ground within [0, 1], got {}", options.groundAlbedo[c]));
  data_ = std::make_shared<const Data>(options);
}

Vec3f ClearSky::sunlight() const {
  const Colour left = data_->transmittance.ofSun(data_->radius, data_->sun.y);
  return {float(kSun[0] * left[0]), float(kSun[1] * left[1]), float(kSun[2] * left[2])};
}

Vec3f ClearSky::radiance(const Vec3f& towards) const {
  const Vec3d way = normalize(Vec3d(towards));
  return data_->radianceAlong(data_->pathFrom(data_->radius, way.y), way);
}

ClearSky::Air ClearSky::airBefore(const Vec3f& towards, float metres) const {
  require(metres >= 0, fmt::format("sky: expected a distance of at least 0 metres, got {}", metres));
  const Vec3d way = normalize(Vec3d(towards));
  const Path path = data_->pathFrom(data_->radius, way.y, double(metres) * 1e-3);
  const Colour light = data_->lightAlong(path, data_->radius, way);
  Air result;
  for (std::size_t c = 0; c != 3; ++c) {
    result.left[int(c)] = float(path.left[c]);
    result.light[int(c)] = float(kSun[c] * light[c]);
  }
  return result;
}

ClearSky ClearSky::turned(double degrees) const {
  ClearSky result = *this;
  auto data = std::make_shared<Data>(*data_);
  const double a = degrees * double(kPi) / 180, x = data->sun.x, z = data->sun.z;
  data->sun.x = x * std::cos(a) + z * std::sin(a);
  data->sun.z = z * std::cos(a) - x * std::sin(a);
  result.data_ = std::move(data);
  return result;
}

// The half to the left of the sun is that to its right.
Environment ClearSky::map(int rows, float intensity) const {
  require(rows >= 2 && rows <= 4096 && rows % 2 == 0,
          fmt::format("sky: expected an even number of rows within [2, 4096], got {}", rows));
  const int width = 2 * rows;
  const double sunAzimuth = std::atan2(data_->sun.x, data_->sun.z);
  std::vector<Vec3f> values(std::size_t(width) * std::size_t(rows));
  parallelFor(std::size_t(rows), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y != end; ++y) {
      const double theta = double(kPi) * (double(y) + 0.5) / rows, rise = std::cos(theta),
                   flat = std::sin(theta);
      const Path path = data_->pathFrom(data_->radius, rise);
      for (int x = 0; x != rows; ++x) {
        const double turn = sunAzimuth + 2 * double(kPi) * (x + 0.5) / width;
        const Vec3f colour = data_->radianceAlong(path, {flat * std::sin(turn), rise, flat * std::cos(turn)});
        values[y * std::size_t(width) + std::size_t(rows - 1 - x)] = colour;
        values[y * std::size_t(width) + std::size_t(rows + x)] = colour;
      }
    }
  });
  Environment::Options options;
  options.intensity = intensity;
  options.hasSpots = false;
  // The middle of the picture is the sun's azimuth.
  options.rotationDegrees = float(sunAzimuth * 180 / double(kPi));
  return Environment(width, rows, std::move(values), options);
}

}  // namespace nephele
