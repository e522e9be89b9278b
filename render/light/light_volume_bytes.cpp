#include <algorithm>
#include <cstdint>
#include <vector>

#include "nephele/render/light/light_volume.h"

namespace nephele {

namespace {

// Bricks that 4 x 4 around each of `occupied` cover, across the axis that has most of them.
double reachedBricks(const std::vector<Vec3i>& occupied) {
  // Beyond, looking would take longer than it is worth.
  constexpr double kMostPlaces = 1 << 26;
  Vec3i low = occupied.front(), high = low;
  for (const Vec3i& brick : occupied) low = min(low, brick), high = max(high, brick);
  const Vec3i n = high - low + Vec3i{4, 4, 4};
  if (double(n.x) * n.y * n.z > kMostPlaces) return 16.0 * double(occupied.size());
  const std::size_t along[3] = {std::size_t(n.x), std::size_t(n.y), std::size_t(n.z)};
  const std::size_t stride[3] = {1, along[0], along[0] * along[1]};
  std::vector<std::uint8_t> own(along[0] * along[1] * along[2]), reached;
  // Three places are left behind the last along every axis.
  for (const Vec3i& brick : occupied) {
    const Vec3i at = brick - low;
    own[std::size_t(at.x) * stride[0] + std::size_t(at.y) * stride[1] + std::size_t(at.z) * stride[2]] = 1;
  }
  std::size_t most = 0;
  for (int w = 0; w != 3; ++w) {
    reached = own;
    for (const std::size_t step : {stride[(w + 1) % 3], stride[(w + 2) % 3]})
      // By one and by two places more: four in all.
      for (const std::size_t by : {step, 2 * step})
        for (std::size_t i = reached.size(); i-- > by;) reached[i] |= reached[i - by];
    most = std::max(most, std::size_t(std::count(reached.begin(), reached.end(), std::uint8_t(1))));
  }
  return double(most);
}

}  // namespace

double LightVolume::estimateBytes(const RenderVolume& volume, const Options& options) {
  if (volume.isEmpty()) return 0;
  // Sheared by 45 degrees both ways, a brick and a node around it reach into at most 4 x 4 across; those of
  // bricks side by side are the same ones.
  const Vec3f size = volume.indexBounds().size() * (1.0f / kBrick);
  double box = 0;
  for (int w = 0; w != 3; ++w)
    box = std::max(box, (2.0 * size[(w + 1) % 3] + 3) * (2.0 * size[(w + 2) % 3] + 3) * (size[w] + 1.0));
  // Two more are what is empty and what is dark.
  const double bricks = std::min(reachedBricks(volume.occupiedBricks()), box) + 2;
  return CodedBricks::estimateBytes(bricks, box) + box * sizeof(std::int32_t) +
         (options.coded ? 0 : bricks * kVolume * sizeof(float));
}

}  // namespace nephele
