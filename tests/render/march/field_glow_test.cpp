// What rays ask a field for that glows or moves.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/scene/black_body.h"
#include "nephele/render/volume/field_volume.h"
#include "nephele/render/volume/moved_field.h"

namespace nephele {
namespace {

constexpr float kVoxel = 0.05f;
const Box kBox{{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}};
const Vec3f kFire{1, 0.5f, 0.2f};

// A camera with a single, nearly parallel pixel that looks down z, at (x, 0).
Camera needle(float x = 0) {
  return Camera::lookingAt({x, 0, 9}, {x, 0, 0}, {0, 1, 0}, {1, 1, 0.001f});
}

Medium black(float extinction) {
  return {extinction, {0, 0, 0}, Phase()};
}

RenderOptions options(int samples = 16) {
  RenderOptions result;
  result.octaves.count = 1;
  result.samples = samples;
  result.aovs = {};
  return result;
}

Vec3f pixel(const Image& image) {
  return {image.at("R", 0, 0), image.at("G", 0, 0), image.at("B", 0, 0)};
}

Vec3f seen(const FieldParts& parts, float extinction, float x = 0) {
  return pixel(renderImage(gridlessVolume(parts, kVoxel), black(extinction), {}, needle(x), options()).image);
}

// 1 within the ball of radius 1.
ScalarField inside() {
  return mask(sphere({0, 0, 0}, 1));
}

void expectNear(const Vec3f& found, const Vec3f& expected, float share) {
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c], expected[c], share * expected[c] + 1e-6f) << c;
}

// Of all channels: the sum of differences over the sum.
double difference(const Image& a, const Image& b) {
  double sum = 0, total = 0;
  for (const char* channel : {"R", "G", "B"}) {
    const std::vector<float>&x = a.find(channel)->values, &y = b.find(channel)->values;
    for (std::size_t i = 0; i != x.size(); ++i)
      sum += std::abs(double(x[i] - y[i])), total += std::abs(double(y[i]));
  }
  return sum / total;
}

TEST(FieldGlow, OfAGasThatHidesNothingIsItsLengthTimesItsEmission) {
  const FieldParts parts{.box = kBox, .emission = kFire * inside(), .emissionScale = 3};
  expectNear(seen(parts, 0.7f), kFire * (3 * 0.7f * 2), 0.01f);
  // At 0.8 of the radius.
  expectNear(seen(parts, 0.7f, 0.8f), kFire * (3 * 0.7f * 1.2f), 0.01f);
  EXPECT_EQ(seen(parts, 0.7f, 1.1f), Vec3f{});
}

TEST(FieldGlow, ShowsDensity1WhereItIsOpaque) {
  // e (1 - exp(-s L)) of an emission e and a density 1 over L = 2; e s L (exp(-s) - exp(-2 s)) / s of what
  // glows in the far half alone.
  const FieldParts all{.density = inside(), .box = kBox, .emission = kFire * inside()};
  const FieldParts far{
      .density = inside(), .box = kBox, .emission = kFire * (inside() * mask(-component(position(), 2)))};
  for (const float s : {0.1f, 1.0f, 5.0f}) {
    expectNear(seen(all, s), kFire * -std::expm1(-2 * s), 0.01f);
    expectNear(seen(far, s), kFire * (std::exp(-s) - std::exp(-2 * s)), 0.02f);
  }
}

TEST(FieldGlow, OfHeatIsThatOfABlackBody) {
  const FieldParts parts{.box = kBox, .temperature = inside() * 2100.0f, .emissionScale = 0.5f};
  expectNear(seen(parts, 2), blackBody(2100) * (0.5f * 2 * 2), 0.01f);
  // Both add up.
  FieldParts both = parts;
  both.emission = kFire * inside();
  expectNear(seen(both, 2), (blackBody(2100) + kFire) * (0.5f * 2 * 2), 0.01f);
}

