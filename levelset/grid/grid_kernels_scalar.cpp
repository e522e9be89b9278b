// The plain loops beside the vector kernels of grid_kernels.cpp, which say how cells are interpolated.
#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/detail/grid_map.h"
#include "nephele/levelset/grid/grid_kernels.h"

namespace nephele {

namespace detail {

namespace {

float notBelow(double v) {
  const float f = float(v);
  return f < v ? std::nextafter(f, HUGE_VALF) : f;
}

}  // namespace

GridMap mapOf(const GridView& grid) {
  const Mat3f& m = grid.layout->worldToIndex().linear;
  const Vec3f& t = grid.layout->worldToIndex().translation;
  GridMap map{m.m,
              {t.x, t.y, t.z},
              {},
              {},
              {},
              grid.layout->brickCount().x,
              grid.layout->brickCount().y,
              true,
              grid.layout->table().data(),
              grid.values,
              grid.packed,
              grid.packed ? &AssembledBricks::local() : nullptr};
  for (int axis = 0; axis < 3; ++axis) {
    map.first[axis] = grid.layout->firstBrick()[axis];
    map.low[axis] = notBelow(8.0 * grid.layout->firstBrick()[axis]);
    map.high[axis] =
        -notBelow(-8.0 * (double(grid.layout->firstBrick()[axis]) + grid.layout->brickCount()[axis]));
    for (int column = 0; column < 3; ++column)
      if (column != axis && m(axis, column) != 0) map.diagonal = false;
  }
  return map;
}

GridMap nearestMapOf(const GridView& grid) {
  GridMap map = mapOf(grid);
  for (float& t : map.translation) t += 0.5f;
  return map;
}

bool fillIfEmpty(const GridView& grid, const PointBlock& points, float* values, const BlockLanes<3>* grads) {
  if (!grid.layout->table().empty()) return false;
  std::fill_n(values, points.paddedCount(), grid.layout->background());
  if (grads)
    for (float* lane : *grads) std::fill_n(lane, points.paddedCount(), 0.0f);
  return true;
}

}  // namespace detail

namespace {

using detail::CellPart;
using detail::fillIfEmpty;
using detail::GridMap;
using detail::kCorner;
using detail::kRow;
using detail::mapOf;
using detail::nearestMapOf;
using detail::rowOffset;

/// The cell of a point: its fractions and the stored sample one before its corner in x, y and z.
struct Cell {
  float fx, fy, fz;
  const float* corner;
};

Cell locate(const GridMap& map, const CellPart& part, float x, float y, float z) {
  const auto& m = map.linear;
  const auto& t = map.translation;
  float q[3];
  if (map.diagonal) {
    q[0] = m[0] * x + t[0], q[1] = m[4] * y + t[1], q[2] = m[8] * z + t[2];
  } else {
    for (int a = 0; a < 3; ++a) q[a] = m[3 * a] * x + m[3 * a + 1] * y + m[3 * a + 2] * z + t[a];
  }
  for (int a = 0; a < 3; ++a)
    if (!(q[a] >= map.low[a] && q[a] < map.high[a]))
      return {0, 0, 0, map.packed ? map.bricks->outside(*map.packed) : map.values};
  int brick[3], local[3];
  float f[3];
  for (int a = 0; a < 3; ++a) {
    const float cell = std::floor(q[a]);
    f[a] = q[a] - cell;
    brick[a] = brickOf(int(cell)) - map.first[a];
    local[a] = insideBrick(int(cell));
  }
  const std::size_t place = (std::size_t(brick[2]) * map.countY + brick[1]) * map.countX + brick[0];
  const int offset = (local[2] * kRow + local[1]) * kRow + local[0];
  const float* corner = map.packed ? map.bricks->cell(*map.packed, place, offset, part.begin, part.count)
                                   : map.values + std::size_t(map.table[place]) * BrickGrid::kVolume + offset;
  return {f[0], f[1], f[2], corner};
}

float lerp(float a, float b, float f) {
  return a + f * (b - a);
}

/// A gradient with respect to index coordinates as one with respect to the world, point `i` of the lanes.
void storeGradient(const GridMap& map, const std::array<float, 3>& g, const BlockLanes<3>& grads, int i) {
  const auto& m = map.linear;
  for (int a = 0; a < 3; ++a)
    grads[a][i] = map.diagonal ? m[4 * a] * g[a] : m[a] * g[0] + m[3 + a] * g[1] + m[6 + a] * g[2];
}

/// Catmull-Rom as offsets from the second of four samples: its own weight is one less the others, so that
/// constants stay exact.
struct CubicWeights {
  float w0, w2, w3;

