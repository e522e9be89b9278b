// From light to the numbers of a screen.
//
// filmic is S. Hill's fit of the ACES transforms (in M. Pettineo's BakingLab, ACES.hlsl): a matrix towards
// the working primaries, a curve per channel, a matrix back. It is known to turn blue towards cyan and orange
// towards yellow. Keeping the hue of the light altogether, as digital cameras do (the tone curves of Adobe's
// DNG: the least and the largest channel go through the curve, the middle one keeps its place between them)
// turns fire pink. The middle of both keeps skies blue and fire orange.
//
// agx is T. Sobotka's AgX with the numbers of his configuration (github.com/sobotka/AgX): its default
// contrast, J. Smith's sigmoid, by its formula in place of the table there.
#include "nephele/render/image/view_transform.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

constexpr Mat3f kToAces{{0.59719f, 0.35458f, 0.04823f,  //
                         0.07600f, 0.90834f, 0.01566f,  //
                         0.02840f, 0.13383f, 0.83777f}};
constexpr Mat3f kFromAces{{1.60475f, -0.53108f, -0.07367f,  //
                           -0.10208f, 1.10813f, -0.00605f,  //
                           -0.00327f, -0.07276f, 1.07602f}};
constexpr Mat3f kToAgx{{0.842479062f, 0.078433600f, 0.079223745f,  //
                        0.042328242f, 0.878468636f, 0.079166127f,  //
                        0.042375655f, 0.078433600f, 0.879142974f}};
constexpr Mat3f kFromAgx{{1.196879006f, -0.098020881f, -0.099029744f,  //
                          -0.052896852f, 1.151903130f, -0.098961177f,  //
                          -0.052971636f, -0.098043450f, 1.151073673f}};

template <class Curve>
Vec3f perChannel(const Vec3f& v, const Curve& curve) {
  return {curve(v.x), curve(v.y), curve(v.z)};
}

float clamped(float x) {
  return x > 0 ? std::min(x, 1.0f) : 0.0f;
}

// IEC 61966-2-1
float srgbOf(float x) {
  return x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
}

float shouldered(float x, float shoulder) {
  const float room = 1.0f - shoulder;
  return x <= shoulder ? x : shoulder + room * (1.0f - std::exp(-(x - shoulder) / room));
}

// The extremes of `shown`, with the middle channel between them where it is in `light`.
Vec3f withHueOf(const Vec3f& light, const Vec3f& shown) {
  std::array order{0, 1, 2};
  std::ranges::sort(order, {}, [&](int c) { return light[c]; });
  const auto [least, middle, most] = order;
  const float range = light[most] - light[least];
  const float low = std::min({shown.x, shown.y, shown.z}), high = std::max({shown.x, shown.y, shown.z});
  Vec3f result;
  result[least] = low;
  result[most] = high;
  result[middle] = range > 0 ? low + (high - low) * (light[middle] - light[least]) / range : low;
  return result;
}

Vec3f filmic(const Vec3f& light) {
  // What takes 0.18 to 0.18.
  constexpr float kGain = 1.458f;
  const Vec3f curved = perChannel(kToAces * (kGain * light), [](float v) {
    return (v * (v + 0.0245786f) - 0.000090537f) / (v * (0.983729f * v + 0.4329510f) + 0.238081f);
  });
  const Vec3f fitted = perChannel(kFromAces * curved, clamped);
  return perChannel(0.5f * (fitted + withHueOf(light, fitted)), srgbOf);
}

// From (0, 0) to (1, 1), through a middle of slope 2.
class Sigmoid {
 public:
  float operator()(float x) const {
    const float from = kSlope * (x - kMiddle);
    return from >= 0 ? kShown + bent(from, shoulder_, kShoulderPower) : kShown - bent(-from, toe_, kToePower);
  }

 private:
  static constexpr float kMiddle = 10 / 16.5f, kShown = 0.5f, kSlope = 2, kToePower = 3,
                         kShoulderPower = 3.25f;

  static float bent(float t, float scale, float power) {
    return t / std::pow(1 + std::pow(t / scale, power), 1 / power);
  }
  // What makes `bent` end at `height`, `width` from the middle.
  static float scaleOf(float width, float height, float power) {
    const double run = double(kSlope * width), ratio = run / double(height), p = double(power);
    return float(run / std::pow(std::pow(ratio, p) - 1, 1 / p));
  }

