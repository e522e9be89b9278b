#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/base/math.h"
#include "nephele/render/scene/holdout_curve.h"
#include "nephele/render/volume/lattice_ray.h"
#include "nephele/render/volume/march_scene.h"

namespace nephele {

/// A ray from where it enters the volume to where it leaves it, s from 0 to `length` in world units.
struct MarchRay {
  LatticeRay density, scattered;
  /// In the world, for densities that are no grid.
  LatticeRay world;
  LatticeRay suns[MarchScene::kMostSuns];
  /// In a local light's frame.
  struct Local {
    LatticeRay frame;
    /// Where on the ray the light is closest, and how far it then is, squared.
    float closest = 0.0f, distance2 = 1.0f;
    /// In nodes, added to every look-up.
    Vec3f shift{};
  };
  Local locals[MarchScene::kMostLocals];
  /// Distance from the camera at s = 0.
  float start = 0.0f;
  float length = 0.0f;
  /// Of the angle between the ray and the line of sight.
  float cosine = 1.0f;
  /// Where in its step a sample is taken, in [0, 1).
  float jitter = 0.5f;
  /// Weight of every term of every sun (ForwardLight) times albedo, per colour.
  float weight[MarchScene::kMostSuns][3][MarchScene::kMostOctaves];
  HoldoutCurve holdout{};
  /// Something opaque is at the end, so that the last step must not reach beyond it.
  bool isCut = false;
};

/// What a ray gathers. Multiply `suns`, which the locals follow, by irradiance or intensity, `sky` by the
/// sky's radiance.
struct MarchResult {
  float opticalDepth = 0.0f;
  float suns[MarchScene::kMostLights][3] = {};
  float sky[3] = {};
  /// Radiance of what glows.
  float emission[3] = {};
  /// Distance from the camera at which the opacity first exceeds 0.5 %; infinite if it never does.
  float distance = 0.0f;
  /// Opacity per colour that MarchRay::holdout leaves to be seen, if there is a holdout.
  float heldOpacity[3] = {};
  /// The opacity that is seen times the colour of the volume, where MarchScene::hasColour.
  float colouredOpacity[3] = {};
  std::uint32_t samples = 0;

  /// What scattered light of a kind adds to.
  float& of(const MarchScene::Scattered::Kind& kind) {
    return (kind.light >= 0                              ? suns[kind.light]
            : kind.light == MarchScene::Scattered::kGlow ? emission
                                                         : sky)[kind.part];
  }
};

/// What a ray met on its way: the steps that added opacity or light, and every few steps the result so far.
struct MarchRecord {
  struct Step {
    /// From where to where, and the opacity at its end that is seen: the mean of the colours.
    float begin, end, opacity;
  };
  struct Mark {
    /// Of the steps so far.
    std::size_t stepCount;
    MarchResult result;
  };
  std::vector<Step> steps;
  std::vector<Mark> marks;

  void clear() { steps.clear(), marks.clear(); }
};

/// Marches rays with the widest instructions that the machine has, 64 samples of a ray at a time. Fills in as
/// many `records` as there are rays, or none, which changes no result. A ray ends with the first sample
/// behind which less than the cutoff is seen.
///
/// Behind a holdout with transmittance H the weight of a step is H T (1 - dT), and T goes on as without it.
void marchRays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
               std::span<MarchRecord> records = {});

/// A step of known optical depth, and where on the ray its light is read. Steps that follow each other do not
/// overlap; between them there is nothing.
struct MarchStep {
  float begin = 0.0f, length = 0.0f, opticalDepth = 0.0f, place = 0.0f;
  /// Multiplies the albedo where MarchScene::hasStepColours.
  Vec3f colour{1, 1, 1};
  /// In the units of MarchScene::emission, where MarchScene::hasStepGlow. Such steps need no optical depth.
  Vec3f glow{};
};

/// As marchRays where the steps are known, near to far: the densities of `scene` are not read.
void marchSteps(const MarchScene& scene, std::span<const MarchRay> rays,
                std::span<const std::span<const MarchStep>> steps, std::span<MarchResult> results,
                std::span<MarchRecord> records = {});

}  // namespace nephele
