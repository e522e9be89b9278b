// Improved Perlin noise (K. Perlin, Improving Noise, 2002): at each lattice corner a gradient from the middle
// of the cube to the middle of an edge, blended by the curve 6 t^5 - 15 t^4 + 10 t^3.
//
// Gradients come from a hash of the corner's coordinates instead of a table of permutations: a table would
// need eight gathers per point and repeat every 256 cells, the hash stays in registers. One of the three
// pairs of axes is chosen by the hash's size, two signs by its lowest bits, so that all 12 gradients are
// equally likely (the table of the paper has 16 entries and prefers four of them).
//
// Lanes and truth do the same operations in the same order, never fused, and agree bit for bit on every
// machine. Known limit: beyond 2^24 cells from the origin floats are whole numbers, and the noise is 0 there.
#include "nephele/modeling/noise/detail/noise_kernels.h"

#include <cmath>
#include <cstddef>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/modeling/noise/detail/noise_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as it decides what it defines.
#include <hwy/highway.h>

#include "nephele/modeling/noise/detail/noise_cells.h"

#ifndef NEPHELE_NOISE_CONSTANTS
#define NEPHELE_NOISE_CONSTANTS
namespace nephele::detail {

constexpr float kInverseRms = 1 / kPerlinRms;

}  // namespace nephele::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace nephele::detail::HWY_NAMESPACE {
using DI = hn::RebindToSigned<D>;
using VI = hn::Vec<DI>;
using DU = hn::RebindToUnsigned<D>;
using VU = hn::Vec<DU>;

HWY_INLINE VU constantU(std::uint32_t v) {
  return hn::Set(DU(), v);
}

HWY_INLINE V lerp(V a, V b, V t) {
  return hn::Add(a, hn::Mul(t, hn::Sub(b, a)));
}

/// One axis: cell number, and position in the cell, 0 where the coordinate is not finite.
struct Axis {
  VU cell;
  V near, far, fade, slope;
};

template <bool kWithSlope>
HWY_INLINE Axis axis(V q) {
  const D d;
  Axis a;
  const V whole = hn::Floor(q);
  const V t = hn::Sub(q, whole);
  const auto finite = hn::Ge(t, hn::Zero(d));
  a.near = hn::IfThenElseZero(finite, t);
  const V limited =
      hn::Max(hn::Min(hn::IfThenElseZero(finite, whole), constant(kFarthest)), constant(-kFarthest));
  a.cell = hn::BitCast(DU(), hn::ConvertTo(DI(), limited));
  a.far = hn::Sub(a.near, constant(1));
  const V s = a.near, ss = hn::Mul(s, s);
  const V inner = hn::Add(hn::Mul(s, hn::Sub(hn::Mul(s, constant(6)), constant(15))), constant(10));
  a.fade = hn::Mul(hn::Mul(ss, s), inner);
  // 30 t^2 (t - 1)^2
  if constexpr (kWithSlope) {
    const V p = hn::Mul(s, a.far);
    a.slope = hn::Mul(hn::Mul(p, p), constant(30));
  }
  return a;
}

/// The gradient at a corner: two axes, each with a sign in the top bit.
struct Corner {
  VI hash;
  V signU, signV;
};

HWY_INLINE Corner corner(VU row, VU xTerm) {
  const DU du;
  const D d;
  VU h = hn::Xor(row, xTerm);
  h = hn::Mul(hn::Xor(h, hn::ShiftRight<15>(h)), constantU(kMixCorner));
  h = hn::Xor(h, hn::ShiftRight<16>(h));
  const VU top = constantU(0x80000000u);
  static_cast<void>(du);
  return {hn::BitCast(DI(), h), hn::BitCast(d, hn::ShiftLeft<31>(h)),
          hn::BitCast(d, hn::And(hn::ShiftLeft<30>(h), top))};
}

