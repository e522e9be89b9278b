#include <gtest/gtest.h>

#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/light/projected_light_volume.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"
#include "tests/support/each_target.h"
#include "tests/support/march_scene.h"
#include "tests/support/scalar_march.h"

namespace nephele {
namespace {

using test::ball;
using test::densityGrid;
using test::voxels;

LocalLight point(const Vec3f& position, float intensity = 1.0f) {
  LocalLight light;
  light.position = position;
  light.intensity = Vec3f{1, 1, 1} * intensity;
  return light;
}

LocalLight spot(const Vec3f& position, const Vec3f& target, float angle, float penumbra) {
  LocalLight light = point(position);
  light.name = "spot";
  light.cone = LocalLight::Cone{target - position, angle, penumbra};
  return light;
}

Medium medium(float extinction, const Phase& phase = {}) {
  return {extinction, {1, 1, 1}, phase};
}

// Length of the part of the segment from a to b inside the unit ball about the origin.
double inBall(const Vec3d& a, const Vec3d& b) {
  const Vec3d way = b - a;
  const double l = length(way), along = -dot(a, way) / l, away2 = dot(a, a) - along * along;
  if (away2 >= 1) return 0;
  const double half = std::sqrt(1 - away2);
  return std::max(0.0, std::min(l, along + half) - std::max(0.0, along - half));
}

// Light scattered once in a unit ball of extinction `sigma` along the line through (x, 0, z) from z =
// infinity down, by quadrature: sigma exp(-sigma way) phase I / r^2 exp(-sigma way to the light).
double onceInBall(double x, double sigma, const LocalLight& light, const Phase& phase) {
  const double half = std::sqrt(1 - x * x);
  constexpr int n = 20000;
  double sum = 0;
  for (int i = 0; i != n; ++i) {
    const double depth = (i + 0.5) / n * 2 * half;
    const Vec3d p{x, 0, half - depth}, way = Vec3d(light.position) - p;
    const double r = length(way);
    const Vec3f towards(way / r);
    sum += std::exp(-sigma * (depth + inBall(p, Vec3d(light.position)))) * double(phase(-towards.z)) *
           double(light.decayAt(float(r))) * double(light.coneAt(-towards));
  }
  return sum * sigma * 2 * half / n;
}

Camera downAlong(float x) {
  return Camera::lookingAt({x, 0, 9}, {x, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
}

RenderOptions singleScattering(int samples = 16) {
  RenderOptions options;
  options.octaves.count = 1;
  options.samples = samples;
  return options;
}

TEST(ProjectedLightVolume, MeasuresTheDensityBetweenAPointAndTheLight) {
  const float h = 0.04f;
  const RenderVolume volume(ball(1.0f, h, 2.0f));
  struct Case {
    LocalLight light;
    std::size_t faces;
  };
  // Far, near, at the edge, inside, in the middle, and in cones.
  for (const auto& [light, faces] :
       {Case{point({0, 5, 1}), 1}, Case{point({-300, 40, 10}), 1}, Case{point({1.3f, 0.4f, -0.2f}), 6},
        Case{point({0, 0.7f, 0.7f}), 6}, Case{point({0.3f, -0.2f, 0.1f}), 6}, Case{point({0, 0, 0}), 6},
        Case{spot({0.2f, 3, 0}, {0, 0, 0}, 40, 5), 1}, Case{spot({0.2f, 0.1f, 0}, {1, 1, 0}, 80, 5), 6}}) {
    const ProjectedLightVolume shadows(volume, light);
    EXPECT_EQ(shadows.faces().size(), faces);
    double worst = 0;
    for (int i = 0; i != 400; ++i) {
      const Vec3f p = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * 0.52f;
      const double exact = 2.0 * inBall(Vec3d(p), Vec3d(light.position));
      worst = std::max(worst, std::fabs(double(shadows.columnDensity(p)) - exact));
    }
    // Closed form; half a voxel's error at the edge of the ball is the discretisation's own, as a sun's.
    EXPECT_LT(worst, 2.0 * 0.5 * double(h)) << light.position.x << " " << light.position.y;
  }
}

TEST(ProjectedLightVolume, SeesOnlyItsCone) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  const ProjectedLightVolume shadows(volume, spot({0, 0, 0}, {0, 0, 1}, 30, 5));
  ASSERT_EQ(shadows.faces().size(), 1u);
  EXPECT_NEAR(shadows.columnDensity({0, 0, 0.8f}), 0.8f, 0.01f);
  EXPECT_NEAR(shadows.columnDensity({0.2f, 0, 0.6f}), std::hypot(0.2f, 0.6f), 0.01f);
  EXPECT_EQ(shadows.columnDensity({0, 0, -0.8f}), 0.0f);
}

TEST(ProjectedLightVolume, FollowsRotatedAndStretchedGrids) {
  const Vec3f centre{100, -50, 30};
  Affine map{Mat3f::rotation({1, 2, 3}, 0.7f), centre};
  for (int row = 0; row != 3; ++row)
    map.linear(row, 0) *= 0.04f, map.linear(row, 1) *= 0.06f, map.linear(row, 2) *= 0.05f;
  const RenderVolume volume(densityGrid(map, {-28, -20, -23}, {28, 20, 23}, [&](const Vec3f& p) {
    return std::fmin(std::fmax((1 - length(p - centre)) / 0.05f + 0.5f, 0.0f), 1.0f);
  }));
  for (const Vec3f& from : {Vec3f{0, 3, 0}, Vec3f{0.3f, 0.2f, -0.4f}}) {
    const ProjectedLightVolume shadows(volume, point(centre + from));
    for (int i = 0; i != 200; ++i) {
      const Vec3f p = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * 0.5f;
      EXPECT_NEAR(shadows.columnDensity(centre + p), inBall(Vec3d(p), Vec3d(from)), 0.03) << i;
    }
  }
}

TEST(ProjectedLightVolume, StaysWithinItsEstimateAndRefusesLightsAtInfinity) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  for (const Vec3f& from : {Vec3f{0, 2, 0}, Vec3f{0.1f, 0.1f, 0}, Vec3f{1, 1, 1}, Vec3f{-400, 3, 1}})
    EXPECT_LE(double(ProjectedLightVolume(volume, point(from)).memoryBytes()),
              ProjectedLightVolume::estimateBytes(volume));
  EXPECT_THROW(ProjectedLightVolume(volume, point({0, 1e6f, 0})), Error);
  EXPECT_THROW(ProjectedLightVolume(volume, point({0, NAN, 0})), Error);
  const RenderVolume empty(densityGrid(voxels(1), {0, 0, 0}, {3, 3, 3}, [](const Vec3f&) { return 0.0f; }));
  EXPECT_EQ(ProjectedLightVolume(empty, point({0, 1, 0})).columnDensity({1, 1, 1}), 0.0f);
}

TEST(NearLights, BallScattersOnceAsIntegrated) {
  const RenderVolume volume(ball(1.0f, 0.025f));
  LocalLight linear = point({1, 2, 1}), held = point({0.2f, 0.3f, 0.1f}), none = point({-2, 1, 0});
  linear.decay = Decay::linear;
  held.decayStart = 0.8f;
  none.decay = Decay::none;
  for (const LocalLight& light :
       {point({0, 1, 2}), point({0.1f, 0.5f, 0.2f}), point({0, 0, 0}), linear, held, none,
        spot({0, 2, 0.5f}, {0, 0, 0}, 30, 15), spot({-0.4f, 0.1f, 0.1f}, {1, 0, 0}, 70, 30)})
    for (const float sigma : {0.1f, 2.0f}) {
      const char* text = sigma > 1 ? "isotropic" : "hg:0.6";
      const Phase phase = Phase::parse(text);
      const double exact = onceInBall(0.25, double(sigma), light, phase);
      const Image image =
          renderImage(volume, medium(sigma, phase), {{}, {}, {light}}, downAlong(0.25f), singleScattering())
              .image;
      // The ball's voxels are worth half a percent, as in a sun's light; no light grazes its edge.
      EXPECT_NEAR(double(image.at("R", 0, 0)), exact, 0.01 * exact)
          << light.position.x << " " << light.position.y << " " << sigma << " " << text;
      EXPECT_EQ(image.at("R", 0, 0), image.at("B", 0, 0));
    }
}

TEST(NearLights, GetWeakerWithTheSquareOfTheDistance) {
  // A thin ball of radius 1 seen from 50 and 100 away: 1 / r^2 over the ball differs by 3 / (5 r^2) from that
  // of its middle.
  const RenderVolume volume(ball(1.0f, 0.1f));
  const auto seen = [&](float distance) {
    return renderImage(volume, medium(1e-3f), {{}, {}, {point({0, distance, 0})}}, downAlong(0.0f),
                       singleScattering())
        .image.at("R", 0, 0);
  };
  EXPECT_NEAR(seen(50) / seen(100), 4.0f, 4.0f * 1e-3f);
}

TEST(NearLights, FarAwayAreSuns) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  const Vec3f towards = directionTowards(60, 35);
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {24, 20, 35});
  const Medium cloud = medium(3.0f, Phase::henyeyGreenstein(0.5f));
  RenderOptions options;
  const Image sun = renderImage(volume, cloud, {{{"sun", towards, {2, 2, 2}}}, {}}, camera, options).image;
  const Image near =
      renderImage(volume, cloud, {{}, {}, {point(towards * 1000.0f, 2e6f)}}, camera, options).image;
  for (int y = 0; y != 20; ++y)
    for (int x = 0; x != 24; ++x)
      // Rays differ by a thousandth.
      ASSERT_NEAR(near.at("R", x, y), sun.at("R", x, y), 0.01f * sun.at("R", x, y) + 1e-3f) << x << " " << y;
}

TEST(NearLights, MarcherOfOneOctaveAgreesWithThePathTracer) {
  const RenderVolume volume(densityGrid(voxels(0.0625f), {-24, -24, -24}, {24, 24, 24}, [](const Vec3f& p) {
    const float bumps = 0.3f * std::sin(5 * p.x) * std::sin(4 * p.y) * std::sin(6 * p.z);
    return std::fmin(std::fmax((1 + bumps - length(p)) / 0.3f, 0.0f), 1.0f);
  }));
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {16, 12, 35});
  Lights lights{{{"sun", {1, 0.7f, 0.4f}, {1, 1, 1}}}, {}};
  lights.suns[0].shadow = {1, 0.3f, 0.05f};
  lights.locals = {point({1, 1.4f, 0.8f}, 3), spot({-1.5f, 1, 1}, {0, 0, 0}, 20, 10)};
  lights.locals[1].intensity = {8, 6, 4};
  lights.locals[1].shadow = {0.5f, 1, 2};
  const Medium cloud = medium(3.0f, Phase::henyeyGreenstein(0.3f));
  RenderOptions once = singleScattering(64);
  once.aovs = {"light"};
  PathOptions paths;
  paths.samplesPerPixel = 16000;
  paths.maxScatterings = 1;
  paths.aovs = {"light"};
  const Image marched = renderImage(volume, cloud, lights, camera, once).image;
  const Image traced = pathTraceImage(volume, cloud, lights, camera, paths).image;
  for (const char* name : {"light_sun.R", "light_sun.G", "light_sun.B", "light_point.R", "light_spot.R",
                           "light_spot.G", "light_spot.B"}) {
    double a = 0, b = 0;
    for (int y = 0; y != 12; ++y)
      for (int x = 0; x != 16; ++x) a += marched.at(name, x, y), b += traced.at(name, x, y);
    // 3 million paths: a standard error of 0.25 % where the spot shines, which few of them meet, as measured
    // over seeds.
    EXPECT_NEAR(a, b, 0.01 * b) << name;
    EXPECT_GT(b, 0.1) << name;
  }
}

