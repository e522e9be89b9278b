// Noises made of random numbers on the corners of a lattice: moving Perlin, simplex and value noise. Those of
// random points in cells are in cell_noise.cpp.
//
// Simplex (K. Perlin, Noise Hardware, 2001): gradients on the corners of tetrahedra that fill space, each
// fading as (1/2 - r^2)^4, which is 0 before the next tetrahedron. Value: uniform numbers on a cubic lattice,
// blended by 6 t^5 - 15 t^4 + 10 t^3.
//
// Time: each corner has two random gradients (or values) and goes from one to the other and back on an
// ellipse, g = g0 cos + g1 sin, at one of 16 rates. The mean square of g stays, and so does that of the
// noise.
//
// Each noise is a template of the numbers it computes with (noise_lanes.h), so the lanes and the scalar truth
// agree bit for bit. Known limit: beyond 2^24 cells from the origin floats are whole numbers.
#include "nephele/modeling/noise/lattice_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/modeling/noise/lattice_noise.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as it decides what they define.
#include <hwy/highway.h>

#include "nephele/modeling/noise/detail/noise_loop.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::detail {
namespace HWY_NAMESPACE {

template <class F>
HWY_INLINE F lerp(F a, F b, F t) {
  return a + t * (b - a);
}

template <int kBits>
HWY_INLINE WholeLanes left(WholeLanes a) {
  return WholeLanes(hn::ShiftLeft<kBits>(a.v));
}
template <int kBits>
HWY_INLINE std::uint32_t left(std::uint32_t a) {
  return a << kBits;
}

/// One of 12 gradients, from the middle of a cube to the middle of an edge.
template <class F>
HWY_INLINE Vector<F> edge(Whole<F> h) {
  using U = Whole<F>;
  const F zero(0.0f);
  const F u = F(1.0f) - toFloat(left<1>(h & U(1u))), v = F(1.0f) - toFloat(h & U(2u));
  const auto inXY = signedBelow(h, kThird), notInYZ = signedBelow(h, kTwoThirds);
  return {select(notInYZ, u, zero), select(inXY, v, select(notInYZ, zero, u)), select(inXY, zero, v)};
}

template <class F, bool kMoves>
HWY_INLINE Vector<F> gradientAt(const LatticeNoise& noise, Whole<F> h) {
  const Vector<F> g = edge<F>(h);
  if constexpr (!kMoves) return g;
  const Whole<F> other = hashAgain(h), rate = rateOf(other);
  return sum(scaled(g, lookUp(noise.clock.cosine, rate)),
             scaled(edge<F>(other), lookUp(noise.clock.sine, rate)));
}

/// The blend of 8 corners, x fastest, and its slopes where the corner values stay.
template <class F, bool kGrad>
struct Blend {
  F fade[3], slope[3];

