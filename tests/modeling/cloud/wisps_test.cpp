// Wisps and where their guides come from.
#include "nephele/modeling/cloud/wisps.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>

#include "nephele/modeling/cloud/wisp_guides.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Options that leave dots at the directions of their walks, on the unit sphere.
WispOptions onSphere(float correlation) {
  return {.dots = 40000, .correlation = correlation, .walkLength = 40000, .clump = 0, .displacement = 0};
}

Dots unitWisp(const WispOptions& options) {
  const WispGuide guide;
  return growWisps({&guide, 1}, options);
}

/// Mean cosine of the angle between two isotropic normal vectors in space whose coordinates have the
/// correlation `rho`: (8 rho / 3 pi) F(1/2, 1/2; 5/2; rho^2), by its series.
double meanCosine(double rho) {
  double term = 1, sum = 0;
  for (int n = 0; n < 4000; ++n) {
    sum += term;
    term *= (n + 0.5) * (n + 0.5) / ((n + 2.5) * (n + 1.0)) * rho * rho;
  }
  return 8 * rho / (3 * M_PI) * sum;
}

std::string saidBy(const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing";
}

TEST(Wisps, WithoutCorrelationDirectionsAreEvenlySpread) {
  const Dots dots = unitWisp(onSphere(0));
  const double n = double(dots.size());
  Vec3d sum{}, squares{};
  double next = 0;
  for (std::size_t i = 0; i < dots.size(); ++i) {
    const Vec3d p(dots.positions[i]);
    EXPECT_NEAR(length(p), 1, 1e-6);
    sum += p;
    squares += p * p;
    if (i > 0) next += dot(p, Vec3d(dots.positions[i - 1]));
  }
  // Means have the deviation sqrt(1/3 / n) = 0.003, squares, of variance 4/45, 0.0015.
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(sum[a] / n, 0, 0.012);
    EXPECT_NEAR(squares[a] / n, 1.0 / 3, 0.006);
  }
  EXPECT_NEAR(next / n, 0, 0.012);
}

TEST(Wisps, StepsOfTheWalkHaveTheCorrelationAskedFor) {
  for (const float correlation : {0.3f, 0.7f, 0.9f}) {
    const Dots dots = unitWisp(onSphere(correlation));
    for (const int lag : {1, 2, 5}) {
      double sum = 0;
      const std::size_t n = dots.size() - std::size_t(lag);
      for (std::size_t i = 0; i < n; ++i)
        sum += double(dot(dots.positions[i], dots.positions[i + std::size_t(lag)]));
      // A correlation c per step is c^lag after lag steps; the walk forgets after some 1 / (1 - c) steps.
      EXPECT_NEAR(sum / double(n), meanCosine(std::pow(double(correlation), lag)), 0.015) << correlation;
    }
  }
}

TEST(Wisps, AtFullCorrelationAWalkIsOneDot) {
  WispOptions options = onSphere(1);
  options.dots = 300;
  options.walkLength = 100;
  options.clump = 0.3f;
  options.displacement = 0.5f;
  const Dots dots = unitWisp(options);
  for (std::size_t i = 0; i < 300; ++i) EXPECT_EQ(dots.positions[i], dots.positions[i / 100 * 100]);
  EXPECT_NE(dots.positions[0], dots.positions[100]);
  EXPECT_NE(dots.positions[100], dots.positions[200]);
}

TEST(Wisps, ClumpIsThePowerOfTheRadialDisplacement) {
  // |2 a n|^c = 2^c |a n|^c at every dot, and the power 2 c squares what c gives.
  WispOptions options = onSphere(0);
  options.dots = 2000;
  options.clump = 0.5f;
  const Dots once = unitWisp(options);
  options.amplitude = 2;
  const Dots twice = unitWisp(options);
  options.amplitude = 1;
  options.clump = 1;
  const Dots squared = unitWisp(options);
  for (std::size_t i = 0; i < once.size(); ++i) {
    const float r = length(once.positions[i]);
    EXPECT_NEAR(length(twice.positions[i]), std::sqrt(2.0f) * r, 1e-5);
    EXPECT_NEAR(length(squared.positions[i]), r * r, 1e-5);
  }
}

TEST(Wisps, ASheetHasOneRadiusPerDirection) {
  // Noise that is read on the sphere changes little between near directions; read at the random place it
  // does.
  const auto spread = [](float thickness) {
    WispOptions options = onSphere(0);
    options.thickness = thickness;
    options.clump = 1;
    Dots dots = unitWisp(options);
    std::vector<float> radii;
    for (const Vec3f& p : dots.positions)
      if (p.z > 0.9995f * length(p)) radii.push_back(length(p));
    EXPECT_GT(radii.size(), 5u);
    return *std::max_element(radii.begin(), radii.end()) - *std::min_element(radii.begin(), radii.end());
  };
  EXPECT_LT(spread(0), 0.35f);
  EXPECT_GT(spread(1), 2 * spread(0));
}

