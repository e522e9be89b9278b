#include "nephele/render/march/field_march.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <vector>

#include "nephele/levelset/grid/bake.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/function_field.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/volume/field_volume.h"

namespace nephele {
namespace {

constexpr float kVoxel = 0.05f;
const Box kBox{{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}};

Camera looking(const Vec3f& from, int pixels, float fovDegrees) {
  return Camera::lookingAt(from, {0, 0, 0}, {0, 1, 0}, {pixels, pixels, fovDegrees});
}

// A camera with a single, nearly parallel pixel.
Camera needle(const Vec3f& from, const Vec3f& to) {
  return Camera::lookingAt(from, to, {0, 1, 0}, {1, 1, 0.001f});
}

RenderVolume gridless(const ScalarField& density, float voxelSize = kVoxel) {
  return gridlessVolume(density, kBox, voxelSize);
}

Medium medium(float extinction) {
  Medium result;
  result.extinction = extinction;
  return result;
}

RenderOptions options(int samples = 1) {
  RenderOptions result;
  result.samples = samples;
  result.aovs = {};
  return result;
}

const Lights kLights{{{"sun", {1, 1, 1}, {3, 3, 3}}}, {0.2f, 0.3f, 0.4f}};

// A bumpy ball whose edge is a tenth of a voxel wide.
ScalarField crisp() {
  FractalSumOptions bumps;
  bumps.octaves = 3;
  bumps.frequency = 1 / (12 * kVoxel);
  return smoothstep(-0.05f * kVoxel, 0.05f * kVoxel,
                    sphere({0, 0, 0}, 0.8f) + fractalSum(bumps) * (2 * kVoxel));
}

double rootMeanSquare(const Image& a, const Image& b, const std::string& channel) {
  const std::vector<float>&x = a.channel(channel).values, &y = b.channel(channel).values;
  double sum = 0;
  for (std::size_t i = 0; i != x.size(); ++i) sum += (double(x[i]) - y[i]) * (double(x[i]) - y[i]);
  return std::sqrt(sum / double(x.size()));
}

// Lines through the box, from one face to the others.
std::vector<FieldDensity::Line> lines(int count) {
  std::vector<FieldDensity::Line> result;
  for (int i = 0; i != count; ++i) {
    const float t = float(i);
    const Vec3f from{1.4f * std::sin(t * 1.7f), 1.4f * std::sin(t * 2.9f), -1.5f},
        to{1.5f * std::sin(t * 0.7f + 1), 1.5f * std::cos(t * 1.3f), 1.5f};
    result.push_back({from, normalize(to - from), length(to - from)});
  }
  return result;
}

TEST(FieldDensity, BoundsHoldAllAlongALine) {
  // Spans contain what the field is there, and between them it is nothing.
  const ScalarField field = crisp() * (sin(dot(position(), VectorField(Vec3f{7, 5, 3}))) + 1.2f);
  const FieldDensity density(field, kBox, kVoxel);
  for (const auto detail : {FieldDensity::Detail::cells, FieldDensity::Detail::bricks})
    for (const FieldDensity::Line& line : lines(40)) {
      FieldDensity::Walk walk(density, line, detail);
      FieldDensity::Span span;
      bool isMore = walk.next(span);
      for (int i = 0; i != 500; ++i) {
        const float s = line.length * (float(i) + 0.5f) / 500;
        float last = 0;
        while (isMore && span.end < s) {
          EXPECT_GE(span.begin, last);
          last = span.end;
          isMore = walk.next(span);
        }
        const float value = field(line.at(s));
        // Rounding may put a place next to a border on its other side.
        if (isMore && std::min(std::fabs(s - span.begin), std::fabs(s - span.end)) < 1e-5f) continue;
        if (isMore && span.begin < s)
          EXPECT_TRUE(span.range.contains(value)) << s << ' ' << value;
        else
          EXPECT_EQ(value, 0.0f) << s;
      }
    }
}

TEST(FieldDensity, CellsLeaveLessToLookAtThanBricks) {
  const FieldDensity density(mask(sphere({0, 0, 0}, 0.8f), 0.1f * kVoxel), kBox, kVoxel);
  const FieldDensity::Line line{{0.1f, 0.1f, -1.5f}, {0, 0, 1}, 3};
  const auto open = [&](FieldDensity::Detail detail) {
    FieldDensity::Walk walk(density, line, detail);
    float sum = 0;
    for (FieldDensity::Span span; walk.next(span);)
      if (!span.range.isPoint()) sum += span.end - span.begin;
    return sum;
  };
  EXPECT_LT(open(FieldDensity::Detail::cells), 0.5f * open(FieldDensity::Detail::bricks));
  EXPECT_GT(open(FieldDensity::Detail::cells), 0);
}

TEST(FieldDensity, ValuesAreThoseOfTheField) {
  // Restricted expressions give the same bits.
  std::vector<ScalarField> balls;
  for (int i = 0; i != 40; ++i)
    balls.push_back(sphere({1.2f * std::sin(i * 1.1f), 1.2f * std::sin(i * 2.3f), 1.2f * std::sin(i * 3.7f)},
                           0.2f + 0.1f * std::sin(float(i))));
  const ScalarField field = mask(unionOf(balls), 0.05f);
  const FieldDensity density(field, kBox, kVoxel);
  FieldDensity::Batch batch;
  std::vector<float> expected;
  for (const FieldDensity::Line& line : lines(20))
    for (int i = 0; i != 100; ++i) {
      const float s = line.length * float(i) / 100;
      batch.add(density, line, s);
      expected.push_back(field(line.at(s)));
    }
  const std::span<const float> values = batch.eval(density);
  ASSERT_EQ(values.size(), expected.size());
  for (std::size_t i = 0; i != expected.size(); ++i) EXPECT_EQ(values[i], expected[i]) << i;
}

TEST(FieldDensity, WhatIsNotANumberOrNegativeIsNothing) {
  const ScalarField odd = functionField([](const Vec3f& p) {
    return p.x > 0.5f ? std::nanf("") : p.x < -0.5f ? -1.0f : 1.0f;
  });
  const FieldDensity density(odd, kBox, 0.5f);
  FieldDensity::Batch batch;
  for (const float x : {-1.0f, 0.0f, 1.0f}) batch.add(density, {{x, 0, 0}, {0, 0, 1}, 1}, 0.0f);
  const std::span<const float> values = batch.eval(density);
  EXPECT_EQ(values[0], 0);
  EXPECT_EQ(values[1], 1);
  EXPECT_EQ(values[2], 0);
}

TEST(FieldDensity, RefusesWhatHasNoMeaning) {
  EXPECT_THROW(FieldDensity(crisp(), {}, kVoxel), Error);
  EXPECT_THROW(FieldDensity(crisp(), Box::everywhere(), kVoxel), Error);
  EXPECT_THROW(FieldDensity(crisp(), kBox, 0), Error);
  EXPECT_THROW(FieldDensity(crisp(), kBox, std::nanf("")), Error);
  EXPECT_THROW(FieldDensity(crisp(), kBox, 1e-4f), Error);
}

TEST(FieldMarch, SlabTransmitsByBeersLaw) {
  // Sharp faces, straight and slanted: T = exp(-sigma d / cos), each face found to within the last halving of
  // a step of half a voxel, a 64th of a voxel.
  const RenderVolume volume = gridless(mask(box({{-1.4f, -1.4f, -0.313f}, {1.4f, 1.4f, 0.313f}})) * 0.5f);
  for (const float sigma : {0.1f, 1.0f, 6.0f})
    for (const float x : {0.0f, 3.0f}) {
      const float tau = 0.5f * sigma * 0.626f * std::sqrt(1 + x * x / 36);
      const Image image =
          renderImage(volume, medium(sigma), {}, needle({x, 0, 6}, {0, 0, 0}), options()).image;
      EXPECT_NEAR(image.at("A", 0, 0), 1 - std::exp(-tau), std::exp(-tau) * sigma * kVoxel / 64) << sigma;
    }
}

TEST(FieldMarch, BallTransmitsByTheIntegralOfItsDensity) {
  // The reference is the midpoint rule with 20000 steps; the edge is a tenth of a voxel wide. Steps that are
  // as they should be err by the threshold, and there are a few on either side of the ball.
  const ScalarField ball = mask(sphere({0, 0, 0}, 1), 0.1f * kVoxel);
  const RenderVolume volume = gridless(ball);
  for (const float offset : {0.0f, 0.4f, 0.9f, 0.99f, 0.999f, 1.01f}) {
    const int steps = 20000;
    double sum = 0;
    for (int i = 0; i != steps; ++i)
      sum += ball({offset, 0.1f * offset, 3 * (float(i) + 0.5f) / steps - 1.5f});
    const double exact = 1 - std::exp(-4.0 * sum * 3 / steps);
    const Vec3f to{offset, 0.1f * offset, 0};
    const Image image = renderImage(volume, medium(4), {}, needle(to + Vec3f{0, 0, 4}, to), options()).image;
    EXPECT_NEAR(image.at("A", 0, 0), exact, 3.0 / 1024) << offset;
  }
}

// The least numbers that floats hold times a length are 0, and nothing is opaque for it.
TEST(FieldMarch, TheLeastDensitiesAreNotOpaque) {
  const RenderVolume volume = gridless(exp(square(component(position(), 1) * (1 / 0.035f)) * -1.0f), 0.02f);
  const Camera camera = Camera::lookingAt({0, 3.2f, 5.6f}, {0, 0, 0}, {0, 1, 0}, {64, 48});
  const Image image = renderImage(volume, medium(20), kLights, camera, options()).image;
  // A slanted line through the sheet, whose integral is sqrt(pi) 0.035 over the sine of its elevation.
  for (const float alpha : image.channel("A").values) EXPECT_LT(alpha, 0.97f);
}

TEST(FieldMarch, AgreesWithTheGridOnASmoothDensity) {
  // A bell of half a unit, which voxels of a tenth of that hold to some 1e-3 of its height.
  const ScalarField bell = exp(dot(position(), position()) * -4.0f) - 0.01f;
  BakeOptions baking;
  baking.voxelSize = kVoxel;
  baking.box = kBox;
  baking.background = 0.0f;
  const RenderVolume grid(bakeGrid(max(bell, 0.0f), baking));
  const Camera camera = looking({0, 1, 6}, 32, 25);
  for (const float sigma : {1.0f, 10.0f}) {
    const Image a = renderImage(grid, medium(sigma), kLights, camera, options(4)).image,
                b = renderImage(gridless(bell), medium(sigma), kLights, camera, options(4)).image;
    for (const char* channel : {"R", "G", "B", "A"})
      EXPECT_LT(rootMeanSquare(a, b, channel), 0.004) << channel << ' ' << sigma;
  }
}

TEST(FieldMarch, RefinementReachesFineStepsWithATenthOfTheirSamples) {
  // Against steps of a 512th of a voxel; transitions are a tenth of one wide. Uniform steps of a 64th are the
  // bar for opacities; what the light adds, read at fewer places, is below a thousandth.
  const RenderVolume volume = gridless(crisp());
  const Medium dense = medium(1 / kVoxel);
  const Camera camera = looking({0.3f, 0.4f, 6}, 24, 18);
  const auto look = [&](float voxels, const Refinement& refinement) {
    RenderOptions how = options();
    how.step = voxels * kVoxel;
    how.refinement = refinement;
    return renderImage(volume, dense, kLights, camera, how);
  };
  const RenderResult truth = look(1.0f / 512, {1, 0}), fine = look(1.0f / 64, {1, 0}),
                     coarse = look(0.5f, {1, 0}), adaptive = look(0.125f, {1.0f / 32768, 4});
  EXPECT_LT(rootMeanSquare(adaptive.image, truth.image, "A"), 5e-5);
  EXPECT_LT(rootMeanSquare(adaptive.image, truth.image, "G"), 1e-4);
  EXPECT_LT(rootMeanSquare(fine.image, truth.image, "A"), 5e-5);
  EXPECT_GT(rootMeanSquare(coarse.image, truth.image, "A"), 1e-3);
  EXPECT_LT(adaptive.samples * 10, fine.samples);
  // What it takes by default.
  const RenderResult usual = renderImage(volume, dense, kLights, camera, options());
  EXPECT_LT(rootMeanSquare(usual.image, truth.image, "G"), 1e-3);
  EXPECT_LT(usual.samples * 15, fine.samples);
}

TEST(FieldMarch, ASmallerThresholdGivesASmallerError) {
  const RenderVolume volume = gridless(crisp());
  const Camera camera = looking({0.3f, 0.4f, 6}, 24, 18);
  const auto look = [&](float step, const Refinement& refinement) {
    RenderOptions how = options();
    how.step = step;
    how.refinement = refinement;
    return renderImage(volume, medium(1 / kVoxel), {}, camera, how).image;
  };
  const Image truth = look(kVoxel / 256, {1, 0});
  double before = 1;
  for (const float threshold : {1 / 16.0f, 1 / 256.0f, 1 / 4096.0f}) {
    const double error = rootMeanSquare(look(kVoxel / 8, {threshold, 6}), truth, "A");
    EXPECT_LT(error, before / 2);
    before = error;
  }
}

TEST(FieldMarch, OpacityBehindTheEarlyOutDoesNotDependOnTheSteps) {
  // A ray ends where it lets through 1e-4.
  const RenderVolume volume = gridless(mask(sphere({0, 0, 0}, 1), 0.1f * kVoxel));
  for (const float step : {0.01f, 0.1f, 1.0f})
    for (const int halvings : {0, 5}) {
      RenderOptions how = options();
      how.step = step;
      how.refinement.halvings = halvings;
      EXPECT_NEAR(renderImage(volume, medium(200), {}, needle({0, 0, 4}, {0, 0, 0}), how).image.at("A", 0, 0),
                  1 - 1e-4, 1e-6);
    }
}

TEST(FieldMarch, HolesAreNotLookedInto) {
  // Two small balls far apart; the same without bounds has to be searched everywhere.
  const ScalarField balls = mask(unionOf(sphere({-1, 0, 0.2f}, 0.15f), sphere({1, 0, -0.2f}, 0.15f)), 0.01f);
  const ScalarField blind = functionField([balls](const Vec3f& p) { return balls(p); });
  const Camera camera = looking({0, 0, 9}, 16, 20);
  const RenderResult a = renderImage(gridless(balls, 0.1f), medium(8), kLights, camera, options()),
                     b = renderImage(gridless(blind, 0.1f), medium(8), kLights, camera, options());
  EXPECT_LT(a.samples * 10, b.samples);
  EXPECT_LT(rootMeanSquare(a.image, b.image, "A"), 2e-3);
  EXPECT_LT(rootMeanSquare(a.image, b.image, "G"), 2e-3);
}

TEST(FieldMarch, DetailIsAsFineAsThePicture) {
  // Stripes a 50th of a voxel wide, density 1 + cos, seen by pixels of a 500th of one: optical depths from 0
  // to 2 sigma t behind a slab of thickness t.
  const float period = kVoxel / 50;
  const ScalarField x = dot(position(), VectorField(Vec3f{1, 0, 0}));
  const ScalarField stripes =
      (cos(x * (2 * kPi / period)) + 1) * mask(box({{-1, -1, -kVoxel}, {1, 1, kVoxel}}));
  Camera::Frame frame{40, 2};
  frame.projection = Camera::Projection::orthographic;
  frame.orthographicWidth = 40 * kVoxel / 500;
  const Camera camera = Camera::lookingAt({0, 0, 2}, {0, 0, 0}, {0, 1, 0}, frame);
  const Image image = renderImage(gridless(stripes), medium(5 / kVoxel), {}, camera, options()).image;
  for (int i = 0; i != 40; ++i) {
    const double phase = 2 * kPi * (i + 0.5 - 20) * (double(frame.orthographicWidth.value()) / 40) / period;
    EXPECT_NEAR(image.at("A", i, 0), 1 - std::exp(-10 * (1 + std::cos(phase))), 5e-3) << i;
  }
}

TEST(FieldMarch, EndsHoweverSmallTheStepsOrLargeTheNumbers) {
  // A ball about as dense as volumes may be, and steps that they cannot tell apart.
  const RenderVolume volume = gridless(mask(sphere({0, 0, 0}, 0.02f), 0.01f) * 1e17f);
  RenderOptions how = options();
  how.step = 1e-20f;
  how.refinement.halvings = 16;
  const Image image = renderImage(volume, medium(1e9f), {}, needle({0, 0, 4}, {0, 0, 0}), how).image;
  EXPECT_NEAR(image.at("A", 0, 0), 1 - 1e-4, 1e-6);
}

TEST(FieldMarch, IsTheSameAtAnyNumberOfThreads) {
  const auto look = [] {
    const RenderVolume volume = gridless(crisp());
    RenderOptions how = options(4);
    how.deep = DeepOptions{};
    return renderImage(volume, medium(20), kLights, looking({0.3f, 0.4f, 6}, 40, 20), how);
  };
  const RenderResult many = look();
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const RenderResult alone = look();
  for (std::size_t c = 0; c != many.image.channels.size(); ++c)
    EXPECT_EQ(many.image.channels[c].values, alone.image.channels[c].values) << many.image.channels[c].name;
  EXPECT_EQ(many.samples, alone.samples);
}

TEST(FieldMarch, RaysDoNotDependOnEachOther) {
  const FieldDensity density(crisp(), kBox, kVoxel);
  MarchScene scene;
  scene.extinction = 20;
  FieldSteps steps;
  steps.longest = kVoxel / 4;
  steps.pixelWidth = kVoxel;
  steps.lightLength = steps.uniformLength = kVoxel;
  std::vector<MarchRay> rays;
  for (const FieldDensity::Line& line : lines(50)) {
    MarchRay& ray = rays.emplace_back();
    ray.world = {line.origin, line.direction};
    ray.length = line.length;
    ray.jitter = float(rays.size()) / 50;
  }
  std::vector<MarchResult> together(rays.size()), alone(rays.size());
  FieldMarcher(density, steps).march(scene, rays, together);
  FieldMarcher marcher(density, steps);
  for (std::size_t i = rays.size(); i-- != 0;) marcher.march(scene, {&rays[i], 1}, {&alone[i], 1});
  for (std::size_t i = 0; i != rays.size(); ++i) {
    EXPECT_EQ(together[i].opticalDepth, alone[i].opticalDepth) << i;
    EXPECT_EQ(together[i].samples, alone[i].samples) << i;
    EXPECT_EQ(together[i].distance, alone[i].distance) << i;
  }
}

TEST(FieldMarch, DeepPicturesFlattenToTheBeauty) {
  const RenderVolume volume = gridless(crisp());
  RenderOptions how = options(4);
  how.deep = DeepOptions{};
  const RenderResult result = renderImage(volume, medium(6), kLights, looking({0.3f, 0.4f, 6}, 24, 22), how);
  for (int y = 0; y != 24; ++y)
    for (int x = 0; x != 24; ++x) {
      const FlatPixel flat = flattened(result.deep->at(x, y));
      // Half of the last digit of a 16 bit float below 1, and of the brightest colour here.
      EXPECT_NEAR(flat.alpha, result.image.at("A", x, y), 2.5e-4f);
      EXPECT_NEAR(flat.colour.y, result.image.at("G", x, y), 5e-4f);
      float before = 0;
      for (const DeepSample& sample : result.deep->at(x, y)) {
        EXPECT_GE(sample.z, before);
        EXPECT_GE(sample.zBack, sample.z);
        before = sample.zBack;
      }
    }
}

TEST(FieldMarch, LayersComeFromTheField) {
  // The ball's front is at 6 - 1 from the camera, and its opacity met within a few hundredths.
  const RenderVolume volume = gridless(mask(sphere({0, 0, 0}, 1), 0.1f * kVoxel));
  RenderOptions how = options();
  how.aovs = {"Z", "Z_median", "position", "light"};
  const Image image = renderImage(volume, medium(100), kLights, needle({0, 0, 6}, {0, 0, 0}), how).image;
  EXPECT_NEAR(image.at("Z", 0, 0), 5, 0.002f);
  EXPECT_NEAR(image.at("Z_median", 0, 0), 5 + std::log(2.0f) / 100, 0.002f);
  EXPECT_NEAR(image.at("P.Z", 0, 0), 1 - std::log(2.0f) / 100, 0.002f);
}

TEST(FieldMarch, AHoldoutHidesWhatIsBehindIt) {
  // Half of the light is held back in front of everything: alpha and light are half as much.
  const RenderVolume volume = gridless(mask(sphere({0, 0, 0}, 1), 0.1f));
  const Camera camera = looking({0, 0, 6}, 4, 5);
  DeepImage front{4, 4, {}, {}};
  front.pixels.assign(16, {DeepSample{1.0f, 1.0f, 0.5f, {}}});
  RenderOptions how = options(4);
  const Image plain = renderImage(volume, medium(2), kLights, camera, how).image;
  how.holdout = std::make_shared<const Holdout>(front);
  const Image held = renderImage(volume, medium(2), kLights, camera, how).image;
  EXPECT_NEAR(held.at("A", 1, 1), 0.5f * plain.at("A", 1, 1), 1e-4f);
  EXPECT_NEAR(held.at("G", 1, 1), 0.5f * plain.at("G", 1, 1), 1e-3f);
}

TEST(FieldMarch, ACameraInsideSeesOut) {
  // From the middle of a ball of radius 1: T = exp(-sigma), whatever is in front of the box.
  const RenderVolume volume = gridless(mask(sphere({0, 0, 0}, 1), 0.1f * kVoxel));
  const Image image = renderImage(volume, medium(0.8f), {},
                                  Camera::lookingAt({0, 0, 0}, {0, 0, 1}, {0, 1, 0}, {2, 2, 40}), options())
                          .image;
  for (int i = 0; i != 4; ++i) EXPECT_NEAR(image.at("A", i % 2, i / 2), 1 - std::exp(-0.8f), 2e-3f);
}

TEST(GridlessVolume, OfNothingIsEmpty) {
  const RenderVolume volume = gridless(ScalarField(-1.0f));
  EXPECT_TRUE(volume.isEmpty());
  EXPECT_EQ(renderImage(volume, medium(1), kLights, looking({0, 0, 6}, 4, 20), options()).image.at("A", 1, 1),
            0);
}

TEST(GridlessVolume, RefusesWhatTheLightWouldMissAltogether) {
  // A thread a hundredth of a voxel thick.
  EXPECT_THROW(gridless(mask(capsule({-1, 0.012f, 0.003f}, {1, 0.012f, 0.003f}, 0.0005f), 1e-4f)), Error);
}

TEST(GridlessVolume, RefusesOptionsWithoutMeaning) {
  const RenderVolume volume = gridless(mask(sphere({0, 0, 0}, 1), 0.1f));
  const Camera camera = looking({0, 0, 6}, 4, 20);
  for (const Refinement& refinement : {Refinement{0, 5}, Refinement{-1, 5}, Refinement{std::nanf(""), 5},
                                       Refinement{0.1f, -1}, Refinement{0.1f, 17}}) {
    RenderOptions how = options();
    how.refinement = refinement;
    EXPECT_THROW(renderImage(volume, medium(1), kLights, camera, how), Error);
  }
  EXPECT_THROW(gridlessVolume(crisp(), {}, kVoxel), Error);
  EXPECT_THROW(gridlessVolume(crisp(), kBox, -1), Error);
}

}  // namespace
}  // namespace nephele
