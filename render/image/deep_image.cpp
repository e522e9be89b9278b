#include "nephele/render/image/deep_image.h"

namespace nephele {

std::size_t DeepImage::sampleCount() const {
  std::size_t count = 0;
  for (const auto& pixel : pixels) count += pixel.size();
  return count;
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
