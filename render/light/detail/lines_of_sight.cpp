// Light that goes along lines, near to far: sources are linear in depth between two places.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/light/detail/lines_of_sight.cpp"
#include "nephele/render/light/detail/lines_of_sight.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>

#include "nephele/render/light/detail/lattice_point.h"
#include "nephele/render/light/exp_of_minus_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using detail::kLightsTogether;

// Steps grow this often, after so many of them.
constexpr int kStepsOfALength = 4, kLongestStep = 4;

using Sight = hn::CappedTag<float, detail::LinesOfSight::kCount>;
using SightFloats = hn::Vec<Sight>;

// Density and sources at places.
struct MetLanes {
  SightFloats values[1 + kLightsTogether];
};

HWY_INLINE MetLanes metAt(const detail::SightLattice& lattice, const SightFloats (&place)[3]) {
  const Sight d;
  const hn::RebindToSigned<Sight> i;
  constexpr int kLanes = int(hn::MaxLanes(Sight()));
  alignas(64) std::int32_t first[kLanes];
  alignas(64) float share[3][kLanes];
  alignas(64) float found[kLanes][1 + kLightsTogether];
  detail::LatticePoint at(lattice.size, Vec3f{});
  auto node = hn::Zero(i);
  std::int32_t stride = 1;
  for (int axis = 0; axis != 3; ++axis) {
    const int size = lattice.size[axis];
    const SightFloats x = hn::Min(hn::Max(place[axis], hn::Zero(d)), hn::Set(d, float(size - 1)));
    const SightFloats low = hn::Min(hn::Floor(x), hn::Set(d, float(std::max(size - 2, 0))));
    hn::Store(hn::Sub(x, low), d, share[axis]);
    node = hn::Add(node, hn::Mul(hn::ConvertTo(i, low), hn::Set(i, stride)));
    stride *= size;
  }
  hn::Store(node, i, first);
  for (int lane = 0; lane != kLanes; ++lane) {
    at.first = std::size_t(first[lane]);
    at.share = {share[0][lane], share[1][lane], share[2][lane]};
    const detail::Met met = at.of(lattice.met);
    std::copy_n(met.values, 1 + kLightsTogether, found[lane]);
  }
  MetLanes out;
  hn::LoadInterleaved4(d, found[0], out.values[0], out.values[1], out.values[2], out.values[3]);
  return out;
}

void followLines(const detail::SightLattice& lattice, int count, detail::LinesOfSight& lines) {
  static_assert(kLightsTogether == 3);
  const Sight d;
  const SightFloats zero = hn::Zero(d), one = hn::Set(d, 1.0f);
  for (int from = 0; from < count; from += int(hn::Lanes(d))) {
    SightFloats node[3], way[3], sent[kLightsTogether] = {zero, zero, zero}, through = one;
    for (int axis = 0; axis != 3; ++axis)
      node[axis] = hn::Load(d, lines.node[axis] + from), way[axis] = hn::Load(d, lines.way[axis] + from);
    MetLanes met = metAt(lattice, node);
    auto goesOn = hn::FirstN(d, std::size_t(count - from));
    float at = 0;
    for (int step = 0;; ++step) {
      const float length = float(std::min(1 << std::min(step / kStepsOfALength, 8), kLongestStep));
      at += length;
      SightFloats place[3];
      for (int axis = 0; axis != 3; ++axis) {
        place[axis] = hn::MulAdd(way[axis], hn::Set(d, at), node[axis]);
        goesOn = hn::And(goesOn, hn::And(hn::Gt(place[axis], hn::Set(d, -1.0f)),
                                         hn::Lt(place[axis], hn::Set(d, float(lattice.size[axis])))));
      }
      if (hn::AllFalse(d, goesOn)) break;
      const MetLanes next = metAt(lattice, place);
      const auto isSome = hn::Gt(next.values[0], zero);
      const SightFloats depth = hn::Min(hn::Mul(hn::Add(met.values[0], next.values[0]),
                                                hn::Set(d, 0.5f * length * lattice.depthPerDensity)),
                                        hn::Set(d, 80.0f));
      const SightFloats left = expOfMinus(d, depth);
      const SightFloats thin =
          hn::NegMulAdd(depth, hn::NegMulAdd(depth, hn::Set(d, 1.0f / 6), hn::Set(d, 0.5f)), one);
      const SightFloats mean = hn::IfThenElse(hn::Lt(depth, hn::Set(d, 0.03f)), thin,
                                              hn::Div(hn::Sub(one, left), hn::Max(depth, hn::Set(d, 0.03f))));
      for (std::size_t k = 1; k <= kLightsTogether; ++k) {
        // Far from density nothing is known of the source.
        const SightFloats source = hn::IfThenElse(isSome, next.values[k], met.values[k]);
        const SightFloats sum =
            hn::MulAdd(met.values[k], hn::Sub(one, mean), hn::Mul(source, hn::Sub(mean, left)));
        sent[k - 1] = hn::IfThenElse(goesOn, hn::MulAdd(through, sum, sent[k - 1]), sent[k - 1]);
        met.values[k] = source;
      }
      met.values[0] = next.values[0];
      through = hn::IfThenElse(goesOn, hn::Mul(through, left), through);
      goesOn = hn::And(goesOn, hn::Gt(through, hn::Set(d, lattice.cutoff)));
    }
    for (std::size_t k = 0; k != kLightsTogether; ++k) hn::Store(sent[k], d, lines.sent[k] + from);
    hn::Store(through, d, lines.through + from);
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace nephele {
HWY_EXPORT(followLines);

void detail::follow(const SightLattice& lattice, int count, LinesOfSight& lines) {
  HWY_DYNAMIC_DISPATCH(followLines)(lattice, count, lines);
}

}  // namespace nephele

#endif  // HWY_ONCE