TEST(Wisps, DisplacementIsRmsPerAxisInSizesOfTheGuide) {
  // Noise has rms 1 over space; 300 guides read it at places of their own.
  WispOptions options = onSphere(0);
  options.dots = 40;
  std::vector<WispGuide> guides(300, {.size = 2});
  const Dots before = growWisps(guides, options);
  options.displacement = 0.25f;
  const Dots after = growWisps(guides, options);
  Vec3d squares{};
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Vec3d way = Vec3d(after.positions[i]) - Vec3d(before.positions[i]);
    squares += way * way / double(before.size());
  }
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(std::sqrt(squares[a]), 0.5, 0.04);
}

TEST(Wisps, ScaleAndMoveWithTheirGuide) {
  const WispGuide small, large{.position = {10, 20, 30}, .size = 4};
  const WispOptions options{.dots = 500, .seed = 3};
  const Dots a = growWisps({&small, 1}, options), b = growWisps({&large, 1}, options);
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_LT(length(large.position + 4 * a.positions[i] - b.positions[i]), 1e-5f);
}

TEST(Wisps, ShareTheMassOfTheirGuides) {
  std::vector<WispGuide> guides(2);
  guides[0] = {.size = 0.5f, .density = 3};
  guides[1] = {.size = 2, .density = 0};
  const Dots dots = growWisps(guides, {.dots = 100});
  ASSERT_EQ(dots.masses.size(), 200u);
  double sum = 0;
  for (const float m : dots.masses) sum += double(m);
  EXPECT_NEAR(sum, 3 * 4.0 / 3 * M_PI * 0.125, 1e-5);  // density times the volume of the sphere
  EXPECT_EQ(dots.masses[100], 0);
}

TEST(Wisps, CarryColourAndVelocityWhereThereIsAny) {
  std::vector<WispGuide> guides(2);
  const Dots plain = growWisps(guides, {.dots = 10});
  EXPECT_TRUE(plain.colors.empty());
  EXPECT_TRUE(plain.velocities.empty());
  guides[1].color = {1, 0, 0};
  guides[1].velocity = {0, 1, 0};
  Dots dots = growWisps(guides, {.dots = 10});
  ASSERT_EQ(dots.colors.size(), 20u);
  EXPECT_EQ(dots.colors[9], (Vec3f{1, 1, 1}));
  EXPECT_EQ(dots.colors[10], (Vec3f{1, 0, 0}));
  EXPECT_EQ(dots.velocities[9], Vec3f{});
  EXPECT_EQ(dots.velocities[10], (Vec3f{0, 1, 0}));
  addVelocity(dots, VectorField(Vec3f{1, 2, 3}));
  EXPECT_EQ(dots.velocities[9], (Vec3f{1, 2, 3}));
  EXPECT_EQ(dots.velocities[19], (Vec3f{1, 3, 3}));
}

TEST(Wisps, AreTheSameAtAnyThreadCountAndInParts) {
  const std::vector<WispGuide> guides = guidesInside(sphere({0, 0, 0}, 1), {{-1, -1, -1}, {1, 1, 1}});
  WispOptions options{.dots = 700, .correlation = 0.5f, .walkLength = 150, .seed = 12};
  const auto grown = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return growWisps(guides, options);
  };
  const Dots one = grown(1);
  EXPECT_EQ(one.positions, grown(4).positions);
  options.firstGuide = 30;
  const Dots part = growWisps(std::span(guides).subspan(30, 20), options);
  for (std::size_t i = 0; i < part.size(); ++i) ASSERT_EQ(part.positions[i], one.positions[30 * 700 + i]);
  options.seed = 13;
  EXPECT_NE(part.positions[0], growWisps(std::span(guides).subspan(30, 20), options).positions[0]);
}

TEST(Wisps, GuidesDifferAndWalksDoNotRepeat) {
  const std::vector<WispGuide> guides(20);
  Dots dots = growWisps(guides, {.dots = 1000, .walkLength = 10});
  std::sort(dots.positions.begin(), dots.positions.end());
  EXPECT_EQ(std::adjacent_find(dots.positions.begin(), dots.positions.end()), dots.positions.end());
}

TEST(Wisps, TheirBoxHoldsAllButAFew) {
  const std::vector<WispGuide> guides(50);
  const WispOptions options{.dots = 1000, .clump = 0.5f, .displacement = 0.4f};
  const Box box = wispBox(guides, options);
  const Dots dots = growWisps(guides, options);
  const auto outside = std::count_if(dots.positions.begin(), dots.positions.end(),
                                     [&](const Vec3f& p) { return !box.contains(p); });
  EXPECT_LT(outside, 50);
  // Dots do reach far out in it.
  float farthest = 0;
  for (const Vec3f& p : dots.positions) farthest = std::max(farthest, std::abs(p.x));
  EXPECT_GT(farthest, 0.7f * box.max.x);
}

