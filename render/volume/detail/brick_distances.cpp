// Twice through the table, forwards and backwards: each time an entry looks at those of its neighbours that
// were done before it (Borgefors' distance transform, 1986; exact for the largest of the axes).
#include "nephele/render/volume/detail/brick_distances.h"

#include <algorithm>

namespace nephele::detail {

void spreadDistances(std::vector<std::uint8_t>& distances, const Vec3i& n) {
  const auto row = std::ptrdiff_t(n.x), plane = row * n.y;
  // With an entry before and behind. In locals: bytes might be any number of the loops.
  std::vector<std::uint8_t> entries(std::size_t(n.x) + 2);
  std::uint8_t* const near = entries.data() + 1;
  const int width = n.x;
  constexpr std::uint8_t kMost = 255;
  for (const int way : {1, -1})
    for (int k = 0; k != n.z; ++k)
      for (int j = 0; j != n.y; ++j) {
        const int z = way > 0 ? k : n.z - 1 - k, y = way > 0 ? j : n.y - 1 - j;
        std::uint8_t* const own = distances.data() + z * plane + y * row;
        std::fill_n(near - 1, width + 2, kMost);
        const auto look = [near, width](const std::uint8_t* other) {
          for (int x = 0; x != width; ++x) near[x] = std::min(near[x], other[x]);
        };
        if (j > 0) look(own - way * row);
        for (int side = -1; k > 0 && side <= 1; ++side)
          if (y + side >= 0 && y + side < n.y) look(own - way * plane + side * row);
        for (int x = 0; x != width; ++x) {
          const std::uint8_t least = std::min(std::min(near[x - 1], near[x]), near[x + 1]);
          own[x] = std::min(own[x], std::uint8_t(least == kMost ? least : least + 1));
        }
        for (int i = 1, x = way > 0 ? 1 : width - 2; i < width; ++i, x += way)
          own[x] = std::min(own[x], std::uint8_t(std::min<int>(own[x - way] + 1, kMost)));
      }
}

}  // namespace nephele::detail
