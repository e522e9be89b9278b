#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/levelset/cut/balls_and_blades.h"
#include "tests/support/brick_grids.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

/// Whether a sample within `reach` steps is inside.
bool isNearInside(const PieceLevelSet& grid, const Vec3i& voxel, int reach) {
  for (int z = -reach; z <= reach; ++z)
    for (int y = -reach; y <= reach; ++y)
      for (int x = -reach; x <= reach; ++x)
        if (grid.at(voxel + Vec3i{x, y, z}) > 0) return true;
  return false;
}

TEST(PiecesAsLevelSets, EqualTheirField) {
  // In the band, the samples are those of the expression min(shape, +-knives - kerf / 2).
  const std::vector<Knife> knives{
      flatKnife({{0.1f, 0, 0}, {1, 0.2f, 0}}), Knife(sphere({0, 1, 0}, 0.8f)),
      roughKnife({{}, {0, 0.1f, 1}}, {.amplitude = 0.03f, .noise = {.frequency = 2}})};
  for (const float kerf : {0.0f, 0.05f}) {
    const Pieces cut =
        cutIntoLevelSets(ball(), {.voxelSize = 0.05f, .box = kBall}, {.fields = knives}, {.kerf = kerf});
    EXPECT_EQ(cut.pieces.size(), 8u);
    for (const Piece& piece : cut.pieces) {
      const ScalarField field = pieceField(ball(), knives, piece.code, kerf);
      const PieceLevelSet& grid = *piece.level;
      for (int k = -24; k <= 24; k += 3)
        for (int j = -24; j <= 24; j += 2)
          for (int i = -24; i <= 24; ++i) {
            const Vec3f p = Vec3f(float(i), float(j), float(k)) * 0.05f;
            const float band = 0.15f, v = grid.at({i, j, k});
            // Only a knife that is no distance is divided by its slope here and not there, if nothing is
            // lost.
            const float tolerance = kerf > 0 ? 2e-6f : 0.1f;
            const float expected = std::clamp(field(p), -band, band);
            // Beyond two voxels of the inside, a rim's value may already be the band's end.
            if (isNearInside(grid, {i, j, k}, 2)) {
              ASSERT_NEAR(v, expected, tolerance) << i << " " << j << " " << k;
            } else {
              ASSERT_LE(expected, 0);
            }
            if (kerf == 0) {
              ASSERT_EQ(v > 0, expected > 0);
            }
          }
    }
  }
}

TEST(PiecesAsLevelSets, AreTheSameForAnyOrderOfTheKnives) {
  std::vector<Knife> knives = flat(randomBlades({.count = 5, .box = kBall, .seed = 3}));
  knives.push_back(roughKnife({{}, {1, 1, 1}}, {.amplitude = 0.02f, .noise = {.frequency = 2}}));
  const PieceLattice lattice{.voxelSize = 0.04f, .box = kBall};
  const CutOptions options{.kerf = 0.01f};
  const Pieces first = cutIntoLevelSets(ball(), lattice, {.fields = knives}, options);
  std::vector<std::size_t> order(knives.size());
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 random(1);
  for (int round = 0; round < 3; ++round) {
    std::shuffle(order.begin(), order.end(), random);
    Knives shuffled;
    for (const std::size_t k : order) shuffled.fields.push_back(knives[k]);
    const Pieces other = cutIntoLevelSets(ball(), lattice, shuffled, options);
    ASSERT_EQ(first.pieces.size(), other.pieces.size());
    EXPECT_EQ(first.sliverVolume, other.sliverVolume);
    for (std::size_t i = 0; i < first.pieces.size(); ++i) {
      EXPECT_TRUE(sameGrid(*first.pieces[i].level->toBricks(), *other.pieces[i].level->toBricks())) << i;
      for (std::size_t k = 0; k < order.size(); ++k)
        EXPECT_EQ(first.pieces[i].code.sides[order[k]], other.pieces[i].code.sides[k]);
    }
  }
}