TEST(Wisps, NoGuidesAreNoDots) {
  EXPECT_EQ(growWisps({}, {}).size(), 0u);
  EXPECT_TRUE(wispBox({}, {}).isEmpty());
}

TEST(Wisps, RefuseWhatIsOutsideTheirRange) {
  const auto said = [](const WispGuide& guide, const WispOptions& options) {
    return saidBy([&] { growWisps({&guide, 1}, options); });
  };
  const auto expect = [&](const std::string& text, const WispGuide& guide, const WispOptions& options = {}) {
    EXPECT_NE(said(guide, options).find(text), std::string::npos) << said(guide, options);
  };
  expect("guide 0: size must be > 0", {.size = 0});
  expect("guide 7: size must be > 0", {.size = -1}, {.firstGuide = 7});
  expect("guide 0: position must be finite", {.position = {0, kNan, 0}});
  expect("guide 0: density must be >= 0", {.density = -1});
  expect("guide 0: color must be finite", {.color = {kNan, 0, 0}});
  expect("guide 0: velocity must be finite", {.velocity = {kNan, 0, 0}});
  expect("dots must be > 0", {}, {.dots = 0});
  expect("walkLength must be > 0", {}, {.walkLength = 0});
  expect("correlation must be from 0 to 1, got 1.5", {}, {.correlation = 1.5f});
  expect("correlation must be", {}, {.correlation = kNan});
  expect("thickness must be from 0 to 1", {}, {.thickness = -0.1f});
  expect("clump must be >= 0", {}, {.clump = -1});
  expect("amplitude must be >= 0", {}, {.amplitude = kNan});
  expect("displacement must be >= 0", {}, {.displacement = -1});
  expect("octaves", {}, {.radial = {.octaves = 0}});
  expect("frequency", {}, {.vector = {.frequency = 0}});
}

Mesh twoTriangles() {
  // Areas 1/2 and 3/2, apart from each other.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {8, 0, 0}, {5, 1, 0}};
  mesh.addFace(std::array<std::uint32_t, 3>{0, 1, 2});
  mesh.addFace(std::array<std::uint32_t, 3>{3, 4, 5});
  return mesh;
}

TEST(WispGuides, OnVerticesTakeTheirAttributes) {
  Mesh mesh = twoTriangles();
  const auto add = [&](const char* name, int width, std::vector<float> values) {
    mesh.attributes.push_back({name, MeshAttribute::Domain::vertex, width, std::move(values)});
  };
  add("pscale", 1, {1, 2, 3, 4, 5, 6});
  add("density", 1, {0, 1, 2, 3, 4, 5});
  add("color", 4, {1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 1, 1, 1, 1, 0, 1, 0, 1, 1, 1, 1, 0, 1, 1});
  add("vx", 1, {1, 1, 1, 1, 1, 1});
  add("vy", 1, {2, 2, 2, 2, 2, 2});
  add("vz", 1, {3, 3, 3, 3, 3, 7});
  const std::vector<WispGuide> guides = guidesOnVertices(mesh);
  ASSERT_EQ(guides.size(), 6u);
  EXPECT_EQ(guides[3].position, (Vec3f{5, 0, 0}));
  EXPECT_EQ(guides[3].size, 4);
  EXPECT_EQ(guides[5].density, 5);
  EXPECT_EQ(guides[1].color, (Vec3f{0, 1, 0}));
  EXPECT_EQ(guides[5].velocity, (Vec3f{1, 2, 7}));
  mesh.attributes.clear();
  EXPECT_EQ(guidesOnVertices(mesh, {.standard = {.size = 0.25f}})[2].size, 0.25f);
}

TEST(WispGuides, OnASurfaceAreSpreadByItsArea) {
  Mesh mesh = twoTriangles();
  mesh.attributes.push_back({"size", MeshAttribute::Domain::vertex, 1, {1, 2, 1, 1, 1, 1}});
  const std::vector<WispGuide> guides = guidesOnSurface(mesh, {.count = 4000, .seed = 1});
  ASSERT_EQ(guides.size(), 4000u);
  int first = 0;
  Vec3d sum{};
  for (const WispGuide& g : guides) {
    EXPECT_EQ(g.position.z, 0);
    if (g.position.x > 1) continue;
    ++first;
    EXPECT_LE(g.position.x + g.position.y, 1.000001f);
    EXPECT_NEAR(g.size, 1 + g.position.x, 1e-5);  // linear between 1, 2 and 1
    sum += Vec3d(g.position);
  }
  EXPECT_NEAR(first, 1000, 110);  // a quarter, within four deviations
  // The centroid of the triangle; a coordinate has the variance 1/18.
  EXPECT_NEAR(sum.x / first, 1.0 / 3, 0.03);
  EXPECT_NEAR(sum.y / first, 1.0 / 3, 0.03);
}

