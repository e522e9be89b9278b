#include "nephele/render/scene/surfaces.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using test::ball;
using test::slab;

// A square of edge 2 `half` in the plane z, facing +z, its texture coordinates from 0 to 1.
Mesh square(float z, float half = 100.0f) {
  Mesh mesh;
  const double h = half;
  mesh.positions = {{-h, -h, z}, {h, -h, z}, {h, h, z}, {-h, h, z}};
  const std::uint32_t corners[] = {0, 1, 2, 3};
  mesh.addFace(corners);
  mesh.attributes = {{"uv", MeshAttribute::Domain::corner, 2, {0, 0, 1, 0, 1, 1, 0, 1}}};
  return mesh;
}

Camera needle(const Vec3f& position = {0, 0, 9}, const Vec3f& target = {}) {
  return Camera::lookingAt(position, target, {0, 1, 0}, {1, 1, 0.001f});
}

Medium medium(float extinction) {
  return {.extinction = extinction, .albedo = {1, 1, 1}, .phase = Phase()};
}

RenderOptions with(std::vector<SurfaceObject> objects) {
  RenderOptions options;
  options.octaves.count = 1;
  options.samples = 1;
  options.deep.emplace();
  options.aovs = {"Z", "Z_median", "normal", "position", "light"};
  options.surfaces = std::make_shared<const Surfaces>(std::move(objects));
  return options;
}

const Lights kSun{{{"sun", {0, 0, 1}, {3, 2, 1}}}, {}};

TEST(Surfaces, MeshesThatAreNotValidAreRefused) {
  Mesh broken = square(0);
  broken.corners[2] = 4;
  EXPECT_THROW(Surfaces::estimateBytes(broken), Error);
  EXPECT_THROW(Surfaces({SurfaceObject{.mesh = broken}}), Error);
}

TEST(Surfaces, AreHitWhereTheyAre) {
  const Surfaces surfaces({{square(-2)}, {.mesh = square(-5), .isHoldout = true}});
  const auto hit = surfaces.hit({{0.3, 0.4, 7}, {0, 0, -1}});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance, 9, 1e-5);
  EXPECT_EQ(hit->normal, (Vec3f{0, 0, 1}));
  EXPECT_FALSE(hit->isHoldout);
  const auto back = surfaces.hit({{0, 0, -9}, {0, 0, 1}});
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->isHoldout);
  EXPECT_EQ(back->normal, (Vec3f{0, 0, -1}));
  EXPECT_FALSE(surfaces.hit({{0, 0, 7}, {0, 0, 1}}));
  EXPECT_TRUE(surfaces.occluded({{0, 0, 7}, {0, 0, -1}}, 10));
  EXPECT_FALSE(surfaces.occluded({{0, 0, 7}, {0, 0, -1}}, 8));
}

// Powers of two round nothing, so that all is the same but for the unit.
TEST(Surfaces, AreHitAlikeHoweverTinyOrVast) {
  const auto tilted = [](double unit) {
    Mesh mesh = square(0, 3);
    for (Vec3d& p : mesh.positions) p = Vec3d{p.x, p.y, 0.25 * p.x} * unit;
    return Surfaces({{.mesh = mesh}});
  };
  const Ray ray{{0.3, 0.4, 7}, {0, 0, -1}};
  const auto hit = tilted(1).hit(ray);
  ASSERT_TRUE(hit);
  // By hand: the plane z = x / 4.
  EXPECT_NEAR(hit->distance, 7 - 0.075, 1e-5);
  for (const int power : {-100, -40, 60}) {
    const double unit = std::ldexp(1.0, power);
    const Surfaces surfaces = tilted(unit);
    const Ray scaled{ray.origin * unit, ray.direction};
    const auto same = surfaces.hit(scaled);
    ASSERT_TRUE(same) << power;
    EXPECT_EQ(same->distance, hit->distance * unit) << power;
    EXPECT_EQ(same->normal, hit->normal) << power;
    EXPECT_TRUE(surfaces.occluded(scaled, 8 * unit));
    EXPECT_FALSE(surfaces.occluded(scaled, 6 * unit));
  }
}

