#include "nephele/levelset/cut/piece_level_set.h"

#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <random>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/cut/detail/level_sets/cut_kernels.h"
#include "nephele/levelset/grid/brick_mask.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/levelset/cut/balls_and_blades.h"

namespace nephele::test {
namespace {

Pieces ballInPieces(int blades, float voxelSize) {
  return cutIntoLevelSets(sphere({0, 0, 0}, 1), {.voxelSize = voxelSize, .box = kBall},
                          {.planes = randomBlades({.count = blades, .box = kBall, .seed = 7})});
}

bool sameBits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

TEST(PieceLevelSet, HasTheSamplesOfItsCopy) {
  const Pieces cut = ballInPieces(3, 0.05f);
  ASSERT_GT(cut.pieces.size(), 3u);
  for (const Piece& piece : cut.pieces) {
    const auto copy = piece.level->toBricks();
    EXPECT_EQ(copy->poolSize(), piece.level->storedBricks() + 2);
    for (int k = -26; k <= 26; k += 2)
      for (int j = -26; j <= 26; j += 3)
        for (int i = -26; i <= 26; ++i)
          ASSERT_TRUE(sameBits(piece.level->at({i, j, k}), copy->at({i, j, k})));
  }
}

TEST(PieceLevelSet, IsAsAFieldWhatItsCopyIs) {
  // The copy's kernels are tested by themselves; both interpolate with the same operations.
  const Pieces cut = ballInPieces(4, 0.05f);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1.4f, 1.4f);
  std::array<std::vector<float>, 3> points;
  for (int i = 0; i < 3000; ++i)
    for (auto& lane : points) lane.push_back(place(random));
  const PointSpans spans{points[0], points[1], points[2]};
  std::vector<float> direct(spans.size()), copied(spans.size());
  for (const Piece& piece : cut.pieces) {
    piece.level->field().eval(spans, direct);
    gridField(piece.level->toBricks()).eval(spans, copied);
    for (std::size_t i = 0; i < direct.size(); ++i) ASSERT_TRUE(sameBits(direct[i], copied[i])) << i;
  }
}

TEST(PieceLevelSet, OutlivesItsCut) {
  Pieces cut = ballInPieces(2, 0.05f);
  const PieceLevelSet kept = *cut.pieces[0].level;
  const auto before = kept.toBricks();
  cut = {};
  const auto after = kept.toBricks();
  EXPECT_EQ(
      std::memcmp(before->values().data(), after->values().data(), before->values().size() * sizeof(float)),
      0);
}

TEST(PieceLevelSet, TakesLessThanHalfOfACopyWithBorders) {
  for (const Piece& piece : ballInPieces(5, 0.03f).pieces)
    EXPECT_LT(2 * piece.level->memoryBytes(), piece.level->toBricks()->memoryBytes());
}

TEST(PieceLevelSet, RangesNarrowWithTheirBoxes) {
  // A ball of radius 1 with a band of 0.15: nothing of the surface is near the middle, beside the ball or
  // beyond the table, and a box of one voxel holds values no farther apart than its diagonal.
  const ScalarField ball = ballInPieces(0, 0.05f).pieces.at(0).level->field();
  const Interval all = ball.range({{-2, -2, -2}, {2, 2, 2}});
  EXPECT_LE(all.min, -0.15f);
  EXPECT_GE(all.max, 0.15f);
  const Interval middle = ball.range({{-0.2f, -0.2f, -0.2f}, {0.2f, 0.2f, 0.2f}});
  EXPECT_EQ(middle.min, 0.15f);
  EXPECT_EQ(middle.max, 0.15f);
  for (const float x : {1.5f, 100.0f, 1e12f})
    EXPECT_EQ(ball.range({{x, 0, 0}, {x * 1.1f, 1, 1}}).max, -0.15f);
  const Interval atSurface = ball.range({{0.98f, 0, 0}, {1.02f, 0.05f, 0.05f}});
  EXPECT_LT(atSurface.min, 0);
  EXPECT_GT(atSurface.max, 0);
  EXPECT_LT(atSurface.max - atSurface.min, 0.15f);
}

TEST(PieceLevelSet, RangesContainAllValues) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> place(-1.3f, 1.3f), size(0, 0.5f), share(0, 1);
  for (const Piece& piece : ballInPieces(4, 0.05f).pieces) {
    const ScalarField field = piece.level->field();
    for (int round = 0; round < 200; ++round) {
      const Vec3f low{place(random), place(random), place(random)};
      const float edge = size(random);
      const Interval range = field.range({low, low + Vec3f{edge, edge, edge}});
      for (int i = 0; i < 20; ++i) {
        const float v = field(low + Vec3f{share(random), share(random), share(random)} * edge);
        ASSERT_LE(range.min, v);
        ASSERT_GE(range.max, v);
      }
    }
  }
}

