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
namespace nephele::detail::HWY_NAMESPACE {

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

/// The cube around a point: its 8 corners, x fastest, the blend of their values, and its slopes where they
/// stay.
template <class F, bool kGrad>
struct Cube {
  LatticeCell<F> x, y, z;
  F fade[3], slope[3];

  HWY_INLINE explicit Cube(const Vector<F>& q) : x(cellOf(q.x)), y(cellOf(q.y)), z(cellOf(q.z)) {
    const F at[3] = {x.at, y.at, z.at};
    for (int a = 0; a < 3; ++a) {
      const F s = at[a];
      fade[a] = s * s * s * (s * (s * F(6.0f) - F(15.0f)) + F(10.0f));
      if constexpr (kGrad) {
        const F p = s * (s - F(1.0f));
        slope[a] = p * p * F(30.0f);
      }
    }
  }
  HWY_INLINE Whole<F> hashOf(unsigned corner, std::uint32_t seed) const {
    using U = Whole<F>;
    const U row = hashRow(y.number + U(corner >> 1 & 1), z.number + U(corner >> 2), seed);
    return hashCorner(row, x.number + U(corner & 1));
  }
  HWY_INLINE F blend(const F* v) const {
    const F near = lerp(lerp(v[0], v[1], fade[0]), lerp(v[2], v[3], fade[0]), fade[1]);
    const F far = lerp(lerp(v[4], v[5], fade[0]), lerp(v[6], v[7], fade[0]), fade[1]);
    return lerp(near, far, fade[2]);
  }
  HWY_INLINE Vector<F> slopes(const F* v) const {
    const F x0 = lerp(v[1] - v[0], v[3] - v[2], fade[1]), x1 = lerp(v[5] - v[4], v[7] - v[6], fade[1]);
    const F r0 = lerp(v[0], v[1], fade[0]), r1 = lerp(v[2], v[3], fade[0]);
    const F r2 = lerp(v[4], v[5], fade[0]), r3 = lerp(v[6], v[7], fade[0]);
    const F alongZ = lerp(r2, r3, fade[1]) - lerp(r0, r1, fade[1]);
    return {slope[0] * lerp(x0, x1, fade[2]), slope[1] * lerp(r1 - r0, r3 - r2, fade[2]), slope[2] * alongZ};
  }
};

struct Perlin {
  template <class F, bool kMoves, bool kGrad>
  static HWY_INLINE NoiseSample<F> at(const LatticeNoise& noise, const Vector<F>& q) {
    const Cube<F, kGrad> cube(q);
    F v[8];
    Vector<F> g[8];
    for (unsigned c = 0; c < 8; ++c) {
      g[c] = gradientAt<F, kMoves>(noise, cube.hashOf(c, noise.lattice.seed));
      const F i(float(c & 1)), j(float(c >> 1 & 1)), k(float(c >> 2));
      v[c] = dot(g[c], Vector<F>{cube.x.at - i, cube.y.at - j, cube.z.at - k});
    }
    NoiseSample<F> s;
    s.value = cube.blend(v);
    if constexpr (kGrad) {
      F gx[8], gy[8], gz[8];
      for (int c = 0; c < 8; ++c) gx[c] = g[c].x, gy[c] = g[c].y, gz[c] = g[c].z;
      s.gradient = sum(Vector<F>{cube.blend(gx), cube.blend(gy), cube.blend(gz)}, cube.slopes(v));
    }
    return s;
  }
};

struct Value {
  template <class F, bool kMoves, bool kGrad>
  static HWY_INLINE NoiseSample<F> at(const LatticeNoise& noise, const Vector<F>& q) {
    const Cube<F, kGrad> cube(q);
    F v[8];
    for (unsigned c = 0; c < 8; ++c) {
      const Whole<F> h = cube.hashOf(c, noise.lattice.seed);
      v[c] = number<F>(h);
      if constexpr (kMoves) {
        const Whole<F> other = hashAgain(h), rate = rateOf(other);
        v[c] = v[c] * lookUp(noise.clock.cosine, rate) + number<F>(other) * lookUp(noise.clock.sine, rate);
      }
    }
    NoiseSample<F> s;
    s.value = cube.blend(v);
    if constexpr (kGrad) s.gradient = cube.slopes(v);
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

constexpr auto& latticeNoiseKernel = evaluateLattice<Lanes>;

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

namespace {

bool isCellNoise(LatticeKind kind) {
  return kind == LatticeKind::worley || kind == LatticeKind::worleyDifference || kind == LatticeKind::gabor;
}

/// Facts of a distance that is cut off at the reach of Worley noise.
LatticeFacts distanceFacts(float mean, float rms, float steepest) {
  return {mean, rms, -1.0001f * mean / rms, 1.0001f * (kWorleyReach - mean) / rms, steepest / rms, 0};
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
      return distanceFacts(kWorleyMean, kWorleyRms, 1.0001f);
    case LatticeKind::worleyDifference:
      return distanceFacts(kWorleyDifferenceMean, kWorleyDifferenceRms, 2.0002f);
    case LatticeKind::gabor:
      break;
  }
  return {0, kGaborRms, -1.0001f * kGaborBound, 1.0001f * kGaborBound, 189.5f, 4.202318f};
}

double clockRate(int index, float period) {
  // A different place in each sixteenth, by the golden ratio: equal steps would all meet again.
  const double place = 0.6180339887498949 * (index + 1), rate = (index + place - std::floor(place)) / 32;
  return period > 0 ? std::max(index < 8 ? 1.0 : 2.0, std::round(rate * period)) / period : rate;
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

HWY_EXPORT(latticeNoiseKernel);

void latticeNoiseLanes(const LatticeNoise& noise, const float* const points[3], float* values,
                       float* const* grads, int count) {
  if (isCellNoise(noise.kind)) return cellNoiseLanes(noise, points, values, grads, count);
  HWY_DYNAMIC_DISPATCH(latticeNoiseKernel)(noise, points, values, grads, count);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE
