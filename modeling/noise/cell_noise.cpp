// Noises of random points in cells: Worley and Gabor.
//
// Worley (S. Worley, A Cellular Texture Basis Function, 1996): one feature point per cell; the 4 x 4 x 4
// cells around a point hold all feature points within 1.5 cells, where distances are cut off: so the noise
// has no jumps. Gabor (Lagae and others, Procedural Noise using Sparse Gabor Convolution, 2009): two impulses
// per cell, each a wave of one cycle per cell in a random direction, fading as (1 - r^2)^3.
//
// Time: coordinates of feature points bounce between the walls of their cells, phases of waves turn, each at
// one of 16 rates. Both keep their distribution, uniform, so that the noise has unit rms at every time.
//
// Lanes skip a cell only where all of them can; the result does not depend on it.
#include <array>
#include <cmath>
#include <cstddef>

#include "nephele/modeling/noise/lattice_noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/modeling/noise/cell_noise.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as it decides what they define.
#include <hwy/highway.h>

#include "nephele/modeling/noise/detail/noise_loop.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

struct CellIndex {
  signed char x, y, z;
};

/// The 64 cells around a point, the nearest first: the sooner a near point is found, the more are skipped.
constexpr std::array<CellIndex, 64> nearCellsFirst() {
  std::array<CellIndex, 64> cells{};
  int n = 0;
  // Distance of a cell's middle from the middle of all, per axis 1/2 or 3/2: how many axes are far.
  for (int farAxes = 0; farAxes <= 3; ++farAxes)
    for (int c = 0; c < 64; ++c) {
      const int i[3] = {c & 3, c >> 2 & 3, c >> 4};
      int count = 0;
      for (const int k : i) count += k == 0 || k == 3;
      if (count == farAxes)
        cells[std::size_t(n++)] = {static_cast<signed char>(i[0]), static_cast<signed char>(i[1]),
                                   static_cast<signed char>(i[2])};
    }
  return cells;
}
constexpr std::array<CellIndex, 64> kNearCellsFirst = nearCellsFirst();

template <bool kSecondNearest>
struct Worley {
  template <class F, bool kMoves, bool kGrad>
  static HWY_INLINE NoiseSample<F> at(const LatticeNoise& noise, const Vector<F>& q) {
    using U = Whole<F>;
    const Axis<F> x(q.x), y(q.y), z(q.z);
    const F zero(0.0f), limit(kWorleyReach * kWorleyReach);
    F nearest = limit, second = limit;
    Vector<F> toNearest{zero, zero, zero}, toSecond{zero, zero, zero};
    for (const CellIndex& c : kNearCellsFirst) {
      const F gap = x.gap[c.x] + y.gap[c.y] + z.gap[c.z];
      if (none(gap < (kSecondNearest ? second : nearest))) continue;
      const U row =
          hashRow(y.first + U(std::uint32_t(c.y)), z.first + U(std::uint32_t(c.z)), noise.lattice.seed);
      const U h = hashCorner(row, x.first + U(std::uint32_t(c.x)));
      const U h2 = h * U(kSecond), h3 = h * U(kThirdNumber);
      const F px = bounced<F, kMoves>(noise, h, h), py = bounced<F, kMoves>(noise, h2, right<4>(h));
      const F pz = bounced<F, kMoves>(noise, h3, h3);
      const Vector<F> d{x.at - (px + F(float(c.x))), y.at - (py + F(float(c.y))),
                        z.at - (pz + F(float(c.z)))};
      const F square = dot(d, d);
      // Where the cell need not be looked at it is not, whatever other lanes need.
      const auto isNearest = both(gap < nearest, square < nearest);
      if constexpr (kSecondNearest) {
        const auto isSecond = both(gap < second, square < second);
        second = select(isNearest, nearest, select(isSecond, square, second));
        if constexpr (kGrad) {
          toSecond.x = select(isNearest, toNearest.x, select(isSecond, d.x, toSecond.x));
          toSecond.y = select(isNearest, toNearest.y, select(isSecond, d.y, toSecond.y));
          toSecond.z = select(isNearest, toNearest.z, select(isSecond, d.z, toSecond.z));
        }
      }
      nearest = select(isNearest, square, nearest);
      if constexpr (kGrad) {
        toNearest.x = select(isNearest, d.x, toNearest.x);
        toNearest.y = select(isNearest, d.y, toNearest.y);
        toNearest.z = select(isNearest, d.z, toNearest.z);
      }
    }
    const F distance = sqrtOf(nearest);
    NoiseSample<F> s;
    s.value = distance;
    if constexpr (kSecondNearest) s.value = sqrtOf(second) - distance;
    if constexpr (kGrad) {
      // Where nothing is within reach the way is 0, and so is the gradient.
      s.gradient = direction(toNearest, distance);
      if constexpr (kSecondNearest)
        s.gradient = sum(direction(toSecond, sqrtOf(second)), scaled(s.gradient, F(-1.0f)));
    }
    return s;
  }

 private:
  /// Four cells in a row, the point in one of the two in the middle, more than 1.5 cells from both ends.
  template <class F>
  struct Axis {
    Whole<F> first;
    F at;      ///< From the start of the first cell.
    F gap[4];  ///< Square of the way to each cell, 0 inside.

