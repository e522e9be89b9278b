#pragma once

#include <bit>
#include <cstdint>

namespace nephele::detail {

/// 2^f = 1 + kPowerOfTwo[0] f + ... for |f| <= 1/2: best fit, off by 2e-8 of it at most.
inline constexpr float kPowerOfTwo[] = {0.693147182f,   0.240226477f,   0.0555033237f,
                                        0.00961843692f, 0.00133988739f, 0.00015353362f};
/// -1 / ln 2, and a number whose sum with a small one ends in the nearest whole number.
inline constexpr float kPerMinusLog2 = -1.44269504f, kRounding = 12582912.0f;

/// exp(-x) for x from 0 to 80, off by 1e-7 (1 + x) of it at most; 1 where x is 0. Half the work of what
/// libraries have for all numbers, in a form that compilers vectorise. The marcher has the same for vectors
/// of Highway.
inline float expOfMinus(float x) {
  const float y = x * kPerMinusLog2, whole = y + kRounding;
  const float f = y - (whole - kRounding), f2 = f * f;
  const float high = (f2 * kPowerOfTwo[5] + (f * kPowerOfTwo[4] + kPowerOfTwo[3])) * f2 +
                     (f * kPowerOfTwo[2] + kPowerOfTwo[1]);
  const float power = high * f2 + (f * kPowerOfTwo[0] + 1.0f);
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(power) +
                              (std::bit_cast<std::uint32_t>(whole) << 23));
}

}  // namespace nephele::detail
