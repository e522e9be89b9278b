#include "nephele/render/volume/brick_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/density.h"
#include "tests/support/march_scene.h"

namespace nephele {
namespace {

struct Visit {
  float begin, end;
  std::int32_t pool;
};

std::vector<Visit> walked(const MarchScene& scene, const LatticeRay& ray, float length) {
  std::vector<Visit> visits;
  detail::walkBricks(scene, ray, length, [&](float begin, float end, std::int32_t pool) {
    visits.push_back({begin, end, pool});
    return true;
  });
  return visits;
}

// At many points of the ray, but for those that rounding may put on either side of a plane between bricks,
// the brick of the table that the point lies in says whether it must have been visited, and as which of the
// pool.
void expectTheBricksOfItsPoints(const MarchScene& scene, const LatticeRay& ray, float length) {
  const std::vector<Visit> visits = walked(scene, ray, length);
  for (std::size_t i = 0; i != visits.size(); ++i) {
    EXPECT_LE(visits[i].begin, visits[i].end);
    EXPECT_GE(visits[i].begin, i > 0 ? visits[i - 1].end : 0.0f);
  }
  const Vec3i count = scene.density.count;
  for (int n = 0; n != 500; ++n) {
    const float s = length * (float(n) + 0.5f) / 500;
    std::size_t entry = 0, stride = 1;
    bool isClear = true, isInside = true;
    for (int axis = 0; axis != 3; ++axis) {
      const float at = (ray.origin[axis] + s * ray.direction[axis]) / 8;
      isClear = isClear && std::fabs(at - std::round(at)) > 1e-3f;
      isInside = isInside && at > 0 && at < float(count[axis]);
      entry += std::size_t(std::max(at, 0.0f)) * stride;
      stride *= std::size_t(count[axis]);
    }
    if (!isClear || !isInside) continue;
    const auto visit = std::find_if(visits.begin(), visits.end(),
                                    [s](const Visit& v) { return v.begin <= s && s <= v.end; });
    ASSERT_EQ(visit != visits.end(), scene.emptiness[entry] == 0) << s;
    if (visit == visits.end()) continue;
    ASSERT_EQ(visit->pool, scene.density.table[entry]) << s;
  }
}

// A ball with a constant core, and a voxel far from it.
RenderVolume ballAndVoxel() {
  return RenderVolume(test::densityGrid(test::voxels(1), {0, 0, 0}, {95, 71, 79}, [](const Vec3f& p) {
    return p == Vec3f{92, 68, 4} ? 0.3f : std::clamp(30.5f - length(p - Vec3f{40, 36, 40}), 0.0f, 1.0f);
  }));
}

TEST(BrickWalk, VisitsWhatTheRayPasses) {
  const RenderVolume volume = ballAndVoxel();
  MarchScene scene = test::sceneOf(volume);
  const Vec3f size = Vec3f(scene.density.count) * 8.0f;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0, 1);
  const auto anywhere = [&] {
    return Vec3f{size.x * uniform(random), size.y * uniform(random), size.z * uniform(random)};
  };
  for (const bool skipsUniform : {true, false}) {
    if (!skipsUniform) scene.uniformity = nullptr;
    for (int n = 0; n != 300; ++n) {
      const Vec3f from = anywhere(), way = anywhere() - from;
      expectTheBricksOfItsPoints(scene, {from, normalize(way)}, length(way));
    }
  }
}

TEST(BrickWalk, PassesAlongAxesAndDiagonals) {
  const RenderVolume volume = ballAndVoxel();
  const MarchScene scene = test::sceneOf(volume);
  for (int x = -1; x != 2; ++x)
    for (int y = -1; y != 2; ++y)
      for (int z = -1; z != 2; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vec3f way = normalize(Vec3f(Vec3i{x, y, z}));
        // Through nodes of the lattice of bricks, and beside them.
        for (const Vec3f& through :
             {Vec3f{40, 40, 40}, Vec3f{41.3f, 36.6f, 44.9f}, Vec3f{92.2f, 68.1f, 3.7f}})
          expectTheBricksOfItsPoints(scene, {through - way * 30.0f, way}, 60.0f);
      }
}

TEST(BrickWalk, EndsWhereItIsTold) {
  const RenderVolume volume = ballAndVoxel();
  const MarchScene scene = test::sceneOf(volume);
  const LatticeRay ray{{0.5f, 36.5f, 40.5f}, {1, 0, 0}};
  const std::vector<Visit> all = walked(scene, ray, 1e6f), some = walked(scene, ray, 30.0f);
  ASSERT_FALSE(all.empty());
  EXPECT_LE(all.back().end, 96.0f);
  ASSERT_FALSE(some.empty());
  EXPECT_EQ(some.back().end, 30.0f);
  int visits = 0;
  detail::walkBricks(scene, ray, 1e6f, [&](float, float, std::int32_t) { return ++visits != 2; });
  EXPECT_EQ(visits, 2);
}

}  // namespace
}  // namespace nephele
