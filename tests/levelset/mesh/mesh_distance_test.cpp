#include "nephele/levelset/mesh/mesh_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

struct Points {
  std::vector<float> x, y, z;

  void add(const Vec3f& p) {
    x.push_back(p.x);
    y.push_back(p.y);
    z.push_back(p.z);
  }
  std::size_t size() const { return x.size(); }
  Vec3f operator[](std::size_t i) const { return {x[i], y[i], z[i]}; }
  PointSpans spans() const { return {x, y, z}; }
};

Points randomPoints(const Box& box, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  Points points;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3f t{unit(random), unit(random), unit(random)};
    points.add(box.min + t * box.size());
  }
  return points;
}

TEST(MeshDistance, IsWithinAFewHundredthsOfAVoxelOfASphere) {
  // Closed form r - |x|; the split-5 icosphere lies within 3e-4 of it, 0.015 voxels.
  constexpr float kVoxel = 0.02f;
  const ScalarField distance =
      meshDistance(icosphere(1.0, 5), {.voxelSize = kVoxel, .exteriorBand = 1.0, .interiorBand = 0.12});
  const Points points = randomPoints({{-2, -2, -2}, {2, 2, 2}}, 40000, 1);
  std::vector<float> values(points.size()), gx(points.size()), gy(points.size()), gz(points.size());
  distance.evalGrad(points.spans(), values, {{{gx, gy, gz}}});
  float worst = 0, worstGradient = 0;
  std::size_t inside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float r = length(points[i]), exact = 1.0f - r;
    if (exact < -0.99f || exact > 0.115f) continue;
    ++inside;
    worst = std::max(worst, std::abs(values[i] - exact));
    worstGradient = std::max(worstGradient, length(Vec3f{gx[i], gy[i], gz[i]} + points[i] / r));
  }
  EXPECT_GT(inside, 10000u);
  EXPECT_LT(worst / kVoxel, 0.05f);
  EXPECT_LT(worstGradient, 0.05f);
}

TEST(MeshDistance, BeyondItsBandsIsTheConstantAtTheirEdge) {
  const ScalarField distance =
      meshDistance(icosphere(1.0, 4), {.voxelSize = 0.02, .exteriorBand = 0.3, .interiorBand = 0.1});
  EXPECT_FLOAT_EQ(distance({0, 0, 0}), 0.1f);
  EXPECT_FLOAT_EQ(distance({0.5f, 0, 0}), 0.1f);
  EXPECT_FLOAT_EQ(distance({1.5f, 0, 0}), -0.3f);
  EXPECT_FLOAT_EQ(distance({100.0f, 3.0f, -7.0f}), -0.3f);
}

TEST(MeshDistance, AWiderBandChangesNoValue) {
  // ALGORITHMS 2.3: widths W and W + 6 voxels agree within 0.01 voxel.
  const Mesh mesh = torusMesh(1.0, 0.4, 96, 48);
  constexpr double kVoxel = 0.03;
  for (const double width : {4.0, 9.5, 20.0}) {
    const ScalarField narrow =
        meshDistance(mesh, {.voxelSize = kVoxel, .exteriorBand = width * kVoxel, .interiorBand = 5 * kVoxel});
    const ScalarField wide = meshDistance(
        mesh, {.voxelSize = kVoxel, .exteriorBand = (width + 6) * kVoxel, .interiorBand = 5 * kVoxel});
    const Points points = randomPoints({{-2, -2, -1}, {2, 2, 1}}, 20000, 2);
    std::vector<float> a(points.size()), b(points.size());
    narrow.eval(points.spans(), a);
    wide.eval(points.spans(), b);
    for (std::size_t i = 0; i < points.size(); ++i)
      if (a[i] > -0.99 * width * kVoxel) {
        ASSERT_NEAR(a[i] / kVoxel, b[i] / kVoxel, 0.01) << width;
      }
  }
}

TEST(MeshDistance, ChangesContinuouslyFromLevelToLevel) {
  // Along rays from the centre: steps of 1/20 voxel change the value by no more than their length and a
  // hundredth.
  constexpr double kVoxel = 0.02;
  const ScalarField distance =
      meshDistance(icosphere(1.0, 5), {.voxelSize = kVoxel, .exteriorBand = 1.7, .interiorBand = 0.12});
  const Vec3f direction = normalize(Vec3f{0.6f, -0.3f, 0.74f});
  Points points;
  for (int i = 0; i < 18000; ++i) points.add(direction * (0.98f + float(i) * 0.05f * float(kVoxel)));
  std::vector<float> values(points.size());
  distance.eval(points.spans(), values);
  float worst = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    worst = std::max(worst, std::abs(values[i] - values[i - 1]));
  EXPECT_LT(worst / kVoxel, 0.05f + 0.01f);
}

TEST(MeshDistance, SaysTheSameOfAPointInAnyCompany) {
  // Points are grouped by the levels that have a say there. Alone, each starts from its own; a far one
  // among many near ones passes through all levels.
  const ScalarField distance = meshDistance(torusMesh(1.0, 0.4, 96, 48),
                                            {.voxelSize = 0.02, .exteriorBand = 1.5, .interiorBand = 0.2});
  const Points far = randomPoints({{-3, -3, -2}, {3, 3, 2}}, 3000, 7);
  std::mt19937 random(8);
  std::uniform_real_distribution<float> angle(0.0f, 6.2831f), beside(-0.01f, 0.01f);
  const auto onSurface = [&] {
    const float u = angle(random), v = angle(random), tube = 0.4f + beside(random);
    return Vec3f{(1 + tube * std::cos(v)) * std::cos(u), (1 + tube * std::cos(v)) * std::sin(u),
                 tube * std::sin(v)};
  };
  using Lanes = std::array<std::vector<float>, 4>;
  const auto evaluated = [&](const Points& points) {
    Lanes l;
    for (auto& lane : l) lane.resize(points.size());
    distance.evalGrad(points.spans(), l[0], {{{l[1], l[2], l[3]}}});
    return l;
  };
  constexpr std::size_t kBlock = 256;
  Points lonely;
  for (std::size_t i = 0; i < far.size(); ++i)
    for (std::size_t k = 0; k < kBlock; ++k) lonely.add(k == 3 ? far[i] : onSurface());
  const Lanes together = evaluated(far), amongNear = evaluated(lonely);
  int levels = 0;
  for (std::size_t i = 0; i < far.size(); ++i) {
    Points single;
    single.add(far[i]);
    const Lanes alone = evaluated(single);
    for (std::size_t c = 0; c < 4; ++c) {
      ASSERT_EQ(alone[c][0], together[c][i]);
      ASSERT_EQ(alone[c][0], amongNear[c][i * kBlock + 3]);
    }
    levels |= 1 << int(std::abs(alone[0][0]) / 0.1f);
  }
  // Distances of all sizes up to the band.
  EXPECT_EQ(levels & 0x7ff, 0x7ff);
}

TEST(MeshDistance, RangeTellsThatABoxLiesBeyondTheBands) {
  const ScalarField distance = meshDistance(torusMesh(1.0, 0.4, 96, 48),
                                            {.voxelSize = 0.02, .exteriorBand = 0.7, .interiorBand = 0.1});
  // 1.2 from the torus, with three voxels of the coarsest level (8 fine ones) in hand.
  const Interval outside = distance.range({{-0.1f, -0.1f, 1.6f}, {0.1f, 0.1f, 1.8f}});
  EXPECT_EQ(outside, Interval::of(-0.7f));
}

TEST(MeshDistance, RangeContainsItsValuesAndRestrictionKeepsThem) {
  const ScalarField distance = meshDistance(torusMesh(1.0, 0.4, 96, 48),
                                            {.voxelSize = 0.02, .exteriorBand = 0.7, .interiorBand = 0.1});
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-2.0f, 2.0f), extent(0.01f, 0.5f);
  for (int k = 0; k < 60; ++k) {
    const Vec3f low{place(random), place(random), 0.6f * place(random)};
    const Box box{low, low + Vec3f{extent(random), extent(random), extent(random)}};
    const Interval range = distance.range(box);
    const ScalarField local = distance.restrictedTo(box);
    const Points points = randomPoints(box, 400, unsigned(k));
    std::vector<float> values(points.size()), localValues(points.size());
    distance.eval(points.spans(), values);
    local.eval(points.spans(), localValues);
    for (std::size_t i = 0; i < points.size(); ++i) {
      ASSERT_TRUE(range.contains(values[i])) << values[i] << " not in " << range.min << " .. " << range.max;
      ASSERT_EQ(values[i], localValues[i]);
    }
    // Not wider than the way across the box and the coarsest voxel there (8 fine ones) allow.
    EXPECT_LE(range.max - range.min, 1.01f * length(box.size()) + 4 * 8 * 0.02f + 1e-4f);
  }
}

TEST(MeshDistance, OfARealMeshStaysNearTheExactDistance) {
  const std::string path = sharedData("meshes/bunny_7k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = triangulated(readMesh(path));
  const float side = boundingBox(mesh).longestSide(), voxel = side / 160;
  const ScalarField distance =
      meshDistance(mesh, {.voxelSize = voxel, .exteriorBand = 0.17 * side, .interiorBand = 6.0 * voxel});
  const NearestOnMesh exact(mesh);
  const Points points = randomPoints(boundingBox(mesh).expanded(0.15f * side), 20000, 5);
  std::vector<float> values(points.size());
  distance.eval(points.spans(), values);
  std::vector<float> errors;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto hit = exact.nearest(points[i], 10 * side);
    ASSERT_TRUE(hit.has_value());
    if (values[i] >= 5.9f * voxel || hit->distance > 0.165f * side) continue;
    errors.push_back(std::abs(std::abs(values[i]) - hit->distance) / voxel);
  }
  std::sort(errors.begin(), errors.end());
  ASSERT_GT(errors.size(), 5000u);
  // Bar: 0.05 away from the medial axis; the last hundredths of the points lie on its ridges.
  EXPECT_LT(errors[errors.size() / 2], 0.02f);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.1f);
}

TEST(MeshDistance, RefusesWrongArguments) {
  const Mesh mesh = icosphere(1.0, 1);
  EXPECT_THROW(meshDistance(mesh, {.voxelSize = 0.0, .exteriorBand = 1, .interiorBand = 1}), Error);
  EXPECT_THROW(meshDistance(mesh, {.voxelSize = 0.1, .exteriorBand = 0, .interiorBand = 1}), Error);
  EXPECT_THROW(meshDistance(Mesh{}, {.voxelSize = 0.1, .exteriorBand = 1, .interiorBand = 1}), Error);
}

TEST(MeshDistance, RefusesABandThatNoGridCanHold) {
  const Mesh mesh = icosphere(1.0, 1);
  for (const double width : {1e6, 1e12, 1e300})
    EXPECT_THROW(meshDistance(mesh, {.voxelSize = 0.1, .exteriorBand = width, .interiorBand = 1}), Error);
}

TEST(MeshDistance, UsesNoMoreOfABandThanThereIsInsideTheMesh) {
  // The inscribed sphere of this icosphere has a radius of 1 to within 0.002; coarse levels round its ridge,
  // the centre, over a voxel of theirs: 8 fine ones at this depth of 50.
  const ScalarField distance =
      meshDistance(icosphere(1.0, 4), {.voxelSize = 0.02, .exteriorBand = 0.1, .interiorBand = 1e300});
  EXPECT_NEAR(distance({0.5f, 0, 0}), 0.5f, 0.005f);
  EXPECT_NEAR(distance({0, 0, 0}), 1.0f, 0.16f);
}

/// Nearest point by trying a fine sampling of barycentrics refined by projection: double precision, all
/// triangles.
double bruteForceDistance(const Mesh& mesh, const Vec3d& p) {
  double best = INFINITY;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const Vec3d a = mesh.positions[mesh.face(f)[0]], b = mesh.positions[mesh.face(f)[1]],
                c = mesh.positions[mesh.face(f)[2]];
    const Vec3d n = cross(b - a, c - a);
    const auto onSide = [&](const Vec3d& u, const Vec3d& v) {
      const double t = std::clamp(dot(p - u, v - u) / dot(v - u, v - u), 0.0, 1.0);
      return length(p - (u + (v - u) * t));
    };
    double d = std::min({onSide(a, b), onSide(b, c), onSide(c, a)});
    if (dot(cross(n, b - a), p - a) >= 0 && dot(cross(n, c - b), p - b) >= 0 &&
        dot(cross(n, a - c), p - c) >= 0)
      d = std::min(d, std::abs(dot(n, p - a)) / length(n));
    best = std::min(best, d);
  }
  return best;
}