TEST(NearLights, OctavesAreAsBrightAsPathsOfManyScatterings) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  const Camera camera = Camera::framing(volume.outline(), 25, 15, {12, 12, 35});
  const Lights lights{{}, {}, {point({0.5f, 2, 1}, 4)}};
  Medium cloud = medium(20.0f, Phase::henyeyGreenstein(0.3f));
  cloud.albedo = {0.98f, 0.98f, 0.98f};
  PathOptions paths;
  paths.samplesPerPixel = 300;
  const Image marched = renderImage(volume, cloud, lights, camera, {}).image;
  const Image traced = pathTraceImage(volume, cloud, lights, camera, paths).image;
  double a = 0, b = 0;
  for (int y = 0; y != 12; ++y)
    for (int x = 0; x != 12; ++x) a += marched.at("R", x, y), b += traced.at("R", x, y);
  // The bar of octaves against the reference in a sun's light: mean luminance within 5 %; noise of 1 %.
  EXPECT_NEAR(a, b, 0.06 * b);
}

TEST(NearLights, VectorsAgreeWithTheScalarLoop) {
  const auto grid = densityGrid(voxels(0.1f), {-20, -20, -20}, {20, 20, 20}, [](const Vec3f& p) {
    return std::fmax(0.0f, std::sin(3 * p.x) * std::cos(4 * p.y) + std::sin(5 * p.z));
  });
  const RenderVolume volume(grid);
  std::vector<float> phase;
  for (int i = 0; i != 2 * (MarchScene::Local::kPhaseNodes + 1); ++i)
    phase.push_back(0.1f + 0.05f * std::sin(0.01f * float(i)));
  std::vector<LocalLight> lights{point({0.3f, 0.2f, -0.1f}), point({3, 4, 1}),
                                 spot({0, 2, 0}, {0, 0, 0}, 30, 20), point({-1, -1, 2})};
  lights[1].decay = Decay::linear;
  lights[2].decay = Decay::none;
  lights[3].decayStart = 1.5f;
  std::vector<ProjectedLightVolume> shadows;
  for (const LocalLight& light : lights) shadows.emplace_back(volume, light);

  MarchScene scene = test::sceneOf(volume);
  scene.octaves = 2;
  scene.attenuation[1] = 0.4f;
  scene.colours = scene.skyParts = 3;
  scene.step = 0.1f;
  scene.leastStep = 0.0125f;
  scene.extinction = 2;
  for (std::size_t i = 0; i != lights.size(); ++i) {
    MarchScene::Local& local = scene.locals.emplace_back();
    for (const ProjectedLightVolume::Face& face : shadows[i].faces())
      local.faces.push_back({{face.values.data(), face.table.data(), face.brickCount},
                             face.axis,
                             face.side,
                             face.perTangent,
                             face.perDepth,
                             Vec3f(face.firstBrick * 8)});
    local.decay = lights[i].decay == Decay::quadratic ? 2 : lights[i].decay == Decay::linear ? 1 : 0;
    local.decayStart = lights[i].decayStart;
    local.phase = phase.data();
    local.least = 1e-4f;
    if (!lights[i].cone) continue;
    local.hasCone = true;
    local.axis = shadows[i].worldToFrame().linear * normalize(lights[i].cone->direction);
    local.outerCosine = lights[i].outerCosine();
    local.perCosine = 1 / (lights[i].innerCosine() - local.outerCosine);
  }
  std::vector<MarchRay> rays;
  for (int i = 0; i != 300; ++i) {
    const Vec3f direction = normalize(Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)});
    const Vec3f origin =
        Vec3f{std::sin(i * 0.9f), std::cos(i * 1.9f), std::sin(i * 0.4f)} * 0.8f - direction * 1.2f;
    MarchRay ray;
    const Vec3f at = grid->worldToIndex()(origin) - Vec3f(grid->firstBrick() * 8);
    ray.density = {at, grid->worldToIndex().linear * direction};
    ray.length = 2.5f;
    ray.jitter = 0.3f;
    for (std::size_t l = 0; l != lights.size(); ++l) {
      const Vec3f from = shadows[l].worldToFrame()(origin),
                  way = shadows[l].worldToFrame().linear * direction;
      const float closest = -dot(from, way);
      const Vec3f foot = from + way * closest;
      ray.locals[l] = {{from, way}, closest, std::max(dot(foot, foot), 1e-8f), {0.1f, -0.2f, 0.1f}};
    }
    rays.push_back(ray);
  }
  for (const bool coloured : {false, true}) {
    scene.hasColouredShadow = coloured;
    for (MarchScene::Local& local : scene.locals) {
      local.shadow[1] = coloured ? 0.3f : 1.0f;
      local.shadow[2] = coloured ? 2.0f : 1.0f;
    }
    std::vector<MarchResult> expected(rays.size());
    test::marchRaysScalar(scene, rays, expected);
    test::forEachTarget([&] {
      std::vector<MarchResult> results(rays.size());
      marchRays(scene, rays, results);
      for (std::size_t i = 0; i != rays.size(); ++i)
        for (std::size_t l = 0; l != lights.size(); ++l)
          for (int c = 0; c != 3; ++c)
            // Near a light 1 / r^2 makes the numbers large; rays end at a transmittance of 1e-4.
            ASSERT_NEAR(results[i].suns[l][c], expected[i].suns[l][c], 3e-4f * (1 + expected[i].suns[l][c]))
                << i << " " << l << " " << c;
    });
  }
}

