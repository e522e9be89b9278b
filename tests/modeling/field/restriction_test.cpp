#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "nephele/modeling/cloud/cumulo.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {
namespace {

const Box kBox{{-1, -1, -1}, {1, 1, 1}};

/// x, within [-1, 1] as far as anyone is told, that counts how often it is told.
ScalarField counted(std::atomic<int>& count) {
  return functionField([](const Vec3f& p) { return p.x; }, {.range = [&count](const Box&) {
                         ++count;
                         return Interval{-1, 1};
                       }});
}

TEST(Restriction, RangesEachPartOfAUnionTwiceAtMost) {
  std::atomic<int> count{0};
  std::vector<ScalarField> parts;
  for (int i = 0; i < 1000; ++i) parts.push_back(counted(count));
  const ScalarField all = unionOf(parts);
  static_cast<void>(all.restrictedTo(kBox));
  // By the node above, to see whether the part matters, and for that node's own range; and once more for the
  // first questions, which are not remembered. Each of the tree's 10 levels would range all below it again.
  EXPECT_LE(count.load(), 2 * 1000 + 32);
}

TEST(Restriction, RangesEachPartOfAChainTwiceAtMost) {
  std::atomic<int> count{0};
  ScalarField sum = counted(count);
  for (int i = 1; i < 300; ++i) sum = abs(sum + counted(count));
  static_cast<void>(sum.restrictedTo(kBox));
  // Not 300^2.
  EXPECT_LE(count.load(), 2 * 300 + 32);
}

TEST(Restriction, RangesASharedExpressionOnce) {
  std::atomic<int> count{0};
  ScalarField f = counted(count);
  for (int i = 0; i < 16; ++i) f = 0.5f * f + abs(f - 0.25f);
  EXPECT_TRUE(f.range(kBox).contains(f({0.5f, 0, 0})));
  // 2^16 ways lead to x. Those of the first 32 questions are gone again.
  EXPECT_LE(count.load(), 32);
  count = 0;
  const ScalarField local = f.restrictedTo(kBox);
  EXPECT_LE(count.load(), 32);
  EXPECT_EQ(local({0.5f, 0, 0}), f({0.5f, 0, 0}));
}

TEST(Restriction, RemembersWhatIsReadElsewhere) {
  std::atomic<int> count{0};
  ScalarField f = counted(count);
  const VectorField back = position() * ScalarField(0.5f);
  for (int i = 0; i < 12; ++i) f = compose(f, back) + abs(compose(f, back));
  static_cast<void>(f.restrictedTo(kBox));
  // 2^12 ways, all to one box.
  EXPECT_LE(count.load(), 64);
}

TEST(Restriction, OfACumuloGrowsWithItsLayers) {
  const auto rangesOf = [](int layerCount) {
    std::atomic<int> count{0};
    const ScalarField base =
        functionField([](const Vec3f& p) { return 1 - length(p); }, {.range = [&count](const Box& box) {
                        ++count;
                        return sphere({0, 0, 0}, 1).range(box);
                      }});
    std::vector<CumuloLayer> layers;
    for (int i = 0; i < layerCount; ++i)
      layers.push_back({.noise = perlin({.frequency = 4, .seed = unsigned(i)}), .amplitude = 0.05f});
    const ScalarField cloud = cumulo(base, layers, {.voxelSize = 0.01f});
    count = 0;
    static_cast<void>(cloud.restrictedTo({{0.8f, -0.1f, -0.1f}, {1, 0.1f, 0.1f}}));
    return count.load();
  };
  // Every layer reads the sum before it twice, which would be 2^layers.
  EXPECT_LE(rangesOf(4), 16);
  EXPECT_LE(rangesOf(12), 32);
}

TEST(Restriction, ThreadsDoNotDisturbEachOther) {
  ScalarField f = sphere({0, 0, 0}, 1);
  for (int i = 0; i < 12; ++i) f = unionOf(f + 0.01f, 0.9f * f);
  const Interval expected = f.range(kBox);
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 20; ++i) {
        wrong += !(f.range(kBox) == expected);
        wrong += f.restrictedTo(kBox)({0.3f, 0, 0}) != f({0.3f, 0, 0});
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong.load(), 0);
}

}  // namespace
}  // namespace nephele