TEST(ClosestPoint, IsAsNearAsTryingEveryTriangle) {
  // Far from the origin, where floats of the world would be too coarse for the mesh.
  const Vec3d offset(1000, 2000, -500);
  const Mesh mesh = icosphere(1.0, 3, offset);
  const VectorField nearest = closestPoint(mesh);
  const Points points =
      randomPoints({Vec3f(offset) - Vec3f{2, 2, 2}, Vec3f(offset) + Vec3f{2, 2, 2}}, 300, 11);
  std::vector<float> x(points.size()), y(points.size()), z(points.size());
  nearest.eval(points.spans(), {{x, y, z}});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double reached = length(Vec3d(points[i]) - Vec3d(Vec3f{x[i], y[i], z[i]}));
    EXPECT_NEAR(reached, bruteForceDistance(mesh, Vec3d(points[i])), 2e-4);  // Ulp of 2000: 1.2e-4.
  }
}

TEST(ClosestPoint, SliversAreNoExceptions) {
  // A fan of needles of width 1e-5, and triangles without area, against trying each.
  Mesh mesh;
  std::mt19937 random(17);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < 400; ++i) {
    const auto first = std::uint32_t(mesh.positions.size());
    const Vec3d a(unit(random), unit(random), unit(random)), b(unit(random), unit(random), unit(random));
    const double width = i % 5 == 0 ? 0.0 : 1e-5;
    mesh.positions.insert(mesh.positions.end(), {a, b, (a + b) * 0.5 + Vec3d(width, -width, 0.3 * width)});
    mesh.addFace(std::array<std::uint32_t, 3>{first, first + 1, first + 2});
  }
  const VectorField nearest = closestPoint(mesh);
  const Points points = randomPoints({{-2, -2, -2}, {2, 2, 2}}, 300, 12);
  std::vector<float> x(points.size()), y(points.size()), z(points.size());
  nearest.eval(points.spans(), {{x, y, z}});
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_NEAR(length(Vec3d(points[i]) - Vec3d(Vec3f{x[i], y[i], z[i]})),
                bruteForceDistance(mesh, Vec3d(points[i])), 3e-6);
}

// Powers of two round nothing, so that all is the same but for the unit.
TEST(ClosestPoint, OfTinyAndVastMeshesIsThatOfOthersScaled) {
  const Mesh mesh = icosphere(1.0, 3);
  const VectorField nearest = closestPoint(mesh);
  const Points points = randomPoints({{-2, -2, -2}, {2, 2, 2}}, 100, 13);
  for (const int power : {-90, -30, 50}) {
    Mesh scaled = mesh;
    for (Vec3d& p : scaled.positions) p = p * std::ldexp(1.0, power);
    const VectorField nearestOfScaled = closestPoint(scaled);
    const float unit = std::ldexp(1.0f, power);
    for (std::size_t i = 0; i < points.size(); ++i)
      EXPECT_EQ(nearestOfScaled(points[i] * unit), nearest(points[i]) * unit) << power;
  }
}

TEST(ClosestPoint, OfPointsThatAreNotFiniteIsNan) {
  const VectorField nearest = closestPoint(icosphere(1.0, 1));
  EXPECT_TRUE(std::isnan(nearest({NAN, 0, 0}).x));
  EXPECT_NEAR(length(nearest({3, 0, 0})), 1.0f, 0.2f);
}

TEST(ClosestPoint, RangeIsTheBoxOfTheMesh) {
  const VectorField nearest = closestPoint(boxMesh({-1, -2, -3}, {1, 2, 3}));
  const Box box = boxOf(nearest.range(Box::everywhere()));
  EXPECT_TRUE(box.contains(Vec3f{1, 2, 3}));
  EXPECT_LT(box.max.z, 3.01f);
}

TEST(ClosestPoint, RefusesAnEmptyMesh) {
  EXPECT_THROW(closestPoint(Mesh{}), Error);
}

}  // namespace
}  // namespace nephele::test
