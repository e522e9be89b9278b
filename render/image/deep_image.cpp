#include "nephele/render/image/deep_image.h"

#include <Imath/half.h>
#include <fmt/format.h>

#include <algorithm>

#include "nephele/modeling/base/error.h"

namespace nephele {

std::size_t DeepImage::sampleCount() const {
  std::size_t count = 0;
  for (const auto& pixel : pixels) count += pixel.size();
  return count;
}

void DeepImage::check() const {
  require(width > 0 && height > 0 && pixels.size() == std::size_t(width) * std::size_t(height),
          fmt::format("deep image: has {} lists of samples, but its size is {}x{}", pixels.size(), width,
                      height));
}

float roundedToHalf(float value) {
  return float(half(std::clamp(value, -65504.0f, 65504.0f)));
}

FlatPixel flattened(const std::vector<DeepSample>& samples) {
  FlatPixel front;
  for (const DeepSample& sample : samples) {
    const float left = 1 - front.alpha;
    front.colour += sample.colour * left;
    front.alpha += sample.alpha * left;
  }
  return front;
}

}  // namespace nephele