TEST(PieceVolumes, AreThoseOfTheMarchingCubesMeshes) {
  // Sharp rims, kerf, cells, and white noise, whose cells are ambiguous on every other face.
  const auto check = [](const Pieces& cut) {
    ASSERT_FALSE(cut.pieces.empty());
    for (const Piece& piece : cut.pieces) {
      const double volume = signedVolume(marchingCubes(*piece.level->toBricks()));
      EXPECT_NEAR(piece.level->volume() / volume, 1, 1e-10);
    }
  };
  check(ballInPieces(9, 0.04f));
  check(cutIntoLevelSets(sphere({0, 0, 0}, 1), {.voxelSize = 0.05f, .box = kBall},
                         {.cells = scatteredPoints(sphere({0, 0, 0}, 1), kBall, 12, 1)}, {.kerf = 0.06f}));
  const ScalarField speckled = sphere({0, 0, 0}, 1) + 0.3f * noise({.frequency = 9});
  check(cutIntoLevelSets(speckled, {.voxelSize = 0.05f, .box = kBall, .bandVoxels = 7}, {}));
}

TEST(PieceVolumes, OfAShapeThatItsBoxCutsOffAreThoseOfTheMeshes) {
  const Box half{{-0.1f, -1, -1}, {1, 1, 1}};
  for (const float shift : {0.0f, 0.31f, 0.57f}) {
    const Pieces cut = cutIntoLevelSets(
        sphere({0, 0, 0}, 1), {.voxelSize = 0.07f, .box = Box{half.min + Vec3f{shift, shift, 0}, half.max}},
        {.planes = {{{0.3f, 0, 0}, {1, 0.2f, 0.1f}}}});
    for (const Piece& piece : cut.pieces)
      EXPECT_NEAR(piece.level->volume() / signedVolume(marchingCubes(*piece.level->toBricks())), 1, 1e-10)
          << shift;
  }
}

TEST(CutKernels, AreThePlainLoopsToTheBit) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(-1, 1);
  const float odd[] = {0.0f,
                       -0.0f,
                       0.25f,
                       -0.25f,
                       std::numeric_limits<float>::quiet_NaN(),
                       std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity()};
  for (std::size_t count = 0; count < 6; ++count) {
    std::vector<float> samples((1 + count) * 512);
    for (float& v : samples) v = random() % 8 == 0 ? odd[random() % std::size(odd)] : value(random);
    std::vector<detail::KnifeSide> knives;
    for (std::size_t k = 1; k <= count; ++k)
      knives.push_back({samples.data() + 512 * k, random() % 2 == 0 ? 1.0f : -1.0f});
    for (const float half : {0.0f, 0.1f}) {
      std::array<float, 512> fast, plain;
      const Interval a = detail::pieceSamples(samples.data(), knives, half, 0.5f, fast.data());
      const Interval b = detail::pieceSamplesScalar(samples.data(), knives, half, 0.5f, plain.data());
      EXPECT_EQ(std::memcmp(fast.data(), plain.data(), sizeof(fast)), 0) << count;
      EXPECT_EQ(a.min, b.min);
      EXPECT_EQ(a.max, b.max);
      const detail::Sides sides = detail::sidesOf(samples.data(), half),
                          expected = detail::sidesOfScalar(samples.data(), half);
      EXPECT_EQ(sides.above, expected.above);
      EXPECT_EQ(sides.below, expected.below);
    }
  }
}

TEST(BrickMask, FacesMeetWhereSamplesDo) {
  std::mt19937 random(2);
  for (int round = 0; round < 20; ++round) {
    detail::BrickMask a, b;
    for (int i = 0; i < 60; ++i) a.add(int(random() % 512)), b.add(int(random() % 512));
    for (int axis = 0; axis < 3; ++axis) {
      Vec3i across{};
      across[axis] = -7;
      const bool meet = !(detail::moved(a, across) & b).isEmpty();
      EXPECT_EQ((detail::faceOf(a, axis, true) & detail::faceOf(b, axis, false)) != 0, meet);
    }
  }
}

TEST(BrickMask, WholeCellsHaveAllCorners) {
  std::mt19937 random(4);
  for (int round = 0; round < 10; ++round) {
    detail::BrickMask mask = detail::BrickMask::all();
    for (int i = 0; i < 5 * round; ++i)
      mask = detail::without(mask, [&] {
        detail::BrickMask one;
        one.add(int(random() % 512));
        return one;
      }());
    int expected = 0;
    for (int s = 0; s < 512; ++s) {
      if ((s & 7) == 7 || (s >> 3 & 7) == 7 || s >> 6 == 7) continue;
      bool all = true;
      for (const int step : {0, 1, 8, 9, 64, 65, 72, 73}) all = all && mask.contains(s + step);
      expected += all;
    }
    EXPECT_EQ(detail::wholeCells(mask), expected);
  }
}

}  // namespace
}  // namespace nephele::test
