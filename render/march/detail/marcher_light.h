// How a Marcher adds light. No #pragma once: read for every instruction set, by <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCHER_LIGHT) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCHER_LIGHT
#undef NEPHELE_MARCHER_LIGHT
#else
#define NEPHELE_MARCHER_LIGHT
#endif

#include <hwy/highway.h>

#include <cstddef>

#include "nephele/render/march/detail/marcher.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

template <int kColours>
HWY_INLINE void Marcher<kColours>::weigh(int first, Floats own, Floats after, Floats seen,
                                         LitPart<kColours>& steps) {
  const Lanes d;
  Floats before[kColours];
  for (int c = 0; c != kColours; ++c) {
    const Floats depth = kColours == 1 ? after : hn::Mul(after, hn::Set(d, scene_.extinctionColour[c]));
    const Floats left = expOfMinus(hn::Min(depth, hn::Set(d, 80.0f)));
    before[c] = movedUp(left, hn::Set(d, through_[c]));
    steps.weight[c] = hn::Sub(before[c], left);
    through_[c] = hn::GetLane(broadcastLast(left));
  }
  Floats most = before[0];
  for (int c = 1; c != kColours; ++c) most = hn::Max(most, before[c]);
  const auto isSeen = hn::Gt(most, hn::Set(d, scene_.cutoff));
  for (Floats& weight : steps.weight) weight = hn::IfThenElseZero(isSeen, weight);
  if constexpr (kColours == 3) {
    if (scene_.glows()) {
      for (Floats& left : before) left = hn::IfThenElseZero(isSeen, left);
      glow(first, own, before, seen, steps);
    }
    if (scene_.colour.table) colour(own, steps);
  }
  if (isHeld_)
    for (Floats& weight : steps.weight) weight = hn::Mul(weight, seen);
}

template <int kColours>
inline void Marcher<kColours>::glow(int first, Floats own, const Floats (&before)[kColours], Floats seen,
                                    const LitPart<kColours>& steps) {
  const Lanes d;
  Floats glow[3];
  if (scene_.hasStepGlow)
    for (int c = 0; c != 3; ++c) glow[c] = hn::Load(d, glows_[c] + first);
  else
    sampleColour(scene_.emission, pointAt(ray_.density, steps.s), glow);
  const Floats step = hn::Mul(steps.length, hn::Set(d, scene_.extinction * scene_.emissionScale));
  for (int c = 0; c != 3; ++c) {
    const Floats t = hn::Mul(own, hn::Set(d, scene_.extinctionColour[c]));
    const Floats thin =
        hn::NegMulAdd(t, hn::NegMulAdd(t, hn::Set(d, 1.0f / 6), hn::Set(d, 0.5f)), hn::Set(d, 1.0f));
    const Floats mean = hn::IfThenElse(hn::Lt(t, hn::Set(d, 0.03f)), hn::Mul(before[c], thin),
                                       hn::Div(steps.weight[c], hn::Max(t, hn::Set(d, 0.03f))));
    result_.emission[c] +=
        hn::GetLane(hn::SumOfLanes(d, hn::Mul(hn::Mul(glow[c], step), hn::Mul(mean, seen))));
  }
}

template <int kColours>
inline void Marcher<kColours>::colour(Floats own, LitPart<kColours>& steps) {
  const Lanes d;
  const Floats density =
      hn::Div(own, hn::Max(hn::Mul(steps.length, hn::Set(d, scene_.extinction)), hn::Set(d, 1e-30f)));
  const auto some = hn::Gt(density, hn::Set(d, 1e-30f));
  Floats colour[3];
  sampleColour(scene_.colour, pointAt(ray_.density, steps.s), colour);
  for (int c = 0; c != 3; ++c)
    steps.weight[c] = hn::Mul(steps.weight[c], hn::IfThenElseZero(some, hn::Div(colour[c], density)));
}

template <int kColours>
inline void Marcher<kColours>::light(const LitPart<kColours>& steps) {
  if (locatedCount_ == kMostLocated) readLight();
  const int own = locatedCount_++;
  located_[own] = steps;
  for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun)
    locateCoded(scene_.suns[sun], pointAt(ray_.suns[sun], steps.s), places_[sun][own]);
  if (!scene_.scattered.empty())
    locate(scene_.scatteredSize, clamped(pointAt(ray_.scattered, steps.s), scene_.scatteredSize),
           cells_[own]);
}

template <int kColours>
inline void Marcher<kColours>::readLight() {
  for (int n = 0; n != locatedCount_; ++n) readLight(n);
  locatedCount_ = 0;
}

template <int kColours>
inline void Marcher<kColours>::readLight(int located) {
  const Lanes d;
  const LitPart<kColours>& steps = located_[located];
  for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun) {
    const Floats bent = readCoded(scene_.suns[sun], places_[sun][located]),
                 bend = hn::Set(d, scene_.suns[sun].bend),
                 column = hn::Sub(hn::Sqrt(hn::MulAdd(bent, bent, hn::Mul(bend, bend))), bend);
    // Of every colour of the result, and one where a weight is all colours'.
    const auto add = [&]<int kSums>() HWY_ATTR {
      Floats sums[kSums];
      for (Floats& sum : sums) sum = hn::Zero(d);
      for (int n = 0; n != scene_.octaves; ++n) {
        Floats lit[kColours];
        for (int c = 0; c != kColours; ++c) {
          const float share = scene_.extinction * scene_.attenuation[n] *
                              (kColours == 1 ? 1.0f : scene_.extinctionColour[c]) *
                              scene_.suns[sun].shadow[c];
          lit[c] = expOfMinus(hn::Min(hn::Mul(column, hn::Set(d, share)), hn::Set(d, 80.0f)));
        }
        for (int c = 0; c != kSums; ++c)
          sums[c] = hn::MulAdd(lit[kColours == 1 ? 0 : c], hn::Set(d, ray_.weight[sun][c][n]), sums[c]);
      }
      for (int c = 0; c != kSums; ++c) {
        Floats& sum = sums_[3 * sun + std::size_t(c)];
        sum = hn::MulAdd(sums[c], steps.weight[kColours == 1 ? 0 : c], sum);
      }
    };
    if (kColours == 1 && scene_.colours == 1)
      add.template operator()<1>();
    else
      add.template operator()<3>();
  }
  for (std::size_t n = 0; n != scene_.locals.size(); ++n)
    addLocal(scene_, ray_, n, jitter_, steps.s, steps.length, steps.weight, result_);
  scattered(steps, cells_[located]);
}

template <int kColours>
inline void Marcher<kColours>::scattered(const LitPart<kColours>& steps, const Cells& cells) {
  Floats* sum = sums_ + 3 * scene_.suns.size();
  for (const MarchScene::Scattered& lattice : scene_.scattered) {
    Floats two[2];
    readTwo(lattice.nodes, cells, two);
    for (int n = 0; n != 2; ++n, ++sum)
      *sum = hn::MulAdd(two[n], steps.weight[kColours == 1 ? 0 : lattice.kinds[n].part], *sum);
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
