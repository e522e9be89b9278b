// Twice through the table, forwards and backwards: each time an entry looks at those of its neighbours that
// were done before it (Borgefors' distance transform, 1986; exact for the largest of the axes).
#include "nephele/render/volume/detail/brick_distances.h"

#include <algorithm>

namespace nephele::detail {

void spreadDistances(std::vector<std::uint8_t>& distances, const Vec3i& n) {
  const auto row = std::ptrdiff_t(n.x), plane = row * n.y;
  // With an entry before and behind.
  std::vector<std::uint8_t> near(std::size_t(n.x) + 2);
  constexpr std::uint8_t kMost = 255;
  for (const int way : {1, -1})
    for (int k = 0; k != n.z; ++k)
      for (int j = 0; j != n.y; ++j) {
        const int z = way > 0 ? k : n.z - 1 - k, y = way > 0 ? j : n.y - 1 - j;
        std::uint8_t* own = distances.data() + z * plane + y * row;
        std::fill(near.begin(), near.end(), kMost);
        const auto look = [&](const std::uint8_t* other) {
          for (int x = 0; x != n.x; ++x)
            near[std::size_t(x) + 1] = std::min(near[std::size_t(x) + 1], other[x]);
        };
        if (j > 0) look(own - way * row);
        for (int side = -1; k > 0 && side <= 1; ++side)
          if (y + side >= 0 && y + side < n.y) look(own - way * plane + side * row);
        for (int i = 0, x = way > 0 ? 0 : n.x - 1; i != n.x; ++i, x += way) {
          const std::uint8_t* there = near.data() + x;
          std::uint8_t least = std::min({there[0], there[1], there[2]});
          if (i > 0) least = std::min(least, own[x - way]);
          own[x] = std::min(own[x], std::uint8_t(std::min(int(least) + 1, int(kMost))));
        }
      }
}

}  // namespace nephele::detail
