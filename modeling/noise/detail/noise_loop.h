// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_NOISE_LOOP) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_NOISE_LOOP
#undef NEPHELE_NOISE_LOOP
#else
#define NEPHELE_NOISE_LOOP
#endif

#include <type_traits>

#include "nephele/modeling/noise/detail/noise_cells.h"

/// The loop over points that all noises of a lattice share. A noise is a struct with
/// `template <class F, bool kMoves, bool kGrad> static NoiseSample<F> at(const LatticeNoise&, const
/// Vector<F>&)`.
HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

template <class F>
HWY_INLINE F load(const float* from) {
  if constexpr (std::is_same_v<F, float>)
    return *from;
  else
    return F(hn::Load(D(), from));
}
/// Numbers per F.
template <class F>
HWY_INLINE int laneCount() {
  if constexpr (std::is_same_v<F, float>)
    return 1;
  else
    return int(hn::Lanes(D()));
}

/// Lattice coordinate of row `r` of the map.
template <class F>
HWY_INLINE F latticeCoordinate(const PerlinLattice& lattice, int r, const Vector<F>& p) {
  const float* const m = lattice.toLattice.m.data() + 3 * r;
  return F(m[0]) * p.x + F(m[1]) * p.y + F(m[2]) * p.z + F(lattice.offset[r]);
}

/// `count` points by one noise.
template <class Noise, class F, bool kMoves, bool kGrad>
void evaluate(const LatticeNoise& noise, const float* const points[3], float* values, float* const* grads,
              int count) {
  const LatticeFacts facts = latticeFacts(noise.kind, kMoves);
  const F mean(facts.mean), scale(1 / facts.rms);
  for (int i = 0; i < count; i += laneCount<F>()) {
    const Vector<F> p{load<F>(points[0] + i), load<F>(points[1] + i), load<F>(points[2] + i)};
    const Vector<F> q{latticeCoordinate(noise.lattice, 0, p), latticeCoordinate(noise.lattice, 1, p),
                      latticeCoordinate(noise.lattice, 2, p)};
    const NoiseSample<F> s = Noise::template at<F, kMoves, kGrad>(noise, q);
    store((s.value - mean) * scale, values + i);
    if constexpr (kGrad) {
      for (int a = 0; a < 3; ++a) {
        const float* const m = noise.lattice.toLattice.m.data() + a;
        store((F(m[0]) * s.gradient.x + F(m[3]) * s.gradient.y + F(m[6]) * s.gradient.z) * scale,
              grads[a] + i);
      }
    }
  }
}

template <class Noise, class F>
void evaluateKind(const LatticeNoise& noise, const float* const points[3], float* values, float* const* grads,
                  int count) {
  if (noise.moves) {
    if (grads)
      evaluate<Noise, F, true, true>(noise, points, values, grads, count);
    else
      evaluate<Noise, F, true, false>(noise, points, values, grads, count);
  } else {
    if (grads)
      evaluate<Noise, F, false, true>(noise, points, values, grads, count);
    else
      evaluate<Noise, F, false, false>(noise, points, values, grads, count);
  }
}

/// One point by `evaluate`, a loop over plain floats: the truth.
template <class Evaluate>
float evaluateOne(const Evaluate& evaluate, const LatticeNoise& noise, const Vec3f& point, Vec3f* gradient) {
  const float* const xyz[3] = {&point.x, &point.y, &point.z};
  float value = 0;
  if (!gradient) {
    evaluate(noise, xyz, &value, nullptr, 1);
    return value;
  }
  float* const grads[3] = {&gradient->x, &gradient->y, &gradient->z};
  evaluate(noise, xyz, &value, grads, 1);
  return value;
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