// A plane 2 below: distances along rays that sink by 2 in so many units follow from the closed form.
TEST(Surfaces, TheGroundIsMetExactlyFromNearItsMiddleToTheHorizon) {
  const Surfaces ground({{.mesh = groundPlane({1, 5, -3}, -2, 2e5f), .castsShadows = false}});
  for (const double far : {0.0, 0.5, 3.0, 40.0, 1e3, 9e4})
    for (const double azimuth : {0.1, 1.0, 2.5, 4.4}) {
      const Vec3d way{far * std::cos(azimuth), -2, far * std::sin(azimuth)};
      const auto hit = ground.hit({{1, 0, -3}, normalize(way)});
      ASSERT_TRUE(hit) << far << " " << azimuth;
      EXPECT_NEAR(hit->distance / length(way), 1, 2e-6) << far << " " << azimuth;
      EXPECT_EQ(hit->normal, (Vec3f{0, 1, 0}));
    }
  EXPECT_FALSE(ground.hit({{1, 0, -3}, normalize(Vec3d{2e5, -2, 0})}));
}

// Rays of shadows begin as near to a surface as what casts shadows asks for, however wide the ground is.
TEST(Surfaces, TheGroundDoesNotMoveShadowsAway) {
  const Surfaces object({{square(0, 1)}}),
      both({{square(0, 1)}, {.mesh = groundPlane({}, -2, 2e5f), .castsShadows = false}});
  EXPECT_EQ(both.clearance(), object.clearance());
}

TEST(Surfaces, AreNotMetFromFartherAwayThanFloatsTell) {
  // Embree ends the program where rays begin beyond 1.8e18 from what it holds, in units of about its size.
  const Surfaces surfaces({{square(0)}});
  for (const double away : {1e21, 1e30, 1e300}) {
    const Ray ray{{0.3, 0.4, away}, {0, 0, -1}};
    EXPECT_FALSE(surfaces.hit(ray));
    EXPECT_FALSE(surfaces.occluded(ray, INFINITY));
    EXPECT_EQ(surfaces.distanceToShade(ray), INFINITY);
  }
  EXPECT_TRUE(surfaces.hit({{0.3, 0.4, 1e15}, {0, 0, -1}}));
}

TEST(Surfaces, ShowCheckersAndTextures) {
  auto texture = std::make_shared<Image>();
  texture->width = texture->height = 2;
  for (const char* name : {"R", "G", "B"}) texture->add(name);
  texture->channels[0].values = {0.1f, 0.2f, 0.3f, 0.4f};
  SurfaceObject object{square(0, 1)};
  object.colour = {1, 1, 1};
  object.checkers = 2;
  const auto colourAt = [&](double x, double y) {
    return Surfaces({object}).hit({{x, y, 5}, {0, 0, -1}})->colour.x;
  };
  // Texture coordinates are (x + 1) / 2, so that fields are as wide as a unit.
  EXPECT_EQ(colourAt(-0.5, -0.5), 1.0f);
  EXPECT_EQ(colourAt(0.5, -0.5), 0.25f);
  EXPECT_EQ(colourAt(0.5, 0.5), 1.0f);
  object.checkers = 0;
  object.texture = texture;
  // Middles of the texels: the first row of the picture is at the top.
  EXPECT_NEAR(colourAt(-0.5, 0.5), 0.1f, 1e-6f);
  EXPECT_NEAR(colourAt(0.5, 0.5), 0.2f, 1e-6f);
  EXPECT_NEAR(colourAt(0.5, -0.5), 0.4f, 1e-6f);
  EXPECT_NEAR(colourAt(0, 0), 0.25f, 1e-6f);
  // Through what is half transparent half of the object's own colour is seen.
  texture->add("A").values.assign(4, 0.5f);
  object.colour = {0.6f, 1, 1};
  EXPECT_NEAR(colourAt(-0.5, 0.5), 0.6f * (0.1f + 0.5f), 1e-6f);
}

TEST(Surfaces, RefuseWhatCannotBeDrawn) {
  EXPECT_THROW(Surfaces({SurfaceObject{Mesh{}}}), Error);
  Mesh bare = square(0);
  bare.attributes.clear();
  EXPECT_THROW(Surfaces({{.mesh = bare, .checkers = 4}}), Error);
  Mesh broken = square(0);
  broken.positions[1].x = NAN;
  EXPECT_THROW(Surfaces({{.mesh = broken}}), Error);
}