TEST(PiecesAsLevelSets, AreTheSameAtAnyThreadCount) {
  const Knives knives{.planes = randomBlades({.count = 7, .box = kBall, .seed = 3}),
                      .cells = scatteredPoints(ball(), kBall, 5, 2)};
  std::optional<Pieces> first;
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    Pieces cut = cutIntoLevelSets(ball(), {.voxelSize = 0.05f, .box = kBall}, knives);
    if (!first) first = cut;
    ASSERT_EQ(first->pieces.size(), cut.pieces.size());
    for (std::size_t i = 0; i < cut.pieces.size(); ++i)
      EXPECT_TRUE(sameGrid(*first->pieces[i].level->toBricks(), *cut.pieces[i].level->toBricks()));
  }
}

TEST(PiecesAsLevelSets, AreDisjointAndTheirContactFacesCoincide) {
  const BladePlane blade{{0.03f, -0.02f, 0.01f}, {1, 0.4f, 0.3f}};
  const Pieces cut =
      cutIntoLevelSets(ball(), {.voxelSize = 0.04f, .box = kBall}, {.fields = {flatKnife(blade)}});
  ASSERT_EQ(cut.pieces.size(), 2u);
  for (int k = -30; k <= 30; ++k)
    for (int j = -30; j <= 30; ++j)
      for (int i = -30; i <= 30; ++i)
        ASSERT_FALSE(cut.pieces[0].level->at({i, j, k}) > 0 && cut.pieces[1].level->at({i, j, k}) > 0);
  // Vertices on the blade, away from its rim: the same points on both sides.
  const Vec3d n = normalize(Vec3d(blade.normal));
  const auto onBlade = [&](const Piece& piece) {
    std::vector<Vec3d> points;
    for (const Vec3d& p : marchingCubes(*piece.level->toBricks()).positions)
      if (std::abs(dot(p - Vec3d(blade.point), n)) < 1e-4 && length(p) < 0.9) points.push_back(p);
    std::sort(points.begin(), points.end());
    return points;
  };
  const auto a = onBlade(cut.pieces[0]), b = onBlade(cut.pieces[1]);
  ASSERT_GT(a.size(), 500u);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) ASSERT_LT(length(a[i] - b[i]), 1e-5);
}

TEST(PiecesAsLevelSets, AreClosedAndManifold) {
  const Pieces cut = cutIntoLevelSets(ball(), {.voxelSize = 0.04f, .box = kBall},
                                      {.fields = flat(randomBlades({.count = 9, .box = kBall, .seed = 8}))});
  EXPECT_GT(cut.pieces.size(), 40u);
  for (const Piece& piece : cut.pieces) {
    const Mesh mesh = marchingCubes(*piece.level->toBricks());
    const MeshDiagnosis diagnosis = diagnose(mesh);
    EXPECT_TRUE(diagnosis.manifold());
    EXPECT_GT(diagnosis.volume, 0.04 * 0.04 * 0.04);
    EXPECT_NEAR(diagnosis.volume, piece.level->volume(), 1e-9);
  }
}

TEST(PiecesAsLevelSets, CodesNameTheSides) {
  const std::vector<Knife> knives{flatKnife({{0.05f, 0, 0}, {1, 0, 0}}),
                                  flatKnife({{0, 0.05f, 0}, {0, 1, 0}})};
  const Pieces cut = cutIntoLevelSets(ball(), {.voxelSize = 0.1f, .box = kBall}, {.fields = knives});
  ASSERT_EQ(cut.pieces.size(), 4u);
  for (const Piece& piece : cut.pieces) {
    const Mesh mesh = marchingCubes(*piece.level->toBricks());
    const Vec3f middle = boundingBox(mesh).center();
    EXPECT_EQ(piece.code.sides[0], middle.x > 0.05f);
    EXPECT_EQ(piece.code.sides[1], middle.y > 0.05f);
    EXPECT_FALSE(piece.cell.has_value());
  }
}

