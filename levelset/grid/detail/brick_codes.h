#pragma once

#include <cstdint>

namespace nephele::detail {

/// The bricks whose samples a brick with its border holds, in the order of kBorderParts: of each the codes of
/// its own samples, x fastest, and how they become values: low + unit * code.
struct CodesAround {
  const std::uint16_t* codes[27];
  float low[27], unit[27];
};

/// Writes the kVolume samples of the brick in the middle with its border.
void decodeBrick(const CodesAround& around, float* samples);

}  // namespace nephele::detail
