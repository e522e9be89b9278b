#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "nephele/render/march/detail/step_growth.h"
#include "nephele/render/march/march_kernels.h"

namespace nephele::detail {

/// Cuts the occupied part of a ray into runs of equal steps, and in constant densities of growing ones: calls
/// take(s, ds, count, density), where steps start at s, s + ds ..., or take(GrowingSteps, density), and stops
/// when it returns false, or where the ranges of the bricks in front promise that nothing is left to see.
/// `density` is negative where it has to be looked up.
///
/// Runs go on from brick to brick where bricks touch, so that their borders leave no trace, and start anew
/// behind a gap. Steps grow with the optical depth that the ranges of the bricks in front promise. All of it
/// is inlined, so that it is compiled for the instructions of the kernel around it.
template <class Take>
class Runs {
 public:
  Runs(const MarchScene& scene, const MarchRay& ray, const StepGrowth& law, Take& take)
      : scene_(scene), ray_(ray), take_(take), law_(law) {}

  /// A brick of this range from s0 to s1. False once there is no need to go on.
  [[gnu::always_inline]] bool add(float s0, float s1, const Interval& range) {
    const bool isUniform = range.max - range.min < 0.01f * range.max;
    if (s0 >= farther_) widen(s0);
    const float wide = isUniform ? widestUniform_ : widest_;
    const float thickest = scene_.extinction * range.max;
    const float least =
        std::max(thickest * wide > scene_.stepDepth ? scene_.stepDepth / thickest : wide, scene_.leastStep);
    const float depth = depth_ + (isUniform_ ? thinnest_ * (end_ - start_) : 0.0f),
                growth = isUniform_ ? law_.at(depth) : growth_;
    // Where the density varies it must still be met at every voxel.
    const float ds = isUniform ? least : std::min(least * growth, std::max(least, scene_.step));
    const bool isSame = isUniform == isUniform_ && !(s0 > end_) &&
                        (isUniform ? range.isPoint() && range.max == density_ : ds == ds_),
               isLong = isUniform_ ? !(depth < law_.opaque) : !((end_ - start_) * perStep_ < kMany);
    if (!isSame || isLong) {
      if (!close()) return false;
      start_ = std::max(start_, s0);
      ds_ = ds, perStep_ = 1.0f / ds;
      isUniform_ = isUniform;
      density_ = isUniform && range.isPoint() ? range.max : -1.0f;
      thinnest_ = scene_.extinction * std::max(range.min, 0.0f);
    }
    end_ = s1;
    if (!isUniform && range.min > 0) promise(scene_.extinction * range.min * (s1 - std::max(s0, start_)));
    return true;
  }

  [[gnu::always_inline]] bool close() {
    if (!(start_ < end_)) return true;
    if (isUniform_) return closeUniform();
    float ds = ds_;
    const int count = int(std::ceil((end_ - start_) * perStep_));
    if (ray_.isCut && end_ >= ray_.length) ds = (end_ - start_) / float(count);
    const float start = std::exchange(start_, start_ + float(count) * ds);
    end_ = start_;
    return take_(start, ds, count, -1.0f) && depth_ < law_.opaque;
  }

 private:
  // Enough steps to be worth a call.
  static constexpr float kMany = 64;

  // Steps as wide as pixels are, and by a tenth wider in turn, so that runs are long.
  [[gnu::always_inline]] void widen(float s) {
    const float pixel = scene_.pixelAngle * (ray_.start + s),
                divided = scene_.divided * std::min(pixel, scene_.step);
    widest_ = std::max({scene_.step, std::min(4.0f * scene_.step, pixel), divided});
    widestUniform_ = std::max(scene_.uniformStep, widest_);
    const float next = std::max(1.1f * pixel, scene_.step / scene_.divided);
    farther_ = pixel > 0 ? next / scene_.pixelAngle - ray_.start : INFINITY;
  }

  [[gnu::always_inline]] void promise(float depth) {
    depth_ += depth;
    growth_ = law_.at(depth_);
  }

  // Steps may be longer than voxels.
  [[gnu::always_inline]] bool closeUniform() {
    const float s0 = std::exchange(start_, end_), depth = depth_, thickness = thinnest_ * (end_ - s0),
                ds = ds_ * growth_;
    promise(thickness);
    // Far enough for steps to grow by more than a third.
    if (thickness * law_.xPerDepth > 1.0f / 3) {
      // What is seen of them.
      const float s1 = depth_ < law_.opaque ? end_ : s0 + (law_.opaque - depth) / thinnest_;
      return take_(GrowingSteps(law_, s0, s1, ds_, thinnest_, depth), density_) && depth_ < law_.opaque;
    }
    const int count = std::max(int(std::ceil((end_ - s0) / ds)), 1);
    // The last of them must not reach into a brick that differs.
    return take_(s0, (end_ - s0) / float(count), count, density_) && depth_ < law_.opaque;
  }

  const MarchScene& scene_;
  const MarchRay& ray_;
  Take& take_;
  const StepGrowth& law_;
  // The run so far: where it began and how far it has to go.
  float start_ = 0.0f, end_ = 0.0f, ds_ = 0.0f, perStep_ = 0.0f;
  // Whether its density hardly varies: then it is constant where this is not negative, and `thinnest_` is the
  // least optical depth per length.
  bool isUniform_ = false;
  float density_ = -1.0f, thinnest_ = 0.0f;
  // Of steps from here to `farther_`.
  float widest_ = 0.0f, widestUniform_ = 0.0f, farther_ = 0.0f;
  // At least so much lies in front of the run, or with it where it varies.
  float depth_ = 0.0f, growth_ = 1.0f;
};

/// walk(visit) calls visit(s0, s1, range) for every brick with density, near to far, until it returns false.
template <class Walk, class Take>
[[gnu::always_inline]] inline void forEachRun(const MarchScene& scene, const MarchRay& ray,
                                              const StepGrowth& law, Walk&& walk, Take&& take) {
  Runs runs(scene, ray, law, take);
  bool goesOn = true;
  walk([&](float s0, float s1, const Interval& range)
           __attribute__((always_inline)) { return goesOn = !(s0 < s1) || runs.add(s0, s1, range); });
  if (goesOn) runs.close();
}

}  // namespace nephele::detail