  HWY_INLINE explicit Blend(const Vector<F>& t) {
    const F at[3] = {t.x, t.y, t.z};
    for (int a = 0; a < 3; ++a) {
      const F s = at[a];
      fade[a] = s * s * s * (s * (s * F(6.0f) - F(15.0f)) + F(10.0f));
      if constexpr (kGrad) {
        const F p = s * (s - F(1.0f));
        slope[a] = p * p * F(30.0f);
      }
    }
  }
  HWY_INLINE F operator()(const F* v) const {
    const F near = lerp(lerp(v[0], v[1], fade[0]), lerp(v[2], v[3], fade[0]), fade[1]);
    const F far = lerp(lerp(v[4], v[5], fade[0]), lerp(v[6], v[7], fade[0]), fade[1]);
    return lerp(near, far, fade[2]);
  }
  HWY_INLINE Vector<F> slopes(const F* v) const {
    const F x0 = lerp(v[1] - v[0], v[3] - v[2], fade[1]), x1 = lerp(v[5] - v[4], v[7] - v[6], fade[1]);
    const F r0 = lerp(v[0], v[1], fade[0]), r1 = lerp(v[2], v[3], fade[0]);
    const F r2 = lerp(v[4], v[5], fade[0]), r3 = lerp(v[6], v[7], fade[0]);
    const F z = lerp(r2, r3, fade[1]) - lerp(r0, r1, fade[1]);
    return {slope[0] * lerp(x0, x1, fade[2]), slope[1] * lerp(r1 - r0, r3 - r2, fade[2]), slope[2] * z};
  }
};

struct Perlin {
  template <class F, bool kMoves, bool kGrad>
  static HWY_INLINE NoiseSample<F> at(const LatticeNoise& noise, const Vector<F>& q) {
    using U = Whole<F>;
    const LatticeCell<F> x = cellOf(q.x), y = cellOf(q.y), z = cellOf(q.z);
    const Blend<F, kGrad> blend({x.at, y.at, z.at});
    F v[8];
    Vector<F> g[8];
    for (unsigned c = 0; c < 8; ++c) {
      const unsigned i = c & 1, j = c >> 1 & 1, k = c >> 2;
      const U row = hashRow(y.number + U(j), z.number + U(k), noise.lattice.seed);
      g[c] = gradientAt<F, kMoves>(noise, hashCorner(row, x.number + U(i)));
      v[c] = dot(g[c], Vector<F>{x.at - F(float(i)), y.at - F(float(j)), z.at - F(float(k))});
    }
    NoiseSample<F> s;
    s.value = blend(v);
    if constexpr (kGrad) {
      F gx[8], gy[8], gz[8];
      for (int c = 0; c < 8; ++c) gx[c] = g[c].x, gy[c] = g[c].y, gz[c] = g[c].z;
      s.gradient = sum(Vector<F>{blend(gx), blend(gy), blend(gz)}, blend.slopes(v));
    }
    return s;
  }
};

struct Value {
  template <class F, bool kMoves, bool kGrad>
  static HWY_INLINE NoiseSample<F> at(const LatticeNoise& noise, const Vector<F>& q) {
    using U = Whole<F>;
    const LatticeCell<F> x = cellOf(q.x), y = cellOf(q.y), z = cellOf(q.z);
    const Blend<F, kGrad> blend({x.at, y.at, z.at});
    F v[8];
    for (unsigned c = 0; c < 8; ++c) {
      const U row = hashRow(y.number + U(c >> 1 & 1), z.number + U(c >> 2), noise.lattice.seed);
      const U h = hashCorner(row, x.number + U(c & 1));
      v[c] = number<F>(h);
      if constexpr (kMoves) {
        const U other = hashAgain(h), rate = rateOf(other);
        v[c] = v[c] * lookUp(noise.clock.cosine, rate) + number<F>(other) * lookUp(noise.clock.sine, rate);
      }
    }
    NoiseSample<F> s;
    s.value = blend(v);
    if constexpr (kGrad) s.gradient = blend.slopes(v);
    return s;
  }
  /// Uniform between -1 and 1, of mean 0.
  template <class F>
  static HWY_INLINE F number(Whole<F> h) {
    return toFloat(right<8>(h)) * F(0x1p-23f) - F(1 - 0x1p-24f);
  }
};

struct Simplex {
  template <class F, bool kMoves, bool kGrad>
  static HWY_INLINE NoiseSample<F> at(const LatticeNoise& noise, const Vector<F>& q) {
    using U = Whole<F>;
    // Corners are where x + (x + y + z) / 3 is whole in all axes.
    const F skew = (q.x + q.y + q.z) * F(1.0f / 3);
    const LatticeCell<F> x = cellOf(q.x + skew), y = cellOf(q.y + skew), z = cellOf(q.z + skew);
    const F back = (x.at + y.at + z.at) * F(1.0f / 6);
    const Vector<F> first{x.at - back, y.at - back, z.at - back};
    // From the first corner to the last, one step along each axis, the longest way first.
    const F zero(0.0f), one(1.0f);
    const F xy = select(x.at >= y.at, one, zero), xz = select(x.at >= z.at, one, zero);
    const F yz = select(y.at >= z.at, one, zero);
    const F rank[3] = {xy + xz, one - xy + yz, (one - xz) + (one - yz)};
    F value = zero;
    Vector<F> gradient{zero, zero, zero};
    for (int c = 0; c < 4; ++c) {
      // Axes of rank 2 step first, then those of rank 1, then 0.
      const F least(2.5f - float(c));
      const F i = select(rank[0] >= least, one, zero), j = select(rank[1] >= least, one, zero);
      const F k = select(rank[2] >= least, one, zero);
      const F unskew(float(c) / 6);
      const Vector<F> d{first.x - i + unskew, first.y - j + unskew, first.z - k + unskew};
      const U row = hashRow(y.number + toWhole(j), z.number + toWhole(k), noise.lattice.seed);
      const Vector<F> g = gradientAt<F, kMoves>(noise, hashCorner(row, x.number + toWhole(i)));
      const F w = maxOf(F(0.5f) - dot(d, d), zero), ww = w * w, along = dot(g, d);
      value = value + ww * ww * along;
      if constexpr (kGrad)
        gradient = sum(gradient, sum(scaled(g, ww * ww), scaled(d, F(-8.0f) * ww * w * along)));
    }
    return {value, gradient};
  }
};

template <class F>
void evaluateLattice(const LatticeNoise& noise, const float* const points[3], float* values,
                     float* const* grads, int count) {
  switch (noise.kind) {
    case LatticeKind::perlin:
      return evaluateKind<Perlin, F>(noise, points, values, grads, count);
    case LatticeKind::simplex:
      return evaluateKind<Simplex, F>(noise, points, values, grads, count);
    case LatticeKind::value:
      return evaluateKind<Value, F>(noise, points, values, grads, count);
    case LatticeKind::worley:
    case LatticeKind::worleyDifference:
    case LatticeKind::gabor:
      break;
  }
}

void latticeNoiseKernel(const LatticeNoise& noise, const float* const points[3], float* values,
                        float* const* grads, int count) {
  evaluateLattice<Lanes>(noise, points, values, grads, count);
}

}  // namespace HWY_NAMESPACE
}  // namespace nephele::detail
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(latticeNoiseKernel);