TEST(FieldGlow, ComesNearerToWhatIsSampledAsVoxelsShrink) {
  // A bumpy ball of smoke with a warm core, lit by it alone.
  const ScalarField ball = sphere({0, 0, 0}, 1) + 0.15f * perlin({.frequency = 3.0f});
  const FieldParts parts{
      .density = mask(ball, 0.2f), .box = kBox, .temperature = 2200.0f * mask(ball - 0.3f, 0.3f)};
  const Medium smoke{3, {0.8f, 0.8f, 0.8f}, Phase()};
  const Camera camera = Camera::lookingAt({2, 3, 5}, {0, 0, 0}, {0, 1, 0}, {24, 24, 24});
  RenderOptions how = options(4);
  how.octaves.count = 3;
  const Image exact = renderImage(gridlessVolume(parts, kVoxel), smoke, {}, camera, how).image;
  double before = 1;
  for (const float voxel : {0.2f, 0.1f, 0.05f}) {
    const double now =
        difference(renderImage(sampledVolume(parts, voxel), smoke, {}, camera, how).image, exact);
    EXPECT_LT(now, 0.7 * before) << voxel;
    before = now;
  }
  EXPECT_LT(before, 0.03);
}

TEST(FieldGlow, IsTheSameToPaths) {
  // Within 4 standard errors of 40000 paths (relative 0.005 each); what glows reaches beyond the density.
  const FieldParts parts{
      .density = mask(sphere({0, 0, 0.2f}, 0.5f)), .box = kBox, .emission = kFire * inside()};
  const RenderVolume volume = gridlessVolume(parts, kVoxel);
  PathOptions paths;
  paths.samplesPerPixel = 40000;
  for (const Vec3f& extinction : {Vec3f{1, 1, 1}, Vec3f{0.4f, 0.7f, 1}}) {
    Medium its = black(1.5f);
    its.extinctionColour = extinction;
    const Vec3f traced = pixel(pathTraceImage(volume, its, {}, needle(), paths).image),
                marched = pixel(renderImage(volume, its, {}, needle(), options()).image);
    expectNear(traced, marched, 0.02f);
  }
}

TEST(FieldGlow, DeepPicturesFlattenToTheBeauty) {
  const FieldParts parts{.density = mask(sphere({0, 0, 0.2f}, 0.5f), 0.1f),
                         .box = kBox,
                         .emission = kFire * mask(sphere({0, 0, 0}, 1), 0.2f)};
  RenderOptions how = options(4);
  how.deep = DeepOptions{};
  const Camera camera = Camera::lookingAt({0, 0, 6}, {0, 0, 0}, {0, 1, 0}, {16, 16, 24});
  const RenderResult result = renderImage(gridlessVolume(parts, kVoxel), black(2), {}, camera, how);
  for (int y = 0; y != 16; ++y)
    for (int x = 0; x != 16; ++x) {
      const FlatPixel flat = flattened(result.deep->at(x, y));
      EXPECT_NEAR(flat.alpha, result.image.at("A", x, y), 5e-4f);
      EXPECT_NEAR(flat.colour.x, result.image.at("R", x, y), 4e-3f) << x << " " << y;
    }
}

TEST(FieldMotion, MovesASlabByItsShareOfTheShutter) {
  // A slab of |x| < 0.2 at 1.0 per frame, from 0 to 0.6: at x it is there for so long as |x - t| < 0.2, and
  // counts in 24 places.
  FieldParts parts{
      .density = mask(0.2f - abs(component(position(), 0))) * mask(0.5f - abs(component(position(), 2))),
      .box = {{-0.25f, -0.1f, -0.55f}, {0.25f, 0.1f, 0.55f}},
      .velocity = VectorField(Vec3f{1, 0, 0}),
      .shutter = {0, 0.6}};
  const RenderVolume volume = gridlessVolume(parts, kVoxel);
  for (const float x : {-0.3f, -0.1f, 0.0f, 0.1f, 0.2f, 0.3f, 0.5f}) {
    const float there = std::max(std::min(x + 0.2f, 0.6f) - std::max(x - 0.2f, 0.0f), 0.0f) / 0.6f;
    const Image image = renderImage(volume, black(2), {}, needle(x), options(4)).image;
    EXPECT_NEAR(image.at("A", 0, 0), 1 - std::exp(-2 * there), 2.0f / 24) << x;
  }
}