TEST(NearLights, GiveBlackWhereThereAreNone) {
  const RenderVolume volume(ball(1.0f, 0.1f));
  const Image image = renderImage(volume, medium(2.0f), {}, downAlong(0.0f), singleScattering()).image;
  EXPECT_EQ(image.at("R", 0, 0), 0.0f);
  EXPECT_NEAR(image.at("A", 0, 0), 1 - std::exp(-4.0f), 0.01f);
}

TEST(NearLights, RefuseWhatIsAbsurd) {
  const auto refused = [](const auto& change, const std::string& words) {
    Lights lights{{{}}, {}, {point({0, 1, 0})}};
    lights.locals[0].cone = LocalLight::Cone{{0, -1, 0}, 25, 5};
    change(lights);
    try {
      lights.check();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
      return true;
    }
    return false;
  };
  EXPECT_FALSE(refused([](Lights&) {}, ""));
  EXPECT_TRUE(refused([](Lights& l) { l.suns[0].irradiance.y = -1; }, "sun: expected three numbers"));
  EXPECT_TRUE(refused([](Lights& l) { l.suns[0].direction = {}; }, "sun: expected a direction"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].position.x = NAN; }, "point: expected a position"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].intensity.x = INFINITY; }, "point: expected three"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].shadow.z = -1; }, "point: shadow multiplier"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].decayStart = -1; }, "point: expected a decay"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].cone->angleDegrees = 91; }, "point: expected a cone"));
  EXPECT_TRUE(
      refused([](Lights& l) { l.locals[0].cone->penumbraDegrees = 26; }, "point: expected a penumbra"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].name = "sun"; }, "'sun' is taken twice"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].name = "a.b"; }, "got 'a.b'"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].name = "air"; }, "'air' is that of a layer"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals[0].name = std::string(201, 'a'); }, "at most 200 bytes"));
  EXPECT_TRUE(refused([](Lights& l) { l.locals.resize(9); }, "at most 8"));
}

