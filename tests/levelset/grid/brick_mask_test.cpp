#include "nephele/levelset/grid/brick_mask.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace nephele {
namespace {

TEST(BrickMask, MovesAndMeasuresItsSamples) {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    detail::BrickMask mask;
    Vec3i low{8, 8, 8}, high{-1, -1, -1};
    for (int i = 0; i < 1 + round % 5; ++i) {
      const int s = int(random() % 512);
      mask.add(s);
      low = min(low, Vec3i{s & 7, s >> 3 & 7, s >> 6});
      high = max(high, Vec3i{s & 7, s >> 3 & 7, s >> 6});
    }
    EXPECT_EQ(detail::boundsOf(mask).low, low);
    EXPECT_EQ(detail::boundsOf(mask).high, high);
    const Vec3i offset{int(random() % 19) - 9, int(random() % 5) - 2, int(random() % 19) - 9};
    const detail::BrickMask moved = detail::moved(mask, offset);
    for (int s = 0; s < 512; ++s) {
      const Vec3i p = Vec3i{s & 7, s >> 3 & 7, s >> 6} - offset;
      const bool isIn = p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < 8 && p.y < 8 && p.z < 8;
      ASSERT_EQ(moved.contains(s), isIn && mask.contains(p.x + 8 * p.y + 64 * p.z));
    }
  }
}

TEST(BrickMask, ConnectedPartReachesAroundCornersAndNoFarther) {
  detail::BrickMask mask;
  for (const int s : {0, 1, 1 + 8, 1 + 8 + 64, 2 + 16 + 64, 5 + 5 * 8 + 5 * 64}) mask.add(s);
  const detail::BrickMask part = detail::connectedPart(mask);
  EXPECT_EQ(part.count(), 4);
  // A neighbour across an edge is none.
  EXPECT_EQ(detail::without(mask, part).first(), 2 + 16 + 64);
}

TEST(BrickMask, ConnectedPartsAreThoseOfAPlainFlood) {
  std::mt19937 random(3);
  for (int round = 0; round < 30; ++round) {
    detail::BrickMask mask;
    for (int s = 0; s < 512; ++s)
      if (random() % 10 < 4) mask.add(s);
    std::vector<int> open{mask.first()};
    detail::BrickMask expected;
    while (!open.empty()) {
      const int s = open.back();
      open.pop_back();
      if (expected.contains(s)) continue;
      expected.add(s);
      const int at[3] = {s & 7, s >> 3 & 7, s >> 6}, stride[3] = {1, 8, 64};
      for (int axis = 0; axis < 3; ++axis) {
        if (at[axis] > 0 && mask.contains(s - stride[axis])) open.push_back(s - stride[axis]);
        if (at[axis] < 7 && mask.contains(s + stride[axis])) open.push_back(s + stride[axis]);
      }
    }
    EXPECT_EQ(detail::connectedPart(mask), expected);
  }
}

}  // namespace
}  // namespace nephele
