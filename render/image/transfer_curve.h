#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace nephele {

/// From the numbers of a picture file, 0 to 1, to linear light:
/// Y = (scale X + offset)^exponent from `start` on, slope X below; or straight between the values of a table.
class TransferCurve {
 public:
  /// Y = X.
  static TransferCurve linear() { return power(1); }
  /// Of sRGB (IEC 61966-2-1).
  static TransferCurve srgb();
  static TransferCurve power(float exponent);
  /// Those of red, green and blue, or of grey three times, that an ICC profile describes; nothing if it
  /// describes colours by other means or is damaged. Its primaries are not looked at.
  /// Source: ICC.1, curveType and parametricCurveType.
  static std::optional<std::array<TransferCurve, 3>> ofProfile(std::span<const std::uint8_t> profile);

  /// Numbers beyond 1 follow the same formula; tables end with their last value. Those below 0 are on the
  /// straight part, or mirrored where there is none.
  float operator()(float x) const;

 private:
  static std::optional<TransferCurve> parse(std::span<const std::uint8_t> bytes);

  double exponent_ = 1, scale_ = 1, offset_ = 0, slope_ = 0, start_ = 0, added_ = 0, addedBelow_ = 0;
  std::vector<float> table_;
};

}  // namespace nephele