TEST(Surfaces, ScatterEvenlyAndLieBehindTheVolume) {
  // Radiance colour E / pi, dimmed by the slab on the way in and out; opacity of both is 1.
  const RenderVolume volume(slab(2.1f, 6.0f, 0.1f));
  const Lights sun = kSun;
  for (const float sigma : {1e-6f, 0.4f}) {
    const RenderOptions options = with({{.mesh = square(-3), .colour = {0.5f, 0.5f, 0.25f}}});
    Medium dark = medium(sigma);
    dark.albedo = {};
    const RenderResult result = renderImage(volume, dark, sun, needle(), options);
    const float through = std::exp(-2.1f * sigma);
    EXPECT_NEAR(result.image.at("A", 0, 0), 1, 1e-5f);
    EXPECT_NEAR(result.image.at("R", 0, 0), 0.5f * 3 / kPi * through * through, 2e-3f);
    EXPECT_NEAR(result.image.at("B", 0, 0), 0.25f * 1 / kPi * through * through, 2e-3f);
    EXPECT_EQ(result.image.at("R", 0, 0), result.image.at("light_objects.R", 0, 0));
    const FlatPixel flat = flattened(result.deep->at(0, 0));
    EXPECT_NEAR(flat.alpha, 1, 2.5e-4f);
    EXPECT_NEAR(flat.colour.x, result.image.at("R", 0, 0), 2.5e-4f);
    if (sigma > 0.1f) continue;
    EXPECT_NEAR(result.image.at("Z", 0, 0), 12, 1e-4f);
    EXPECT_NEAR(result.image.at("Z_median", 0, 0), 12, 1e-4f);
    EXPECT_NEAR(result.image.at("P.Z", 0, 0), -3, 1e-4f);
    EXPECT_EQ(result.image.at("N.Z", 0, 0), 1);
  }
}

TEST(Surfaces, SeeTheSky) {
  // A sky of radiance L on all sides makes colour L; behind a wide black slab of optical depth t
  // it is dimmed to 2 E3(t), the mean of exp(-t / cos) weighted by the cosine.
  const RenderVolume volume(slab(2.1f, 80.0f, 0.5f));
  Medium dark = medium(1e-6f);
  dark.albedo = {};
  const Lights sky{{}, {1, 2, 3}};
  const RenderOptions options = with({{.mesh = square(-3, 1), .colour = {0.5f, 0.5f, 0.5f}}});
  const Image open = renderImage(volume, dark, sky, needle(), options).image;
  EXPECT_NEAR(open.at("G", 0, 0), 1, 1e-3f);
  dark.extinction = 0.5f;
  const Image covered = renderImage(volume, dark, sky, needle(), options).image;
  RenderOptions bare;
  bare.octaves.count = bare.samples = 1;
  const float through = 1 - renderImage(volume, dark, {}, needle(), bare).image.at("A", 0, 0);
  const double depth = -std::log(double(through));
  double mean = 0;
  for (int i = 0; i != 20000; ++i) {
    const double mu = (i + 0.5) / 20000;
    mean += 2 * mu * std::exp(-depth / mu) / 20000;
  }
  EXPECT_NEAR(covered.at("G", 0, 0) / through, mean, 0.05 * mean);
}

TEST(Surfaces, HoldOutWhatIsBehindThem) {
  // A plane through the middle of a ball that lets half of the light through a radius.
  const RenderVolume volume(ball(1.0f, 0.025f));
  const float sigma = std::log(2.0f);
  const RenderResult held =
      renderImage(volume, medium(sigma), kSun, needle(),
                  with({{.mesh = square(0), .isHoldout = true, .castsShadows = false}}));
  EXPECT_NEAR(held.image.at("A", 0, 0), 0.5f, 0.006f);
  EXPECT_NEAR(flattened(held.deep->at(0, 0)).alpha, held.image.at("A", 0, 0), 2.5e-4f);
  // The object itself, seen through the front half, is the rest: opacities add up to 1.
  const RenderOptions seen = with({{.mesh = square(0)}});
  const Image both = renderImage(volume, medium(sigma), kSun, needle(), seen).image;
  EXPECT_NEAR(both.at("A", 0, 0), 1, 1e-5f);
  RenderOptions nothing = with({{.mesh = square(5), .isHoldout = true, .castsShadows = false}});
  EXPECT_EQ(renderImage(volume, medium(sigma), kSun, needle(), nothing).image.at("A", 0, 0), 0);
}

