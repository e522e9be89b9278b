#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "nephele/render/march/march_kernels.h"
#include "nephele/render/volume/field_glow.h"
#include "nephele/render/volume/march_scene.h"

namespace nephele {

/// Where a ray looks at a field, and when it looks again. Lengths in world units.
struct FieldSteps {
  /// Between the first samples at most; where a pixel is narrower they stand as close as that.
  float longest = 1.0f;
  /// Width of a pixel at the eye, and how it grows with the distance.
  float pixelWidth = 0.0f, pixelAngle = 0.0f;
  /// A step is halved where that changes the opacity that the picture shows of it by more than this.
  float threshold = 1.0f / 1024;
  /// As often as this at most. 0: steps of one length through all bricks of the bounds that may hold
  /// anything, and light for each of them.
  int halvings = 5;
  /// Of the steps that the light is read for, since it varies less: an optical depth and a length that they
  /// do not exceed, and the length where the density is constant.
  float lightDepth = 0.5f, lightLength = 1.0f, uniformLength = 1.0f;
};

/// Turns what rays meet of a field into steps of known optical depth, many rays together.
///
/// A step is looked at in both ends and its middle. If the middle is off the straight line by so much that
/// the opacity, times the transmittance in front of it, differs by more than the threshold, both halves
/// become steps of their own, and all new middles of all rays are evaluated together. The optical depth of a
/// step is that of a parabola through the three. What the bounds settle to within the threshold is not
/// evaluated. Source: notes, adaptive raymarching; the test is on what halving changes and not on the
/// contribution.
class FieldMarcher {
 public:
  /// Keeps references to `density` and to its `colour` and `glow`, which may be null.
  FieldMarcher(const FieldDensity& density, const FieldSteps& steps, const VectorField* colour = nullptr,
               const FieldGlow* glow = nullptr)
      : density_(density), colour_(colour), glow_(glow), how_(steps) {}

  /// As marchRays, with the density of the field along MarchRay::world; those of `scene` are not read. Where
  /// MarchScene::hasStepColours, the colour is asked for once for every step that the light is read for.
  /// Where it has a glow of steps, so is the glow, and there are steps where there is nothing else. `samples`
  /// of the results are evaluations of the field. What becomes of a ray does not depend on the others.
  void march(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
             std::span<MarchRecord> records = {});

 private:
  // A step under refinement: the densities in its ends and its middle.
  struct Piece {
    std::uint32_t ray;
    // Where its expression is, if it is all in one region of the density.
    std::int32_t region;
    float begin, end;
    float first = 0.0f, middle = 0.0f, last = 0.0f;
    // What halving it, or the one it is a half of, changes of the optical depth; and that in front of it.
    float doubt = 0.0f, depthBefore = 0.0f;
    // Its two halves, which follow each other; 0: it is not halved.
    std::uint32_t halves = 0;
    // Whether it was evaluated and not settled by bounds, and whether it begins where the one before it ends.
    bool isOpen = true, follows = false;
  };
  struct State {
    FieldDensity::Line line;
    FieldDensity::Walk walk;
    // The run of steps that is being laid: from where on there are none yet, its end so far, the density in
    // its last sample, and its last region with where that begins.
    float cursor = 0.0f, runEnd = 0.0f, lastDensity = 0.0f, regionBegin = 0.0f;
    std::int32_t region = FieldDensity::kAnyRegion;
    // Whether there is a run, it has steps, the first of them, which the jitter shortens, is still to come,
    // and its last cells are flat.
    bool isRunning = false, isStarted = false, isFresh = false, isDone = false, isFlat = false;
    float opticalDepth = 0.0f;
    // The step for the light that is being filled, where it ends so far, the optical depth that it may have
    // and that of the steps in front of it.
    MarchStep light{};
    float lightEnd = 0.0f, lightDepth = 0.0f, lit = 0.0f;
    std::size_t holdoutCursor = 0;
    std::uint32_t samples = 0;
  };

  void addWindow(std::uint32_t index, const MarchRay& ray);
  void ask(const Piece& piece, float s);
  void answerFirst();
  void refine();
  void halve(std::size_t index);
  void emit();
  void emitPiece(std::size_t index);
  void emitHalf(std::uint32_t ray, float begin, float end, float first, float last, float share);
  void closeLight(std::uint32_t ray);
  void addLight(State& state, MarchStep step, std::vector<MarchStep>& steps) const;
  void growLight(State& state) const;
  void askColours(std::span<const MarchRay> rays);
  void addGlow(std::span<const MarchRay> rays);
  void fillGlowing(std::uint32_t ray);
  float depthOf(const Piece& piece) const;

  const FieldDensity& density_;
  const VectorField* colour_;
  const FieldGlow* glow_;
  FieldSteps how_;
  float extinction_ = 1.0f, cutoff_ = 0.0f, leastStep_ = 0.0f, leastLight_ = 0.0f, leastColour_ = 1.0f,
        growth_ = 1.0f, hidden_ = 0.0f;
  std::vector<State> states_;
  std::vector<std::uint32_t> live_;
  // Those of a window, ray by ray, then all halves, level by level.
  std::vector<Piece> pieces_;
  std::size_t firstCount_ = 0;
  FieldDensity::Batch batch_;
  std::vector<std::vector<MarchStep>> steps_;
  // With those that only glow; and which steps may glow at all.
  std::vector<MarchStep> filled_;
  struct Glowing {
    std::uint32_t ray, step;
  };
  std::vector<Glowing> glowing_;
  std::vector<std::span<const MarchStep>> spans_;
  // Places and colours of steps.
  std::array<std::vector<float>, 6> lanes_;
};

}  // namespace nephele
