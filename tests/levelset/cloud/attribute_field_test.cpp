#include "nephele/levelset/cloud/attribute_field.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/check_field.h"
#include "tests/support/message_of.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

using Spread = AttributeFieldOptions::Spread;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// `mesh` with a vertex attribute of one number, from a function of the position.
template <class F>
Mesh painted(Mesh mesh, const std::string& name, const F& function) {
  MeshAttribute attribute{name, MeshAttribute::Domain::vertex, 1, {}};
  for (const Vec3d& p : mesh.positions) attribute.values.push_back(float(function(p)));
  mesh.attributes.push_back(std::move(attribute));
  return mesh;
}

/// A square in the plane y = 0 from -1 to 1, `n` by `n` cells of two triangles.
Mesh plane(int n) {
  Mesh mesh;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) mesh.positions.push_back({2.0 * i / n - 1, 0, 2.0 * j / n - 1});
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const auto v = [&](int di, int dj) { return std::uint32_t((j + dj) * (n + 1) + i + di); };
      mesh.addFace(std::array<std::uint32_t, 3>{v(0, 0), v(0, 1), v(1, 1)});
      mesh.addFace(std::array<std::uint32_t, 3>{v(0, 0), v(1, 1), v(1, 0)});
    }
  return mesh;
}

double wave(const Vec3d& p) {
  return 0.5 + 0.5 * std::sin(5 * p.x + 1) * std::cos(4 * p.y) * std::sin(3 * p.z + 2);
}

TEST(AttributeField, NamesPartsOfWideAttributesAndLeavesCornersOut) {
  Mesh mesh = painted(icosphere(1, 0), "billow", [](const Vec3d& p) { return p.x; });
  const std::size_t n = mesh.positions.size();
  mesh.attributes.push_back({"color", MeshAttribute::Domain::vertex, 4, std::vector<float>(4 * n)});
  mesh.attributes.push_back({"flow", MeshAttribute::Domain::vertex, 3, std::vector<float>(3 * n)});
  mesh.attributes.push_back({"bones", MeshAttribute::Domain::vertex, 5, std::vector<float>(5 * n)});
  mesh.attributes.push_back(
      {"uv", MeshAttribute::Domain::corner, 2, std::vector<float>(2 * mesh.corners.size())});
  const std::vector<std::string> expected{"billow",  "color.r", "color.g", "color.b", "color.a",
                                          "flow.x",  "flow.y",  "flow.z",  "bones.0", "bones.1",
                                          "bones.2", "bones.3", "bones.4"};
  EXPECT_EQ(attributeNames(mesh), expected);
}

TEST(AttributeField, ReadsThePartThatTheNameStandsFor) {
  Mesh mesh = icosphere(1, 0);
  MeshAttribute color{"color", MeshAttribute::Domain::vertex, 3, {}};
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    color.values.insert(color.values.end(), {0.25f, 0.5f, 0.75f});
  mesh.attributes.push_back(color);
  EXPECT_EQ(attributeField(mesh, "color.r")({0, 0, 2}), 0.25f);
  EXPECT_EQ(attributeField(mesh, "color.g")({0, 0, 2}), 0.5f);
  EXPECT_EQ(attributeField(mesh, "color.b")({0, 0, 2}), 0.75f);
}

TEST(AttributeField, RefusesUnknownNamesWithTheKnownOnes) {
  Mesh mesh = painted(icosphere(1, 0), "billow", [](const Vec3d&) { return 1; });
  EXPECT_EQ(messageOf([&] { attributeField(mesh, "bilow"); }),
            "the mesh has no vertex attribute 'bilow'; it has billow");
  mesh.attributes.push_back(
      {"uv", MeshAttribute::Domain::corner, 2, std::vector<float>(2 * mesh.corners.size())});
  EXPECT_EQ(messageOf([&] { attributeField(mesh, "uv.x"); }),
            "the mesh has no vertex attribute 'uv.x'; it has billow (per corner, which will not do: uv)");
  EXPECT_EQ(messageOf([] { attributeField(icosphere(1, 0), "a"); }),
            "the mesh has no vertex attribute 'a'; it has none");
}

