// Skies from pictures.
//
// A pixel covers the solid angle (2 pi / width) (cos above - cos below). Directions are drawn by inversion of
// the cumulative luminance, first of rows, then within the row, and evenly within the pixel: since radiance
// is constant there, the density is luminance over its integral, exactly.
//
// Source: inversion of tabulated distributions, any textbook of rendering (Pharr, Jakob, Humphreys).
// Limits: paths that leave see pixels as such.
#include "nephele/render/scene/environment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/image/image.h"

namespace nephele {

namespace {

constexpr float kSpotDegrees = 5, kRingDegrees = 8;
constexpr std::size_t kRowsTogether = 8;

double luminance(const Vec3f& c) {
  return 0.2126 * double(c.x) + 0.7152 * double(c.y) + 0.0722 * double(c.z);
}

std::size_t drawn(const double* cumulative, std::size_t count, double value) {
  const double* at = std::upper_bound(cumulative, cumulative + count, value);
  return std::min(std::size_t(at - cumulative), count - 1);
}

// The cubic B-spline: 0 from 2 on, of integral 1.
double bSpline(double x) {
  x = std::fabs(x);
  if (x >= 2) return 0;
  return x < 1 ? 2.0 / 3 - x * x + 0.5 * x * x * x : (2 - x) * (2 - x) * (2 - x) / 6;
}

}  // namespace

struct Environment::Data {
  int width, height;
  std::vector<Vec3f> radiance;
  /// Integral of radiance over all directions, and of luminance.
  Vec3d whole{};
  double bright = 0;
  /// Cumulative luminance of rows, and of the pixels of every row, each times its solid angle.
  std::vector<double> rows, pixels;

  Data(int itsWidth, int itsHeight, std::vector<Vec3f> values)
      : width(itsWidth), height(itsHeight), radiance(std::move(values)) {
    rows.resize(std::size_t(height));
    pixels.resize(radiance.size());
    std::vector<Vec3d> sums(rows.size());
    parallelFor(rows.size(), kRowsTogether, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y != end; ++y) {
        double row = 0;
        const double share = solidAngle(int(y));
        for (std::size_t at = y * std::size_t(width); at != (y + 1) * std::size_t(width); ++at) {
          sums[y] += Vec3d(radiance[at]) * share;
          row += luminance(radiance[at]) * share;
          pixels[at] = row;
        }
        rows[y] = row;
      }
    });
    for (std::size_t y = 0; y != rows.size(); ++y) {
      whole += sums[y];
      bright += rows[y];
      rows[y] = bright;
    }
  }

  double cosineAbove(int y) const { return std::cos(double(kPi) * y / height); }
  double middleCosine(int y) const { return (cosineAbove(y) + cosineAbove(y + 1)) / 2; }
  double solidAngle(int y) const { return 2 * double(kPi) / width * (cosineAbove(y) - cosineAbove(y + 1)); }
};

Environment::Environment(int width, int height, std::vector<Vec3f> radiance, const Options& options) {
  require(height >= 1 && width == 2 * height,
          fmt::format("sky: expected a map twice as wide as high, got {} x {}", width, height));
  require(radiance.size() == std::size_t(width) * std::size_t(height),
          fmt::format("sky: expected {} x {} colours, got {}", width, height, radiance.size()));
  require(std::isfinite(options.rotationDegrees),
          fmt::format("sky: expected a rotation that is finite, got {}", options.rotationDegrees));
  require(options.intensity >= 0 && options.intensity <= 1e6f,
          fmt::format("sky: expected an intensity within [0, 1e6], got {}", options.intensity));
  for (Vec3f& value : radiance)
    for (int c = 0; c != 3; ++c) {
      require(std::isfinite(value[c]), "sky: the map holds numbers that are not finite");
      value[c] = std::max(value[c], 0.0f) * options.intensity;
      require(std::isfinite(value[c]),
              fmt::format("sky: the map is too bright to be multiplied by {:g}", options.intensity));
    }
  data_ = std::make_shared<const Data>(width, height, std::move(radiance));
  hasSpots_ = options.hasSpots;
  rotation_ = std::remainder(double(options.rotationDegrees), 360.0);
}

Environment Environment::read(const std::string& path, const Options& options, double mostBytes) {
  const Image image = readLinearImage(path, options.encoding, mostBytes);
  const std::vector<float>&r = image.channel("R").values, &g = image.channel("G").values,
        &b = image.channel("B").values;
  std::vector<Vec3f> radiance(r.size());
  for (std::size_t i = 0; i != radiance.size(); ++i) radiance[i] = {r[i], g[i], b[i]};
  try {
    return Environment(image.width, image.height, std::move(radiance), options);
  } catch (const Error& error) {
    throw Error(path + ": " + error.what());
  }
}

