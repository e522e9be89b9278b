#include "nephele/levelset/cut/detail/tetrahedra/lattice_cells.h"

#include <algorithm>
#include <bit>

namespace nephele::detail {
namespace {

/// Whether neighbours hang together; none do not.
bool isConnected(unsigned neighbours) {
  if (neighbours == 0) return false;
  unsigned reached = neighbours & (~neighbours + 1), open = reached;
  while (open != 0) {
    const auto at = std::size_t(std::countr_zero(open));
    open &= open - 1;
    const unsigned found = neighboursOfNeighbours()[at] & neighbours & ~reached;
    reached |= found;
    open |= found;
  }
  return reached == neighbours;
}

}  // namespace

const std::array<std::uint16_t, 14>& neighboursOfNeighbours() {
  static const auto table = [] {
    std::array<std::uint16_t, 14> result{};
    for (std::size_t a = 0; a < 14; ++a)
      for (std::size_t b = 0; b < 14; ++b)
        if (std::find(kEdgeSteps.begin(), kEdgeSteps.end(), kEdgeSteps[b] - kEdgeSteps[a]) !=
            kEdgeSteps.end())
          result[a] = std::uint16_t(result[a] | 1u << b);
    return result;
  }();
  return table;
}

bool isDisc(unsigned positive, unsigned zero) {
  constexpr unsigned kAll = (1u << 14) - 1;
  if (!isConnected(positive) || !isConnected(kAll & ~positive)) return false;
  const auto& around = neighboursOfNeighbours();
  for (std::size_t n = 0; n < 14; ++n) {
    if ((zero >> n & 1) == 0) continue;
    // Around the edge to another sample of 0: one arc of positive samples, and something else.
    const unsigned arc = around[n] & positive;
    if (arc != 0 && (arc == around[n] || !isConnected(arc))) return false;
    for (std::size_t m = 0; m < n; ++m) {
      if ((zero >> m & 1) == 0 || (around[n] >> m & 1) == 0) continue;
      // A triangle of samples of 0 has the inside on one side at most.
      const unsigned apexes = around[n] & around[m];
      if (apexes != 0 && (apexes & positive) == apexes) return false;
    }
  }
  return true;
}

void gather(const BrickGrid& level, const Vec3i& brick, std::array<float, kRingSamples>& samples) {
  std::array<std::int32_t, 27> pools;
  for (int i = 0; i < 27; ++i)
    pools[std::size_t(i)] = level.poolIndex(brick + Vec3i{i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1});
  for (int z = -1; z <= kCellSide; ++z)
    for (int y = -1; y <= kCellSide; ++y)
      for (int x = -1; x <= kCellSide; ++x) {
        const Vec3i b{brickOf(x) + 1, brickOf(y) + 1, brickOf(z) + 1};
        const float v = level.brick(pools[std::size_t((b.z * 3 + b.y) * 3 + b.x)])[sampleOffset(
            insideBrick(x), insideBrick(y), insideBrick(z))];
        samples[std::size_t(ringIndex(x, y, z))] = v;
      }
}

}  // namespace nephele::detail
