#pragma once

#include <cstddef>
#include <memory>

namespace nephele::detail {

/// Room for samples that lasts from cell to cell.
struct SampleBuffer {
  std::unique_ptr<float[]> samples;
  std::size_t size = 0;

  float* of(std::size_t count) {
    if (count > size) {
      samples = std::make_unique_for_overwrite<float[]>(count);
      size = count;
    }
    return samples.get();
  }
};

}  // namespace nephele::detail