TEST(AttributeField, RefusesValuesThatAreNotFiniteWhereFacesUseThem) {
  Mesh mesh = painted(icosphere(1, 0), "a", [](const Vec3d& p) { return p.x; });
  mesh.attributes[0].values[3] = kNan;
  mesh.attributes[0].values[7] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(messageOf([&] { attributeField(mesh, "a"); }),
            "attribute 'a' is not finite at 2 of 12 vertices, first at vertex 3");
  // A vertex of no face has no say.
  Mesh spare = painted(icosphere(1, 0), "a", [](const Vec3d&) { return 2; });
  spare.positions.push_back({5, 5, 5});
  spare.attributes[0].values.push_back(kNan);
  EXPECT_EQ(attributeField(spare, "a")({1, 2, 3}), 2.0f);
}

TEST(AttributeField, RefusesMeshesAndOptionsThatWillNotDo) {
  const Mesh mesh = painted(icosphere(1, 0), "a", [](const Vec3d& p) { return p.x; });
  EXPECT_THROW(attributeField(Mesh{}, "a"), Error);
  Mesh quad;
  quad.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  quad.addFace(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  EXPECT_THROW(attributeField(quad, "a"), Error);
  EXPECT_EQ(messageOf([&] { attributeField(mesh, "a", {.radius = -1}); }),
            "attribute field: radius must be >= 0, got -1");
  EXPECT_EQ(messageOf([&] { attributeField(mesh, "a", {.voxelSize = kNan}); }),
            "attribute field: voxelSize must be >= 0, got nan");
  EXPECT_EQ(messageOf([&] { attributeField(mesh, "a", {.voxelSize = 0.1f, .band = -2}); }),
            "attribute field: band must be >= 0, got -2");
  EXPECT_THROW(attributeField(mesh, "a", {.voxelSize = 1e-5f, .band = 1}), Error);
  EXPECT_THROW(facingField(mesh, {0, 0, 0}), Error);
  EXPECT_THROW(facingField(mesh, {kNan, 0, 1}), Error);
}

TEST(AttributeField, ConstantAttributeIsThatConstant) {
  const Mesh mesh = painted(icosphere(1, 2), "a", [](const Vec3d&) { return 0.1f; });
  for (const Spread spread : {Spread::closest, Spread::spheres})
    for (const float voxel : {0.0f, 0.1f}) {
      const ScalarField field =
          attributeField(mesh, "a", {.spread = spread, .voxelSize = voxel, .band = 0.3f});
      EXPECT_EQ(field({0.3f, 0.9f, 7.0f}), 0.1f);
      EXPECT_EQ(field.range(Box::everywhere()), Interval::of(0.1f));
    }
}

TEST(AttributeField, ClosestIsLinearOverAPlane) {
  // Closed form: the foot of a point above the square is (x, 0, z), clamped to the square's rim.
  const auto linear = [](const Vec3d& p) { return 2 * p.x - 3 * p.z + 0.5; };
  const ScalarField field = attributeField(painted(plane(7), "a", linear), "a");
  std::mt19937 random(1);
  const Points points = randomPoints({{-1.5f, -2, -1.5f}, {1.5f, 2, 1.5f}}, 3000, random);
  const Values<float> values = evaluate(field, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3d p(points[i]);
    const double expected = linear({std::clamp(p.x, -1.0, 1.0), 0, std::clamp(p.z, -1.0, 1.0)});
    // Squared distances in floats tell feet apart that are sqrt(2^-23) of the distance from each other.
    const double foot =
        std::sqrt(0x1p-23) * length(p - Vec3d{std::clamp(p.x, -1.0, 1.0), 0, std::clamp(p.z, -1.0, 1.0)});
    ASSERT_NEAR(values.data[0][i], expected, 5e-6 + std::sqrt(13.0) * foot) << i;
  }
}

TEST(AttributeField, KeepsWhatEveryFieldPromises) {
  const Mesh mesh = painted(torusMesh(1, 0.4, 40, 20), "a", wave);
  const Box box{{-1.6f, -1.6f, -0.7f}, {1.6f, 1.6f, 0.7f}};
  for (const Spread spread : {Spread::closest, Spread::spheres})
    for (const float voxel : {0.0f, 0.05f}) {
      SCOPED_TRACE(int(spread) * 10 + int(voxel > 0));
      const AttributeFieldOptions options{.spread = spread, .voxelSize = voxel, .band = 0.2f};
      // Piecewise linear: differences meet kinks, so gradients are checked by batches only.
      checkField(attributeField(mesh, "a", options), box, {.gradient = false});
      checkField(facingField(mesh, {1, 2, 0.5f}, options), box, {.gradient = false});
    }
}

TEST(AttributeField, RangeIsThatOfTheValuesAndTighterOnSmallBoxes) {
  const Mesh mesh = painted(icosphere(1, 4), "a", [](const Vec3d& p) { return p.x; });
  for (const Spread spread : {Spread::closest, Spread::spheres}) {
    const ScalarField field = attributeField(mesh, "a", {.spread = spread});
    float least = 1, most = -1;
    for (const float v : mesh.attributes[0].values) least = std::min(least, v), most = std::max(most, v);
    EXPECT_EQ(field.range(Box::everywhere()), (Interval{least, most}));
    // Near the pole of x the values are near 1; the box and the triangles add their size.
    const Interval range = field.range({{0.95f, -0.05f, -0.05f}, {1.05f, 0.05f, 0.05f}});
    EXPECT_GT(range.min, spread == Spread::closest ? 0.95f : 0.8f);
  }
}

TEST(AttributeField, IsOneValueWhereAMaskIsFlat) {
  // Painted masks are mostly 0 or 1; there the field simplifies to a constant, so it costs nothing.
  const Mesh mesh = painted(icosphere(1, 4), "mask", [](const Vec3d& p) { return p.y > 0.5 ? 1.0 : 0.0; });
  for (const float voxel : {0.0f, 0.03f}) {
    const ScalarField field = attributeField(mesh, "mask", {.voxelSize = voxel, .band = 0.1f});
    EXPECT_EQ(field.range({{-0.1f, 0.9f, -0.1f}, {0.1f, 1.1f, 0.1f}}), Interval::of(1));
    EXPECT_EQ(field.range({{-0.1f, -1.1f, -0.1f}, {0.1f, -0.9f, 0.1f}}), Interval::of(0));
    EXPECT_EQ(field.range({{0.8f, 0.4f, -0.1f}, {0.9f, 0.6f, 0.1f}}), (Interval{0, 1}));
  }
}

TEST(AttributeField, SpheresBlendByTheStatedWeights) {
  // Two vertices in reach of the point; the formula of the header, in double.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 3, 0}};
  mesh.addFace(std::array<std::uint32_t, 3>{0, 1, 2});
  mesh.attributes.push_back({"a", MeshAttribute::Domain::vertex, 1, {2, 5, 11}});
  const ScalarField field = attributeField(mesh, "a", {.spread = Spread::spheres, .radius = 1.5f});
  const Vec3d p{0.25, 0.5, 0.25};
  double sum = 0, weighted = 0;
  for (int v = 0; v < 2; ++v) {
    const Vec3d away = p - mesh.positions[std::size_t(v)];
    const double w = std::pow(1 - dot(away, away) / (1.5 * 1.5), 3);
    sum += w;
    weighted += w * double(mesh.attributes[0].values[std::size_t(v)]);
  }
  EXPECT_NEAR(field(Vec3f(p)), weighted / sum, 1e-6);
  // Beyond all spheres: the closest point's.
  EXPECT_FLOAT_EQ(field({0, 0, -4}), 2.0f);
  EXPECT_FLOAT_EQ(field({-3, 3, 0}), 11.0f);
}

TEST(AttributeField, SpheresOfAnySizeGiveAPartitionOfUnity) {
  // A patch of one value stays that value wherever only its vertices reach, whatever the sizes of the
  // triangles.
  Mesh mesh = joined(icosphere(1, 4), icosphere(20, 1, {50, 0, 0}));
  mesh = painted(std::move(mesh), "a", [](const Vec3d& p) { return p.x < 10 ? 0.3 : 0.7; });
  const ScalarField field = attributeField(mesh, "a", {.spread = Spread::spheres});
  std::mt19937 random(2);
  const Points near = randomPoints({{-2, -2, -2}, {2, 2, 2}}, 2000, random);
  const Values<float> nearValues = evaluate(field, near);
  for (const float v : nearValues.data[0]) ASSERT_NEAR(v, 0.3f, 3e-8f);
  const Points far = randomPoints({{70, -5, -5}, {90, 5, 5}}, 500, random);
  const Values<float> farValues = evaluate(field, far);
  for (const float v : farValues.data[0]) ASSERT_NEAR(v, 0.7f, 6e-8f);
}

TEST(AttributeField, SpheresAreContinuousToTheirRimAndBeyond) {
  // Along a line out of the surface the closest point stays the same, so the field may not jump.
  const Mesh mesh = painted(icosphere(1, 3), "a", wave);
  const ScalarField field = attributeField(mesh, "a", {.spread = Spread::spheres, .radius = 0.3f});
  const Vec3f direction = normalize(Vec3f{0.3f, 0.5f, 0.8f});
  constexpr int kSteps = 4000;
  float before = field(direction);
  for (int i = 1; i <= kSteps; ++i) {
    const float value = field(direction * (1 + 0.6f * float(i) / kSteps));
    ASSERT_NEAR(value, before, 2e-3f) << "at " << 1 + 0.6f * float(i) / kSteps;
    before = value;
  }
}

TEST(AttributeField, DegenerateFacesDoNoHarm) {
  Mesh mesh = painted(icosphere(1, 2), "a", [](const Vec3d& p) { return p.z; });
  const Mesh clean = mesh;
  // On the surface, so the closest points stay the same.
  const std::uint32_t a = mesh.corners[30], b = mesh.corners[31];
  mesh.addFace(std::array<std::uint32_t, 3>{a, a, a});
  mesh.addFace(std::array<std::uint32_t, 3>{a, a, b});
  mesh.addFace(std::array<std::uint32_t, 3>{b, a, b});
  std::mt19937 random(3);
  const Points points = randomPoints({{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}, 2000, random);
  for (const Spread spread : {Spread::closest, Spread::spheres}) {
    const auto compare = [&](const ScalarField& with, const ScalarField& without) {
      const Values<float> x = evaluate(with, points), y = evaluate(without, points);
      for (std::size_t i = 0; i < points.size(); ++i) ASSERT_NEAR(x.data[0][i], y.data[0][i], 1e-6f);
    };
    compare(attributeField(mesh, "a", {.spread = spread}), attributeField(clean, "a", {.spread = spread}));
    compare(facingField(mesh, {0, 0, 1}, {.spread = spread}),
            facingField(clean, {0, 0, 1}, {.spread = spread}));
  }
  // Nothing but degenerate faces still has closest points.
  Mesh line;
  line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.addFace(std::array<std::uint32_t, 3>{0, 1, 2});
  line.attributes.push_back({"a", MeshAttribute::Domain::vertex, 1, {0, 1, 2}});
  EXPECT_NEAR(attributeField(line, "a")({0.5f, 1, 0}), 0.5f, 1e-6f);
  EXPECT_EQ(facingField(line, {0, 1, 0})({0.5f, 1, 0}), 0.0f);
}

TEST(AttributeField, PointsThatAreNotFiniteGiveNaN) {
  const Mesh mesh = painted(icosphere(1, 2), "a", [](const Vec3d& p) { return p.z; });
  for (const Spread spread : {Spread::closest, Spread::spheres})
    for (const float voxel : {0.0f, 0.1f}) {
      const ScalarField field =
          attributeField(mesh, "a", {.spread = spread, .voxelSize = voxel, .band = 0.2f});
      EXPECT_TRUE(std::isnan(field({kNan, 0, 0})));
      EXPECT_TRUE(std::isnan(field({0, std::numeric_limits<float>::infinity(), 0})));
      EXPECT_TRUE(std::isfinite(field({1e18f, -1e18f, 1e18f})));
    }
}

TEST(AttributeField, GridIsTheExactFieldAtItsVoxelsAndBeyondItsBand) {
  const Mesh mesh = painted(icosphere(1, 3), "a", wave);
  constexpr float kVoxel = 0.0625f, kBand = 0.25f;
  for (const Spread spread : {Spread::closest, Spread::spheres}) {
    const ScalarField exact = attributeField(mesh, "a", {.spread = spread});
    const ScalarField gridded =
        attributeField(mesh, "a", {.spread = spread, .voxelSize = kVoxel, .band = kBand});
    // All voxels of the band, also where a corner of a brick has no neighbour.
    for (int k = -22; k <= 22; ++k)
      for (int j = -22; j <= 22; ++j)
        for (int i = -22; i <= 22; i += 3) {
          const Vec3f p = Vec3f(float(i), float(j), float(k)) * kVoxel;
          if (std::abs(length(p) - 1) > kBand) continue;
          // Two ways to the foot, each told by squared distances in floats; the wave rises by sqrt(50) / 2.
          // Inside, points behind an edge have two feet, at most its dihedral angle, 0.15, times their depth
          // apart.
          const double depth = 1 - double(length(p)), rise = 3.6;
          const double foot = depth > 0 ? 0.15 * depth : -std::sqrt(0x1p-23) * depth;
          ASSERT_NEAR(gridded(p), exact(p), 3e-6 + 2 * rise * foot) << p.x << " " << p.y << " " << p.z;
        }
    for (const Vec3f& p : {Vec3f{3, 1, 2}, Vec3f{-8, 0.1f, 0.2f}}) EXPECT_EQ(gridded(p), exact(p));
  }
}

TEST(AttributeField, GridFollowsASmoothAttributeOfTheBunny) {
  const std::string path = sharedData("meshes/bunny_7k.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = painted(readMesh(path), "a", wave);
  const float side = boundingBox(mesh).longestSide(), voxel = side / 100, band = 4 * voxel;
  const ScalarField exact = attributeField(mesh, "a");
  const ScalarField gridded = attributeField(mesh, "a", {.voxelSize = voxel, .band = band});
  // Points of the surface moved by up to the band.
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1, 1);
  Points points;
  for (const Vec3d& p : mesh.positions)
    for (std::vector<float>* lane : {&points.x, &points.y, &points.z})
      lane->push_back(float(p[lane == &points.x ? 0 : lane == &points.y ? 1 : 2] + unit(random) * band / 2));
  const Values<float> a = evaluate(exact, points), b = evaluate(gridded, points);
  std::vector<float> errors;
  for (std::size_t i = 0; i < points.size(); ++i) errors.push_back(std::abs(a.data[0][i] - b.data[0][i]));
  std::sort(errors.begin(), errors.end());
  // Second differences of the wave over one voxel are 5^2 0.5 (side / 100)^2 / 8, some 5e-4; folds of the
  // closest point add a tail.
  EXPECT_LT(errors[errors.size() / 2], 1e-3f);
  EXPECT_LT(errors[errors.size() * 95 / 100], 0.02f);
}

TEST(FacingField, OfASphereIsTheCosine) {
  // Closed form x . d / |x|. At distance 0.1 the foot on a facet, 0.02 from its middle to its corners, is off
  // by up to 0.1 * 0.02.
  const Vec3f direction = normalize(Vec3f{1, -2, 0.5f});
  const ScalarField field = facingField(icosphere(1, 5), direction * 7.0f);
  std::mt19937 random(5);
  const Points points = randomPoints({{-1.1f, -1.1f, -1.1f}, {1.1f, 1.1f, 1.1f}}, 5000, random);
  const Values<float> values = evaluate(field, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (std::abs(length(points[i]) - 1) > 0.1f) continue;
    ASSERT_NEAR(values.data[0][i], dot(points[i], direction) / length(points[i]), 2.2e-3f);
  }
  EXPECT_TRUE((Interval{-1, 1}).contains(field.range(Box::everywhere())));
}

TEST(FacingField, DoesNotSeeHowFacesAreCut) {
  // Angle weights: at every corner of a box the three sides count alike, so the normal there is the diagonal.
  const Mesh box = boxMesh({-1, -1, -1}, {1, 1, 1});
  for (const Mesh& mesh : {box, unshared(box)}) {
    const ScalarField field = facingField(mesh, {0, 1, 0});
    for (int i = 0; i < 8; ++i)
      EXPECT_NEAR(field({i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f}),
                  (i & 2 ? 1 : -1) / std::sqrt(3.0), 1e-6);
  }
}

TEST(AttributeField, IsTheSameAtAnyThreadCount) {
  const Mesh mesh = painted(torusMesh(1, 0.4, 30, 15), "a", wave);
  std::mt19937 random(6);
  const Points points = randomPoints({{-1.5f, -1.5f, -0.5f}, {1.5f, 1.5f, 0.5f}}, 2000, random);
  for (const Spread spread : {Spread::closest, Spread::spheres}) {
    std::vector<float> first;
    for (const std::size_t threads : {1, 2, 4}) {
      const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      const Values<float> values =
          evaluate(attributeField(mesh, "a", {.spread = spread, .voxelSize = 0.1f, .band = 0.1f}), points);
      if (first.empty()) first = values.data[0];
      EXPECT_EQ(first, values.data[0]) << threads << " threads";
    }
  }
}

TEST(AttributeField, StopsWhenCancelled) {
  struct Stop : Progress {
    bool cancelled() const override { return true; }
  } stop;
  const Mesh mesh = painted(icosphere(1, 3), "a", wave);
  EXPECT_THROW(attributeField(mesh, "a", {.voxelSize = 0.01f, .band = 0.2f}, stop), Cancelled);
}

}  // namespace
}  // namespace nephele::test