TEST(WispGuides, InsideAShapeAreSpreadByVolume) {
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  const std::vector<WispGuide> guides = guidesInside(sphere({0, 0, 0}, 1), box, {.count = 8000, .seed = 3});
  int inner = 0, octant = 0;
  for (const WispGuide& g : guides) {
    EXPECT_LT(length(g.position), 1);
    inner += length(g.position) < 0.5f;
    octant += g.position.x > 0 && g.position.y > 0 && g.position.z > 0;
  }
  EXPECT_NEAR(inner, 1000, 120);  // an eighth of the volume, within four deviations
  EXPECT_NEAR(octant, 1000, 120);
}

TEST(WispGuides, SizesVaryWithinTheirLimits) {
  const std::vector<WispGuide> guides =
      guidesInside(sphere({0, 0, 0}, 1), {{-1, -1, -1}, {1, 1, 1}},
                   {.count = 2000, .standard = {.size = 2}, .sizeVariation = 0.5f});
  double sum = 0;
  for (const WispGuide& g : guides) {
    EXPECT_GE(g.size, 1);
    EXPECT_LE(g.size, 3);
    sum += double(g.size);
  }
  EXPECT_NEAR(sum / 2000, 2, 0.06);
}

TEST(WispGuides, SizesOfTheirOwnDoNotVary) {
  Mesh mesh = twoTriangles();
  EXPECT_FALSE(bringsGuideSizes(mesh));
  EXPECT_NE(guidesOnVertices(mesh, {.sizeVariation = 0.5f})[2].size, 1);
  mesh.attributes.push_back({"pscale", MeshAttribute::Domain::vertex, 1, {2, 2, 2, 2, 2, 2}});
  EXPECT_TRUE(bringsGuideSizes(mesh));
  for (const WispGuide& g : guidesOnVertices(mesh, {.sizeVariation = 0.5f})) EXPECT_EQ(g.size, 2);
  for (const WispGuide& g : guidesOnSurface(mesh, {.count = 9, .sizeVariation = 0.5f}))
    EXPECT_NEAR(g.size, 2, 1e-6);  // weights of corners add up to 1, to rounding
}

TEST(WispGuides, RefuseWhatHoldsNone) {
  Mesh empty;
  EXPECT_NE(saidBy([&] { guidesOnVertices(empty); }).find("no vertices"), std::string::npos);
  EXPECT_NE(saidBy([&] { guidesOnSurface(empty); }).find("no area"), std::string::npos);
  Mesh flat = twoTriangles();
  for (Vec3d& p : flat.positions) p = {};
  EXPECT_NE(saidBy([&] { guidesOnSurface(flat); }).find("no area"), std::string::npos);
  Mesh mesh = twoTriangles();
  mesh.attributes.push_back({"radius", MeshAttribute::Domain::vertex, 1, {1, 1, 0, 1, 1, 1}});
  EXPECT_NE(saidBy([&] { guidesOnVertices(mesh); }).find("vertex 2 has the size 0"), std::string::npos);
  mesh.positions[1].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(saidBy([&] { guidesOnVertices(mesh); }).find("vertex 1 has a position"), std::string::npos);
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  EXPECT_NE(saidBy([&] { guidesInside(ScalarField(-1.0f), box); }).find("a millionth"), std::string::npos);
  EXPECT_NE(saidBy([&] { guidesInside(ScalarField(1.0f), {}); }).find("box"), std::string::npos);
  EXPECT_NE(saidBy([&] { guidesInside(ScalarField(1.0f), box, {.count = 0}); }).find("count"),
            std::string::npos);
  EXPECT_NE(saidBy([&] { guidesInside(ScalarField(1.0f), box, {.sizeVariation = 1}); }).find("sizeVariation"),
            std::string::npos);
}

TEST(WispGuides, PointsOfDotsHoldAllThatDotsCarry) {
  std::vector<WispGuide> guides(1, {.color = {1, 0, 0.5f}, .velocity = {1, 2, 3}});
  const Dots dots = growWisps(guides, {.dots = 5});
  const Mesh points = pointsOf(dots);
  EXPECT_EQ(points.faceCount(), 0u);
  ASSERT_EQ(points.positions.size(), 5u);
  EXPECT_EQ(Vec3f(points.positions[4]), dots.positions[4]);
  const std::vector<WispGuide> again = guidesOnVertices(points);
  EXPECT_EQ(again[2].color, (Vec3f{1, 0, 0.5f}));
  EXPECT_EQ(again[2].velocity, (Vec3f{1, 2, 3}));
}

}  // namespace
}  // namespace nephele::test
