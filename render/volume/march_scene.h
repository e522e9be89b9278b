#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "nephele/modeling/base/interval.h"
#include "nephele/modeling/base/math.h"
#include "nephele/render/volume/coded_bricks.h"

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
    /// See CodedBricks. Of the density and the suns marchRays reads these and not the values.
    const std::int16_t* codes = nullptr;
    const CodedBricks::Entry* entries = nullptr;
  };

  Bricks density;
  const Interval* ranges = nullptr;
  const std::uint8_t* emptiness = nullptr;
  /// See RenderVolume; null where it is not to be used.
  const std::uint8_t* uniformity = nullptr;
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
  /// Whether steps that are known have colours of their own, in place of `colour`.
  bool hasStepColours = false;
  bool hasColour() const { return colour.table || hasStepColours; }
  /// The same of what glows, in place of `emission`.
  bool hasStepGlow = false;
  float emissionScale = 1.0f;
  /// Multiplies the extinction, at most 1 each.
  float extinctionColour[3] = {1.0f, 1.0f, 1.0f};
  bool hasExtinctionColour() const {
    return extinctionColour[0] != 1.0f || extinctionColour[1] != 1.0f || extinctionColour[2] != 1.0f;
  }
  float leastColour() const {
    return std::min({extinctionColour[0], extinctionColour[1], extinctionColour[2]});
  }
  /// Mean of the colours' opacities at an optical depth.
  float meanOpacity(float opticalDepth) const {
    if (!hasExtinctionColour()) return -std::expm1(-opticalDepth);
    float sum = 0.0f;
    for (const float share : extinctionColour) sum -= std::expm1(-opticalDepth * share);
    return sum / 3.0f;
  }
  /// Where it holds, every colour is marched with opacities of its own; `colours` must be 3.
  bool isColoured() const { return hasColour() || glows() || hasExtinctionColour() || hasColouredShadow; }
  bool glows() const { return emission.table || hasStepGlow; }

  /// `shadow` multiplies the extinction between light and sample, per colour; for `bend` see LightVolume.
  struct Sun : Bricks {
    float shadow[3] = {1.0f, 1.0f, 1.0f};
    float bend = 0.0f;
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

  /// Scattered light of one or two kinds on a dense lattice of `scatteredSize` nodes, first axis fastest: two
  /// numbers side by side for every node, so that both are read at once.
  struct Scattered {
    static constexpr int kSky = -1, kGlow = -2;
    /// A light (the locals follow the suns), the sky or what glows, and which of its `colours`, or of the
    /// sky's `skyParts`.
    struct Kind {
      int light = kSky, part = 0;
    };
    const float* nodes = nullptr;
    int count = 2;
    Kind kinds[2];
  };
  std::vector<Scattered> scattered;
  static constexpr int kMostScattered = (3 * (kMostLights + 2) + 1) / 2;
  Vec3i scatteredSize{};

  /// Octave n of a sun sees extinction * attenuation[n].
  int octaves = 1;
  float attenuation[kMostOctaves] = {1.0f};
  /// 1 where the albedo is grey, else 3.
  int colours = 1;
  /// As `colours` where that is 3, else 1 to 3, see SkyParts.
  int skyParts = 1;

  /// Longest step: `step`, `uniformStep` in bricks whose density hardly varies, or the width of a pixel if
  /// that is larger (up to 4 steps); or `divided` times the smaller of step and pixel. Within a brick no more
  /// than an optical depth of `stepDepth` in its densest voxel, but at least `leastStep`.
  float step = 1.0f, uniformStep = 1.0f, leastStep = 0.125f, stepDepth = 0.5f;
  /// More than 1 where the rays of a pixel divide each other's steps.
  float divided = 1.0f;
  /// Times this at most, steps grow with the optical depth in front of them, since less is seen of them.
  float mostGrowth = 4.0f;
  /// Width of a pixel per distance.
  float pixelAngle = 0.0f;
  /// Stop where less than this is transmitted.
  float cutoff = 1e-4f;
};

}  // namespace nephele