Environment Environment::turned(double degrees) const {
  Environment result = *this;
  result.rotation_ = std::remainder(rotation_ + degrees, 360.0);
  return result;
}

// `column` may be a fraction.
Vec3f Environment::towards(double column, double cosine) const {
  const double azimuth = (0.5 - column / data_->width) * 2 * double(kPi) + rotation_ * double(kPi) / 180;
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  return Vec3f(Vec3d{std::sin(azimuth) * sine, cosine, std::cos(azimuth) * sine});
}

std::size_t Environment::pixelAt(const Vec3f& towards) const {
  const Vec3d d = normalize(Vec3d(towards));
  const double turns = (std::atan2(d.x, d.z) - rotation_ * double(kPi) / 180) / (2 * double(kPi));
  const double u = 0.5 - turns;
  const int x = std::clamp(int((u - std::floor(u)) * data_->width), 0, data_->width - 1);
  const double v = std::acos(std::clamp(d.y, -1.0, 1.0)) / double(kPi);
  const int y = std::clamp(int(v * data_->height), 0, data_->height - 1);
  return std::size_t(y) * std::size_t(data_->width) + std::size_t(x);
}

Vec3f Environment::radiance(const Vec3f& towards) const {
  return data_->radiance[pixelAt(towards)];
}

Vec3f Environment::smoothRadiance(const Vec3f& towards) const {
  const Vec3d d = normalize(Vec3d(towards));
  const int width = data_->width, height = data_->height;
  const double turns = (std::atan2(d.x, d.z) - rotation_ * double(kPi) / 180) / (2 * double(kPi));
  const double column = (0.5 - turns) * width - 0.5,
               row = std::acos(std::clamp(d.y, -1.0, 1.0)) / double(kPi) * height - 0.5;
  Vec3d sum;
  double weights = 0;
  for (int y = int(std::ceil(row - 2)); y <= int(std::floor(row + 2)); ++y) {
    // Beyond a pole rows go on at the other side.
    const bool isBeyond = y < 0 || y >= height;
    const int there = std::clamp(y < 0 ? -1 - y : y >= height ? 2 * height - 1 - y : y, 0, height - 1);
    const double middle = column + (isBeyond ? width / 2.0 : 0.0);
    const double wide = std::min(1 / std::sin((there + 0.5) * double(kPi) / height), width / 4.0);
    Vec3d rowSum;
    double rowWeights = 0;
    for (int x = int(std::ceil(middle - 2 * wide)); x <= int(std::floor(middle + 2 * wide)); ++x) {
      const double weight = bSpline((x - middle) / wide);
      const int column0 = (x % width + width) % width;
      rowSum +=
          Vec3d(data_->radiance[std::size_t(there) * std::size_t(width) + std::size_t(column0)]) * weight;
      rowWeights += weight;
    }
    const double weight = bSpline(y - row);
    if (!(rowWeights > 0)) continue;
    sum += rowSum * (weight / rowWeights);
    weights += weight;
  }
  return weights > 0 ? Vec3f(sum * (1 / weights)) : radiance(towards);
}

Vec3f Environment::mean() const {
  return Vec3f(data_->whole * (0.25 / double(kPi)));
}

std::vector<Vec3f> Environment::around(const std::vector<Vec3f>& directions) const {
  if (directions.empty()) return {};
  // Row by row, added in their order.
  struct Part {
    Vec3d sum;
    double angle = 0;
  };
  const std::size_t count = directions.size(), width = std::size_t(data_->width),
                    height = std::size_t(data_->height);
  std::vector<Part> parts(height * count);
  parallelFor(height, kRowsTogether, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y != end; ++y) {
      const double share = data_->solidAngle(int(y)), cosine = data_->middleCosine(int(y));
      for (std::size_t x = 0; x != width; ++x) {
        const Vec3f d = towards(double(x) + 0.5, cosine);
        std::size_t nearest = 0;
        float most = -2;
        for (std::size_t i = 0; i != count; ++i)
          if (const float c = dot(directions[i], d); c > most) most = c, nearest = i;
        Part& part = parts[y * count + nearest];
        part.sum += Vec3d(data_->radiance[y * width + x]) * share;
        part.angle += share;
      }
    }
  });
  std::vector<Vec3d> sums(count);
  std::vector<double> angles(count);
  for (std::size_t i = 0; i != parts.size(); ++i) {
    sums[i % count] += parts[i].sum;
    angles[i % count] += parts[i].angle;
  }
  std::vector<Vec3f> result(directions.size());
  Vec3d meanOfMeans;
  for (std::size_t i = 0; i != result.size(); ++i) {
    // A map too small to reach every direction: its pixel there.
    const Vec3d value = angles[i] > 0 ? sums[i] / angles[i] : Vec3d(radiance(directions[i]));
    meanOfMeans += value / double(result.size());
    result[i] = Vec3f(value);
  }
  const Vec3d wanted(data_->whole * (0.25 / double(kPi)));
  for (Vec3f& value : result)
    for (int c = 0; c != 3; ++c)
      if (meanOfMeans[c] > 0) value[c] = float(double(value[c]) * (wanted[c] / meanOfMeans[c]));
  return result;
}

