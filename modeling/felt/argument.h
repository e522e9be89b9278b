#pragma once

#include <cmath>
#include <string>

#include "nephele/modeling/base/math.h"
#include "nephele/modeling/felt/diagnostic.h"

/// Arguments of scripts as those of the library, checked on the way.
namespace nephele::felt {

/// `value` as an int. @throws CallError naming the parameter unless lowest <= value <= highest.
inline int inRange(const char* parameter, std::int64_t value, std::int64_t lowest, std::int64_t highest) {
  if (value < lowest || value > highest)
    throw CallError(Code::outOfRange, std::string(parameter) + " is " + std::to_string(value) +
                                          ", and may be from " + std::to_string(lowest) + " to " +
                                          std::to_string(highest));
  return static_cast<int>(value);
}

/// `seed` as the library has them. @throws CallError unless it fits.
inline std::uint32_t seedOf(std::int64_t seed) {
  if (seed < 0 || seed > 4294967295)
    throw CallError(Code::outOfRange,
                    "seed is " + std::to_string(seed) + ", and may be from 0 to 4294967295");
  return static_cast<std::uint32_t>(seed);
}

/// `value` as single precision. @throws CallError naming the parameter if it is not finite as such.
inline float finite(const char* parameter, double value) {
  const float result = static_cast<float>(value);
  if (!std::isfinite(result))
    throw CallError(Code::outOfRange, std::string(parameter) + " must be finite and below 3.4e38");
  return result;
}

/// The same of a place or a direction.
inline Vec3f finite(const char* parameter, const Vec3d& value) {
  return {finite(parameter, value.x), finite(parameter, value.y), finite(parameter, value.z)};
}

/// The same. @throws CallError naming the parameter unless it is positive and finite.
inline float positive(const char* parameter, double value) {
  const float result = static_cast<float>(value);
  if (!(result > 0 && std::isfinite(result)))
    throw CallError(Code::outOfRange, std::string(parameter) + " must be positive and finite");
  return result;
}

}  // namespace nephele::felt
