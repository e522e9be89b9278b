#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "modeling/interval.h"
#include "modeling/math.h"

namespace nephele {

/// The volumes of a picture as the marching kernels read them: plain pointers into structures that others
/// own.
struct MarchScene {
  static constexpr int kMostSuns = 12;
  static constexpr int kMostLocals = 8;
  static constexpr int kMostLights = kMostSuns + kMostLocals;
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

  /// Bricks of three numbers on the density's lattice; none where the table is null.
  struct ColourBricks {
    const float* values[3] = {};
    const std::int32_t* table = nullptr;
    Vec3i count{};
  };

  /// Density times its colour, and light of its own: radiance * extinction *
  /// emissionScale * emission per world unit.
  ColourBricks colour, emission;
  float emissionScale = 1.0f;
  /// What is scattered of the emission, per colour, as `scattered`; null where there is none.
  const float* glow[3] = {};
  /// Multiplies the extinction, at most 1 each.
  float extinctionColour[3] = {1.0f, 1.0f, 1.0f};
  bool hasExtinctionColour() const {
    return extinctionColour[0] != 1.0f || extinctionColour[1] != 1.0f || extinctionColour[2] != 1.0f;
  }
  /// Mean of the colours' opacities at an optical depth.
  float meanOpacity(float opticalDepth) const {
    if (!hasExtinctionColour()) return -std::expm1(-opticalDepth);
    float sum = 0.0f;
    for (const float share : extinctionColour) sum -= std::expm1(-opticalDepth * share);
    return sum / 3.0f;
  }
  /// Where it holds, every colour is marched with opacities of its own; `colours` must be 3.
  bool isColoured() const {
    return colour.table || emission.table || hasExtinctionColour() || hasColouredShadow;
  }

  /// `shadow` multiplies the extinction between light and sample, per colour.
  struct Sun : Bricks {
    float shadow[3] = {1.0f, 1.0f, 1.0f};
  };
  std::vector<Sun> suns;

  /// A light at a place: see ProjectedLightVolume for frame and faces, LocalLight for the rest.
  struct Local {
    struct Face : Bricks {
      int axis = 2;
      float side = 1.0f, perTangent = 1.0f, perDepth = 1.0f;
      /// Of the first brick, in nodes.
      Vec3f corner{};
    };
    std::vector<Face> faces;
    float shadow[3] = {1.0f, 1.0f, 1.0f};
    float albedo[3] = {1.0f, 1.0f, 1.0f};
    /// Power of the distance that the light falls with, from `decayStart` on.
    int decay = 2;
    float decayStart = 0.0f;
    /// Of the cone: its way in the frame, the cosine where it ends and 1 / how far the cosine rises to full.
    bool hasCone = false;
    Vec3f axis{};
    float outerCosine = -1.0f, perCosine = 1.0f;
    /// For every octave kPhaseNodes + 1 values of its phase function, even in the sine of half the angle.
    static constexpr int kPhaseNodes = 1024;
    const float* phase = nullptr;
    /// Distances below this count as this.
    float least = 1e-6f;
  };
  std::vector<Local> locals;
  std::size_t lightCount() const { return suns.size() + locals.size(); }
  /// Whether the shadows of a light differ between colours.
  bool hasColouredShadow = false;

  /// Scattered light on dense lattices of `scatteredSize` nodes: `colours` of every sun in turn, then of the
  /// locals and the sky; null where there is none. Empty if there is none at all.
  std::vector<const float*> scattered;
  Vec3i scatteredSize{};

  /// Octave n of a sun sees extinction * attenuation[n].
  int octaves = 1;
  float attenuation[kMostOctaves] = {1.0f};
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

/// What hides a ray from some depth on: pairs of a depth along the line of sight and the optical depth in
/// front of it, both not decreasing, straight between them and constant beyond. Empty: nothing does.
struct HoldoutCurve {
  struct Knot {
    float depth = 0.0f, opticalDepth = 0.0f;
  };
  const Knot* knots = nullptr;
  std::size_t count = 0;

  bool empty() const { return count == 0; }
  /// At `depth`; `cursor` starts at 0 and is kept by the caller for depths that do not decrease.
  float transmittance(float depth, std::size_t& cursor) const {
    while (cursor != count && knots[cursor].depth <= depth) ++cursor;
    if (cursor == 0) return 1.0f;
    const Knot& a = knots[cursor - 1];
    if (cursor == count) return std::exp(-a.opticalDepth);
    const Knot& b = knots[cursor];
    const float share = (depth - a.depth) / (b.depth - a.depth);
    return std::exp(-(a.opticalDepth + (b.opticalDepth - a.opticalDepth) * share));
  }
};

/// A ray from where it enters the volume to where it leaves it, s from 0 to `length` in world units.
struct MarchRay {
  LatticeRay density, scattered;
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
  /// Weight of every octave of every sun: phase, contribution and albedo, per colour.
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
  std::uint32_t samples = 0;
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

/// Marches rays with the widest instructions that the machine has, 16 samples of a ray at a time. Fills in as
/// many `records` as there are rays, or none; they do not change the results.
///
/// Behind a holdout with transmittance H the weight of a step is H T (1 - dT), and T goes on as without it.
void marchRays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
               std::span<MarchRecord> records = {});

/// The same sample by sample: the truth that marchRays is tested against.
void marchRaysScalar(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results);

}  // namespace nephele
