// Measures of maps between surfaces.
#include "nephele/levelset/warp/transfer_quality.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "nephele/modeling/base/error.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

std::vector<Vec3d> mapped(const Mesh& mesh, const std::function<Vec3d(const Vec3d&)>& map) {
  std::vector<Vec3d> images;
  for (const Vec3d& p : mesh.positions) images.push_back(map(p));
  return images;
}

Mesh turnedInsideOut(Mesh mesh) {
  for (std::size_t f = 0; f < mesh.faceCount(); ++f)
    std::reverse(mesh.corners.begin() + mesh.faceStart[f], mesh.corners.begin() + mesh.faceStart[f + 1]);
  return mesh;
}

TEST(TransferQuality, OfTheIdentityIsPerfect) {
  const Mesh sphere = icosphere(2, 3);
  const TransferQuality q = transferQuality(sphere, sphere, sphere.positions);
  EXPECT_EQ(q.triangleCount, 1280u);
  EXPECT_EQ(q.flippedFraction, 0);
  EXPECT_EQ(q.degenerateFraction, 0);
  EXPECT_NEAR(q.stretchMedian, 1, 1e-6);
  EXPECT_NEAR(q.stretchP95, 1, 1e-6);
  EXPECT_EQ(q.coverage, 1);
}

TEST(TransferQuality, DoesNotDependOnSizePlaceAndTurn) {
  const Mesh sphere = icosphere(1, 3);
  const auto similar = [](const Vec3d& p) { return Vec3d{-p.z, p.y, p.x} * 1000.0 + Vec3d{1e6, 0, -1e6}; };
  Mesh far = sphere;
  for (Vec3d& p : far.positions) p = similar(p);
  for (const auto& q :
       {transferQuality(far, sphere, far.positions), transferQuality(sphere, far, sphere.positions)}) {
    EXPECT_EQ(q.flippedFraction, 0);
    EXPECT_EQ(q.degenerateFraction, 0);
    EXPECT_NEAR(q.stretchP95, 1, 1e-6);
    EXPECT_EQ(q.coverage, 1);
  }
}

TEST(TransferQuality, SeesThatAMirrorTurnsEverythingOver) {
  const Mesh sphere = icosphere(1, 3);
  const auto mirror = [](const Vec3d& p) { return Vec3d{-p.x, p.y, p.z}; };
  const TransferQuality q = transferQuality(sphere, sphere, mapped(sphere, mirror));
  EXPECT_EQ(q.flippedFraction, 1);
  EXPECT_EQ(q.degenerateFraction, 0);
  EXPECT_NEAR(q.stretchP95, 1, 1e-6);
  EXPECT_EQ(q.coverage, 1);
}

TEST(TransferQuality, TakesMeshesThatAreInsideOutTheRightWayRound) {
  const Mesh sphere = icosphere(1, 3), inverted = turnedInsideOut(sphere);
  EXPECT_EQ(transferQuality(inverted, sphere, sphere.positions).flippedFraction, 0);
  EXPECT_EQ(transferQuality(sphere, inverted, sphere.positions).flippedFraction, 0);
  EXPECT_EQ(transferQuality(inverted, inverted, sphere.positions).flippedFraction, 0);
}

// A square of n x n quads over [0, 1]^2 at z = 0, facing +z.
Mesh square(int n) {
  Mesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) mesh.positions.push_back({double(i) / n, double(j) / n, 0});
  const auto id = [n](int i, int j) { return std::uint32_t(j * (n + 1) + i); };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      mesh.addFace(std::array<std::uint32_t, 4>{id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)});
  return mesh;
}

TEST(TransferQuality, MeasuresStretchAndCoverageOfALinearMap) {
  // Lengths times 1/4 along x and 1/2 along y: s1 / s2 = 2, an eighth of the area.
  const Mesh plane = square(32);
  const auto squeeze = [](const Vec3d& p) { return Vec3d{0.25 * p.x + 0.3, 0.5 * p.y + 0.2, 0}; };
  const TransferQuality q = transferQuality(plane, plane, mapped(plane, squeeze));
  EXPECT_EQ(q.triangleCount, 2048u);
  EXPECT_NEAR(q.stretchMedian, 2, 1e-9);
  EXPECT_NEAR(q.stretchP95, 2, 1e-9);
  EXPECT_EQ(q.flippedFraction, 0);
  // 16384 samples, a rim of one sample's width: 1.5 / 128.
  EXPECT_NEAR(q.coverage, 0.125, 0.003);
}

TEST(TransferQuality, CountsWhatCollapsesAndWhatFolds) {
  // x > 3/4 folds back, x < 1/4 collapses onto a line, all on lines of the grid.
  const Mesh plane = square(32);
  const auto map = [](const Vec3d& p) {
    const double x = p.x > 0.75 ? 1.5 - p.x : std::max(p.x, 0.25);
    return Vec3d{x, p.y, 0};
  };
  const TransferQuality q = transferQuality(plane, plane, mapped(plane, map));
  EXPECT_NEAR(q.degenerateFraction, 0.25, 1e-12);
  EXPECT_NEAR(q.flippedFraction, 0.25, 1e-12);
  EXPECT_NEAR(q.coverage, 0.5, 0.003);
  EXPECT_EQ(q.stretchMedian, 1);
  EXPECT_GE(q.stretchP95, 1e5);
}

