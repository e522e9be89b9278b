// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_BRICKS) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_BRICKS
#undef NEPHELE_MARCH_BRICKS
#else
#define NEPHELE_MARCH_BRICKS
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/render/march/detail/march_lanes.h"
#include "nephele/render/march/detail/march_loads.h"
#include "nephele/render/volume/march_scene.h"

/// Look-ups of the march in bricks, a vector of points at a time.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Numbers at the eight corners of cells, as pairs along x of the first half of the lanes and of the second.
struct Corners {
  Floats pairs[4][2];
};

HWY_INLINE Floats alongX(Floats low, Floats high, Floats share) {
#if HWY_TARGET == HWY_SCALAR
  return hn::MulAdd(share, hn::Sub(high, low), low);
#else
  const Lanes d;
  const Floats first = hn::ConcatEven(d, high, low), second = hn::ConcatOdd(d, high, low);
  return hn::MulAdd(share, hn::Sub(second, first), first);
#endif
}

HWY_INLINE Floats between(const Corners& corners, Point f) {
  const auto edge = [&](int n) HWY_ATTR { return alongX(corners.pairs[n][0], corners.pairs[n][1], f.x); };
  const Floats near0 = edge(0), near1 = edge(1), far0 = edge(2), far1 = edge(3);
  const Floats nearFace = hn::MulAdd(f.y, hn::Sub(near1, near0), near0);
  const Floats farFace = hn::MulAdd(f.y, hn::Sub(far1, far0), far0);
  return hn::MulAdd(f.z, hn::Sub(farFace, nearFace), nearFace);
}

// The corners of cells whose first nodes are at addressOf(lane). Made of plain loads, as many at a time as
// addresses fit into registers: gather instructions take several times as long on many processors.
template <class AddressOf>
HWY_INLINE Corners cornersAt(int strideY, int strideZ, AddressOf&& addressOf) {
  const Lanes d;
  Corners corners;
#if HWY_TARGET == HWY_SCALAR
  const float* at = addressOf(0);
  const int offsets[4] = {0, strideY, strideZ, strideZ + strideY};
  for (int n = 0; n != 4; ++n)
    for (int part = 0; part != 2; ++part) corners.pairs[n][part] = hn::Set(d, at[offsets[n] + part]);
#else
  for (int part = 0; part != 2; ++part) {
    const float* at[kLanes / 2];
    for (int n = 0; n != kLanes / 2; ++n) at[n] = addressOf(part * (kLanes / 2) + n);
    corners.pairs[0][part] = pairsAt(d, at, 0);
    corners.pairs[1][part] = pairsAt(d, at, strideY);
    corners.pairs[2][part] = pairsAt(d, at, strideZ);
    corners.pairs[3][part] = pairsAt(d, at, strideZ + strideY);
  }
#endif
  return corners;
}

// Where points lie in bricks: entry of the table, first node of the cell in the brick, and how far beyond it.
struct Places {
  alignas(64) std::int32_t entry[kLanes], node[kLanes];
  Point share;
};

constexpr float kJustBelow1 = 1.0f - 0x1p-24f;

// nodeOf(x, y, z) is where the first nodes of cells, 0 to 7 along every axis, lie in their brick.
template <class NodeOf>
HWY_INLINE void locate(const MarchScene::Bricks& bricks, Point p, Places& places, NodeOf&& nodeOf) {
  const Lanes d;
  const IntLanes i;
  const auto within = [&](Floats x, int count) HWY_ATTR {
    // Just under the end, so that a point on the far face still lies in the last cell.
    return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, 8.0f * float(count) * kJustBelow1));
  };
  const Point q{within(p.x, bricks.count.x), within(p.y, bricks.count.y), within(p.z, bricks.count.z)};
  const Point cell{hn::Floor(q.x), hn::Floor(q.y), hn::Floor(q.z)};
  const Ints x = wholeOf(cell.x), y = wholeOf(cell.y), z = wholeOf(cell.z);
  const Ints row = hn::Add(hn::Mul(hn::ShiftRight<3>(z), hn::Set(i, bricks.count.y)), hn::ShiftRight<3>(y));
  hn::Store(hn::Add(hn::Mul(row, hn::Set(i, bricks.count.x)), hn::ShiftRight<3>(x)), i, places.entry);
  const Ints inside = hn::Set(i, 7);
  hn::Store(nodeOf(hn::And(x, inside), hn::And(y, inside), hn::And(z, inside)), i, places.node);
  places.share = {hn::Sub(q.x, cell.x), hn::Sub(q.y, cell.y), hn::Sub(q.z, cell.z)};
}

template <int kWidth, int kBefore>
HWY_INLINE Floats read(const MarchScene::Bricks& bricks, const Places& places) {
  constexpr int kPlane = kWidth * kWidth;
  const float* first = bricks.values + kBefore * (kPlane + kWidth + 1);
  const Corners corners = cornersAt(kWidth, kPlane, [&](int n) HWY_ATTR {
    return first + std::ptrdiff_t(bricks.table[inMemory(places.entry)[n]]) * (kPlane * kWidth) +
           inMemory(places.node)[n];
  });
  return between(corners, places.share);
}

template <int kWidth, int kBefore>
HWY_INLINE Floats sampleBricks(const MarchScene::Bricks& bricks, Point p) {
  Places places;
  locate(bricks, p, places, [](Ints x, Ints y, Ints z) HWY_ATTR {
    const Ints width = hn::Set(IntLanes(), kWidth);
    return hn::Add(hn::Mul(hn::Add(hn::Mul(z, width), y), width), x);
  });
  return read<kWidth, kBefore>(bricks, places);
}

// Three values at once, at p within bricks that are laid out as the density's.
HWY_INLINE void sampleColour(const MarchScene::ColourBricks& bricks, Point p, Floats (&out)[3]) {
  for (int c = 0; c != 3; ++c)
    out[c] = hn::Max(sampleBricks<BrickGrid::kWidth, BrickGrid::kBefore>(
                         {bricks.values[c], bricks.table, bricks.count}, p),
                     hn::Zero(Lanes()));
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
