// A cubic B-spline on a periodic grid: 64 coefficients per point. Weights are found for lanes of points at
// once; then each point reads its 16 rows of 4 coefficients one row at a time, which is faster than
// gathering; the last sums, along x, are lanes of points again. The truth adds in the same order.
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "nephele/modeling/noise/detail/spectral_noise.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/modeling/noise/detail/spectral_noise_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as it decides what they define.
#include <hwy/highway.h>

#include "nephele/modeling/noise/detail/noise_lanes.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {

/// Weights of the 4 nodes around a point, or of their slopes, per axis.
template <class F>
struct SplineWeights {
  F w[4];
};

template <class F>
HWY_INLINE SplineWeights<F> valueWeights(F t) {
  const F sixth(1.0f / 6), u = F(1.0f) - t, tt = t * t, uu = u * u;
  return {{uu * u * sixth, F(2.0f / 3) - tt + tt * t * F(0.5f), F(2.0f / 3) - uu + uu * u * F(0.5f),
           tt * t * sixth}};
}
template <class F>
HWY_INLINE SplineWeights<F> slopeWeights(F t) {
  const F u = F(1.0f) - t, tt = t * t, uu = u * u, half(0.5f);
  return {{F(0.0f) - uu * half, t * (t * F(1.5f) - F(2.0f)), u * (F(2.0f) - u * F(1.5f)), tt * half}};
}

/// Node coordinate of row `r` of the map, wrapped into the tile: the first of 4 nodes and the rest.
template <class F>
HWY_INLINE F wrapped(const SpectralTile& tile, const PerlinLattice& lattice, int r, F x, F y, F z,
                     Whole<F>& first) {
  const float* const m = lattice.toLattice.m.data() + 3 * r;
  const F q = (F(m[0]) * x + F(m[1]) * y + F(m[2]) * z + F(lattice.offset[r])) * F(tile.nodesPerUnit);
  const F whole = floorOf(q), t = q - whole;
  const auto finite = t >= F(0.0f);
  const F limited = minOf(maxOf(select(finite, whole, F(0.0f)), F(-1e9f)), F(1e9f));
  const Whole<F> mask(std::uint32_t(tile.resolution - 1));
  // One node before the cell.
  first = (toWhole(limited) + mask) & mask;
  return select(finite, t, F(0.0f));
}

template <class F>
HWY_INLINE F along(const F a[4], const SplineWeights<F>& w) {
  return a[0] * w.w[0] + a[1] * w.w[1] + a[2] * w.w[2] + a[3] * w.w[3];
}

/// Four floats in a row.
struct SplineRow {
  static constexpr int kLanes = HWY_TARGET == HWY_SCALAR ? 1 : 4;
  using Tag = hn::FixedTag<float, kLanes>;
  hn::Vec<Tag> part[4 / kLanes];

  static HWY_INLINE SplineRow load(const float* from) {
    SplineRow r;
    for (int i = 0; i < 4 / kLanes; ++i) r.part[i] = hn::LoadU(Tag(), from + i * kLanes);
    return r;
  }
  static HWY_INLINE SplineRow zero() {
    SplineRow r;
    for (auto& p : r.part) p = hn::Zero(Tag());
    return r;
  }
  HWY_INLINE void add(const SplineRow& a, float weight) {
    for (int i = 0; i < 4 / kLanes; ++i)
      part[i] = hn::Add(part[i], hn::Mul(a.part[i], hn::Set(Tag(), weight)));
  }
  HWY_INLINE void store(float* to) const {
    for (int i = 0; i < 4 / kLanes; ++i) hn::Store(part[i], Tag(), to + i * kLanes);
  }
};