  float toe_ = scaleOf(kMiddle, kShown, kToePower);
  float shoulder_ = scaleOf(1 - kMiddle, 1 - kShown, kShoulderPower);
};

Vec3f agx(const Vec3f& light) {
  static const Sigmoid sigmoid;
  constexpr float kLowest = -12.47393f, kHighest = 4.026069f;
  const Vec3f curved = perChannel(kToAgx * light, [](float v) {
    const float place = (std::log2(std::max(v, 1e-6f)) - kLowest) / (kHighest - kLowest);
    return place <= 0 ? 0.0f : place >= 1 ? 1.0f : sigmoid(place);
  });
  return perChannel(kFromAgx * curved, clamped);
}

Vec3f onScreen(const Vec3f& light, const ViewTransform& view) {
  switch (view.curve) {
    case ViewCurve::filmic:
      return filmic(light);
    case ViewCurve::agx:
      return agx(light);
    case ViewCurve::raw:
      return perChannel(light, clamped);
    case ViewCurve::standard:
      break;
  }
  return perChannel(light, [&](float x) { return srgbOf(shouldered(x, view.shoulder)); });
}

// What curves can take: no NaN, nothing below 0, nothing whose square is infinite.
float usable(float x) {
  return x > 0 ? std::min(x, 1e15f) : 0.0f;
}

// In [-0.5, 0.5), its error high in frequency: hides the steps of 8 bits in smooth skies without visible
// grain.
float dither(double x, double y) {
  const double d = 0.7548776662466927 * x + 0.5698402909980532 * y;
  return float(d - std::floor(d)) - 0.5f;
}

}  // namespace

std::string ViewTransform::name() const {
  if (configView) return configView->name;
  switch (curve) {
    case ViewCurve::filmic:
      return "filmic";
    case ViewCurve::agx:
      return "agx";
    case ViewCurve::raw:
      return "raw";
    case ViewCurve::standard:
      break;
  }
  return "standard";
}

std::vector<float> displayed(const Image& image, const ViewTransform& view) {
  image.check();
  require(view.shoulder >= 0 && view.shoulder < 1, "view transform: shoulder must be within [0, 1)");
  const std::vector<float>& alpha = image.channel("A").values;
  const std::vector<float>* colour[] = {&image.channel("R").values, &image.channel("G").values,
                                        &image.channel("B").values};
  const float gain = std::exp2(view.exposureStops);
  const Image::Channel* backdrop[] = {image.find("backdrop.R"), image.find("backdrop.G"),
                                      image.find("backdrop.B")};
  const bool hasBackdrop = backdrop[0] && backdrop[1] && backdrop[2];
  const auto lightAt = [&](std::size_t i) {
    Vec3f light;
    for (int c = 0; c != 3; ++c) {
      const float behind = hasBackdrop ? backdrop[c]->values[i] : view.background[c];
      light[c] = usable(gain * ((*colour[c])[i] + (1.0f - alpha[i]) * behind));
    }
    return light;
  };
  std::vector<float> screen(alpha.size() * 3);
  const auto width = std::size_t(image.width);
  // Row by row, so that a configView is given the same spans at any number of threads.
  parallelFor(std::size_t(image.height), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t y = begin; y != end; ++y) {
      const std::span<float> row = std::span(screen).subspan(y * width * 3, width * 3);
      for (std::size_t x = 0; x != width; ++x) {
        const Vec3f light = lightAt(y * width + x);
        const Vec3f shown = view.configView ? light : onScreen(light, view);
        for (int c = 0; c != 3; ++c) row[x * 3 + std::size_t(c)] = shown[c];
      }
      if (!view.configView) continue;
      view.configView->apply(row);
      std::ranges::transform(row, row.begin(), clamped);
    }
  });
  return screen;
}

std::vector<std::uint8_t> screenBytes(const Image& image, const ViewTransform& view) {
  const std::vector<float> screen = displayed(image, view);
  const auto width = std::size_t(image.width);
  const Image::Display display = image.display.value_or(Image::Display{});
  std::vector<std::uint8_t> bytes(screen.size());
  for (std::size_t i = 0; i != screen.size(); ++i) {
    const double x = double(display.x) + double(i / 3 % width), y = double(display.y) + double(i / 3 / width);
    const float value = std::floor(screen[i] * 255.0f + 0.5f + 0.999f * dither(x, y));
    bytes[i] = std::uint8_t(std::fmin(255.0f, std::fmax(0.0f, value)));
  }
  return bytes;
}

}  // namespace nephele
