// No #pragma once: read once for every instruction set, by files that use <hwy/foreach_target.h>.
#if defined(NEPHELE_MARCH_SAMPLES) == defined(HWY_TARGET_TOGGLE)
#ifdef NEPHELE_MARCH_SAMPLES
#undef NEPHELE_MARCH_SAMPLES
#else
#define NEPHELE_MARCH_SAMPLES
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/render/march/detail/march_lanes.h"
#include "nephele/render/volume/march_scene.h"

/// Look-ups of the march, a vector of points at a time: dense lattices, plain bricks and coded ones.
HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

// Keeps the compiler from taking a stored vector apart in registers, which costs more than loading its parts.
HWY_INLINE const volatile std::int32_t* inMemory(const std::int32_t* stored) {
  return stored;
}

// The numbers at[n][offset] and at[n][offset + 1] of as many places as half a vector has lanes.
template <class D>
HWY_INLINE hn::Vec<D> pairsAt(D d, const float* const* HWY_RESTRICT at, int offset) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, at[0][offset]);
#else
  if constexpr (hn::MaxLanes(D()) == 2) {
    return hn::LoadU(d, at[0] + offset);
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128
  } else if constexpr (hn::MaxLanes(D()) == 4) {
    const auto* first = reinterpret_cast<const __m128i*>(at[0] + offset);
    const auto* second = reinterpret_cast<const __m64*>(at[1] + offset);
    return hn::Vec<D>{_mm_loadh_pi(_mm_castsi128_ps(_mm_loadl_epi64(first)), second)};
#endif
  } else {
    const hn::Half<D> half;
    constexpr int quarter = int(hn::MaxLanes(D())) / 4;
    return hn::Combine(d, pairsAt(half, at + quarter, offset), pairsAt(half, at, offset));
  }
#endif
}

// One vector of some that follow each other.
template <class D, class Part>
HWY_INLINE hn::Vec<D> joined([[maybe_unused]] D d, const Part* parts) {
#if HWY_TARGET == HWY_SCALAR
  return parts[0];
#else
  if constexpr (sizeof(hn::Vec<D>) == sizeof(Part))
    return parts[0];
  else
    return hn::Combine(d, parts[1], parts[0]);
#endif
}

// The 32 bits that lie `offset` codes behind at[n], for every lane.
template <class D>
HWY_INLINE hn::Vec<D> wordsAt([[maybe_unused]] D d, const std::uint16_t* const* HWY_RESTRICT at, int offset) {
  constexpr int kCount = int(hn::MaxLanes(D()));
#if HWY_ARCH_X86 && HWY_TARGET != HWY_EMU128 && HWY_TARGET != HWY_SCALAR
  if constexpr (kCount == 4) {
    const auto two = [&](int n) HWY_ATTR {
      return _mm_unpacklo_epi32(_mm_loadu_si32(at[n] + offset), _mm_loadu_si32(at[n + 1] + offset));
    };
    return hn::Vec<D>{_mm_castsi128_ps(_mm_unpacklo_epi64(two(0), two(2)))};
  } else {
    const hn::Half<D> half;
    return hn::Combine(d, wordsAt(half, at + kCount / 2, offset), wordsAt(half, at, offset));
  }
#else
  float words[kCount];
  for (int n = 0; n != kCount; ++n) std::memcpy(words + n, at[n] + offset, sizeof(float));
  return hn::LoadU(d, words);
#endif
}

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

