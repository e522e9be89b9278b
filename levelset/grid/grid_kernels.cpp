// Interpolation of bricked grids at blocks of points.
//
// Per point: world to index by the affine map, cell by floor, brick by one table look-up; after that
// everything is read from that brick, whose border holds what the neighbours contribute. The cells of a
// vector of points are read as rows of four floats (x - 1 .. x + 2), one load per point and row, and turned
// into vectors by 4x4 transpositions inside 128-bit blocks. That takes a fraction of the time of a gather
// instruction per sample, and the addresses are 64-bit, so that the pool may be of any size.
//
// The bricks of a packed grid are put together before they are read, see AssembledBricks: those around a
// point are asked for again by the next ones.
//
// All arithmetic is written as differences and one product and sum per weight, never fused: constants come
// out exactly, and the vector code gives the bits of the plain loops on every instruction set. Limit: index
// coordinates are floats; positions inside a voxel fade beyond some 10^5 voxels from the origin.

#include "nephele/levelset/grid/grid_kernels.h"

#include "nephele/levelset/grid/detail/grid_map.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/levelset/grid/grid_kernels.cpp"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace nephele {
namespace HWY_NAMESPACE {

// Reading rows takes vectors of a size known when compiling; others use the plain loops.
#if HWY_HAVE_SCALABLE || HWY_TARGET == HWY_SCALAR

void nearest(const GridView& grid, const PointBlock& points, float* values) {
  sampleNearestScalar(grid, points, values);
}
void trilinear(const GridView& grid, const PointBlock& points, float* values) {
  sampleTrilinearScalar(grid, points, values);
}
void trilinearGrad(const GridView& grid, const PointBlock& points, float* values,
                   const BlockLanes<3>& grads) {
  sampleTrilinearGradScalar(grid, points, values, grads);
}
void tricubic(const GridView& grid, const PointBlock& points, float* values) {
  sampleTricubicScalar(grid, points, values);
}
void tricubicGrad(const GridView& grid, const PointBlock& points, float* values, const BlockLanes<3>& grads) {
  sampleTricubicGradScalar(grid, points, values, grads);
}

#else

namespace hn = hwy::HWY_NAMESPACE;
using detail::CellPart;
using detail::GridMap;
using detail::kCorner;
using detail::kPlane;
using detail::kRow;
using detail::mapOf;
using detail::nearestMapOf;
using detail::rowOffset;
using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
using DI = hn::RebindToSigned<D>;
using VI = hn::Vec<DI>;
constexpr int kLanes = int(hn::MaxLanes(D()));

struct Cells {
  V fx, fy, fz;
  const float* corner[kLanes];
};

/// The cells of a packed grid: in a brick that is put together for several points, or each on its own.
HWY_INLINE void findBricks(const GridMap& map, const CellPart& part, const std::int32_t* place,
                           const std::int32_t* start, const std::int32_t* isInside, int count, Cells& cells) {
  const int used = count < kLanes ? count : kLanes;
  for (int l = 0; l < used;) {
    int end = l + 1;
    while (end < used && place[end] == place[l] && isInside[end] == isInside[l]) ++end;
    const auto at = std::size_t(place[l]);
    const float* brick = isInside[l] ? map.bricks->find(*map.packed, at, end - l) : nullptr;
    for (; l < end; ++l) {
      if (brick)
        cells.corner[l] = brick + start[l];
      else if (isInside[l])
        cells.corner[l] = map.bricks->cell(*map.packed, at, start[l], part.begin, part.count);
      else
        cells.corner[l] = map.bricks->outside(*map.packed);
    }
  }
  for (int l = used; l < kLanes; ++l) cells.corner[l] = cells.corner[used - 1];
}

HWY_INLINE void locate(const GridMap& map, const CellPart& part, const PointBlock& points, int i,
                       Cells& cells) {
  const D d;
  const DI di;
  const V x = hn::LoadU(d, points.x + i), y = hn::LoadU(d, points.y + i), z = hn::LoadU(d, points.z + i);
  const auto& m = map.linear;
  const auto set = [&](float v) HWY_ATTR { return hn::Set(d, v); };
  V q[3];
  if (map.diagonal) {
    q[0] = set(m[0]) * x, q[1] = set(m[4]) * y, q[2] = set(m[8]) * z;
  } else {
    for (int a = 0; a < 3; ++a) q[a] = set(m[3 * a]) * x + set(m[3 * a + 1]) * y + set(m[3 * a + 2]) * z;
  }
  for (int a = 0; a < 3; ++a) q[a] = q[a] + set(map.translation[a]);
  auto inside = hn::And(hn::Ge(q[0], set(map.low[0])), hn::Lt(q[0], set(map.high[0])));
  for (int a = 1; a < 3; ++a)
    inside = hn::And(inside, hn::And(hn::Ge(q[a], set(map.low[a])), hn::Lt(q[a], set(map.high[a]))));

  V f[3];
  VI brick[3], local[3];
  for (int a = 0; a < 3; ++a) {
    q[a] = hn::IfThenElseZero(inside, q[a]);
    const V cell = hn::Floor(q[a]);
    f[a] = q[a] - cell;
    const VI voxel = hn::ConvertTo(di, cell);
    brick[a] = hn::ShiftRight<3>(voxel) - hn::Set(di, map.first[a]);
    local[a] = hn::And(voxel, hn::Set(di, 7));
  }
  cells.fx = f[0], cells.fy = f[1], cells.fz = f[2];
  const VI width = hn::Set(di, kRow);
  const VI index = (brick[2] * hn::Set(di, map.countY) + brick[1]) * hn::Set(di, map.countX) + brick[0];
  const VI offset = (local[2] * width + local[1]) * width + local[0];
  const VI keep = hn::VecFromMask(di, hn::RebindMask(di, inside));
  HWY_ALIGN std::int32_t entry[kLanes], start[kLanes], mask[kLanes];
  hn::Store(hn::And(index, keep), di, entry);
  hn::Store(offset, di, start);
  hn::Store(keep, di, mask);
  if (map.packed) return findBricks(map, part, entry, start, mask, points.count - i, cells);
  for (int l = 0; l < kLanes; ++l)
    cells.corner[l] = map.values + std::size_t(map.table[entry[l]] & mask[l]) * BrickGrid::kVolume + start[l];
}

/// Asks for the 4^3 samples around the points of a vector, which are read later.
HWY_INLINE void prefetch(const Cells& cells) {
  for (int l = 0; l < kLanes; ++l)
    for (int k = 0; k < 4; ++k) {
      hwy::Prefetch(cells.corner[l] + rowOffset(0, k));
      hwy::Prefetch(cells.corner[l] + rowOffset(3, k) + 3);
    }
}

/// Calls `interpolate(i, cells)` for every vector of points, with what the next one reads on its way.
template <class Interpolate>
HWY_INLINE void forEachVector(const GridMap& map, const PointBlock& points, const Interpolate& interpolate) {
  Cells cells[2];
  locate(map, detail::kWholeCell, points, 0, cells[0]);
  for (int i = 0, k = 0; i < points.count; i += kLanes, k ^= 1) {
    if (i + kLanes < points.count) {
      locate(map, detail::kWholeCell, points, i + kLanes, cells[k ^ 1]);
      prefetch(cells[k ^ 1]);
    }
    interpolate(i, cells[k]);
  }
}

/// Element e of every 128-bit block b: four floats of point 4 b + e.
template <int kElement>
HWY_INLINE V loadFours(const Cells& cells, int offset) {
  const D d;
  const hn::Full128<float> d4;
  const auto four = [&](int block)
                        HWY_ATTR { return hn::LoadU(d4, cells.corner[4 * block + kElement] + offset); };
#if HWY_MAX_BYTES >= 64
  const hn::Half<D> half;
  return hn::Combine(d, hn::Combine(half, four(3), four(2)), hn::Combine(half, four(1), four(0)));
#elif HWY_MAX_BYTES == 32
  return hn::Combine(d, four(1), four(0));
#else
  static_cast<void>(d);
  return four(0);
#endif
}

/// The samples x - 1 .. x + 2 of one row for all points of a vector.
struct Row {
  V before, left, right, after;
};

HWY_INLINE V lower64(V a, V b) {
  const hn::Repartition<std::uint64_t, D> d64;
  return hn::BitCast(D(), hn::InterleaveLower(d64, hn::BitCast(d64, a), hn::BitCast(d64, b)));
}
HWY_INLINE V upper64(V a, V b) {
  const hn::Repartition<std::uint64_t, D> d64;
  return hn::BitCast(D(), hn::InterleaveUpper(d64, hn::BitCast(d64, a), hn::BitCast(d64, b)));
}

HWY_INLINE Row loadRow(const Cells& cells, int offset) {
  const D d;
  const V p0 = loadFours<0>(cells, offset), p1 = loadFours<1>(cells, offset);
  const V p2 = loadFours<2>(cells, offset), p3 = loadFours<3>(cells, offset);
  const V low01 = hn::InterleaveLower(d, p0, p1), low23 = hn::InterleaveLower(d, p2, p3);
  const V high01 = hn::InterleaveUpper(d, p0, p1), high23 = hn::InterleaveUpper(d, p2, p3);
  return {lower64(low01, low23), upper64(low01, low23), lower64(high01, high23), upper64(high01, high23)};
}

HWY_INLINE V lerp(V a, V b, V f) {
  return a + f * (b - a);
}

/// One row interpolated in x; the compiler drops what loadRow makes and this does not read.
HWY_INLINE V rowValue(const Cells& cells, int offset) {
  const Row row = loadRow(cells, offset);
  return lerp(row.left, row.right, cells.fx);
}

HWY_INLINE void storeGradient(const GridMap& map, V gx, V gy, V gz, const BlockLanes<3>& grads, int i) {
  const D d;
  const auto& m = map.linear;
  const V g[3] = {gx, gy, gz};
  for (int a = 0; a < 3; ++a) {
    V world = hn::Set(d, m[4 * a]) * g[a];
    if (!map.diagonal) world = hn::Set(d, m[a]) * gx + hn::Set(d, m[3 + a]) * gy + hn::Set(d, m[6 + a]) * gz;
    hn::StoreU(world, d, grads[a] + i);
  }
}

void trilinearOf(const GridMap& map, const PointBlock& points, float* values) {
  const D d;
  Cells cells;
  for (int i = 0; i < points.count; i += kLanes) {
    locate(map, detail::kLinearPart, points, i, cells);
    const V plane0 = lerp(rowValue(cells, rowOffset(1, 1)), rowValue(cells, rowOffset(2, 1)), cells.fy);
    const V plane1 = lerp(rowValue(cells, rowOffset(1, 2)), rowValue(cells, rowOffset(2, 2)), cells.fy);
    hn::StoreU(lerp(plane0, plane1, cells.fz), d, values + i);
  }
}

void trilinearGradOf(const GridMap& map, const PointBlock& points, float* values,
                     const BlockLanes<3>& grads) {
  const D d;
  forEachVector(map, points, [&](int i, const Cells& cells) HWY_ATTR {
    const V fx = cells.fx, fy = cells.fy, fz = cells.fz;
    V v[2], dx[2], dy[2], r[2][2];
    for (int k = 0; k < 2; ++k) {
      const Row a = loadRow(cells, rowOffset(1, k + 1)), b = loadRow(cells, rowOffset(2, k + 1));
      r[k][0] = lerp(a.left, a.right, fx);
      r[k][1] = lerp(b.left, b.right, fx);
      v[k] = lerp(r[k][0], r[k][1], fy);
      dx[k] = lerp(lerp(a.right - a.before, a.after - a.left, fx),
                   lerp(b.right - b.before, b.after - b.left, fx), fy);
      const V before = rowValue(cells, rowOffset(0, k + 1)), after = rowValue(cells, rowOffset(3, k + 1));
      dy[k] = lerp(r[k][1] - before, after - r[k][0], fy);
    }
    V dz[2];
    for (int j = 0; j < 2; ++j) {
      const V before = rowValue(cells, rowOffset(j + 1, 0)), after = rowValue(cells, rowOffset(j + 1, 3));
      dz[j] = lerp(r[1][j] - before, after - r[0][j], fz);
    }
    hn::StoreU(lerp(v[0], v[1], fz), d, values + i);
    const V half = hn::Set(d, 0.5f);
    storeGradient(map, half * lerp(dx[0], dx[1], fz), half * lerp(dy[0], dy[1], fz),
                  half * lerp(dz[0], dz[1], fy), grads, i);
  });
}

void nearestOf(const GridMap& map, const PointBlock& points, float* values) {
  const D d;
  Cells cells;
  HWY_ALIGN float samples[kLanes];
  for (int i = 0; i < points.count; i += kLanes) {
    locate(map, detail::kNearestPart, points, i, cells);
    for (int l = 0; l < kLanes; ++l) samples[l] = cells.corner[l][kCorner];
    hn::StoreU(hn::Load(d, samples), d, values + i);
  }
}

struct Weights {
  V w0, w2, w3;

