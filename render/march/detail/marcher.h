// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCHER) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCHER
#undef NEPHELE_MARCHER
#else
#define NEPHELE_MARCHER
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

#include "nephele/render/march/detail/lit_steps.h"
#include "nephele/render/march/detail/local_light.h"
#include "nephele/render/march/detail/march_bricks.h"
#include "nephele/render/march/detail/march_coded_bricks.h"
#include "nephele/render/march/detail/march_lattice.h"
#include "nephele/render/march/detail/step_growth.h"
#include "nephele/render/march/march_kernels.h"
#include "nephele/render/volume/brick_walk.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Enough that the processor need not wait for one vector before it starts the next, and few enough that a ray
// ends soon behind what hides the rest.
constexpr int kBlock = 64;

// One ray's march: collects steps, adds the opacity of a block of them at a time, and the light of a vector
// of those that are seen. Three colours where MarchScene::isColoured, else one.
template <int kColours>
class Marcher {
 public:
  Marcher(const MarchScene& scene, const MarchRay& ray, float opaque, MarchResult& result,
          MarchRecord* record)
      : scene_(scene),
        ray_(ray),
        result_(result),
        record_(record),
        opaque_(opaque),
        isHeld_(!ray.holdout.empty()),
        needsBegin_(isHeld_ || record),
        together_(record ? kBlock / 2 : kBlock) {
    std::fill_n(through_, kColours, 1.0f);
    // Parts of vectors are put into what is there.
    for (int i = 0; i != kBlock; i += kLanes)
      for (float* block : {s_, ds_, begin_, known_}) hn::Store(hn::Zero(Lanes()), Lanes(), block + i);
    for (std::size_t i = 0; i != sumCount(); ++i) sums_[i] = hn::Zero(Lanes());
  }

  // `count` steps of length `ds` from `start` on, of this density if it is not negative. False once the ray
  // is as good as opaque.
  bool take(float start, float ds, int count, float density);
  bool take(const detail::GrowingSteps& steps, float density);
  // One step that is known.
  bool take(const MarchStep& step);

  void finish() {
    if (count_ > 0) flush();
    lightAll();
    result_.opticalDepth = depth_;
    if (record_) mark();
    addSums(result_);
  }

 private:
  // stepsOf(n, length) sets the lengths of steps of these numbers, and returns where they begin.
  template <class StepsOf>
  HWY_INLINE bool takeAll(int count, float density, StepsOf&& stepsOf);

  // Adds the steps collected, up to the first behind which nothing is seen: then false.
  bool flush();

  // Fills the last vector with steps of no length at the place of the last.
  void repeatLast();
  bool someUnknown(int end) const;
  // Densities that are known in place of those looked up, if any were.
  void takeKnown(int end, bool wereLookedUp, float* density);
  // What the holdout leaves of every step, and of its opacity; up to which step, as nothing is seen of it.
  int hold(float before, const float* after, int used);

  // The result so far, with the light that is waited for; what is added later stays as without a record.
  void mark();
  // The steps of a block, before its light is added.
  void record(float before, const float* after, int used);

  // What steps, from the `first` of the block on, weigh in the picture: the transmittance that each takes
  // away, and nothing where the ray is as good as opaque. Adds what glows in them.
  HWY_INLINE void weigh(int first, Floats own, Floats after, Floats seen, LitPart<kColours>& steps);

  // T (1 - exp(-t)) / t, by its series where the difference would lose its digits.
  void glow(int first, Floats own, const Floats (&before)[kColours], Floats seen,
            const LitPart<kColours>& steps);

  void colour(Floats own, LitPart<kColours>& steps);
  // Of all that wait for it.
  void lightAll();
  // Finds where the light of steps is. It is read when the next densities have been found: one wait for both.
  void light(const LitPart<kColours>& steps);

  // Adds the light that located steps send to the eye.
  void readLight();
  void readLight(int located);
  // The part of it that the lattices hold.
  void scattered(const LitPart<kColours>& steps, const Cells& cells);

  // So far, a vector each: three colours of every sun, the scattered lattices, MarchResult::colouredOpacity.
  static constexpr std::size_t kMostSums = 3 * MarchScene::kMostSuns + 2 * MarchScene::kMostScattered + 3;
  std::size_t sumCount() const { return 3 * scene_.suns.size() + 2 * scene_.scattered.size() + 3; }

  void addSums(MarchResult& result) const;

  const MarchScene& scene_;
  const MarchRay& ray_;
  MarchResult& result_;
  MarchRecord* record_;
  // Behind this optical depth nothing is seen.
  const float opaque_;
  const bool isHeld_, needsBegin_;
  // Steps of a block: fewer where every block is marked in the record.
  const int together_;
  // Whether some densities of the block need no look-up.
  bool someKnown_ = false;
  std::size_t holdoutCursor_ = 0;
  // Where in its step a sample is, about.
  float jitter_ = ray_.jitter;
  alignas(64) float seen_[kBlock], s_[kBlock], ds_[kBlock], begin_[kBlock];
  // Densities, negative where they have to be looked up.
  alignas(64) float known_[kBlock];
  // Of steps that have them.
  alignas(64) float colours_[kColours][kBlock] = {};
  alignas(64) float glows_[kColours][kBlock] = {};
  int count_ = 0;
  // Optical depth, and what is left of light from behind, per colour.
  float depth_ = 0.0f, through_[kColours];
  LitSteps<kColours> lit_;
  // Steps whose light is located, and where it is.
  static constexpr int kMostLocated = kBlock / kLanes;
  int locatedCount_ = 0;
  LitPart<kColours> located_[kMostLocated];
  Places places_[MarchScene::kMostSuns][kMostLocated];
  Cells cells_[kMostLocated];
  Floats sums_[kMostSums];
};

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