TEST(Surfaces, CastShadowsIntoTheVolume) {
  // Sun along +x, a plate that covers the upper half of its light: below y = 0 the ball is as without it,
  // above it gets nothing.
  const RenderVolume volume(ball(1.0f, 0.05f));
  Mesh plate;
  plate.positions = {{3, 0, -5}, {3, 5, -5}, {3, 5, 5}, {3, 0, 5}};
  const std::uint32_t corners[] = {0, 1, 2, 3};
  plate.addFace(corners);
  const Lights sun{{{"sun", {1, 0, 0}, {1, 1, 1}}}, {}};
  const auto lightAt = [&](float y, bool isThere) {
    RenderOptions options = with({{plate}});
    if (!isThere) options.surfaces.reset();
    return renderImage(volume, medium(1.0f), sun, needle({0, y, 9}, {0, y, 0}), options).image.at("R", 0, 0);
  };
  EXPECT_NEAR(lightAt(-0.15f, true), lightAt(-0.15f, false), 1e-6f);
  EXPECT_LT(lightAt(0.15f, true), 1e-6f * lightAt(0.15f, false));
  // At its edge about half.
  EXPECT_NEAR(lightAt(0, true) / lightAt(0, false), 0.5f, 0.35f);
}

TEST(Surfaces, NeedAVolume) {
  const auto empty = std::make_shared<BrickGrid>(*ball(1.0f, 0.1f, 0.0f));
  EXPECT_THROW(renderImage(RenderVolume(empty), medium(1), kSun, needle(), with({{square(0)}})), Error);
}

TEST(Surfaces, CastTheShadowsOfPointsAndSpotsIntoTheVolume) {
  // A plate half way between the light and the ball covers the upper half of its light.
  const RenderVolume volume(ball(1.0f, 0.05f));
  Mesh plate;
  plate.positions = {{3, 0, -5}, {3, 5, -5}, {3, 5, 5}, {3, 0, 5}};
  const std::uint32_t corners[] = {0, 1, 2, 3};
  plate.addFace(corners);
  LocalLight light;
  light.position = {6, 0, 0};
  light.intensity = {36, 36, 36};
  for (const bool isSpot : {false, true}) {
    if (isSpot) light.cone = LocalLight::Cone{{-1, 0, 0}, 30, 5};
    const auto lightAt = [&](float y, bool isThere) {
      RenderOptions options = with({{plate}});
      if (!isThere) options.surfaces.reset();
      return renderImage(volume, medium(1.0f), Lights{{}, {}, {light}}, needle({0, y, 9}, {0, y, 0}), options)
          .image.at("R", 0, 0);
    };
    EXPECT_NEAR(lightAt(-0.15f, true), lightAt(-0.15f, false), 1e-6f);
    EXPECT_LT(lightAt(0.15f, true), 1e-6f * lightAt(0.15f, false));
    EXPECT_GT(lightAt(0.15f, false), 0.01f);
  }
}

TEST(Surfaces, StopTheColoursThatShadowMultipliersLetThroughTheVolume) {
  const RenderVolume volume(ball(1.0f, 0.05f));
  Mesh plate;
  plate.positions = {{3, -5, -5}, {3, 5, -5}, {3, 5, 5}, {3, -5, 5}};
  const std::uint32_t corners[] = {0, 1, 2, 3};
  plate.addFace(corners);
  const Lights sun{{{.direction = {1, 0, 0}, .shadow = {1, 0.3f, 0.05f}}}, {}};
  const Image image = renderImage(volume, medium(1.0f), sun, needle(), with({{plate}})).image;
  EXPECT_LT(image.at("B", 0, 0), 1e-6f);
}

TEST(Surfaces, EstimateTheirMemory) {
  // A sheet of 20000 triangles.
  Mesh sheet;
  constexpr std::uint32_t n = 100;
  for (std::uint32_t y = 0; y <= n; ++y)
    for (std::uint32_t x = 0; x <= n; ++x)
      sheet.positions.push_back({double(x), double(y), std::sin(0.3 * x + 0.7 * y)});
  for (std::uint32_t y = 0; y != n; ++y)
    for (std::uint32_t x = 0; x != n; ++x) {
      const std::uint32_t a = y * (n + 1) + x;
      sheet.addFace(std::array{a, a + 1, a + n + 2, a + n + 1});
    }
  const std::size_t bytes = Surfaces({{sheet}}).memoryBytes();
  // At least corners and positions, as Embree and we hold them.
  EXPECT_GT(bytes, 20000u * 24 + 10201u * 36);
  EXPECT_LE(double(bytes), Surfaces::estimateBytes(sheet));
}

}  // namespace
}  // namespace nephele
