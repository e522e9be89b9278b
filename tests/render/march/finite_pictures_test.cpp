// Pictures at the ends of what options allow, looked at before a writer turns what is not finite into
// numbers.
#include <gtest/gtest.h>

#include <cmath>

#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "nephele/render/scene/environment.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

const std::vector<std::string> kLayers{"Z",      "Z_median", "Z_mean",        "normal", "position",
                                       "motion", "light",    "transmittance", "albedo", "emission"};

struct Look {
  Medium medium{.extinction = 4};
  Lights lights{.suns = {DistantLight{}}};
  Vec3f eye{0, 0, 4};

  void expectFinite(const std::string& what) const {
    const RenderVolume volume(test::ball(1, 0.2f));
    const Camera camera = Camera::lookingAt(eye, {0.01f, 0.02f, 0}, {0, 1, 0}, {12, 9, 40});
    RenderOptions options;
    options.aovs = kLayers;
    const RenderResult marched = renderImage(volume, medium, lights, camera, options);
    EXPECT_EQ(notFiniteCount(marched.image), 0u) << what;
    for (const float alpha : marched.image.channel("A").values) {
      EXPECT_GE(alpha, 0) << what;
      EXPECT_LE(alpha, 1 + 1e-6f) << what;
    }
    PathOptions path;
    path.samplesPerPixel = 4;
    EXPECT_EQ(notFiniteCount(pathTraceImage(volume, medium, lights, camera, path).image), 0u) << what;
  }
};

TEST(FinitePictures, WhateverTheExtinction) {
  for (const float extinction : {0.0f, 1e-30f, 1e6f}) {
    Look look;
    look.medium.extinction = extinction;
    look.expectFinite("extinction " + std::to_string(extinction));
  }
}

TEST(FinitePictures, WhateverTheAlbedoAndThePhase) {
  float albedo = 0;
  for (const char* phase : {"rayleigh", "hg:0.99", "hg:-0.99", "two-lobe:0.99,-0.9,0.5", "mie:50"}) {
    Look look;
    look.medium.albedo = Vec3f{1, 1, 1} * albedo;
    look.medium.phase = Phase::parse(phase);
    look.expectFinite(phase);
    albedo = 1;
  }
}

TEST(FinitePictures, WhereverTheCameraAndTheLightStand) {
  // Inside, in the middle of a voxel, at a light, and far away; suns along the axes.
  for (const Vec3f& eye : {Vec3f{0, 0, 0.5f}, Vec3f{0, 0, 1}, Vec3f{0, 0, 3000}}) {
    Look look;
    look.eye = eye;
    LocalLight& lamp = look.lights.locals.emplace_back();
    lamp.name = "lamp";
    lamp.position = eye;
    lamp.intensity = {1, 1, 1};
    look.lights.suns[0].direction = eye.z < 1 ? Vec3f{0, 1, 0} : eye.z < 2 ? Vec3f{0, 0, 1} : Vec3f{-1, 0, 0};
    look.expectFinite("eye at " + std::to_string(eye.z));
  }
}

TEST(FinitePictures, HoweverBrightAndDarkTheSkyIs) {
  std::vector<Vec3f> radiance(8 * 4);
  Look look;
  look.lights.map = std::make_shared<const Environment>(8, 4, radiance);
  look.expectFinite("a black map");
  radiance[9] = {1e20f, 1e10f, 0};
  look.lights.map = std::make_shared<const Environment>(8, 4, radiance);
  look.expectFinite("a map of one pixel");
}

}  // namespace
}  // namespace nephele
