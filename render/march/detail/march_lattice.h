// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_LATTICE) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_LATTICE
#undef NEPHELE_MARCH_LATTICE
#else
#define NEPHELE_MARCH_LATTICE
#endif

#include <hwy/highway.h>

#include <cstdint>
#include <type_traits>

#include "nephele/render/march/detail/march_lanes.h"
#include "nephele/render/march/detail/march_loads.h"

/// Look-ups of the march in dense lattices, a vector of points at a time.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Cells of a dense lattice with two numbers per node: the first number of their first nodes, and how far
// beyond these points lie.
struct Cells {
  alignas(64) std::int32_t first[kLanes];
  Point share;
  int strideY, strideZ;
};

// Those around p, all >= 0 and within the lattice.
HWY_INLINE void locate(const Vec3i& size, Point p, Cells& cells) {
  const IntLanes i;
  const Floats x = hn::Floor(p.x), y = hn::Floor(p.y), z = hn::Floor(p.z);
  cells.strideY = 2 * size.x;
  cells.strideZ = 2 * size.x * size.y;
  const Ints node = hn::Add(wholeOf(x), hn::Add(hn::Mul(wholeOf(y), hn::Set(i, size.x)),
                                                hn::Mul(wholeOf(z), hn::Set(i, size.x * size.y))));
  hn::Store(hn::Add(node, node), i, cells.first);
  cells.share = {hn::Sub(p.x, x), hn::Sub(p.y, y), hn::Sub(p.z, z)};
}

// The two numbers that belong to every node, at the places of cells.
HWY_INLINE void readTwo(const float* HWY_RESTRICT nodes, const Cells& cells, Floats (&two)[2]) {
  const Lanes d;
#if HWY_TARGET == HWY_SCALAR
  for (int n = 0; n != 2; ++n) {
    const float* at = nodes + cells.first[0] + n;
    const auto edge = [&](int offset) {
      return hn::MulAdd(cells.share.x, hn::Set(d, at[offset + 2] - at[offset]), hn::Set(d, at[offset]));
    };
    const auto face = [&](int offset) {
      const Floats near = edge(offset);
      return hn::MulAdd(cells.share.y, hn::Sub(edge(offset + cells.strideY), near), near);
    };
    const Floats near = face(0);
    two[n] = hn::MulAdd(cells.share.z, hn::Sub(face(cells.strideZ), near), near);
  }
#else
  const float *row1 = nodes + cells.strideY, *row2 = nodes + cells.strideZ, *row3 = row2 + cells.strideY;
  // Both numbers of two nodes along x in every block, of every fourth place: of which these are.
  const auto some = [&](auto which) HWY_ATTR {
    constexpr int n = decltype(which)::value;
    const std::int32_t* at = cells.first + n;
    const Floats y = hn::Broadcast<n>(cells.share.y), z = hn::Broadcast<n>(cells.share.z);
    const Floats a = foursAt(d, nodes, at), b = foursAt(d, row1, at), e = foursAt(d, row2, at),
                 f = foursAt(d, row3, at);
    const Floats near = hn::MulAdd(y, hn::Sub(b, a), a), far = hn::MulAdd(y, hn::Sub(f, e), e);
    return hn::MulAdd(z, hn::Sub(far, near), near);
  };
  const Floats of0 = some(std::integral_constant<int, 0>()), of1 = some(std::integral_constant<int, 1>()),
               of2 = some(std::integral_constant<int, 2>()), of3 = some(std::integral_constant<int, 3>());
  const hn::RepartitionToWide<Lanes> w;
  const auto low = [&](Floats low, Floats high) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveLower(w, hn::BitCast(w, low), hn::BitCast(w, high)));
  };
  const auto high = [&](Floats low, Floats high) HWY_ATTR {
    return hn::BitCast(d, hn::InterleaveUpper(w, hn::BitCast(w, low), hn::BitCast(w, high)));
  };
  const Floats first01 = hn::InterleaveLower(d, of0, of1), first23 = hn::InterleaveLower(d, of2, of3),
               next01 = hn::InterleaveUpper(d, of0, of1), next23 = hn::InterleaveUpper(d, of2, of3);
  const Floats a0 = low(first01, first23), b0 = high(first01, first23), a1 = low(next01, next23),
               b1 = high(next01, next23);
  two[0] = hn::MulAdd(cells.share.x, hn::Sub(a1, a0), a0);
  two[1] = hn::MulAdd(cells.share.x, hn::Sub(b1, b0), b0);
#endif
}

HWY_INLINE Point clamped(Point p, const Vec3i& size) {
  const Lanes d;
  const auto within = [&](Floats x, int count) HWY_ATTR {
    return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, float(count - 1) - 1e-3f));
  };
  return {within(p.x, size.x), within(p.y, size.y), within(p.z, size.z)};
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
