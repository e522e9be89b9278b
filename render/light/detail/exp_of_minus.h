#pragma once

#include <bit>
#include <cstdint>

namespace nephele::detail {

/// exp(-x) for 0 <= x <= 80 in a form that compilers vectorise: 2^whole times a polynomial in the rest; 2e-6
/// relative.
inline float expOfMinus(float x) {
  const float y = x * -1.44269504f;
  const int whole = int(y - 0.5f);
  const float r = (y - float(whole)) * 0.69314718f;
  const float p =
      1 + r * (1 + r * (0.5f + r * (1.0f / 6 + r * (1.0f / 24 + r * (1.0f / 120 + r * (1.0f / 720))))));
  return p * std::bit_cast<float>(std::uint32_t(whole + 127) << 23);
}

}  // namespace nephele::detail
