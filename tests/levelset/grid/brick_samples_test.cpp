#include "nephele/levelset/grid/brick_samples.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <limits>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/brick_memo.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/allocation_count.h"

namespace nephele {
namespace {

const Box kBox{{-1.3f, -1.3f, -1.3f}, {1.3f, 1.3f, 1.3f}};

TEST(BrickSamples, PackToWhatTheWholeGridPacksTo) {
  const ScalarField wavy = sphere({}, 1) + 0.1f * perlin({.frequency = 2});
  for (const Interval band : {Interval{-0.2f, 0.1f}, Interval::everything()}) {
    const BakeOptions options{
        .voxelSize = 0.03f, .box = kBox, .band = band, .interpolation = Interpolation::tricubic};
    const auto whole = std::make_shared<const PackedGrid>(std::move(*bakeGrid(wavy, options)));
    const auto packed = detail::packed(detail::bakeSamples(wavy, options));
    ASSERT_EQ(packed->firstBrick(), whole->firstBrick());
    ASSERT_EQ(packed->brickCount(), whole->brickCount());
    EXPECT_EQ(packed->poolSize(), whole->poolSize());
    // The pools differ in their order only.
    for (std::size_t i = 0; i < whole->table().size(); ++i) {
      const std::int32_t a = packed->table()[i], b = whole->table()[i];
      ASSERT_EQ(packed->ranges()[std::size_t(a)], whole->ranges()[std::size_t(b)]);
      ASSERT_TRUE(std::equal(packed->codes(a), packed->codes(a) + kBrickSamples, whole->codes(b)));
    }
  }
}

TEST(BrickSamples, SeparateGivesConstantsPlacesOfTheirOwn) {
  // 1 for x < 0 and 3 beyond: whole bricks of one value.
  const ScalarField step = mask(plane({}, {1, 0, 0})) * 2.0f + 1.0f;
  detail::BrickSamples samples = detail::bakeSamples(step, {.voxelSize = 0.05f, .box = kBox});
  ASSERT_LT(samples.placed.size() + 1, samples.pool.size());
  samples.separate();
  EXPECT_EQ(samples.placed.size() + 1, samples.pool.size());
  for (const PlacedBrick& brick : samples.placed) EXPECT_EQ(samples.table.at(brick.brick), brick.pool);
  const Vec3i inside = brickOf(Vec3i{-12, 3, 3}), beyond = brickOf(Vec3i{12, 3, 3});
  EXPECT_EQ(samples.pool[std::size_t(samples.table.at(inside))][0], 1.0f);
  EXPECT_EQ(samples.pool[std::size_t(samples.table.at(beyond))][0], 3.0f);
}

TEST(BrickSamples, AppendedBricksFollowTheOthers) {
  const ScalarField ball = sphere({}, 1);
  const BakeOptions options{.voxelSize = 0.05f, .box = kBox};
  const auto whole = detail::packed(detail::bakeSamples(ball, options));
  // The same in two goes: bricks below z = 0, then those above.
  const auto parts = detail::emptyPackedGrid(detail::bakeSamples(ball, options));
  for (const bool upper : {false, true}) {
    detail::BrickSamples samples = detail::bakeSamples(ball, options);
    std::vector<detail::Packing> packing(samples.pool.size(), detail::Packing::leaveOut);
    for (const PlacedBrick& brick : samples.placed)
      if ((brick.brick.z >= 0) == upper) packing[std::size_t(brick.pool)] = detail::Packing::whole;
    detail::appendPacked(*parts, std::move(samples), packing);
  }
  const ScalarField a = gridField(whole), b = gridField(parts);
  for (int i = -20; i <= 20; ++i) {
    const Vec3f p{0.06f * float(i), 0.021f * float(i), -0.05f * float(i)};
    EXPECT_EQ(a(p), b(p)) << i;
  }
}

TEST(BrickSamples, KnowWhichBricksAreReadAroundThem) {
  // Cells within a voxel of a sample read from 2 before it to 3 after it: bricks of 8 that these touch.
  for (const int sample : {0, 1, 2, 5, 7, 8 * 3 + 3, 64 * 7 + 8 + 4, 511}) {
    const Vec3i own{sample & 7, sample >> 3 & 7, sample >> 6};
    std::uint32_t wanted = 0;
    for (int number = 0; number < 27; ++number) {
      bool isRead = true;
      for (int axis = 0; axis < 3; ++axis) {
        const int first = detail::neighbour(number)[axis] * 8;
        isRead &= own[axis] - 2 <= first + 7 && own[axis] + 3 >= first;
      }
      wanted |= isRead ? 1u << number : 0;
    }
    EXPECT_EQ(detail::neighboursReadAround(sample), wanted) << sample;
  }
}

TEST(BrickSamples, RefuseToPackWhatIsNotFinite) {
  const ScalarField broken = sphere({}, 1) * std::numeric_limits<float>::infinity();
  EXPECT_THROW(detail::packed(detail::bakeSamples(broken, {.voxelSize = 0.1f, .box = kBox})), Error);
}

/// Counts the points at which a field is evaluated.
class CountingNode final : public FieldNode<float> {
 public:
  explicit CountingNode(NodePtr<float> field) : field_(std::move(field)) {}
  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch& scratch) const override {
    count += points.count;
    field_->eval(points, values, scratch);
  }
  Interval range(const Box& box, RangeMemo& memo) const override { return memo.of(field_, box); }
  float differenceStep() const override { return field_->differenceStep(); }
  mutable std::atomic<int> count = 0;