HWY_INLINE auto inXY(const Corner& c) {
  return hn::RebindMask(D(), hn::Lt(c.hash, hn::Set(DI(), kThird)));
}
HWY_INLINE auto inYZ(const Corner& c) {
  return hn::RebindMask(D(), hn::Gt(c.hash, hn::Set(DI(), kTwoThirds - 1)));
}

/// The gradient times the way (x, y, z) from the corner.
HWY_INLINE V cornerValue(const Corner& c, V x, V y, V z) {
  const V u = hn::IfThenElse(inYZ(c), y, x);
  const V v = hn::IfThenElse(inXY(c), y, z);
  return hn::Add(hn::Xor(u, c.signU), hn::Xor(v, c.signV));
}

struct Rows {
  VU row[2][2];  // [z][y]
  VU x[2];
};

HWY_INLINE Rows hashRows(const Axis& x, const Axis& y, const Axis& z, std::uint32_t seed) {
  Rows r;
  r.x[0] = hn::Mul(x.cell, constantU(kX));
  r.x[1] = hn::Add(r.x[0], constantU(kX));
  const VU y0 = hn::Mul(y.cell, constantU(kY));
  const VU y1 = hn::Add(y0, constantU(kY));
  const VU z0 = hn::Add(hn::Mul(z.cell, constantU(kZ)), constantU(seed));
  const VU z1 = hn::Add(z0, constantU(kZ));
  const VU sums[2][2] = {{hn::Add(y0, z0), hn::Add(y1, z0)}, {hn::Add(y0, z1), hn::Add(y1, z1)}};
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      r.row[k][j] = hn::Mul(hn::Xor(sums[k][j], hn::ShiftRight<15>(sums[k][j])), constantU(kMixRow));
  return r;
}

/// Lattice coordinate of row `r` of the map.
HWY_INLINE V latticeCoordinate(const PerlinLattice& lattice, int r, V x, V y, V z) {
  const float* const m = lattice.toLattice.m.data() + 3 * r;
  const V xy = hn::Add(hn::Mul(constant(m[0]), x), hn::Mul(constant(m[1]), y));
  return hn::Add(hn::Add(xy, hn::Mul(constant(m[2]), z)), constant(lattice.offset[r]));
}

/// The cells that lanes of points are in.
template <bool kWithSlope>
struct Cells {
  Axis x, y, z;
  Rows rows;

  HWY_INLINE Cells(const PerlinLattice& lattice, const float* const points[3], int i) {
    const D d;
    const V px = hn::Load(d, points[0] + i), py = hn::Load(d, points[1] + i), pz = hn::Load(d, points[2] + i);
    x = axis<kWithSlope>(latticeCoordinate(lattice, 0, px, py, pz));
    y = axis<kWithSlope>(latticeCoordinate(lattice, 1, px, py, pz));
    z = axis<kWithSlope>(latticeCoordinate(lattice, 2, px, py, pz));
    rows = hashRows(x, y, z, lattice.seed);
  }
};

void perlinKernel(const PerlinLattice& lattice, const float* const points[3], float* values, int count) {
  const D d;
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const auto [x, y, z, r] = Cells<false>(lattice, points, i);
    const V v000 = cornerValue(corner(r.row[0][0], r.x[0]), x.near, y.near, z.near);
    const V v100 = cornerValue(corner(r.row[0][0], r.x[1]), x.far, y.near, z.near);
    const V v010 = cornerValue(corner(r.row[0][1], r.x[0]), x.near, y.far, z.near);
    const V v110 = cornerValue(corner(r.row[0][1], r.x[1]), x.far, y.far, z.near);
    const V near = lerp(lerp(v000, v100, x.fade), lerp(v010, v110, x.fade), y.fade);
    const V v001 = cornerValue(corner(r.row[1][0], r.x[0]), x.near, y.near, z.far);
    const V v101 = cornerValue(corner(r.row[1][0], r.x[1]), x.far, y.near, z.far);
    const V v011 = cornerValue(corner(r.row[1][1], r.x[0]), x.near, y.far, z.far);
    const V v111 = cornerValue(corner(r.row[1][1], r.x[1]), x.far, y.far, z.far);
    const V far = lerp(lerp(v001, v101, x.fade), lerp(v011, v111, x.fade), y.fade);
    hn::Store(hn::Mul(lerp(near, far, z.fade), constant(kInverseRms)), d, values + i);
  }
}