template <bool kGrad>
void splineKernel(const SpectralTile& tile, const PerlinLattice& lattice, const float* const points[3],
                  float* values, float* const* grads, int count) {
  constexpr int kMost = 16;
  const D d;
  const int lanes = int(hn::Lanes(d));
  const int n = tile.resolution, stride = tile.rowLength(), mask = n - 1;
  const float* const data = tile.coefficients.data();
  alignas(64) std::uint32_t first[3][kMost];
  alignas(64) float wy[4][kMost], wz[4][kMost], sy[4][kMost], sz[4][kMost];
  // Sums of rows, by x: weighted by value, by slope along y, and along z.
  alignas(64) float sums[3][4 * kMost];
  for (int i = 0; i < count; i += lanes) {
    const Lanes x(hn::Load(d, points[0] + i)), y(hn::Load(d, points[1] + i)), z(hn::Load(d, points[2] + i));
    WholeLanes ix, iy, iz;
    const Lanes tx = wrapped(tile, lattice, 0, x, y, z, ix), ty = wrapped(tile, lattice, 1, x, y, z, iy);
    const Lanes tz = wrapped(tile, lattice, 2, x, y, z, iz);
    const WholeTag du;
    hn::Store(ix.v, du, first[0]);
    hn::Store(iy.v, du, first[1]);
    hn::Store(iz.v, du, first[2]);
    const SplineWeights<Lanes> yWeights = valueWeights(ty), zWeights = valueWeights(tz);
    for (int c = 0; c < 4; ++c) {
      store(yWeights.w[c], wy[c]);
      store(zWeights.w[c], wz[c]);
    }
    if constexpr (kGrad) {
      const SplineWeights<Lanes> ySlopes = slopeWeights(ty), zSlopes = slopeWeights(tz);
      for (int c = 0; c < 4; ++c) {
        store(ySlopes.w[c], sy[c]);
        store(zSlopes.w[c], sz[c]);
      }
    }
    for (int p = 0; p < lanes; ++p) {
      const int x0 = int(first[0][p]), y0 = int(first[1][p]), z0 = int(first[2][p]);
      std::size_t rows[4];
      for (int j = 0; j < 4; ++j)
        rows[j] = std::size_t((y0 + j) & mask) * std::size_t(stride) + std::size_t(x0);
      SplineRow a = SplineRow::zero(), b = a, c = a;
      for (int k = 0; k < 4; ++k) {
        const float* const plane = data + std::size_t((z0 + k) & mask) * std::size_t(n) * std::size_t(stride);
        SplineRow inPlane = SplineRow::zero(), change = inPlane;
        for (int j = 0; j < 4; ++j) {
          const SplineRow r = SplineRow::load(plane + rows[j]);
          inPlane.add(r, wy[j][p]);
          if constexpr (kGrad) change.add(r, sy[j][p]);
        }
        a.add(inPlane, wz[k][p]);
        if constexpr (kGrad) {
          b.add(change, wz[k][p]);
          c.add(inPlane, sz[k][p]);
        }
      }
      a.store(sums[0] + 4 * p);
      if constexpr (kGrad) {
        b.store(sums[1] + 4 * p);
        c.store(sums[2] + 4 * p);
      }
    }
    const SplineWeights<Lanes> xWeights = valueWeights(tx);
    Lanes v[4];
    hn::LoadInterleaved4(d, sums[0], v[0].v, v[1].v, v[2].v, v[3].v);
    store(along(v, xWeights), values + i);
    if constexpr (kGrad) {
      const Lanes gx = along(v, slopeWeights(tx));
      hn::LoadInterleaved4(d, sums[1], v[0].v, v[1].v, v[2].v, v[3].v);
      const Lanes gy = along(v, xWeights);
      hn::LoadInterleaved4(d, sums[2], v[0].v, v[1].v, v[2].v, v[3].v);
      const Lanes gz = along(v, xWeights);
      for (int axis = 0; axis < 3; ++axis) {
        const float* const m = lattice.toLattice.m.data() + axis;
        store((Lanes(m[0]) * gx + Lanes(m[3]) * gy + Lanes(m[6]) * gz) * Lanes(tile.nodesPerUnit),
              grads[axis] + i);
      }
    }
  }
}

void spectralKernel(const SpectralTile& tile, const PerlinLattice& lattice, const float* const points[3],
                    float* values, float* const* grads, int count) {
  if (grads)
    splineKernel<true>(tile, lattice, points, values, grads, count);
  else
    splineKernel<false>(tile, lattice, points, values, grads, count);
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(spectralKernel);

float spectralScalar(const SpectralTile& tile, const PerlinLattice& lattice, const Vec3f& point,
                     Vec3f* gradient) {
  using namespace HWY_NAMESPACE;
  const int n = tile.resolution, stride = tile.rowLength(), mask = n - 1;
  std::uint32_t ix, iy, iz;
  const float tx = wrapped(tile, lattice, 0, point.x, point.y, point.z, ix);
  const float ty = wrapped(tile, lattice, 1, point.x, point.y, point.z, iy);
  const float tz = wrapped(tile, lattice, 2, point.x, point.y, point.z, iz);
  const SplineWeights<float> wx = valueWeights(tx), wy = valueWeights(ty), wz = valueWeights(tz);
  SplineWeights<float> sy{}, sz{};
  if (gradient) {
    sy = slopeWeights(ty);
    sz = slopeWeights(tz);
  }
  float a[4] = {}, b[4] = {}, c[4] = {};
  for (int k = 0; k < 4; ++k) {
    float inPlane[4] = {}, change[4] = {};
    for (int j = 0; j < 4; ++j) {
      const std::size_t row =
          std::size_t((int(iz) + k) & mask) * std::size_t(n) + std::size_t((int(iy) + j) & mask);
      const float* const r = tile.coefficients.data() + row * std::size_t(stride) + ix;
      for (int i = 0; i < 4; ++i) inPlane[i] += r[i] * wy.w[j];
      if (gradient)
        for (int i = 0; i < 4; ++i) change[i] += r[i] * sy.w[j];
    }
    for (int i = 0; i < 4; ++i) a[i] += inPlane[i] * wz.w[k];
    if (!gradient) continue;
    for (int i = 0; i < 4; ++i) {
      b[i] += change[i] * wz.w[k];
      c[i] += inPlane[i] * sz.w[k];
    }
  }
  if (gradient) {
    const float gx = along(a, slopeWeights(tx)), gy = along(b, wx), gz = along(c, wx);
    const std::array<float, 9>& m = lattice.toLattice.m;
    for (int axis = 0; axis < 3; ++axis)
      (*gradient)[axis] =
          (m[std::size_t(axis)] * gx + m[std::size_t(axis + 3)] * gy + m[std::size_t(axis + 6)] * gz) *
          tile.nodesPerUnit;
  }
  return along(a, wx);
}

void spectralLanes(const SpectralTile& tile, const PerlinLattice& lattice, const float* const points[3],
                   float* values, float* const* grads, int count) {
  HWY_DYNAMIC_DISPATCH(spectralKernel)(tile, lattice, points, values, grads, count);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE
