#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/field/function_field.h"

namespace nephele::test {
namespace {

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

constexpr int kAlongX = 25, kAlongY = 20;

/// 500 balls of radius 4 in a layer, `spacing` apart.
struct Balls {
  std::shared_ptr<BrickGrid> grid;
  Box box;

  explicit Balls(float spacing) {
    const auto nearest = [spacing](float x, int count) {
      return spacing * std::clamp(std::round(x / spacing), 0.0f, float(count - 1));
    };
    const ScalarField shape = functionField([=](const Vec3f& p) {
      return 4 - length(p - Vec3f{nearest(p.x, kAlongX), nearest(p.y, kAlongY), 0});
    });
    box = {{-5, -5, -5}, {spacing * (kAlongX - 1) + 5, spacing * (kAlongY - 1) + 5, 5}};
    grid = bakeGrid(shape, {.voxelSize = 1, .box = box.expanded(4), .band = {-4, 4}});
  }
};

const Knives kAcross{.planes = {{{0, 0, 0.1f}, {0, 0, 1}}}};

TEST(ShellNecks, OfManyLooseShellsAreNotLookedForInPairs) {
  // 125 000 pairs on either side of the plane: half a minute if all are compared. On a quiet machine the cut
  // takes a tenth of a second; the bar is a second, and ten are given to machines that do other things.
  const Balls balls(13);
  const auto start = Clock::now();
  const Pieces cut = cutIntoLevelSets(gridField(balls.grid), {.voxelSize = 1, .box = balls.box}, kAcross);
  EXPECT_LT(secondsSince(start), 10);
  EXPECT_EQ(cut.pieces.size(), std::size_t(2 * kAlongX * kAlongY));
}

TEST(ShellNecks, CanBeStoppedWhereManyShellsAreInReachOfEachOther) {
  // Gaps of a voxel: every pair is compared.
  const Balls balls(9);
  struct StopWriting : Progress {
    void begin(std::string_view stage) const override {
      if (stage == "write pieces") writing = Clock::now();
    }
    bool cancelled() const override { return writing != Clock::time_point() && secondsSince(writing) > 0.05; }
    mutable Clock::time_point writing{};
  } stop;
  EXPECT_THROW(cutIntoLevelSets(gridField(balls.grid), {.voxelSize = 1, .box = balls.box}, kAcross, {}, stop),
               Cancelled);
  // 0.2 s is the bar on a quiet machine.
  EXPECT_LT(secondsSince(stop.writing), 2);
}

TEST(ShellNecks, JoinWhatIsOneAlsoAmongManyShells) {
  // Plates half a voxel thick that rise by a voxel in 20: samples see each of them as some five stripes. A
  // plate is convex, so that every line between two of its samples stays inside: one piece each.
  constexpr int kPlates = 12;
  const ScalarField shape = functionField([](const Vec3f& p) {
    const float row = 16 * std::clamp(std::round(p.y / 16), 0.0f, float(kPlates - 1));
    return std::min({0.25f - std::abs(p.z - p.x / 20), 4.3f - std::abs(p.y - row), 50 - std::abs(p.x - 50)});
  });
  const Box box{{-1, -5, -1}, {101, 16 * (kPlates - 1) + 5, 6}};
  const Pieces cut = cutIntoLevelSets(shape, {.voxelSize = 1, .box = box}, {}, {.minVolume = 0.0});
  EXPECT_EQ(cut.pieces.size(), std::size_t(kPlates));
  EXPECT_EQ(cut.codes, 1u);
}

}  // namespace
}  // namespace nephele::test