    HWY_INLINE explicit Axis(F q) {
      const LatticeCell<F> cell = cellOf(q);
      const F back = select(cell.at < F(0.5f), F(2.0f), F(1.0f));
      first = cell.number + toWhole(F(0.0f) - back);
      at = cell.at + back;
      for (int i = 0; i < 4; ++i) {
        const F way = maxOf(maxOf(F(float(i)) - at, at - F(float(i + 1))), F(0.0f));
        gap[i] = way * way;
      }
    }
  };
  /// A coordinate in its cell, at all times uniform in [0, 1]: a uniform phase along the way there and back.
  template <class F, bool kMoves>
  static HWY_INLINE F bounced(const LatticeNoise& noise, Whole<F> h, Whole<F> rateBits) {
    F phase = uniform<F>(h);
    if constexpr (kMoves) {
      phase = phase + lookUp(noise.clock.turn, rateBits & Whole<F>(15u));
      phase = phase - floorOf(phase);
    }
    return F(1.0f) - absOf(phase + phase - F(1.0f));
  }
  template <class F>
  static HWY_INLINE Vector<F> direction(const Vector<F>& way, F distance) {
    const auto some = F(0.0f) < distance;
    const F inverse = select(some, F(1.0f) / select(some, distance, F(1.0f)), F(0.0f));
    return scaled(way, inverse);
  }
};

struct Gabor {
  template <class F, bool kMoves, bool kGrad>
  static HWY_INLINE NoiseSample<F> at(const LatticeNoise& noise, const Vector<F>& q) {
    using U = Whole<F>;
    const F zero(0.0f), one(1.0f);
    const LatticeCell<F> x = cellOf(q.x), y = cellOf(q.y), z = cellOf(q.z);
    F value = zero;
    Vector<F> gradient{zero, zero, zero};
    for (int k = -1; k <= 1; ++k)
      for (int j = -1; j <= 1; ++j) {
        const U row =
            hashRow(y.number + U(std::uint32_t(j)), z.number + U(std::uint32_t(k)), noise.lattice.seed);
        for (int i = -1; i <= 1; ++i) {
          U h = hashCorner(row, x.number + U(std::uint32_t(i)));
          for (int impulse = 0; impulse < 2; ++impulse) {
            const Vector<F> d{x.at - (uniform<F>(h) + F(float(i))),
                              y.at - (uniform<F>(h * U(kSecond)) + F(float(j))),
                              z.at - (uniform<F>(h * U(kThirdNumber)) + F(float(k)))};
            const F w = one - dot(d, d);
            const U wave = hashAgain(h ^ U(kY));
            h = hashAgain(h);
            if (none(zero < w)) continue;
            // A direction, all equally likely.
            const F up = F(1.0f) - F(2.0f) * uniform<F>(wave * U(kSecond));
            const F ring = sqrtOf(maxOf(one - up * up, zero));
            const F around = uniform<F>(wave * U(kThirdNumber));
            const Vector<F> n{ring * cosineOfTurns(around), ring * cosineOfTurns(around - F(0.25f)), up};
            F phase = dot(n, d) + uniform<F>(wave);
            if constexpr (kMoves) phase = phase + lookUp(noise.clock.turn, wave & U(15u));
            const F inside = maxOf(w, zero), square = inside * inside;
            const F c = cosineOfTurns(phase), window = square * inside;
            value = value + window * c;
            if constexpr (kGrad) {
              const F along = F(-6.2831853f) * window * cosineOfTurns(phase - F(0.25f));
              gradient = sum(gradient, sum(scaled(d, F(-6.0f) * square * c), scaled(n, along)));
            }
          }
        }
      }
    // The cut is made in raw units, so that it is exact.
    const F bound(kGaborBound * kGaborRms);
    const auto free = absOf(value) < bound;
    NoiseSample<F> s;
    s.value = minOf(maxOf(value, F(0.0f) - bound), bound);
    if constexpr (kGrad) s.gradient = scaled(gradient, select(free, one, zero));
    return s;
  }

 private:
  /// cos(2 pi t): the sine of at most a quarter turn, to 1e-7.
  template <class F>
  static HWY_INLINE F cosineOfTurns(F t) {
    const F r = t - floorOf(t + F(0.5f));
    const F u = F(0.25f) - absOf(r), uu = u * u;
    F p = F(-15.09464258f) * uu + F(42.05869394f);
    p = p * uu - F(76.70585975f);
    p = p * uu + F(81.60524928f);
    p = p * uu - F(41.34170224f);
    return u * (p * uu + F(6.283185307f));
  }
};

template <class F>
void evaluateCell(const LatticeNoise& noise, const float* const points[3], float* values, float* const* grads,
                  int count) {
  if (noise.kind == LatticeKind::worley) {
    evaluateKind<Worley<false>, F>(noise, points, values, grads, count);
  } else if (noise.kind == LatticeKind::worleyDifference) {
    evaluateKind<Worley<true>, F>(noise, points, values, grads, count);
  } else {
    evaluateKind<Gabor, F>(noise, points, values, grads, count);
  }
}

constexpr auto& cellNoiseKernel = evaluateCell<Lanes>;

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(cellNoiseKernel);

float cellNoiseScalar(const LatticeNoise& noise, const Vec3f& point, Vec3f* gradient) {
  return HWY_NAMESPACE::evaluateOne(HWY_NAMESPACE::evaluateCell<float>, noise, point, gradient);
}

void cellNoiseLanes(const LatticeNoise& noise, const float* const points[3], float* values,
                    float* const* grads, int count) {
  HWY_DYNAMIC_DISPATCH(cellNoiseKernel)(noise, points, values, grads, count);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE
