// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_AXIS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_AXIS
#undef NEPHELE_MARCH_AXIS
#else
#define NEPHELE_MARCH_AXIS
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <limits>

#include "nephele/render/march/detail/march_lanes.h"
#include "nephele/render/march/march_kernels.h"

/// One axis of the walk through bricks of a vector of rays.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// The rays' walk along one axis, see walkBricks.
template <class D>
struct AxisWalk {
  using Numbers = hn::Vec<D>;
  using Whole = hn::RebindToSigned<D>;
  using Integers = hn::Vec<Whole>;

  Numbers origin, direction, perPlane, zeroth, step, plane, exit;
  // Of the table's entries, towards larger bricks and the way that the ray goes.
  Integers across, stride, forward, last;

  HWY_INLINE Numbers meets(Numbers at) const { return hn::MulAdd(at, perPlane, zeroth); }

  HWY_INLINE Integers brickAt(Numbers s) const {
    const Numbers at = hn::Mul(hn::MulAdd(s, direction, origin), hn::Set(D(), 0.125f));
    return hn::Min(hn::Max(hn::ConvertTo(Whole(), at), hn::Zero(Whole())), last);
  }

  // In bricks that are left at these planes.
  HWY_INLINE void stand(Numbers at) { plane = at, exit = meets(at); }

  // The plane where a brick is left.
  HWY_INLINE Numbers planeOf(Integers brick) const { return hn::ConvertTo(D(), hn::Add(brick, forward)); }

  // The brick in which rays stand at s that leave a box of so many bricks around theirs: beyond it where they
  // cross its side on this axis.
  template <class Mask>
  HWY_INLINE Integers afterLeap(Integers radius, Mask crossed, Numbers s) const {
    const Whole i;
    const Integers brick = hn::Sub(hn::ConvertTo(i, plane), forward), low = hn::Sub(brick, radius),
                   high = hn::Add(brick, radius), one = hn::Set(i, 1);
    const auto isUp = hn::Gt(forward, hn::Zero(i));
    return hn::IfThenElse(hn::RebindMask(i, crossed),
                          hn::IfThenElse(isUp, hn::Add(high, one), hn::Sub(low, one)),
                          hn::Min(hn::Max(brickAt(s), low), high));
  }

  // `bricks` of the table lie along it, `entries` apart. Lanes beyond `count` repeat the last ray.
  HWY_INLINE void set(const MarchRay* rays, int count, int axis, int bricks, int entries) {
    const D d;
    const Whole i;
    constexpr int kRays = int(hn::MaxLanes(D()));
    alignas(64) float origins[kRays], directions[kRays];
    for (int lane = 0; lane != kRays; ++lane) {
      const LatticeRay& ray = rays[std::min(lane, count - 1)].density;
      origins[lane] = ray.origin[axis], directions[lane] = ray.direction[axis];
    }
    origin = hn::Load(d, origins), direction = hn::Load(d, directions);
    const auto isForward = hn::Gt(direction, hn::Zero(d)),
               crosses = hn::Gt(hn::Abs(direction), hn::Set(d, 1e-30f));
    const Numbers inverse = hn::Div(hn::Set(d, 1.0f), direction);
    perPlane = hn::IfThenElseZero(crosses, hn::Mul(hn::Set(d, 8.0f), inverse));
    zeroth = hn::IfThenElse(crosses, hn::Neg(hn::Mul(origin, inverse)),
                            hn::Set(d, std::numeric_limits<float>::infinity()));
    step = hn::IfThenElse(isForward, hn::Set(d, 1.0f), hn::Set(d, -1.0f));
    across = hn::Set(i, entries), last = hn::Set(i, bricks - 1);
    const auto isUp = hn::RebindMask(i, isForward);
    forward = hn::IfThenElseZero(isUp, hn::Set(i, 1));
    stride = hn::IfThenElse(isUp, across, hn::Neg(across));
  }

  // Where the ray leaves the table.
  HWY_INLINE Numbers leaves() const {
    return meets(hn::ConvertTo(D(), hn::Mul(forward, hn::Add(last, hn::Set(Whole(), 1)))));
  }
};

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