  HWY_INLINE V offset(V p0, V p1, V p2, V p3) const {
    return w0 * (p0 - p1) + w2 * (p2 - p1) + w3 * (p3 - p1);
  }
  HWY_INLINE V operator()(V p0, V p1, V p2, V p3) const { return p1 + offset(p0, p1, p2, p3); }
  HWY_INLINE V operator()(const V* p) const { return operator()(p[0], p[1], p[2], p[3]); }
};

HWY_INLINE Weights cubicWeights(V t) {
  const D d;
  const V one = hn::Set(d, 1.0f), h = hn::Set(d, 0.5f) * t, s = one - t;
  return {hn::Neg(h * s) * s, h * (one + t * (hn::Set(d, 4.0f) - hn::Set(d, 3.0f) * t)), hn::Neg(h * t) * s};
}

HWY_INLINE Weights cubicSlopes(V t) {
  const D d;
  const V one = hn::Set(d, 1.0f), half = hn::Set(d, 0.5f), three = hn::Set(d, 3.0f);
  return {half * (t * (hn::Set(d, 4.0f) - three * t) - one),
          half * (one + t * (hn::Set(d, 8.0f) - hn::Set(d, 9.0f) * t)),
          half * (t * (three * t - hn::Set(d, 2.0f)))};
}

void tricubicOf(const GridMap& map, const PointBlock& points, float* values) {
  const D d;
  Cells cells;
  for (int i = 0; i < points.count; i += kLanes) {
    locate(map, detail::kWholeCell, points, i, cells);
    const Weights wx = cubicWeights(cells.fx), wy = cubicWeights(cells.fy);
    V plane[4];
    for (int k = 0; k < 4; ++k) {
      V row[4];
      for (int j = 0; j < 4; ++j) {
        const Row s = loadRow(cells, rowOffset(j, k));
        row[j] = wx(s.before, s.left, s.right, s.after);
      }
      plane[k] = wy(row);
    }
    hn::StoreU(cubicWeights(cells.fz)(plane), d, values + i);
  }
}

// Flattened: left to itself, the compiler calls the body for each vector.
HWY_FLATTEN void tricubicGradOf(const GridMap& map, const PointBlock& points, float* values,
                                const BlockLanes<3>& grads) {
  const D d;
  forEachVector(map, points, [&](int i, const Cells& cells) HWY_ATTR {
    const Weights wx = cubicWeights(cells.fx), wy = cubicWeights(cells.fy);
    const Weights sx = cubicSlopes(cells.fx), sy = cubicSlopes(cells.fy);
    V v[4], dx[4], dy[4];
    for (int k = 0; k < 4; ++k) {
      V row[4], slope[4];
      for (int j = 0; j < 4; ++j) {
        const Row s = loadRow(cells, rowOffset(j, k));
        row[j] = wx(s.before, s.left, s.right, s.after);
        slope[j] = sx.offset(s.before, s.left, s.right, s.after);
      }
      v[k] = wy(row);
      dx[k] = wy(slope);
      dy[k] = sy.offset(row[0], row[1], row[2], row[3]);
    }
    const Weights wz = cubicWeights(cells.fz), sz = cubicSlopes(cells.fz);
    hn::StoreU(wz(v), d, values + i);
    storeGradient(map, wz(dx), wz(dy), sz.offset(v[0], v[1], v[2], v[3]), grads, i);
  });
}

void nearest(const GridView& grid, const PointBlock& points, float* values) {
  nearestOf(nearestMapOf(grid), points, values);
}
void trilinear(const GridView& grid, const PointBlock& points, float* values) {
  trilinearOf(mapOf(grid), points, values);
}
void trilinearGrad(const GridView& grid, const PointBlock& points, float* values,
                   const BlockLanes<3>& grads) {
  trilinearGradOf(mapOf(grid), points, values, grads);
}
void tricubic(const GridView& grid, const PointBlock& points, float* values) {
  tricubicOf(mapOf(grid), points, values);
}
void tricubicGrad(const GridView& grid, const PointBlock& points, float* values, const BlockLanes<3>& grads) {
  tricubicGradOf(mapOf(grid), points, values, grads);
}

#endif

}  // namespace HWY_NAMESPACE
}  // namespace nephele
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace nephele {

HWY_EXPORT(nearest);
HWY_EXPORT(trilinear);
HWY_EXPORT(trilinearGrad);
HWY_EXPORT(tricubic);
HWY_EXPORT(tricubicGrad);

void sampleNearest(const GridView& grid, const PointBlock& points, float* values) {
  if (!detail::fillIfEmpty(grid, points, values, nullptr))
    HWY_DYNAMIC_DISPATCH(nearest)(grid, points, values);
}

void sampleTrilinear(const GridView& grid, const PointBlock& points, float* values) {
  if (!detail::fillIfEmpty(grid, points, values, nullptr))
    HWY_DYNAMIC_DISPATCH(trilinear)(grid, points, values);
}

void sampleTrilinearGrad(const GridView& grid, const PointBlock& points, float* values,
                         const BlockLanes<3>& grads) {
  if (!detail::fillIfEmpty(grid, points, values, &grads))
    HWY_DYNAMIC_DISPATCH(trilinearGrad)(grid, points, values, grads);
}

void sampleTricubic(const GridView& grid, const PointBlock& points, float* values) {
  if (!detail::fillIfEmpty(grid, points, values, nullptr))
    HWY_DYNAMIC_DISPATCH(tricubic)(grid, points, values);
}

void sampleTricubicGrad(const GridView& grid, const PointBlock& points, float* values,
                        const BlockLanes<3>& grads) {
  if (!detail::fillIfEmpty(grid, points, values, &grads))
    HWY_DYNAMIC_DISPATCH(tricubicGrad)(grid, points, values, grads);
}

}  // namespace nephele
#endif  // HWY_ONCE
