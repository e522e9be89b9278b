#include "nephele/levelset/mesh/subdivision.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>

#include "nephele/levelset/mesh/decimation.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/levelset/mesh/smoothing.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

using test::topologyOf;

TEST(Subdivision, OctahedronFollowsLoopsRules) {
  const Mesh once = subdivided(test::octahedron(), 1);
  ASSERT_EQ(once.positions.size(), 18u);
  ASSERT_EQ(once.faceCount(), 32u);
  EXPECT_TRUE(topologyOf(once).isClosedManifold());
  EXPECT_GT(signedVolume(once), 0);
  // Four neighbours whose sum is 0: the share that stays is 1 - (40 - (3 + 2 cos 90 deg)^2) / 64 = 33 / 64.
  for (std::size_t v = 0; v < 6; ++v) EXPECT_NEAR(length(once.positions[v]), 33.0 / 64, 1e-15);
  // Of an edge: 3/8 of both ends; those opposite are each other's negative.
  for (std::size_t v = 6; v < 18; ++v) EXPECT_NEAR(length(once.positions[v]), std::sqrt(2.0) * 3 / 8, 1e-15);
}

TEST(Subdivision, ManyNeighboursFollowTheSameRule) {
  // A double cone about 80 points, whose tips have 80 neighbours.
  constexpr std::uint32_t kAround = 80;
  Mesh cone;
  for (std::uint32_t i = 0; i < kAround; ++i)
    cone.positions.emplace_back(std::cos(2 * M_PI * i / kAround), std::sin(2 * M_PI * i / kAround), 0.0);
  cone.positions.emplace_back(0, 0, 1);
  cone.positions.emplace_back(0, 0, -1);
  for (std::uint32_t i = 0; i < kAround; ++i) {
    const std::uint32_t j = (i + 1) % kAround;
    cone.addFace(std::array{i, j, kAround});
    cone.addFace(std::array{j, i, kAround + 1});
  }
  const Mesh once = subdivided(cone, 1);
  const double t = 3 + 2 * std::cos(2 * M_PI / kAround), share = (40 - t * t) / 64;
  EXPECT_NEAR(once.positions[kAround].z, 1 - share, 1e-14);
}

TEST(Subdivision, BordersAreCurvesOfTheirOwn) {
  Mesh square;
  square.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  square.addFace(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  const Mesh once = subdivided(square, 1);
  // 3/4 of the corner and 1/8 of its neighbours on the border.
  EXPECT_EQ(once.positions[0], Vec3d(0.125, 0.125, 0));
  EXPECT_EQ(once.faceCount(), 8u);
}

TEST(Subdivision, TextureCoordinatesAndGroupsFollow) {
  Mesh box = test::boxMesh({0, 0, 0}, {1, 1, 1});
  box.groups = {{"bottom", 0, 2}, {"rest", 2, 10}};
  // Every face has a chart of its own, the lower left half of the unit square.
  MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}};
  for (int f = 0; f < 12; ++f) uv.values.insert(uv.values.end(), {0, 0, 1, 0, 0, 1});
  box.attributes.push_back(uv);
  const Mesh twice = subdivided(box, 2);
  ASSERT_EQ(twice.faceCount(), 12u * 16);
  EXPECT_EQ(twice.groups[1].firstFace, 32u);
  EXPECT_EQ(twice.groups[1].faceCount, 160u);
  const std::vector<float>& values = twice.attributes[0].values;
  for (std::size_t f = 0; f < twice.faceCount(); ++f) {
    const auto at = [&](std::size_t k, std::size_t axis) { return values[6 * f + 2 * k + axis]; };
    // A sixteenth of the half, turned as it was.
    EXPECT_EQ((at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(1, 1) - at(0, 1)) * (at(2, 0) - at(0, 0)),
              1.0f / 16);
  }
}

TEST(Subdivision, RefusesWhatItCannotDo) {
  EXPECT_EQ(subdivided(test::octahedron(), 0).faceCount(), 8u);
  EXPECT_THROW(subdivided(test::octahedron(), -1), Error);
  EXPECT_THROW(subdivided(test::octahedron(), 15), Error);
  EXPECT_THROW(subdivided(Mesh{}, 1), Error);
  const Mesh touching =
      test::joined(test::boxMesh({0, 0, 0}, {1, 1, 1}), test::boxMesh({1, 1, 1}, {2, 2, 2}));
  EXPECT_THROW(subdivided(touching, 1), Error);
}

