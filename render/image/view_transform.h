#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/image/image.h"

namespace nephele {

/// How linear light becomes numbers of a screen, from 0 to 1. Black stays black. Middle grey, 0.18, of which
/// the sRGB curve alone makes 0.461, becomes 0.461, 0.460, 0.5 (agx) and 0.18 (raw).
enum class ViewCurve {
  /// Per channel  x <= s: x;  x > s: s + (1 - s)(1 - exp(-(x - s) / (1 - s))), s = ViewTransform::shoulder,
  /// which has no kink, then the sRGB curve. Bright saturated colours end in flat ones, white from 2.4 on.
  standard,
  /// S. Hill's fit of the ACES reference and output transforms, of 1.458 x, then the sRGB curve; of the hue
  /// that this gives and that of the light, the middle. White in 8 bits from 14 on.
  filmic,
  /// T. Sobotka's AgX, base contrast: in its inset primaries from 2^-12.47 to 2^4.03, J. Smith's sigmoid of
  /// the logarithm with slope 2 and powers 3 and 3.25. White in 8 bits from 15 on; bright colours become
  /// pale.
  agx,
  /// The light itself, up to 1.
  raw
};

/// A view that somebody else has defined, such as readConfigView reads.
struct ConfigView {
  std::string name;
  /// Turns linear Rec. 709 light, three values per pixel, into screen values. Several threads may call it.
  std::function<void(std::span<float> rgb)> apply;
};

/// How a picture is shown: the light 2^exposureStops * (rgb + (1 - A) background) through a curve.
struct ViewTransform {
  float exposureStops = 0.0f;
  /// Of ViewCurve::standard.
  float shoulder = 0.6f;
  /// Linear radiance behind pictures that have no layer `backdrop`.
  Vec3f background{};
  ViewCurve curve = ViewCurve::standard;
  /// Takes the place of `curve` where it is there.
  std::shared_ptr<const ConfigView> configView{};

  /// "standard", "filmic", "agx", "raw", or that of the configView.
  std::string name() const;
};

/// Screen values in [0, 1], three per pixel, of R, G, B and A of `image`. @throws Error if one of them is
/// missing, or as Image::check does.
std::vector<float> displayed(const Image& image, const ViewTransform& view);

/// The same in 8 bits, as files for the screen hold it, dithered by less than a step; the pattern stands
/// still from frame to frame, and goes through parts of a picture.
std::vector<std::uint8_t> screenBytes(const Image& image, const ViewTransform& view);

}  // namespace nephele