void perlinGradKernel(const PerlinLattice& lattice, const float* const points[3], float* values,
                      float* const grads[3], int count) {
  const D d;
  const V zero = hn::Zero(d), one = constant(1);
  for (int i = 0; i < count; i += int(hn::Lanes(d))) {
    const auto [x, y, z, r] = Cells<true>(lattice, points, i);
    // Per z layer: the value, its change along x and y, and the blended gradients.
    V value[2], alongX[2], alongY[2], gx[2], gy[2], gz[2];
    for (int k = 0; k < 2; ++k) {
      V v[2][2], cx[2][2], cy[2][2], cz[2][2];
      for (int j = 0; j < 2; ++j)
        for (int h = 0; h < 2; ++h) {
          const Corner c = corner(r.row[k][j], r.x[h]);
          v[j][h] = cornerValue(c, h ? x.far : x.near, j ? y.far : y.near, k ? z.far : z.near);
          const V u = hn::Xor(one, c.signU), w = hn::Xor(one, c.signV);
          cx[j][h] = hn::IfThenZeroElse(inYZ(c), u);
          cy[j][h] = hn::IfThenElse(inXY(c), w, hn::IfThenElse(inYZ(c), u, zero));
          cz[j][h] = hn::IfThenZeroElse(inXY(c), w);
        }
      const V v0 = lerp(v[0][0], v[0][1], x.fade), v1 = lerp(v[1][0], v[1][1], x.fade);
      value[k] = lerp(v0, v1, y.fade);
      alongX[k] = lerp(hn::Sub(v[0][1], v[0][0]), hn::Sub(v[1][1], v[1][0]), y.fade);
      alongY[k] = hn::Sub(v1, v0);
      gx[k] = lerp(lerp(cx[0][0], cx[0][1], x.fade), lerp(cx[1][0], cx[1][1], x.fade), y.fade);
      gy[k] = lerp(lerp(cy[0][0], cy[0][1], x.fade), lerp(cy[1][0], cy[1][1], x.fade), y.fade);
      gz[k] = lerp(lerp(cz[0][0], cz[0][1], x.fade), lerp(cz[1][0], cz[1][1], x.fade), y.fade);
    }
    const V scale = constant(kInverseRms);
    const V g[3] = {
        hn::Mul(hn::Add(lerp(gx[0], gx[1], z.fade), hn::Mul(x.slope, lerp(alongX[0], alongX[1], z.fade))),
                scale),
        hn::Mul(hn::Add(lerp(gy[0], gy[1], z.fade), hn::Mul(y.slope, lerp(alongY[0], alongY[1], z.fade))),
                scale),
        hn::Mul(hn::Add(lerp(gz[0], gz[1], z.fade), hn::Mul(z.slope, hn::Sub(value[1], value[0]))), scale)};
    for (int a = 0; a < 3; ++a) {
      const float* const m = lattice.toLattice.m.data() + a;
      const V sum = hn::Add(hn::Mul(constant(m[0]), g[0]), hn::Mul(constant(m[3]), g[1]));
      hn::Store(hn::Add(sum, hn::Mul(constant(m[6]), g[2])), d, grads[a] + i);
    }
    hn::Store(hn::Mul(lerp(value[0], value[1], z.fade), scale), d, values + i);
  }
}

}  // namespace nephele::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele::detail {

HWY_EXPORT(perlinKernel);
HWY_EXPORT(perlinGradKernel);