TEST(Smoothing, NoiseGoesAndTheVolumeStays) {
  Mesh ball = test::icosphere(1.0, 4);
  const double volume = signedVolume(ball);
  std::uint32_t state = 1;
  for (Vec3d& p : ball.positions) {
    state = state * 1664525u + 1013904223u;
    p *= 1 + 0.02 * (double(state >> 8) / double(1 << 23) - 1);
  }
  const auto roughness = [](const Mesh& mesh) {
    double sum = 0;
    for (const Vec3d& p : mesh.positions) sum += (length(p) - 1) * (length(p) - 1);
    return std::sqrt(sum / double(mesh.positions.size()));
  };
  const Mesh result = smoothed(ball, {.rounds = 20});
  // Random bumps have waves of all lengths, and a fifth of their power at most is in those that pass.
  EXPECT_LT(roughness(result), 0.45 * roughness(ball));
  EXPECT_NEAR(signedVolume(result) / volume, 1, 0.005);
  EXPECT_EQ(result.corners, ball.corners);
}

TEST(Smoothing, ClosedPartsKeepTheirVolumeAtAnySizeOfTriangles) {
  // The filter alone leaves a cube of 8 vertices 0.7 % of its volume, and doubles that of a ball in a
  // thousand rounds.
  Mesh far = test::icosphere(0.1, 3);
  for (Vec3d& p : far.positions) p += Vec3d{5, 5, 5};
  const Mesh both = test::joined(test::boxMesh({0, 0, 0}, {1, 1, 3}), far);
  for (const int rounds : {1, 10, 1000}) {
    const Mesh result = smoothed(both, {.rounds = rounds});
    Mesh box = test::boxMesh({0, 0, 0}, {1, 1, 3}), ball = test::icosphere(0.1, 3);
    const auto at = std::ptrdiff_t(box.positions.size());
    box.positions.assign(result.positions.begin(), result.positions.begin() + at);
    ball.positions.assign(result.positions.begin() + at, result.positions.end());
    EXPECT_NEAR(signedVolume(box), 3, 1e-6) << rounds;
    EXPECT_NEAR(signedVolume(ball) / signedVolume(far), 1, 1e-6) << rounds;
    // A ball stays one, where it is, but for its twelve vertices of five edges, which come to stand out a
    // little.
    for (const Vec3d& p : ball.positions) EXPECT_NEAR(length(p - Vec3d{5, 5, 5}), 0.1, 0.004) << rounds;
  }
}

TEST(Smoothing, EqualPositionsStayTogetherAndPolygonsPolygons) {
  Mesh soup = test::unshared(test::icosphere(1.0, 3));
  const Mesh result = smoothed(soup, {.rounds = 5});
  const Mesh joined = smoothed(test::icosphere(1.0, 3), {.rounds = 5});
  ASSERT_EQ(result.positions.size(), soup.positions.size());
  for (std::size_t c = 0; c < soup.corners.size(); ++c)
    EXPECT_LT(length(result.positions[result.corners[c]] - joined.positions[joined.corners[c]]), 1e-13);
}

TEST(Smoothing, BordersAreSmoothedAlongThemselves) {
  // A flat sheet stays in its plane and within its border.
  Mesh square;
  square.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
  square.addFace(std::array<std::uint32_t, 4>{0, 1, 4, 3});
  square.addFace(std::array<std::uint32_t, 4>{1, 2, 5, 4});
  const Mesh result = smoothed(square, {.rounds = 1});
  // The middle of a straight border stays where it is in the first step, in which the corners move by a
  // quarter each way; the second takes it out by 0.5263 of that.
  EXPECT_NEAR(length(result.positions[1] - Vec3d(1, -0.25 / 1.9, 0)), 0, 1e-12);
  for (const Vec3d& p : result.positions) EXPECT_EQ(p.z, 0);
  EXPECT_THROW(smoothed(square, {.rounds = 0}), Error);
}

// Half-edges, diagnoses and trees of large meshes take most of a second: work that is cancelled between two
// of its looks ends at the next one, whichever that is, and the first looks are before a round or turn is
// done.
TEST(MeshProcessing, StopsWhileItPreparesItself) {
  struct Stop final : Progress {
    explicit Stop(int count) : after(count) {}
    int after;
    mutable std::atomic<int> looks{0}, advances{0};
    bool cancelled() const override { return ++looks > after; }
    void advance(double) const override { ++advances; }
  };
  const Mesh ball = test::icosphere(1.0, 5);
  const std::function<void(const Progress&)> all[] = {
      [&](const Progress& p) { diagnose(ball, p); },
      [&](const Progress& p) { NearestOnMesh(ball, p); },
      [&](const Progress& p) { smoothed(ball, {.rounds = 1}, p); },
      [&](const Progress& p) { subdivided(ball, 1, p); },
      [&](const Progress& p) { decimate(ball, {.faces = 100}, p); },
  };
  const int expected[] = {5, 2, 10, 10, 10};
  for (std::size_t i = 0; i < std::size(all); ++i)
    for (int after = 0; after < expected[i]; ++after) {
      const Stop stop(after);
      EXPECT_THROW(all[i](stop), Cancelled) << i << ", look " << after;
      EXPECT_EQ(stop.advances, 0) << i << ", look " << after;
    }
}

}  // namespace
}  // namespace nephele