// The four numbers at values + at[0], values + at[4] ..., as many as fit into a vector.
template <class D>
HWY_INLINE hn::Vec<D> foursAt(D d, const float* HWY_RESTRICT values, const std::int32_t* HWY_RESTRICT at) {
#if HWY_TARGET == HWY_SCALAR
  return hn::Set(d, values[at[0]]);
#else
  if constexpr (hn::MaxLanes(D()) == 4) {
    return hn::LoadU(d, values + inMemory(at)[0]);
  } else {
    const hn::Half<D> half;
    constexpr int quads = int(hn::MaxLanes(D())) / 8;
    return hn::Combine(d, foursAt(half, values, at + 4 * quads), foursAt(half, values, at));
  }
#endif
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

// Where points lie in bricks: entry of the table, first node of the cell in the brick, and how far beyond it.
struct Places {
  alignas(64) std::int32_t entry[kLanes], node[kLanes];
  Point share;
};

constexpr float kJustBelow1 = 1.0f - 0x1p-24f;

template <int kWidth>
HWY_INLINE void locate(const MarchScene::Bricks& bricks, Point p, Places& places) {
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
  const Ints inside = hn::Set(i, 7), width = hn::Set(i, kWidth);
  const Ints line = hn::Add(hn::Mul(hn::And(z, inside), width), hn::And(y, inside));
  hn::Store(hn::Add(hn::Mul(line, width), hn::And(x, inside)), i, places.node);
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
  locate<kWidth>(bricks, p, places);
  return read<kWidth, kBefore>(bricks, places);
}

// At places in coded bricks; nothing is below 0.
HWY_INLINE Floats readCoded(const MarchScene::Bricks& bricks, const Places& places) {
  const Lanes d;
  constexpr int kRow = CodedBricks::kWidth, kPlane = CodedBricks::kPlane;
  // As many at a time as addresses fit into registers.
  constexpr int kTogether = kLanes < 8 ? kLanes : 8;
  // Two nodes along x in each: of the four rows of a cell; and what belongs to the brick.
  using Some = hn::CappedTag<float, kTogether>;
  hn::Vec<Some> words[5][kLanes / kTogether];
  for (int part = 0; part != kLanes / kTogether; ++part) {
    const std::uint16_t *at[kTogether], *own[kTogether];
    for (int n = 0; n != kTogether; ++n) {
      const int lane = part * kTogether + n;
      const CodedBricks::Entry* entry = bricks.entries + inMemory(places.entry)[lane];
      own[n] = reinterpret_cast<const std::uint16_t*>(&entry->unit);
      at[n] = bricks.codes + (entry->first + std::uint32_t(inMemory(places.node)[lane]));
    }
    for (int n = 0; n != 4; ++n) words[n][part] = wordsAt(Some(), at, n / 2 * kPlane + n % 2 * kRow);
    words[4][part] = wordsAt(Some(), own, 0);
  }
  const auto alongX = [&](const hn::Vec<Some>* pairs) HWY_ATTR {
    const IntLanes i;
    const hn::RebindToUnsigned<Lanes> u;
    const auto bits = hn::BitCast(u, joined(d, pairs));
    const Floats first = hn::ConvertTo(d, hn::BitCast(i, hn::And(bits, hn::Set(u, 0xffffu)))),
                 second = hn::ConvertTo(d, hn::BitCast(i, hn::ShiftRight<16>(bits)));
    return hn::MulAdd(places.share.x, hn::Sub(second, first), first);
  };
  const auto alongY = [&](const hn::Vec<Some>* first, const hn::Vec<Some>* second) HWY_ATTR {
    const Floats low = alongX(first), high = alongX(second);
    return hn::MulAdd(places.share.y, hn::Sub(high, low), low);
  };
  const Floats near = alongY(words[0], words[1]), far = alongY(words[2], words[3]);
  const Floats code = hn::MulAdd(places.share.z, hn::Sub(far, near), near);
  const Floats above = hn::Max(hn::Sub(code, hn::Set(d, CodedBricks::kZero)), hn::Zero(d));
  return hn::Mul(above, joined(d, words[4]));
}

// Places in coded bricks of vectors of samples, at distances s along a ray. All are found before the first
// value is read, so that the processor need not wait for one vector before it starts the next.
HWY_INLINE void locateAll(const MarchScene::Bricks& bricks, const LatticeRay& ray, int vectors,
                          const float* HWY_RESTRICT s, Places* HWY_RESTRICT places) {
  for (int v = 0; v != vectors; ++v)
    locate<CodedBricks::kWidth>(bricks, pointAt(ray, hn::Load(Lanes(), s + v * kLanes)), places[v]);
}

HWY_INLINE void readAll(const MarchScene::Bricks& bricks, int vectors, const Places* HWY_RESTRICT places,
                        float* HWY_RESTRICT values) {
  for (int v = 0; v != vectors; ++v) hn::Store(readCoded(bricks, places[v]), Lanes(), values + v * kLanes);
}

// Three values at once, at p within bricks that are laid out as the density's.
HWY_INLINE void sampleColour(const MarchScene::ColourBricks& bricks, Point p, Floats (&out)[3]) {
  for (int c = 0; c != 3; ++c)
    out[c] = hn::Max(sampleBricks<BrickGrid::kWidth, BrickGrid::kBefore>(
                         {bricks.values[c], bricks.table, bricks.count}, p),
                     hn::Zero(Lanes()));
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