TEST(ProjectedLightVolume, AddsTheShadowOfThingsToWhatIsBehindThem) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  const Vec3d centre{0.0, 0.1, 0.1};
  const double radius = 0.3;
  // One face, a cone, and six faces from within the volume.
  for (const LocalLight& light :
       {point({0, 5, 1}), spot({0.2f, 3, 0}, {0, 0, 0}, 40, 5), point({-0.3f, -0.2f, 0.1f})}) {
    const ProjectedLightVolume bare(volume, light);
    ProjectedLightVolume shaded = bare;
    shaded.addShade(
        [&](const Ray& ray) { return test::distanceToBall(ray.origin, ray.direction, centre, radius); },
        0.1f);
    int lit = 0, dark = 0;
    for (int i = 0; i != 4000; ++i) {
      const Vec3f p = Vec3f{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)} * 0.55f;
      const float added = shaded.columnDensity(p) - bare.columnDensity(p);
      const Vec3d from(light.position), way = Vec3d(p) - from;
      // As in the test of suns; the way from the light to p is as long as `way`.
      const auto isHidden = [&](double r) {
        return test::distanceToBall(from, normalize(way), centre, r) < length(way);
      };
      if (!isHidden(radius + 0.1)) {
        EXPECT_EQ(added, 0.0f) << i;
        ++lit;
      } else if (isHidden(radius - 0.1) && length(Vec3d(p) - centre) < radius - 0.1) {
        EXPECT_NEAR(added, detail::kDark * 0.1f, 1e-3f) << i;
      } else if (isHidden(radius - 0.1) &&
                 test::distanceToBall(from, normalize(way), centre, radius) < length(way) - 0.1) {
        EXPECT_NEAR(added, detail::kDark * 0.1f, 1e-3f) << i;
        ++dark;
      }
    }
    EXPECT_GT(lit, 500);
    EXPECT_GT(dark, 50);
  }
}

}  // namespace
}  // namespace nephele