TEST(PiecesAsLevelSets, OfOneCodeThatAreApartAreSeparate) {
  // Two balls cut by one plane: four pieces of two codes.
  const ScalarField balls = unionOf(sphere({-1.2f, 0, 0}, 1), sphere({1.2f, 0, 0}, 1));
  const Pieces cut = cutIntoLevelSets(balls, {.voxelSize = 0.05f, .box = {{-2.2f, -1, -1}, {2.2f, 1, 1}}},
                                      {.fields = {flatKnife({{0, 0.02f, 0}, {0, 1, 0}})}});
  ASSERT_EQ(cut.pieces.size(), 4u);
  EXPECT_EQ(cut.codes, 2u);
  for (const Piece& piece : cut.pieces) EXPECT_NEAR(piece.level->volume() / (kBallVolume / 2), 1, 0.04);
}

TEST(PiecesAsLevelSets, OfVoronoiCellsEqualTheirFieldAndFillTheShape) {
  const std::vector<Vec3f> points = scatteredPoints(ball(), kBall, 12, 4);
  constexpr float kVoxel = 0.04f, kBand = 3 * kVoxel;
  const Pieces cut = cutIntoLevelSets(ball(), {.voxelSize = kVoxel, .box = kBall}, {.cells = points});
  ASSERT_EQ(cut.pieces.size(), 12u);
  double volume = 0;
  std::size_t dropped = 0;
  for (const Piece& piece : cut.pieces) {
    ASSERT_TRUE(piece.cell.has_value());
    const ScalarField field = intersection(ball(), voronoiCell(points, *piece.cell));
    for (int k = -28; k <= 28; k += 2)
      for (int j = -28; j <= 28; ++j)
        for (int i = -28; i <= 28; ++i) {
          const Vec3f p = Vec3f(float(i), float(j), float(k)) * kVoxel;
          if (!isNearInside(*piece.level, {i, j, k}, 2)) continue;
          const float v = piece.level->at({i, j, k}), expected = std::clamp(field(p), -kBand, kBand);
          // What belongs to a shell that was dropped is outside.
          if (expected > 0 && v <= 0)
            ++dropped;
          else
            ASSERT_NEAR(v, expected, 1e-6f);
        }
    volume += piece.level->volume();
  }
  EXPECT_LE(dropped, 2 * cut.slivers);
  // 25 voxels per radius, some 30 rims: as for 5 planes, 16 times what 100 voxels allow.
  EXPECT_NEAR(volume / kBallVolume, 1, 0.016);
  const Pieces apart =
      cutIntoLevelSets(ball(), {.voxelSize = kVoxel, .box = kBall}, {.cells = points}, {.kerf = 0.08f});
  EXPECT_EQ(apart.pieces.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i)
    EXPECT_LT(apart.pieces[i].level->volume(), cut.pieces[i].level->volume());
}

TEST(PiecesAsLevelSets, OfAGridHaveItsSamplesBitForBitIfTheirVoxelsAreItsOwn) {
  // 0.1 is no binary number: positions and interpolation would lose bits.
  const float h = 0.1f, band = 3 * h;
  const auto grid = bakeGrid(ball(), {.voxelSize = h, .box = kBall, .band = {-band, band}});
  const Pieces cut = cutIntoLevelSets(gridField(grid), {.voxelSize = h, .box = kBall}, {});
  ASSERT_EQ(cut.pieces.size(), 1u);
  int compared = 0;
  for (int z = -12; z <= 12; ++z)
    for (int y = -12; y <= 12; ++y)
      for (int x = -12; x <= 12; ++x) {
        const float sample = grid->at({x, y, z});
        if (std::abs(sample) >= band) continue;
        ASSERT_EQ(cut.pieces[0].level->at({x, y, z}), sample) << x << " " << y << " " << z;
        ++compared;
      }
  EXPECT_GT(compared, 4000);
}