TEST(FieldMotion, IsThatOfGrids) {
  const ScalarField ball = sphere({0, 0, 0}, 0.5f) + 0.1f * perlin({.frequency = 4.0f});
  const FieldParts parts{.density = mask(ball, 0.15f),
                         .box = {{-0.7f, -0.7f, -0.7f}, {0.7f, 0.7f, 0.7f}},
                         .colour = vectorField(0.5f + 0.5f * component(position(), 0), ScalarField(0.6f),
                                               0.5f - 0.4f * component(position(), 1)),
                         .emission = kFire * mask(ball - 0.2f, 0.15f),
                         .velocity = cross(VectorField(Vec3f{0, 0.2f, 0.5f}), position()),
                         .shutter = {-0.5, 0.5}};
  const Medium smoke{4, {1, 1, 1}, Phase()};
  const Lights lights{{{"sun", {0.5f, 0.7f, 0.5f}, {3, 3, 3}}}, {0.3f, 0.4f, 0.5f}};
  const Camera camera = Camera::lookingAt({2, 3, 5}, {0, 0, 0}, {0, 1, 0}, {24, 24, 20});
  RenderOptions how = options(4);
  how.octaves.count = 3;
  const RenderVolume volume = gridlessVolume(parts, kVoxel);
  const Image exact = renderImage(volume, smoke, lights, camera, how).image,
              sampled = renderImage(sampledVolume(parts, 0.02f), smoke, lights, camera, how).image;
  FieldParts still = parts;
  still.velocity = std::nullopt;
  const Image unmoved = renderImage(gridlessVolume(still, kVoxel), smoke, lights, camera, how).image;
  EXPECT_LT(difference(sampled, exact), 0.02);
  EXPECT_GT(difference(unmoved, exact), 0.04);
}

TEST(FieldMotion, HasRangesThatHoldAllItsValues) {
  const ScalarField lumps = max(perlin({.frequency = 2.0f}), 0.0f);
  const VectorField wind = cross(VectorField(Vec3f{0.2f, 1, 0}), position());
  const FieldMotion motion{wind, {-0.3, 0.5}, {{-1, -1, -1}, {1, 1, 1}}, 0.02f};
  const ScalarField whole = blurred(lumps, motion);
  EXPECT_TRUE(motion.reached().contains(Vec3f{1.3f, 1, 1.3f}));
  std::minstd_rand random(5);
  std::uniform_real_distribution<float> place(-1.4f, 1.4f), size(0.02f, 0.6f), share(0, 1);
  for (int i = 0; i != 200; ++i) {
    const Vec3f low{place(random), place(random), place(random)};
    const Box box{low, low + Vec3f{size(random), size(random), size(random)}};
    const Interval range = whole.range(box);
    const ScalarField here = whole.restrictedTo(box);
    for (int k = 0; k != 20; ++k) {
      const Vec3f p = box.min + box.size() * Vec3f{share(random), share(random), share(random)};
      const float value = whole(p);
      EXPECT_TRUE(range.contains(value)) << value << " " << range.min << " " << range.max;
      EXPECT_NEAR(here(p), value, 1e-6f);
    }
  }
}

TEST(FieldGlow, RefusesWhatHasNoMeaning) {
  const auto refuses = [](const FieldParts& parts) { EXPECT_THROW(gridlessVolume(parts, kVoxel), Error); };
  const ScalarField nowhere(std::numeric_limits<float>::quiet_NaN());
  const VectorField still(Vec3f{});
  refuses({.density = inside(), .box = kBox, .temperature = inside() * 2e5f});
  refuses({.density = inside(), .box = kBox, .emission = kFire * inside(), .emissionScale = -1});
  refuses({.density = inside(), .box = kBox, .velocity = vectorField(nowhere, nowhere, nowhere)});
  refuses({.density = inside(), .box = kBox, .velocity = still, .shutter = {1, 0}});
  // What is no number glows as little as it hides.
  expectNear(
      seen({.density = inside(), .box = kBox, .emission = vectorField(nowhere, inside(), inside())}, 1),
      {0, -std::expm1(-2.0f), -std::expm1(-2.0f)}, 0.01f);
}

}  // namespace
}  // namespace nephele
