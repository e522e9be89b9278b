#pragma once

#include <span>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// A coloured sky as the sum of skies without colour, each times a colour of its own: light of the one is
/// what a grey medium makes of the others, times their colours.
struct SkyParts {
  /// One to three, and for each its radiance from every direction, none below 0.
  std::vector<std::vector<float>> values;
  /// May be negative.
  std::vector<Vec3f> colours;
};

/// The fewest parts that give the mean of every colour, and its radiance to 2.5 % of that, root mean square
/// over the directions; three give it exactly. Skies are mostly two: what is blue above and what is pale
/// about the horizon.
///
/// By the largest eigenvectors of the colours' second moments, which leave the least (principal components).
SkyParts partsOfSky(std::span<const Vec3f> radiance);
/// Its red, green and blue as parts.
SkyParts coloursOfSky(std::span<const Vec3f> radiance);

}  // namespace nephele::detail