TEST(PiecesAsLevelSets, SliversAreDroppedAndCounted) {
  // A cap 0.0015 high and 0.055 in radius, less than a voxel, with one sample in it.
  constexpr float kVoxel = 0.0625f;
  const Knife knife = flatKnife({{0.9995f, 0, 0}, {1, 0, 0}});
  const PieceLattice lattice{.voxelSize = kVoxel, .box = kBall.expanded(0.1f)};
  const Knives knives{.fields = {knife}};
  const ScalarField shape = sphere({0.001f, 0, 0}, 1);
  const Pieces cut = cutIntoLevelSets(shape, lattice, knives);
  EXPECT_EQ(cut.codes, 1u);
  EXPECT_EQ(cut.pieces.size(), 1u);
  EXPECT_EQ(cut.slivers, 1u);
  EXPECT_GT(cut.sliverVolume, 0);
  EXPECT_LT(cut.sliverVolume, 0.2 * std::pow(double(kVoxel), 3));
  // Who wants all of it gets it.
  EXPECT_EQ(cutIntoLevelSets(shape, lattice, knives, {.minVolume = 0.0}).pieces.size(), 2u);
  // Everything is a sliver to one who asks for more than there is.
  const Pieces none = cutIntoLevelSets(shape, lattice, knives, {.minVolume = 1e9});
  EXPECT_TRUE(none.pieces.empty());
  EXPECT_EQ(none.codes, 0u);
  EXPECT_EQ(none.slivers, 2u);
  EXPECT_NEAR(none.sliverVolume / kBallVolume, 1, 0.01);
}

TEST(PiecesAsLevelSets, OfTheBunnyKeepItsVoxels) {
  const std::string path = sharedData("meshes/bunny_7k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = readMesh(path);
  const Box around = boundingBox(mesh);
  const float voxel = around.longestSide() / 100;
  const ScalarField level = meshDistance(
      mesh,
      {.voxelSize = double(voxel), .exteriorBand = 4.0 * double(voxel), .interiorBand = 4.0 * double(voxel)});
  const Pieces cut =
      cutIntoLevelSets(level, {.voxelSize = voxel, .box = around},
                       {.fields = flat(randomBlades({.count = 20, .box = around, .seed = 1}))});
  EXPECT_GT(cut.pieces.size(), 100u);
  // Every voxel inside belongs to one piece, or to a sliver.
  const Pieces whole = cutIntoLevelSets(level, {.voxelSize = voxel, .box = around}, {});
  const auto inside = [](const Pieces& pieces) {
    std::size_t count = 0;
    for (const Piece& piece : pieces.pieces)
      count += activeVoxelCount(*piece.level->toBricks(), {0, std::numeric_limits<float>::infinity()});
    return count;
  };
  const std::size_t all = inside(whole), kept = inside(cut);
  EXPECT_LE(kept, all);
  EXPECT_GT(double(kept), 0.99 * double(all));
}

TEST(PiecesAsLevelSets, RefuseWhatMakesNoSense) {
  const auto refused = [](const PieceLattice& lattice, const Knives& knives = {},
                          const CutOptions& options = {}) {
    EXPECT_THROW(cutIntoLevelSets(ball(), lattice, knives, options), Error);
  };
  refused({.voxelSize = 0, .box = kBall});
  refused({.voxelSize = std::numeric_limits<float>::quiet_NaN(), .box = kBall});
  refused({.voxelSize = 0.1f});
  refused({.voxelSize = 1e-6f, .box = kBall});
  refused({.voxelSize = 0.1f, .box = kBall}, {}, {.kerf = -0.1f});
  refused({.voxelSize = 0.1f, .box = kBall}, {}, {.minVolume = -1});
  refused({.voxelSize = 0.1f, .box = kBall, .bandVoxels = 1});
  refused({.voxelSize = 0.1f, .box = kBall}, {.fields = {Knife(ball(), 0.5f)}});
  refused({.voxelSize = 0.1f, .box = kBall}, {.cells = {{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}});
  EXPECT_TRUE(cutIntoLevelSets(ScalarField(-1), {.voxelSize = 0.1f, .box = kBall}, {}).pieces.empty());
  struct Stop : Progress {
    bool cancelled() const override { return true; }
  } stop;
  EXPECT_THROW(cutIntoLevelSets(ball(), {.voxelSize = 0.1f, .box = kBall}, {}, {}, stop), Cancelled);
}

}  // namespace
}  // namespace nephele::test
