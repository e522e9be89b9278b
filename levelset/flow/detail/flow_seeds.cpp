#include "nephele/levelset/flow/detail/flow_seeds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/cloud/advect.h"

namespace nephele::detail {

std::vector<Vec3i> flowSeeds(const std::vector<Vec3i>& bricks, const Lattice& from, const Lattice& to,
                             const VectorField& forward, float longest) {
  constexpr std::size_t kPoints = 27;
  constexpr float kSpacing = 0.5f * BrickGrid::kBrick;
  std::vector<Vec3i> arrived(bricks.size() * kPoints);
  parallelFor(bricks.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<float> xyz[3], moved[3];
    for (std::size_t b = begin; b < end; ++b)
      for (std::size_t k = 0; k < kPoints; ++k) {
        const Vec3f q = Vec3f(bricks[b] * BrickGrid::kBrick) +
                        Vec3f{float(k % 3), float(k / 3 % 3), float(k / 9)} * kSpacing;
        const Vec3f p = from.indexToWorld(q);
        for (int c = 0; c < 3; ++c) xyz[c].push_back(p[c]);
      }
    Spans<3> spans;
    for (int c = 0; c < 3; ++c) {
      moved[c].resize(xyz[c].size());
      spans.lanes[std::size_t(c)] = moved[c];
    }
    forward.eval({xyz[0], xyz[1], xyz[2]}, spans);
    for (std::size_t i = 0; i < moved[0].size(); ++i) {
      const Vec3f start = to.worldToIndex(Vec3f{xyz[0][i], xyz[1][i], xyz[2][i]});
      const Vec3f q = to.worldToIndex(Vec3f{moved[0][i], moved[1][i], moved[2][i]});
      const Vec3f way = q - start;
      const float distance = std::max({std::abs(way.x), std::abs(way.y), std::abs(way.z)});
      if (!(distance <= longest)) {
        const Vec3f p{xyz[0][i], xyz[1][i], xyz[2][i]};
        throw Error(fmt::format(
            "advection: the velocity carries matter at {:g},{:g},{:g} by {:g} voxels at once, allowed: up to "
            "{:g}; use a smaller velocity or dt, and more steps",
            p.x, p.y, p.z, distance, longest));
      }
      arrived[begin * kPoints + i] = brickAround(q);
    }
  });
  std::sort(arrived.begin(), arrived.end(), comesBefore);
  arrived.erase(std::unique(arrived.begin(), arrived.end()), arrived.end());
  return arrived;
}

void requireShortSteps(const std::vector<Vec3i>& bricks, const Lattice& lattice, const VectorField& velocity,
                       float dt, float longest) {
  const VectorField ahead = traceBack(velocity, {.dt = -dt, .rule = TraceRule::euler});
  static_cast<void>(flowSeeds(bricks, lattice, lattice, ahead, longest));
}

}  // namespace nephele::detail