Environment::Sample Environment::sample(float u1, float u2, float u3, float u4) const {
  const auto width = std::size_t(data_->width);
  const std::size_t y = drawn(data_->rows.data(), data_->rows.size(), double(u1) * data_->bright);
  const double* row = data_->pixels.data() + y * width;
  const std::size_t x = drawn(row, width, double(u2) * row[width - 1]);
  const double above = data_->cosineAbove(int(y)), below = data_->cosineAbove(int(y) + 1);
  const double bright = data_->bright;
  return {towards(double(x) + double(u3), above + double(u4) * (below - above)),
          bright > 0 ? float(luminance(data_->radiance[y * width + x]) / bright) : 0.0f};
}

float Environment::density(const Vec3f& towards) const {
  return data_->bright > 0 ? float(luminance(radiance(towards)) / data_->bright) : 0.0f;
}

std::vector<DistantLight> Environment::takeSpots(int most) {
  std::vector<DistantLight> spots;
  if (!hasSpots_) return spots;
  const auto width = std::size_t(data_->width);
  std::vector<Vec3f> radiance = data_->radiance;
  const double mean = data_->bright * (0.25 / double(kPi));
  while (int(spots.size()) < most) {
    const auto peak = std::max_element(radiance.begin(), radiance.end(), [](const Vec3f& a, const Vec3f& b) {
      return luminance(a) < luminance(b);
    });
    if (!(luminance(*peak) > 10 * mean)) break;
    const auto directionOf = [&](std::size_t pixel) {
      return towards(double(pixel % width) + 0.5, data_->middleCosine(int(pixel / width)));
    };
    const Vec3f middle = directionOf(std::size_t(peak - radiance.begin()));
    const float inner = std::cos(radians(kSpotDegrees)), outer = std::cos(radians(kRingDegrees));
    std::vector<std::size_t> inside;
    std::vector<Vec3f> before;
    Vec3d ring;
    double ringAngle = 0;
    // No row is nearer to the middle than their heights are, and a little for rounding.
    const double height = std::acos(std::clamp(double(middle.y), -1.0, 1.0));
    const double reach = double(radians(kRingDegrees)) + 1e-3;
    for (std::size_t i = 0; i != radiance.size(); ++i) {
      if (i % width == 0 && std::fabs(std::acos(data_->middleCosine(int(i / width))) - height) > reach) {
        i += width - 1;
        continue;
      }
      const float c = dot(directionOf(i), middle);
      if (c >= inner) {
        inside.push_back(i);
        before.push_back(radiance[i]);
      } else if (c >= outer) {
        const double share = data_->solidAngle(int(i / width));
        ring += Vec3d(radiance[i]) * share;
        ringAngle += share;
      }
    }
    const Vec3f level = ringAngle > 0 ? Vec3f(ring / ringAngle) : Vec3f{};
    Vec3d excess, direction;
    for (const std::size_t i : inside) {
      const Vec3f left = min(radiance[i], level);
      const Vec3d gain = Vec3d(radiance[i] - left) * data_->solidAngle(int(i / width));
      excess += gain;
      direction += Vec3d(directionOf(i)) * luminance(Vec3f(gain));
      radiance[i] = left;
    }
    if (luminance(Vec3f(excess)) < 0.01 * data_->bright) {
      // Too little to be a light of its own: as it was, and so are all that are less bright.
      for (std::size_t i = 0; i != inside.size(); ++i) radiance[inside[i]] = before[i];
      break;
    }
    DistantLight spot;
    spot.direction = Vec3f(normalize(direction));
    spot.irradiance = Vec3f(excess);
    spots.push_back(spot);
  }
  if (!spots.empty()) data_ = std::make_shared<const Data>(data_->width, data_->height, std::move(radiance));
  return spots;
}

}  // namespace nephele