namespace {

bool isCellNoise(LatticeKind kind) {
  return kind == LatticeKind::worley || kind == LatticeKind::worleyDifference || kind == LatticeKind::gabor;
}

}  // namespace

LatticeFacts latticeFacts(LatticeKind kind, bool moves) {
  // On an ellipse between two numbers a sum is at most sqrt(2) times as large as either can be.
  const float more = moves ? 1.4143f : 1.0f;
  switch (kind) {
    case LatticeKind::perlin:
      return {0, kPerlinRms, -3.8385f * more, 3.8385f * more, kPerlinSteepest * more, 2.608596f};
    case LatticeKind::simplex:
      return {0, kSimplexRms, -2.5482f * more, 2.5482f * more, 17.93f * more, 4.472136f};
    case LatticeKind::value:
      return {0, kValueRms, -2.4973f * more, 2.4973f * more, 9.37f * more, 1.909557f};
    case LatticeKind::worley:
      return {kWorleyMean,
              kWorleyRms,
              -1.0001f * kWorleyMean / kWorleyRms,
              1.0001f * (kWorleyReach - kWorleyMean) / kWorleyRms,
              1.0001f / kWorleyRms,
              0};
    case LatticeKind::worleyDifference:
      return {kWorleyDifferenceMean,
              kWorleyDifferenceRms,
              -1.0001f * kWorleyDifferenceMean / kWorleyDifferenceRms,
              1.0001f * (kWorleyReach - kWorleyDifferenceMean) / kWorleyDifferenceRms,
              2.0002f / kWorleyDifferenceRms,
              0};
    case LatticeKind::gabor:
      break;
  }
  return {0, kGaborRms, -1.0001f * kGaborBound, 1.0001f * kGaborBound, 189.5f, 4.202318f};
}

double clockRate(int index, float period) {
  const double rate = 0.125 + 0.25 * (index + 0.5) / 16;
  return period > 0 ? std::max(1.0, std::round(rate * period)) / period : rate;
}

NoiseClock noiseClock(float time, float period) {
  NoiseClock clock{};
  for (int i = 0; i < 16; ++i) {
    double turns = clockRate(i, period) * double(time);
    turns -= std::floor(turns);
    clock.turn[i] = float(turns);
    clock.cosine[i] = float(std::cos(2 * 3.14159265358979323846 * turns));
    clock.sine[i] = float(std::sin(2 * 3.14159265358979323846 * turns));
  }
  return clock;
}

float latticeNoiseScalar(const LatticeNoise& noise, const Vec3f& point, Vec3f* gradient) {
  if (isCellNoise(noise.kind)) return cellNoiseScalar(noise, point, gradient);
  return HWY_NAMESPACE::evaluateOne(HWY_NAMESPACE::evaluateLattice<float>, noise, point, gradient);
}

void latticeNoiseLanes(const LatticeNoise& noise, const float* const points[3], float* values,
                       float* const* grads, int count) {
  if (isCellNoise(noise.kind)) return cellNoiseLanes(noise, points, values, grads, count);
  HWY_DYNAMIC_DISPATCH(latticeNoiseKernel)(noise, points, values, grads, count);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE
