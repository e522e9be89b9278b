#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "modeling/interval.h"
#include "modeling/math.h"

namespace nephele {

/// The volumes of a picture as the marching kernels read them: plain pointers into structures that others
/// own.
struct MarchScene {
  static constexpr int kMostSuns = 8;
  static constexpr int kMostOctaves = 16;

  /// Bricks on a lattice whose first brick is brick 0.
  struct Bricks {
    const float* values = nullptr;
    const std::int32_t* table = nullptr;
    Vec3i count{};
  };

  Bricks density;
  const Interval* ranges = nullptr;
  const std::uint8_t* emptiness = nullptr;
  float extinction = 1.0f;

  std::vector<Bricks> suns;

  /// Dense lattice of sky visibility; null without a sky.
  const float* sky = nullptr;
  Vec3i skySize{};

  int octaves = 1;
  /// 1 where the albedo is grey, else 3.
  int colours = 1;

  /// Longest step: `step`, `uniformStep` in bricks whose density hardly varies, or the width of a pixel if
  /// that is larger (up to 4 steps). Within a brick no more than an optical depth of `stepDepth` in its
  /// densest voxel, but at least `leastStep`.
  float step = 1.0f, uniformStep = 1.0f, leastStep = 0.125f, stepDepth = 0.5f;
  /// Width of a pixel per distance.
  float pixelAngle = 0.0f;
  /// Stop where less than this is transmitted.
  float cutoff = 1e-4f;
};

/// A line through one lattice: position at distance s is origin + s direction.
struct LatticeRay {
  Vec3f origin, direction;
};

/// A ray from where it enters the volume to where it leaves it, s from 0 to `length` in world units.
struct MarchRay {
  LatticeRay density, sky;
  LatticeRay suns[MarchScene::kMostSuns];
  /// Distance from the camera at s = 0.
  float start = 0.0f;
  float length = 0.0f;
  /// Of the angle between the ray and the line of sight.
  float cosine = 1.0f;
  /// Where in its step a sample is taken, in [0, 1).
  float jitter = 0.5f;
  /// Weight of every octave of every sun: phase, contribution and albedo, per colour.
  float weight[MarchScene::kMostSuns][3][MarchScene::kMostOctaves];
};

/// What a ray gathers. Multiply `suns` by the irradiance, `sky` by the sky's radiance and the albedo.
struct MarchResult {
  float opticalDepth = 0.0f;
  float suns[MarchScene::kMostSuns][3] = {};
  float sky = 0.0f;
  /// Distance from the camera at which the opacity first exceeds 0.5 %; infinite if it never does.
  float distance = 0.0f;
  std::uint32_t samples = 0;
};

/// Marches rays with the widest instructions that the machine has, 16 samples of a ray at a time.
void marchRays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results);

/// The same sample by sample: the truth that marchRays is tested against.
void marchRaysScalar(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results);

}  // namespace nephele