TEST(TransferQuality, SaysWhereMostOfItIsBad) {
  // As above: of x > 3/4 and x < 1/4 the two regions are equal strips; with 3/16 the first is the larger one,
  // and its middle is (7/8, 1/2). What is not covered is x < 3/16 and, by folding back, x > 3/4.
  const Mesh plane = square(32);
  const auto map = [](const Vec3d& p) {
    const double x = p.x > 0.75 ? 1.5 - p.x : std::max(p.x, 0.1875);
    return Vec3d{x, p.y, 0};
  };
  const TransferQuality q = transferQuality(plane, plane, mapped(plane, map));
  EXPECT_NEAR(q.badFraction, 0.25 + 0.1875, 1e-6);
  EXPECT_NEAR(q.worst.share, 0.25, 1e-6);
  EXPECT_NEAR(length(q.worst.middle - Vec3d{0.875, 0.5, 0}), 0, 1e-6);
  EXPECT_NEAR(q.uncovered.share, 0.25, 1.5 / 32);
  EXPECT_NEAR(length(q.uncovered.middle - Vec3d{0.875, 0.5, 0}), 0, 1.5 / 32);
  ASSERT_EQ(q.stretch.size(), 2048u);
  ASSERT_EQ(q.isCovered.size(), 2048u);
  EXPECT_EQ(std::ranges::count_if(q.stretch, [](float s) { return std::isinf(s); }), 2048 * 7 / 16);
  const TransferQuality same = transferQuality(plane, plane, plane.positions);
  EXPECT_EQ(same.worst.share, 0);
  EXPECT_EQ(same.uncovered.share, 0);
  EXPECT_EQ(same.badFraction, 0);
}

TEST(TransferQuality, CoverageKeepsTheTwoSidesOfASheetApart) {
  // A thin slab; only its upper half is mapped to.
  const Mesh slab = boxMesh({0, 0, 0}, {1, 1, 0.01}), plane = square(8);
  const auto up = [](const Vec3d& p) { return Vec3d{p.x, p.y, 0.01}; };
  const double sides = 4 * 0.01, whole = 2 + sides;
  // Smooth normals lean outwards near the rim, so some of the sides counts too.
  EXPECT_NEAR(transferQuality(slab, plane, mapped(plane, up)).coverage, 1 / whole, sides / whole);
}

TEST(TransferQuality, TakesImagesOfCornersToo) {
  // Every face of a soup mapped for itself: the same as by positions.
  const Mesh sphere = icosphere(1, 2);
  std::vector<Vec3d> corners;
  for (const std::uint32_t v : sphere.corners) corners.push_back(sphere.positions[v] * 1.0);
  const TransferQuality q = transferQuality(sphere, sphere, corners);
  EXPECT_EQ(q.flippedFraction, 0);
  EXPECT_EQ(q.coverage, 1);
}

TEST(TransferQuality, LeavesOutTrianglesWithoutArea) {
  Mesh sphere = icosphere(1, 1);
  sphere.addFace(std::array<std::uint32_t, 3>{0, 0, 1});
  sphere.addFace(std::array<std::uint32_t, 3>{2, 2, 2});
  const TransferQuality q = transferQuality(sphere, sphere, sphere.positions);
  EXPECT_EQ(q.triangleCount, 80u);
  EXPECT_EQ(q.degenerateFraction, 0);
}

TEST(TransferQuality, OfAMapToOnePointIsFiniteAndBad) {
  const Mesh sphere = icosphere(1, 2);
  const TransferQuality q =
      transferQuality(sphere, sphere, std::vector<Vec3d>(sphere.positions.size(), Vec3d{1, 0, 0}));
  EXPECT_EQ(q.degenerateFraction, 1);
  EXPECT_EQ(q.flippedFraction, 0);
  EXPECT_EQ(q.coverage, 0);
  EXPECT_EQ(q.stretchMedian, 1e6);
}

TEST(TransferQuality, RefusesWhatCannotBeMeasured) {
  const Mesh sphere = icosphere(1, 1);
  EXPECT_THROW(transferQuality(sphere, sphere, std::vector<Vec3d>(3)), Error);
  std::vector<Vec3d> images = sphere.positions;
  images[5].y = NAN;
  EXPECT_THROW(transferQuality(sphere, sphere, images), Error);
  EXPECT_THROW(transferQuality(Mesh{}, sphere, sphere.positions), Error);
  EXPECT_THROW(transferQuality(sphere, Mesh{}, {}), Error);
}

}  // namespace
}  // namespace nephele::test
