// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_WALK) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_WALK
#undef NEPHELE_MARCH_WALK
#else
#define NEPHELE_MARCH_WALK
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "nephele/render/march/detail/march_axis.h"
#include "nephele/render/march/detail/march_lanes.h"
#include "nephele/render/march/detail/march_loads.h"
#include "nephele/render/march/march_kernels.h"

/// The walk through bricks of a vector of rays.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// The bricks with density that a vector of rays passes, near to far, each with its range. A row has one of
// every ray, or a piece of no length.
struct BrickRows {
  // Most rays end before.
  static constexpr int kMost = 32;

  int count = 0;
  alignas(64) float begin[kMost][kLanes], end[kMost][kLanes], least[kMost][kLanes], most[kMost][kLanes];
  // Where the walk of each goes on behind the last row; infinite where nothing is left to be met or seen.
  alignas(64) float rest[kLanes];
};

// With vectors of no more lanes than are needed.
template <class D>
HWY_NOINLINE void findBricksOf(D d, const MarchScene& scene, const MarchRay* rays, int count, float s0,
                               float opaque, BrickRows& rows) {
  using Numbers = hn::Vec<D>;
  const hn::RebindToSigned<D> i;
  using Integers = hn::Vec<decltype(i)>;
  constexpr int kRays = int(hn::MaxLanes(D()));
  AxisWalk<D> axes[3];
  for (int axis = 0, entries = 1; axis != 3; entries *= scene.density.count[axis++])
    axes[axis].set(rays, count, axis, scene.density.count[axis], entries);
  alignas(64) float lengths[kRays];
  for (int lane = 0; lane != kRays; ++lane) lengths[lane] = rays[std::min(lane, count - 1)].length;
  Numbers end = hn::Load(d, lengths), s = hn::Set(d, s0), depth = hn::Zero(d);
  Integers entry = hn::Zero(i);
  for (AxisWalk<D>& axis : axes) {
    end = hn::Min(end, axis.leaves());
    const Integers brick = axis.brickAt(s);
    axis.stand(axis.planeOf(brick));
    entry = hn::Add(entry, hn::Mul(brick, axis.across));
  }
  const Numbers extinction = hn::Set(d, scene.extinction), enough = hn::Set(d, opaque);
  auto goesOn = hn::FirstN(d, std::size_t(count));
  int row = 0;
  for (; row != BrickRows::kMost && !hn::AllFalse(d, goesOn); ++row) {
    alignas(64) std::int32_t entries[kRays], aways[kRays], radii[kRays];
    hn::Store(entry, i, entries);
    for (int lane = 0; lane != kRays; ++lane) {
      const std::int32_t at = inMemory(entries)[lane];
      const Interval range = scene.ranges[scene.density.table[at]];
      rows.least[row][lane] = range.min, rows.most[row][lane] = range.max;
      radii[lane] = aways[lane] = scene.emptiness[at];
      if (scene.uniformity) radii[lane] |= scene.uniformity[at];
    }
    const Integers radius = hn::Sub(hn::Load(i, radii), hn::Set(i, 1));
    const auto isLeap = hn::RebindMask(d, hn::Gt(radius, hn::Zero(i)));
    const bool someLeap = !hn::AllFalse(d, hn::And(isLeap, goesOn));
    Numbers ahead[3];
    for (int axis = 0; axis != 3; ++axis) ahead[axis] = axes[axis].exit;
    const Numbers reach = hn::ConvertTo(d, radius);
    if (someLeap)
      for (int axis = 0; axis != 3; ++axis)
        ahead[axis] = hn::IfThenElse(
            isLeap, axes[axis].meets(hn::MulAdd(axes[axis].step, reach, axes[axis].plane)), ahead[axis]);
    const Numbers nearest = hn::Min(hn::Min(ahead[0], ahead[1]), ahead[2]), out = hn::Max(nearest, s);
    const auto isMet = hn::And(goesOn, hn::RebindMask(d, hn::Eq(hn::Load(i, aways), hn::Zero(i))));
    const Numbers stop = hn::IfThenElse(isMet, hn::Min(out, end), s);
    hn::Store(s, d, rows.begin[row]);
    hn::Store(stop, d, rows.end[row]);
    const Numbers thinnest = hn::Mul(extinction, hn::Max(hn::Load(d, rows.least[row]), hn::Zero(d)));
    depth = hn::MulAdd(thinnest, hn::Sub(stop, s), depth);
    goesOn = hn::And(goesOn, hn::And(hn::Lt(out, end), hn::Lt(depth, enough)));
    s = out;
    Integers passed = hn::Zero(i), leapt = hn::Zero(i);
    for (int n = 0; n != 3; ++n) {
      AxisWalk<D>& axis = axes[n];
      const auto crossed = hn::Le(ahead[n], nearest);
      passed = hn::Add(passed, hn::IfThenElseZero(hn::RebindMask(i, crossed), axis.stride));
      Numbers plane = hn::Add(axis.plane, hn::IfThenElseZero(crossed, axis.step));
      if (someLeap) {
        const Integers next = axis.afterLeap(radius, crossed, s);
        leapt = hn::Add(leapt, hn::Mul(next, axis.across));
        plane = hn::IfThenElse(isLeap, axis.planeOf(next), plane);
      }
      axis.stand(plane);
    }
    Integers next = hn::Add(entry, passed);
    if (someLeap) next = hn::IfThenElse(hn::RebindMask(i, isLeap), leapt, next);
    // Behind the table there are no entries.
    entry = hn::IfThenElse(hn::RebindMask(i, goesOn), next, entry);
  }
  rows.count = row;
  hn::Store(hn::IfThenElse(goesOn, s, hn::Set(d, std::numeric_limits<float>::infinity())), d, rows.rest);
}

// Of `count` rays, at most as many as a vector has lanes, from s0 on. Those whose bricks promise an optical
// depth of `opaque` end there.
inline void findBricks(const MarchScene& scene, const MarchRay* rays, int count, float s0, float opaque,
                       BrickRows& rows) {
  using Few = hn::CappedTag<float, 4>;
  if (count > int(hn::MaxLanes(Few())))
    findBricksOf(Lanes(), scene, rays, count, s0, opaque, rows);
  else
    findBricksOf(Few(), scene, rays, count, s0, opaque, rows);
}

// Calls visit(s0, s1, range) for every brick with density that the ray of a lane passes, until it returns
// false.
template <class Visit>
HWY_INLINE void forEachBrick(const MarchScene& scene, const MarchRay& ray, float opaque,
                             const BrickRows& first, int lane, Visit&& visit) {
  BrickRows own;
  for (const BrickRows* rows = &first;; rows = &own, lane = 0) {
    for (int row = 0; row != rows->count; ++row) {
      const Interval range{rows->least[row][lane], rows->most[row][lane]};
      if (!visit(rows->begin[row][lane], rows->end[row][lane], range)) return;
    }
    const float rest = rows->rest[lane];
    if (!(rest < ray.length)) return;
    findBricks(scene, &ray, 1, rest, opaque, own);
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