 private:
  NodePtr<float> field_;
};

/// A ball with bumps, and a bake of it that asks for no brick at the edge of its box.
std::shared_ptr<CountingNode> countedBall() {
  return std::make_shared<CountingNode>((sphere({}, 0.5f) + 0.1f * perlin({.frequency = 3})).node());
}
const BakeOptions kBallOptions{.voxelSize = 0.05f, .box = kBox, .band = {-0.1f, 0.1f}};

TEST(BrickMemo, EvaluatesTheSamplesOfBricksOnce) {
  const auto counted = countedBall();
  detail::BrickMemo memo(ScalarField(NodePtr<float>(counted)), kBallOptions.voxelSize, kBox.expanded(0.5f),
                         1e6);
  const auto first = bakeGrid(memo.field(), kBallOptions);
  const int once = counted->count;
  EXPECT_GT(once, 0);
  EXPECT_EQ(bakeGrid(memo.field(), kBallOptions)->values(), first->values());
  EXPECT_EQ(counted->count, once);
  memo.clear();
  EXPECT_EQ(bakeGrid(memo.field(), kBallOptions)->values(), first->values());
  EXPECT_EQ(counted->count, 2 * once);
}

TEST(BrickMemo, NeverAllocatesWhileItIsEvaluated) {
  constexpr float kVoxel = 0.05f;
  const detail::BrickMemo memo(sphere({}, 0.5f), kVoxel, kBox, 1e6);
  std::array<float, kBlockSize> x, y, z, values;
  const auto evaluate = [&](int brick) {
    for (int i = 0; i < kBlockSize; ++i) {
      const Vec3f p = Vec3f(Vec3i{8 * brick + i % 8, i / 8 % 8, i / 64}) * kVoxel;
      x[std::size_t(i)] = p.x, y[std::size_t(i)] = p.y, z[std::size_t(i)] = p.z;
    }
    memo.field().eval({x, y, z}, std::span<float>(values));
  };
  // Once, for the scratch memory of this thread.
  evaluate(0);
  const long before = test::allocationCount();
  for (const int brick : {1, 2, -1, 1}) evaluate(brick);
  EXPECT_EQ(test::allocationCount(), before);
  // Kept, and right: on the x axis the distance is 0.5 - |x|.
  EXPECT_FLOAT_EQ(values[3], 0.5f - 11 * kVoxel);
}

TEST(BrickMemo, RemembersNothingOnALatticeThatIsTooLarge) {
  const auto counted = countedBall();
  const detail::BrickMemo memo(ScalarField(NodePtr<float>(counted)), kBallOptions.voxelSize, kBox, 4);
  bakeGrid(memo.field(), kBallOptions);
  const int once = counted->count;
  bakeGrid(memo.field(), kBallOptions);
  EXPECT_EQ(counted->count, 2 * once);
}

}  // namespace
}  // namespace nephele