namespace {

float lerpScalar(float a, float b, float t) {
  return a + t * (b - a);
}

struct ScalarAxis {
  std::uint32_t cell;
  float at[2];
  float fade, slope;
};

ScalarAxis scalarAxis(float q) {
  float whole = std::floor(q);
  float t = q - whole;
  if (!(t >= 0)) t = whole = 0;
  whole = whole < kFarthest ? whole : kFarthest;
  whole = whole > -kFarthest ? whole : -kFarthest;
  const float p = t * (t - 1);
  return {std::uint32_t(std::int32_t(whole)), {t, t - 1}, t * t * t * (t * (t * 6 - 15) + 10), p * p * 30};
}

/// The gradient at lattice corner (x, y, z).
Vec3f scalarCorner(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t seed) {
  std::uint32_t row = y * kY + (z * kZ + seed);
  row = (row ^ (row >> 15)) * kMixRow;
  std::uint32_t h = row ^ (x * kX);
  h = (h ^ (h >> 15)) * kMixCorner;
  h ^= h >> 16;
  const float u = h & 1 ? -1.0f : 1.0f, v = h & 2 ? -1.0f : 1.0f;
  const auto choice = std::int32_t(h);
  return choice < kThird ? Vec3f{u, v, 0} : choice < kTwoThirds ? Vec3f{u, 0, v} : Vec3f{0, u, v};
}

}  // namespace

float perlinScalar(const PerlinLattice& lattice, const Vec3f& point, Vec3f* gradient) {
  const Vec3f q = lattice.toLattice * point + lattice.offset;
  const ScalarAxis x = scalarAxis(q.x), y = scalarAxis(q.y), z = scalarAxis(q.z);
  float v[2][2][2];
  Vec3f c[2][2][2];
  for (unsigned k = 0; k < 2; ++k)
    for (unsigned j = 0; j < 2; ++j)
      for (unsigned i = 0; i < 2; ++i) {
        c[k][j][i] = scalarCorner(x.cell + i, y.cell + j, z.cell + k, lattice.seed);
        v[k][j][i] = dot(c[k][j][i], Vec3f{x.at[i], y.at[j], z.at[k]});
      }
  float rows[2][2], layers[2];
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) rows[k][j] = lerpScalar(v[k][j][0], v[k][j][1], x.fade);
    layers[k] = lerpScalar(rows[k][0], rows[k][1], y.fade);
  }
  if (gradient) {
    const auto blend = [&](const auto& at) {
      float layer[2];
      for (int k = 0; k < 2; ++k)
        layer[k] = lerpScalar(lerpScalar(at(k, 0, 0), at(k, 0, 1), x.fade),
                              lerpScalar(at(k, 1, 0), at(k, 1, 1), x.fade), y.fade);
      return lerpScalar(layer[0], layer[1], z.fade);
    };
    float alongX[2];
    for (int k = 0; k < 2; ++k)
      alongX[k] = lerpScalar(v[k][0][1] - v[k][0][0], v[k][1][1] - v[k][1][0], y.fade);
    const float changeX = lerpScalar(alongX[0], alongX[1], z.fade);
    const float changeY = lerpScalar(rows[0][1] - rows[0][0], rows[1][1] - rows[1][0], z.fade);
    const float changeZ = layers[1] - layers[0];
    const Vec3f g{
        (blend([&](int k, int j, int i) { return c[k][j][i].x; }) + x.slope * changeX) * kInverseRms,
        (blend([&](int k, int j, int i) { return c[k][j][i].y; }) + y.slope * changeY) * kInverseRms,
        (blend([&](int k, int j, int i) { return c[k][j][i].z; }) + z.slope * changeZ) * kInverseRms};
    *gradient = transpose(lattice.toLattice) * g;
  }
  return lerpScalar(layers[0], layers[1], z.fade) * kInverseRms;
}

void perlinLanes(const PerlinLattice& lattice, const float* const points[3], float* values, int count) {
  HWY_DYNAMIC_DISPATCH(perlinKernel)(lattice, points, values, count);
}

void perlinGradLanes(const PerlinLattice& lattice, const float* const points[3], float* values,
                     float* const grads[3], int count) {
  HWY_DYNAMIC_DISPATCH(perlinGradKernel)(lattice, points, values, grads, count);
}

}  // namespace nephele::detail
#endif  // HWY_ONCE
