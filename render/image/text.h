#pragma once

#include <string_view>

#include "nephele/modeling/base/math.h"
#include "nephele/render/image/image.h"

namespace nephele {

/// How wide a line of text is, in heights of its capital letters.
double textWidth(std::string_view text);

/// Where a line of text stands, in pixels from the upper left corner of an image.
struct TextPlace {
  /// Left end, and the line that letters stand on.
  double x = 0, baseline = 0;
  /// Of capital letters and digits.
  double height = 12;
};

/// Draws one line in front of the channels R, G, B and A (premultiplied) of `image`, in strokes with soft
/// edges. Letters, digits and signs of ASCII; a frame stands for what is none of them. What lies outside the
/// image is left out. @throws Error if a channel is missing or the height is not above 0.
void drawText(Image& image, std::string_view text, const TextPlace& place, const Vec3f& colour);

}  // namespace nephele