  float operator()(float p0, float p1, float p2, float p3) const { return p1 + offset(p0, p1, p2, p3); }
  float offset(float p0, float p1, float p2, float p3) const {
    return w0 * (p0 - p1) + w2 * (p2 - p1) + w3 * (p3 - p1);
  }
};

CubicWeights cubicWeights(float t) {
  const float h = 0.5f * t, s = 1.0f - t;
  return {-(h * s) * s, h * (1.0f + t * (4.0f - 3.0f * t)), -(h * t) * s};
}

CubicWeights cubicSlopes(float t) {
  return {0.5f * (t * (4.0f - 3.0f * t) - 1.0f), 0.5f * (1.0f + t * (8.0f - 9.0f * t)),
          0.5f * (t * (3.0f * t - 2.0f))};
}

void trilinearLoop(const GridMap& map, const PointBlock& points, float* values) {
  for (int i = 0; i < points.count; ++i) {
    const Cell cell = locate(map, detail::kLinearPart, points.x[i], points.y[i], points.z[i]);
    float plane[2];
    for (int k = 0; k < 2; ++k) {
      const float* a = cell.corner + rowOffset(1, k + 1);
      const float* b = cell.corner + rowOffset(2, k + 1);
      plane[k] = lerp(lerp(a[1], a[2], cell.fx), lerp(b[1], b[2], cell.fx), cell.fy);
    }
    values[i] = lerp(plane[0], plane[1], cell.fz);
  }
}

void trilinearGradLoop(const GridMap& map, const PointBlock& points, float* values,
                       const BlockLanes<3>& grads) {
  for (int i = 0; i < points.count; ++i) {
    const Cell cell = locate(map, detail::kWholeCell, points.x[i], points.y[i], points.z[i]);
    const float fx = cell.fx, fy = cell.fy, fz = cell.fz;
    // r[k][j] and dx[k][j]: the rows at z - 1 + k, y - 1 + j, interpolated in x, and their difference along
    // x.
    float r[4][4] = {}, dx[4][4] = {};
    for (int k = 0; k < 4; ++k)
      for (int j = 0; j < 4; ++j) {
        const float* row = cell.corner + rowOffset(j, k);
        r[k][j] = lerp(row[1], row[2], fx);
        dx[k][j] = lerp(float(row[2]) - float(row[0]), float(row[3]) - float(row[1]), fx);
      }
    const auto alongY = [&](int k) { return lerp(r[k][2] - r[k][0], r[k][3] - r[k][1], fy); };
    const auto alongZ = [&](int j) { return lerp(r[2][j] - r[0][j], r[3][j] - r[1][j], fz); };
    values[i] = lerp(lerp(r[1][1], r[1][2], fy), lerp(r[2][1], r[2][2], fy), fz);
    const float half = 0.5f;
    storeGradient(map,
                  {half * lerp(lerp(dx[1][1], dx[1][2], fy), lerp(dx[2][1], dx[2][2], fy), fz),
                   half * lerp(alongY(1), alongY(2), fz), half * lerp(alongZ(1), alongZ(2), fy)},
                  grads, i);
  }
}

void nearestLoop(const GridMap& map, const PointBlock& points, float* values) {
  for (int i = 0; i < points.count; ++i) {
    const Cell cell = locate(map, detail::kNearestPart, points.x[i], points.y[i], points.z[i]);
    values[i] = cell.corner[kCorner];
  }
}

void tricubicLoop(const GridMap& map, const PointBlock& points, float* values) {
  for (int i = 0; i < points.count; ++i) {
    const Cell cell = locate(map, detail::kWholeCell, points.x[i], points.y[i], points.z[i]);
    const CubicWeights wx = cubicWeights(cell.fx), wy = cubicWeights(cell.fy), wz = cubicWeights(cell.fz);
    float plane[4];
    for (int k = 0; k < 4; ++k) {
      float row[4];
      for (int j = 0; j < 4; ++j) {
        const float* s = cell.corner + rowOffset(j, k);
        row[j] = wx(s[0], s[1], s[2], s[3]);
      }
      plane[k] = wy(row[0], row[1], row[2], row[3]);
    }
    values[i] = wz(plane[0], plane[1], plane[2], plane[3]);
  }
}

void tricubicGradLoop(const GridMap& map, const PointBlock& points, float* values,
                      const BlockLanes<3>& grads) {
  for (int i = 0; i < points.count; ++i) {
    const Cell cell = locate(map, detail::kWholeCell, points.x[i], points.y[i], points.z[i]);
    const CubicWeights wx = cubicWeights(cell.fx), wy = cubicWeights(cell.fy), wz = cubicWeights(cell.fz);
    const CubicWeights sx = cubicSlopes(cell.fx), sy = cubicSlopes(cell.fy), sz = cubicSlopes(cell.fz);
    float v[4], dx[4], dy[4];
    for (int k = 0; k < 4; ++k) {
      float row[4], slope[4];
      for (int j = 0; j < 4; ++j) {
        const float* s = cell.corner + rowOffset(j, k);
        row[j] = wx(s[0], s[1], s[2], s[3]);
        slope[j] = sx.offset(s[0], s[1], s[2], s[3]);
      }
      v[k] = wy(row[0], row[1], row[2], row[3]);
      dx[k] = wy(slope[0], slope[1], slope[2], slope[3]);
      dy[k] = sy.offset(row[0], row[1], row[2], row[3]);
    }
    values[i] = wz(v[0], v[1], v[2], v[3]);
    storeGradient(
        map,
        {wz(dx[0], dx[1], dx[2], dx[3]), wz(dy[0], dy[1], dy[2], dy[3]), sz.offset(v[0], v[1], v[2], v[3])},
        grads, i);
  }
}

}  // namespace

void sampleNearestScalar(const GridView& grid, const PointBlock& points, float* values) {
  if (fillIfEmpty(grid, points, values, nullptr)) return;
  nearestLoop(nearestMapOf(grid), points, values);
}

void sampleTrilinearScalar(const GridView& grid, const PointBlock& points, float* values) {
  if (fillIfEmpty(grid, points, values, nullptr)) return;
  trilinearLoop(mapOf(grid), points, values);
}

void sampleTrilinearGradScalar(const GridView& grid, const PointBlock& points, float* values,
                               const BlockLanes<3>& grads) {
  if (fillIfEmpty(grid, points, values, &grads)) return;
  trilinearGradLoop(mapOf(grid), points, values, grads);
}

void sampleTricubicScalar(const GridView& grid, const PointBlock& points, float* values) {
  if (fillIfEmpty(grid, points, values, nullptr)) return;
  tricubicLoop(mapOf(grid), points, values);
}

void sampleTricubicGradScalar(const GridView& grid, const PointBlock& points, float* values,
                              const BlockLanes<3>& grads) {
  if (fillIfEmpty(grid, points, values, &grads)) return;
  tricubicGradLoop(mapOf(grid), points, values, grads);
}

}  // namespace nephele
