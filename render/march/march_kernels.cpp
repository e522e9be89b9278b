// The inner loop of the renderer: density, light and opacity along a ray.
//
// Per step:  dT = exp(-sigma ds);  C += T (1 - dT) (sum of lights);  T *= dT,  written as T (1 - dT) =
// T_before - T_after with T = exp(-optical depth so far), so that the weights of a ray add up to its opacity
// exactly, whatever the steps are.
//
// Steps are gathered into blocks of 32 that run across bricks. A block is looked up as vectors: brick table,
// then the eight corners, in the density, in every sun's column densities and in the scattered light. The
// first two are CodedBricks: what limits a sample is how many loads and shuffles it takes, and they need half
// as many. Whatever does not have to wait for the densities stands beside what does.
//
// Limits: pool bricks are indexed by 32 bits (RenderVolume refuses more).
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/march/march_kernels.cpp"
#include "nephele/render/march/march_kernels.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "hwy/contrib/math/math-inl.h"
#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/march/detail/march_runs.h"

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Two vectors of the widest kind: while one waits for memory, the processor works on the other.
constexpr int kBlock = 32;
using Lanes = hn::CappedTag<float, 16>;
using IntLanes = hn::RebindToSigned<Lanes>;
using Floats = hn::Vec<Lanes>;
using Ints = hn::Vec<IntLanes>;

struct Point {
  Floats x, y, z;
};

HWY_INLINE Point pointAt(const LatticeRay& ray, Floats s) {
  const Lanes d;
  return {hn::MulAdd(s, hn::Set(d, ray.direction.x), hn::Set(d, ray.origin.x)),
          hn::MulAdd(s, hn::Set(d, ray.direction.y), hn::Set(d, ray.origin.y)),
          hn::MulAdd(s, hn::Set(d, ray.direction.z), hn::Set(d, ray.origin.z))};
}

constexpr int kLanes = int(hn::MaxLanes(Lanes()));

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

// An integer >= 0 and < 2^23 that is held as a float.
HWY_INLINE Ints wholeOf(Floats x) {
  const Lanes d;
  const IntLanes i;
  return hn::And(hn::BitCast(i, hn::Add(x, hn::Set(d, 8388608.0f))), hn::Set(i, 0x7fffff));
}

// Cells of a dense lattice of nodes: their first nodes, and how far beyond these points lie.
struct Cells {
  alignas(64) std::int32_t node[kLanes];
  Point share;
  int strideY, strideZ;
};

// Those around p, all >= 0 and within the lattice.
HWY_INLINE void locate(const Vec3i& size, Point p, Cells& cells) {
  const IntLanes i;
  const Floats x = hn::Floor(p.x), y = hn::Floor(p.y), z = hn::Floor(p.z);
  cells.strideY = size.x;
  cells.strideZ = size.x * size.y;
  hn::Store(hn::Add(wholeOf(x), hn::Add(hn::Mul(wholeOf(y), hn::Set(i, cells.strideY)),
                                        hn::Mul(wholeOf(z), hn::Set(i, cells.strideZ)))),
            i, cells.node);
  cells.share = {hn::Sub(p.x, x), hn::Sub(p.y, y), hn::Sub(p.z, z)};
}

HWY_INLINE Floats read(const float* HWY_RESTRICT values, const Cells& cells) {
  const Corners corners = cornersAt(cells.strideY, cells.strideZ,
                                    [&](int n) HWY_ATTR { return values + inMemory(cells.node)[n]; });
  return between(corners, cells.share);
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

// Of vectors that hold pairs side by side, all the first halves or all the second.
HWY_INLINE Floats firstOf(Floats low, Floats high) {
#if HWY_TARGET == HWY_SCALAR
  return static_cast<void>(high), low;
#else
  return hn::ConcatEven(Lanes(), high, low);
#endif
}

HWY_INLINE Floats secondOf(Floats low, Floats high) {
#if HWY_TARGET == HWY_SCALAR
  return static_cast<void>(low), high;
#else
  return hn::ConcatOdd(Lanes(), high, low);
#endif
}

// At places in coded bricks; nothing is below 0.
HWY_INLINE Floats readCoded(const MarchScene::Bricks& bricks, const Places& places) {
  const Lanes d;
  // As in Corners, the two rows of a cell; and what belongs to the brick.
  Floats rows[2][2], entries[2];
#if HWY_TARGET == HWY_SCALAR
  const CodedBricks::Entry& entry = bricks.entries[places.entry[0]];
  const float* at = bricks.pairs + (entry.first + std::uint32_t(places.node[0]));
  for (int part = 0; part != 2; ++part) {
    rows[0][part] = hn::Set(d, at[part]);
    rows[1][part] = hn::Set(d, at[CodedBricks::kWidth + part]);
    entries[part] = hn::Set(d, entry.unit);
  }
#else
  static_assert(sizeof(CodedBricks::Entry) == 2 * sizeof(float));
  for (int part = 0; part != 2; ++part) {
    const float *at[kLanes / 2], *own[kLanes / 2];
    for (int n = 0; n != kLanes / 2; ++n) {
      const int lane = part * (kLanes / 2) + n;
      const CodedBricks::Entry* entry = bricks.entries + inMemory(places.entry)[lane];
      own[n] = reinterpret_cast<const float*>(entry);
      at[n] = bricks.pairs + (entry->first + std::uint32_t(inMemory(places.node)[lane]));
    }
    entries[part] = pairsAt(d, own, 0);
    rows[0][part] = pairsAt(d, at, 0);
    rows[1][part] = pairsAt(d, at, CodedBricks::kWidth);
  }
#endif
  const auto alongZ = [&](Floats pairs) HWY_ATTR {
    const IntLanes i;
    const hn::RebindToUnsigned<Lanes> u;
    const auto bits = hn::BitCast(u, pairs);
    const Floats near = hn::ConvertTo(d, hn::BitCast(i, hn::And(bits, hn::Set(u, 0xffffu)))),
                 far = hn::ConvertTo(d, hn::BitCast(i, hn::ShiftRight<16>(bits)));
    return hn::MulAdd(places.share.z, hn::Sub(far, near), near);
  };
  const auto alongRow = [&](const Floats(&row)[2]) HWY_ATTR {
    const Floats first = alongZ(firstOf(row[0], row[1])), second = alongZ(secondOf(row[0], row[1]));
    return hn::MulAdd(places.share.x, hn::Sub(second, first), first);
  };
  const Floats low = alongRow(rows[0]), high = alongRow(rows[1]);
  const Floats code = hn::MulAdd(places.share.y, hn::Sub(high, low), low);
  const Floats above = hn::Max(hn::Sub(code, hn::Set(d, CodedBricks::kZero)), hn::Zero(d));
  return hn::Mul(above, secondOf(entries[0], entries[1]));
}

// Lane n of the result is lane `from[n]` of x.
struct LaneOrder {
  alignas(64) std::int32_t from[kLanes];
};
HWY_INLINE Floats reordered(Floats x, [[maybe_unused]] const LaneOrder& order) {
#if HWY_TARGET == HWY_SCALAR
  return x;
#else
  return hn::TableLookupLanes(x, hn::SetTableIndices(Lanes(), order.from));
#endif
}
template <class From>
constexpr LaneOrder laneOrder(From&& from) {
  LaneOrder order{};
  for (int n = 0; n != kLanes; ++n) order.from[n] = from(n);
  return order;
}

// The sums of each lane and those before it, and `before`.
HWY_INLINE Floats runningSum(Floats x, Floats before) {
  const Lanes d;
  const IntLanes i;
  const auto step = [&](auto width) HWY_ATTR {
    constexpr int kWidth = decltype(width)::value;
    if constexpr (kWidth < kLanes) {
      static constexpr LaneOrder order =
          laneOrder([](int n) { return n & kWidth ? (n & ~(kWidth - 1)) - 1 : n; });
      const auto odd = hn::RebindMask(d, hn::Ne(hn::And(hn::Iota(i, 0), hn::Set(i, kWidth)), hn::Zero(i)));
      x = hn::Add(x, hn::IfThenElseZero(odd, reordered(x, order)));
    }
  };
  step(std::integral_constant<int, 1>());
  step(std::integral_constant<int, 2>());
  step(std::integral_constant<int, 4>());
  step(std::integral_constant<int, 8>());
  return hn::Add(x, before);
}

HWY_INLINE Floats broadcastLast(Floats x) {
  static constexpr LaneOrder order = laneOrder([](int) { return kLanes - 1; });
  return reordered(x, order);
}

// The lanes moved up by one, with the first one of `first` before them.
HWY_INLINE Floats movedUp(Floats x, Floats first) {
  const Lanes d;
  static constexpr LaneOrder order = laneOrder([](int n) { return n > 0 ? n - 1 : 0; });
  return hn::IfThenElse(hn::FirstN(d, 1), first, reordered(x, order));
}

// Places in coded bricks of as many samples as a block has, at distances s along a ray. All are found before
// the first value is read, so that the processor need not wait for one vector before it starts the next.
template <int kSize>
HWY_INLINE void locateBlock(const MarchScene::Bricks& bricks, const LatticeRay& ray,
                            const float* HWY_RESTRICT s, Places (&places)[kSize / kLanes]) {
  for (int v = 0; v != kSize / kLanes; ++v)
    locate<CodedBricks::kWidth>(bricks, pointAt(ray, hn::Load(Lanes(), s + v * kLanes)), places[v]);
}

template <int kSize>
HWY_INLINE void readBlock(const MarchScene::Bricks& bricks, const Places (&places)[kSize / kLanes],
                          float* HWY_RESTRICT values) {
  for (int v = 0; v != kSize / kLanes; ++v)
    hn::Store(readCoded(bricks, places[v]), Lanes(), values + v * kLanes);
}

template <int kSize>
HWY_INLINE void sampleBlock(const MarchScene::Bricks& bricks, const LatticeRay& ray,
                            const float* HWY_RESTRICT s, float* HWY_RESTRICT values) {
  Places places[kSize / kLanes];
  locateBlock<kSize>(bricks, ray, s, places);
  readBlock<kSize>(bricks, places, values);
}

// 2^f = 1 + kPower[0] f + ... for |f| <= 1/2: best fit, off by 2e-8 of it at most.
constexpr float kPower[] = {0.693147182f,   0.240226477f,   0.0555033237f,
                            0.00961843692f, 0.00133988739f, 0.00015353362f};

// exp(-x) for x from 0 to 80, off by 1e-7 (1 + x) of it at most; 1 where x is 0. Half the work of what
// libraries have for all numbers.
HWY_INLINE Floats expOfMinus(Floats x) {
  const Lanes d;
  const IntLanes i;
  // The last bits of `whole` are the nearest whole number.
  const Floats y = hn::Mul(x, hn::Set(d, -1.44269504f)), middle = hn::Set(d, 12582912.0f);
  const Floats whole = hn::Add(y, middle), f = hn::Sub(y, hn::Sub(whole, middle)), f2 = hn::Mul(f, f);
  const auto line = [&](float slope, float at0)
                        HWY_ATTR { return hn::MulAdd(f, hn::Set(d, slope), hn::Set(d, at0)); };
  const Floats high = hn::MulAdd(hn::MulAdd(f2, hn::Set(d, kPower[5]), line(kPower[4], kPower[3])), f2,
                                 line(kPower[2], kPower[1]));
  const Floats power = hn::MulAdd(high, f2, line(kPower[0], 1.0f));
  return hn::BitCast(d, hn::Add(hn::BitCast(i, power), hn::ShiftLeft<23>(hn::BitCast(i, whole))));
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

// One ray's march: collects steps, and adds a block of them at a time.
class Marcher {
 public:
  Marcher(const MarchScene& scene, const MarchRay& ray, MarchResult& result, MarchRecord* record)
      : scene_(scene),
        ray_(ray),
        result_(result),
        record_(record),
        isHeld_(!ray.holdout.empty()),
        needsBegin_(isHeld_ || record) {}

  // `count` steps of length `ds` from `start` on, of this density if it is not negative. False once the ray
  // is as good as opaque.
  bool take(float start, float ds, int count, float density) {
    const Lanes d;
    const int lanes = int(hn::Lanes(d));
    float begin = start;
    start += ray_.jitter * ds;
    while (count > 0) {
      if (density >= 0 && !someKnown_) {
        std::fill_n(known_, count_, -1.0f);
        someKnown_ = true;
      }
      // Whole vectors, whatever room there is: the blocks have as much again behind them.
      for (int i = 0; i < std::min(count, kBlock); i += lanes) {
        const Floats index = hn::Iota(d, float(i));
        hn::StoreU(hn::MulAdd(index, hn::Set(d, ds), hn::Set(d, start)), d, s_ + count_ + i);
        hn::StoreU(hn::Set(d, ds), d, ds_ + count_ + i);
        if (needsBegin_)
          hn::StoreU(hn::MulAdd(index, hn::Set(d, ds), hn::Set(d, begin)), d, begin_ + count_ + i);
        if (someKnown_) hn::StoreU(hn::Set(d, density), d, known_ + count_ + i);
      }
      const int taken = std::min(count, kBlock - count_);
      count_ += taken;
      count -= taken;
      start += float(taken) * ds;
      begin += float(taken) * ds;
      if (count_ == kBlock && (!flush() || isHidden_)) return false;
    }
    return true;
  }

  // One step that is known. False once the ray is as good as opaque.
  bool take(const MarchStep& step) {
    jitter_ = 0.5f;
    s_[count_] = step.place;
    begin_[count_] = step.begin;
    ds_[count_] = step.length;
    known_[count_] = step.opticalDepth / (scene_.extinction * step.length);
    someKnown_ = true;
    return ++count_ != kBlock || (flush() && !isHidden_);
  }

  void finish() {
    if (count_ > 0) flush();
    result_.opticalDepth = depth_;
    if (record_) mark();
  }

 private:
  template <int kColours>
  struct Weights {
    alignas(64) float of[kColours][kBlock];
  };

  // Adds the steps collected. False once the ray is as good as opaque.
  bool flush() { return count_ > kBlock / 2 ? flushFirst<kBlock>() : flushFirst<kBlock / 2>(); }

  // Those among the first kSize of the block, where all are.
  template <int kSize>
  bool flushFirst() {
    const Lanes d;
    const std::size_t lanes = hn::Lanes(d);
    const int used = count_;
    for (int i = used; i != kSize; ++i) s_[i] = s_[used - 1], ds_[i] = 0.0f, known_[i] = known_[used - 1];
    count_ = 0;
    const bool someKnown = someKnown_;
    someKnown_ = false;
    result_.samples += std::uint32_t(used);

    // The first sun's light is read here, beside the densities, which have to be waited for.
    alignas(64) float depth[kSize], column[kSize];
    const bool hasSun = !scene_.suns.empty();
    Places places[kSize / kLanes], sunPlaces[kSize / kLanes];
    if (!someKnown) locateBlock<kSize>(scene_.density, ray_.density, s_, places);
    if (hasSun) locateBlock<kSize>(scene_.suns[0], ray_.suns[0], s_, sunPlaces);
    if (!someKnown) {
      readBlock<kSize>(scene_.density, places, depth);
    } else {
      for (std::size_t i = 0; i < kSize; i += lanes) {
        Floats density = hn::Load(d, known_ + i);
        if (!hn::AllTrue(d, hn::Ge(density, hn::Zero(d)))) {
          locate<CodedBricks::kWidth>(scene_.density, pointAt(ray_.density, hn::Load(d, s_ + i)), places[0]);
          density = readCoded(scene_.density, places[0]);
        }
        hn::Store(density, d, depth + i);
      }
    }
    if (!scene_.emission.table) {
      Floats most = hn::Zero(d);
      for (std::size_t i = 0; i < kSize; i += lanes) most = hn::Max(most, hn::Load(d, depth + i));
      if (hn::AllTrue(d, hn::Eq(most, hn::Zero(d)))) return true;
    }
    if (hasSun) readBlock<kSize>(scene_.suns[0], sunPlaces, column);
    const Floats extinction = hn::Set(d, scene_.extinction);
    for (std::size_t i = 0; i < kSize; i += lanes)
      hn::Store(hn::Mul(hn::Mul(hn::Load(d, depth + i), extinction), hn::Load(d, ds_ + i)), d, depth + i);
    alignas(64) float after[kBlock];
    const float start = depth_;
    Floats behind = hn::Set(d, depth_);
    for (std::size_t i = 0; i < kSize; i += lanes) {
      const Floats sums = runningSum(hn::Load(d, depth + i), behind);
      behind = broadcastLast(sums);
      hn::Store(sums, d, after + i);
    }
    depth_ = hn::GetLane(behind);
    if (!isHeld_ && start <= detail::kVisibleDepth && depth_ > detail::kVisibleDepth) {
      int first = 0;
      while (after[first] <= detail::kVisibleDepth) ++first;
      result_.distance = ray_.start + s_[first];
    }

    if (isHeld_) hold(start, after, used);
    if (record_) record(start, after, used);
    if (scene_.isColoured()) return flushColours<kSize>(depth, after, column);

    Weights<1> weights;
    Floats through = hn::Set(d, through_);
    for (std::size_t i = 0; i < kSize; i += lanes) {
      const Floats tau = hn::Min(hn::Load(d, after + i), hn::Set(d, 80.0f));
      const Floats left = expOfMinus(tau);
      Floats weight = hn::Sub(movedUp(left, through), left);
      if (isHeld_) weight = hn::Mul(weight, hn::Load(d, seen_ + i));
      hn::Store(weight, d, weights.of[0] + i);
      through = broadcastLast(left);
    }
    through_ = hn::GetLane(through);
    light<kSize>(weights, column);
    return through_ > scene_.cutoff;
  }

  // What the holdout leaves of every step, and of its opacity.
  void hold(float before, const float* after, int used) {
    for (int i = 0; i != used; ++i) {
      const float middle = ray_.start + begin_[i] + 0.5f * ds_[i];
      seen_[i] = ray_.holdout.transmittance(middle * ray_.cosine, holdoutCursor_);
      for (int c = 0; c != 3; ++c) {
        const float share = scene_.extinctionColour[c];
        result_.heldOpacity[c] += seen_[i] * (std::exp(-std::min(before * share, 80.0f)) -
                                              std::exp(-std::min(after[i] * share, 80.0f)));
      }
      before = after[i];
      if (std::isinf(result_.distance) && isVisible(result_.heldOpacity))
        result_.distance = ray_.start + s_[i];
    }
    for (int i = used; i != kBlock; ++i) seen_[i] = seen_[used - 1];
    isHidden_ = seen_[used - 1] <= scene_.cutoff;
  }

  static bool isVisible(const float* opacity) {
    return opacity[0] + opacity[1] + opacity[2] > 3 * detail::kVisibleOpacity;
  }

  void mark() { record_->marks.push_back({record_->steps.size(), result_}); }

  // The steps of a block, before its light is added.
  void record(float before, const float* after, int used) {
    mark();
    float opacity = record_->steps.empty() ? 0.0f : record_->steps.back().opacity;
    for (int i = 0; i != used; ++i) {
      if (after[i] == before && !scene_.emission.table) continue;
      const float gain = scene_.meanOpacity(after[i]) - scene_.meanOpacity(before);
      opacity = isHeld_ ? opacity + seen_[i] * gain : scene_.meanOpacity(after[i]);
      record_->steps.push_back({begin_[i], begin_[i] + ds_[i], opacity});
      before = after[i];
    }
  }

  // The same where colours differ in more than their albedo: `after` are optical depths behind the steps,
  // `depth` their own.
  template <int kSize>
  bool flushColours(const float* depth, const float* after, const float* column) {
    const Lanes d;
    const std::size_t lanes = hn::Lanes(d);
    alignas(64) float through[3][kBlock + 1];
    for (int c = 0; c != 3; ++c) {
      through[c][0] = throughColours_[c];
      const Floats share = hn::Set(d, scene_.extinctionColour[c]);
      for (std::size_t i = 0; i < kSize; i += lanes) {
        const Floats tau = hn::Min(hn::Mul(hn::Load(d, after + i), share), hn::Set(d, 80.0f));
        hn::StoreU(expOfMinus(tau), d, through[c] + 1 + i);
      }
      throughColours_[c] = through[c][kSize];
    }
    Weights<3> weights;
    for (std::size_t i = 0; i < kSize; i += lanes) {
      const Floats s = hn::Load(d, s_ + i), own = hn::Load(d, depth + i);
      Floats weight[3];
      for (int c = 0; c != 3; ++c)
        weight[c] = hn::Sub(hn::LoadU(d, through[c] + i), hn::LoadU(d, through[c] + i + 1));
      const Floats seen = isHeld_ ? hn::Load(d, seen_ + i) : hn::Set(d, 1.0f);
      if (scene_.emission.table) {
        // T (1 - exp(-t)) / t, by its series where the difference would lose its digits.
        Floats glow[3];
        sampleColour(scene_.emission, pointAt(ray_.density, s), glow);
        const Floats step =
            hn::Mul(hn::Load(d, ds_ + i), hn::Set(d, scene_.extinction * scene_.emissionScale));
        for (int c = 0; c != 3; ++c) {
          const Floats t = hn::Mul(own, hn::Set(d, scene_.extinctionColour[c]));
          const Floats thin =
              hn::NegMulAdd(t, hn::NegMulAdd(t, hn::Set(d, 1.0f / 6), hn::Set(d, 0.5f)), hn::Set(d, 1.0f));
          const Floats mean =
              hn::IfThenElse(hn::Lt(t, hn::Set(d, 0.03f)), hn::Mul(hn::LoadU(d, through[c] + i), thin),
                             hn::Div(weight[c], hn::Max(t, hn::Set(d, 0.03f))));
          result_.emission[c] +=
              hn::GetLane(hn::SumOfLanes(d, hn::Mul(hn::Mul(glow[c], step), hn::Mul(mean, seen))));
        }
      }
      if (scene_.colour.table) {
        const Floats density = hn::Div(
            own, hn::Max(hn::Mul(hn::Load(d, ds_ + i), hn::Set(d, scene_.extinction)), hn::Set(d, 1e-30f)));
        const auto some = hn::Gt(density, hn::Set(d, 1e-30f));
        Floats colour[3];
        sampleColour(scene_.colour, pointAt(ray_.density, s), colour);
        for (int c = 0; c != 3; ++c)
          weight[c] = hn::Mul(weight[c], hn::IfThenElseZero(some, hn::Div(colour[c], density)));
      }
      for (int c = 0; c != 3; ++c) hn::Store(hn::Mul(weight[c], seen), d, weights.of[c] + i);
    }
    light<kSize>(weights, column);
    return std::max({throughColours_[0], throughColours_[1], throughColours_[2]}) > scene_.cutoff;
  }

  // Adds the light that steps of one weight, or of one for each colour, send to the eye.
  template <int kSize, int kColours>
  void light(const Weights<kColours>& weights, const float* firstColumn) {
    const Lanes d;
    for (std::size_t sun = 0; sun != scene_.suns.size(); ++sun) {
      alignas(64) float other[kSize];
      if (sun > 0) sampleBlock<kSize>(scene_.suns[sun], ray_.suns[sun], s_, other);
      const float* column = sun > 0 ? other : firstColumn;
      for (int n = 0; n != scene_.octaves; ++n)
        for (int c = 0; c != kColours; ++c) {
          const float share = scene_.extinction * scene_.attenuation[n] *
                              (kColours == 1 ? 1.0f : scene_.extinctionColour[c]) *
                              scene_.suns[sun].shadow[c];
          Floats sum = hn::Zero(d);
          for (int i = 0; i != kSize; i += kLanes) {
            const Floats left =
                hn::Min(hn::Mul(hn::Load(d, column + i), hn::Set(d, share)), hn::Set(d, 80.0f));
            sum = hn::MulAdd(expOfMinus(left), hn::Load(d, weights.of[c] + i), sum);
          }
          const float all = hn::GetLane(hn::SumOfLanes(d, sum));
          if constexpr (kColours == 1)
            for (int k = 0; k != scene_.colours; ++k) result_.suns[sun][k] += all * ray_.weight[sun][k][n];
          else
            result_.suns[sun][c] += all * ray_.weight[sun][c][n];
        }
    }
    if (scene_.locals.empty() && scene_.scattered.empty() && (kColours == 1 || !scene_.glow[0])) return;
    for (int i = 0; i != kSize; i += kLanes) {
      const Floats s = hn::Load(d, s_ + i), ds = hn::Load(d, ds_ + i);
      Floats weight[kColours];
      for (int c = 0; c != kColours; ++c) weight[c] = hn::Load(d, weights.of[c] + i);
      for (std::size_t n = 0; n != scene_.locals.size(); ++n) local(n, s, ds, weight);
      if (!scene_.scattered.empty()) scattered(s, weight);
      if constexpr (kColours == 3)
        if (scene_.glow[0]) scatteredGlow(s, weight);
    }
  }

  // The same for a light at a place. Within a step distance and angle change as the light goes by: taken are
  // the mean of 1 / r^2, which is the angle that the step fills as seen from the light over its length and
  // the distance of its line, and the phase function half way along that angle.
  template <int kColours>
  void local(std::size_t index, Floats s, Floats ds, const Floats (&weight)[kColours]) {
    const Lanes d;
    const MarchScene::Local& light = scene_.locals[index];
    const MarchRay::Local& line = ray_.locals[index];
    const Floats least = hn::Set(d, light.least), one = hn::Set(d, 1.0f), zero = hn::Zero(d);
    const Floats length = hn::Max(ds, least), away2 = hn::Set(d, line.distance2), away = hn::Sqrt(away2);
    const Floats along = hn::Sub(s, hn::Set(d, line.closest));
    const Floats first = hn::NegMulAdd(hn::Set(d, jitter_), length, along), last = hn::Add(first, length);
    const Floats r = hn::Sqrt(hn::MulAdd(along, along, away2));
    Floats share = one;
    {
      Floats decay = one;
      const Floats start = hn::Set(d, light.decayStart);
      if (light.decay == 2) {
        const Floats area = hn::Mul(away, length), x = hn::MulAdd(first, last, away2);
        const Floats tangent = hn::Div(area, hn::IfThenElse(hn::Eq(x, zero), hn::Set(d, 1e-30f), x));
        const Floats acute = hn::Atan(d, tangent);
        const Floats angle = hn::IfThenElse(hn::Lt(x, zero), hn::Add(acute, hn::Set(d, 3.14159265f)), acute);
        decay = hn::Div(angle, area);
        if (light.decayStart > 0)
          decay = hn::IfThenElse(hn::Lt(r, start), hn::Div(one, hn::Mul(start, start)), decay);
      } else if (light.decay == 1) {
        decay = hn::Div(one, hn::Max(r, hn::Max(start, least)));
      }
      const Point q = pointAt(line.frame, s);
      if (light.hasCone) {
        const Floats c = hn::Div(
            hn::MulAdd(q.x, hn::Set(d, light.axis.x),
                       hn::MulAdd(q.y, hn::Set(d, light.axis.y), hn::Mul(q.z, hn::Set(d, light.axis.z)))),
            hn::Max(r, least));
        const Floats t = hn::Min(
            hn::Max(hn::Mul(hn::Sub(c, hn::Set(d, light.outerCosine)), hn::Set(d, light.perCosine)), zero),
            one);
        decay = hn::Mul(decay, hn::Mul(hn::Mul(t, t), hn::NegMulAdd(hn::Set(d, 2.0f), t, hn::Set(d, 3.0f))));
        if (hn::AllTrue(d, hn::Eq(decay, zero))) return;
      }
      share = decay;
    }
    const Floats depth = hn::Mul(hn::Max(localColumn(light, line, s), zero), hn::Set(d, scene_.extinction));

    const Floats a = hn::Div(one, hn::Sqrt(hn::MulAdd(first, first, away2))),
                 b = hn::Div(one, hn::Sqrt(hn::MulAdd(last, last, away2)));
    const Floats across = hn::Mul(away, hn::Add(a, b)), forward = hn::MulAdd(first, a, hn::Mul(last, b));
    const Floats norm = hn::Sqrt(hn::MulAdd(across, across, hn::Mul(forward, forward)));
    const Floats sine = hn::Div(forward, hn::Max(norm, hn::Set(d, 1e-30f)));
    const Floats place =
        hn::Mul(hn::Sqrt(hn::Min(hn::Max(hn::Mul(hn::Add(one, sine), hn::Set(d, 0.5f)), zero), one)),
                hn::Set(d, float(MarchScene::Local::kPhaseNodes) - 0.001f));
    const IntLanes i;
    const Ints node = hn::ConvertTo(i, place);
    const Floats part = hn::Sub(place, hn::ConvertTo(d, node));

    float* result = result_.suns[scene_.suns.size() + index];
    for (int n = 0; n != scene_.octaves; ++n) {
      const float* table = light.phase + n * (MarchScene::Local::kPhaseNodes + 1);
      const Floats p0 = hn::GatherIndex(d, table, node), p1 = hn::GatherIndex(d, table + 1, node);
      const Floats lit = hn::Mul(hn::MulAdd(part, hn::Sub(p1, p0), p0), share);
      const auto seen = [&](float extinction, Floats of) HWY_ATTR {
        const Floats left = hn::Min(hn::Mul(depth, hn::Set(d, extinction)), hn::Set(d, 80.0f));
        return hn::GetLane(hn::SumOfLanes(d, hn::Mul(hn::Mul(expOfMinus(left), lit), of)));
      };
      if constexpr (kColours == 1) {
        const float sum = seen(scene_.attenuation[n] * light.shadow[0], weight[0]);
        for (int c = 0; c != scene_.colours; ++c) result[c] += sum * light.albedo[c];
      } else {
        for (int c = 0; c != kColours; ++c)
          result[c] += light.albedo[c] *
                       seen(scene_.attenuation[n] * light.shadow[c] * scene_.extinctionColour[c], weight[c]);
      }
    }
  }

  // Density between a light at a place and points of the ray.
  HWY_INLINE Floats localColumn(const MarchScene::Local& light, const MarchRay::Local& line, Floats s) const {
    const Lanes d;
    const Point q = pointAt(line.frame, s);
    const Floats x = hn::Abs(q.x), y = hn::Abs(q.y), z = hn::Abs(q.z);
    Floats column = hn::Zero(d);
    for (const MarchScene::Local::Face& face : light.faces) {
      const Floats u = face.axis == 0   ? q.y
                       : face.axis == 1 ? q.z
                                        : q.x,
                   v = face.axis == 0   ? q.z
                       : face.axis == 1 ? q.x
                                        : q.y,
                   w = hn::Mul(face.axis == 0   ? q.x
                               : face.axis == 1 ? q.y
                                                : q.z,
                               hn::Set(d, face.side));
      const auto inFront = hn::Gt(w, hn::Zero(d));
      const auto mine = light.faces.size() == 1 ? inFront
                        : face.axis == 0        ? hn::And(inFront, hn::And(hn::Ge(x, y), hn::Ge(x, z)))
                        : face.axis == 1        ? hn::And(inFront, hn::And(hn::Gt(y, x), hn::Ge(y, z)))
                                                : hn::And(inFront, hn::And(hn::Gt(z, x), hn::Gt(z, y)));
      if (hn::AllFalse(d, mine)) continue;
      const Floats depth = hn::Max(w, hn::Set(d, light.least)),
                   scale = hn::Div(hn::Set(d, face.perTangent), depth);
      const Point p{hn::Sub(hn::MulAdd(u, scale, hn::Set(d, line.shift.x)), hn::Set(d, face.corner.x)),
                    hn::Sub(hn::MulAdd(v, scale, hn::Set(d, line.shift.y)), hn::Set(d, face.corner.y)),
                    hn::Sub(hn::MulAdd(depth, hn::Set(d, face.perDepth), hn::Set(d, line.shift.z)),
                            hn::Set(d, face.corner.z))};
      column = hn::IfThenElse(mine, sampleBricks<LightVolume::kWidth, 0>(face, p), column);
    }
    return column;
  }

  void scatteredGlow(Floats s, const Floats (&weight)[3]) {
    const Lanes d;
    Cells cells;
    locate(scene_.scatteredSize, clamped(pointAt(ray_.scattered, s), scene_.scatteredSize), cells);
    for (int c = 0; c != 3; ++c) {
      const Floats there = read(scene_.glow[c], cells);
      result_.emission[c] += hn::GetLane(hn::SumOfLanes(d, hn::Mul(there, weight[c])));
    }
  }

  template <int kColours>
  void scattered(Floats s, const Floats (&weight)[kColours]) {
    const Lanes d;
    Cells cells;
    locate(scene_.scatteredSize, clamped(pointAt(ray_.scattered, s), scene_.scatteredSize), cells);
    std::size_t lattice = 0;
    for (std::size_t light = 0; light <= scene_.lightCount(); ++light) {
      float* result = light < scene_.lightCount() ? result_.suns[light] : result_.sky;
      for (int c = 0; c != scene_.colours; ++c) {
        const float* values = scene_.scattered[lattice++];
        if (!values) continue;
        const Floats there = read(values, cells);
        result[c] += hn::GetLane(hn::SumOfLanes(d, hn::Mul(there, weight[kColours == 1 ? 0 : c])));
      }
    }
  }

  const MarchScene& scene_;
  const MarchRay& ray_;
  MarchResult& result_;
  MarchRecord* record_;
  const bool isHeld_, needsBegin_;
  // Whether some densities of the block need no look-up.
  bool someKnown_ = false;
  // Nothing farther away is seen.
  bool isHidden_ = false;
  std::size_t holdoutCursor_ = 0;
  // Where in its step a sample is, about.
  float jitter_ = ray_.jitter;
  alignas(64) float seen_[kBlock];
  alignas(64) float s_[2 * kBlock];
  alignas(64) float ds_[2 * kBlock];
  alignas(64) float begin_[2 * kBlock];
  // Densities, negative where they have to be looked up.
  alignas(64) float known_[2 * kBlock];
  int count_ = 0;
  float depth_ = 0.0f;
  float through_ = 1.0f;
  float throughColours_[3] = {1.0f, 1.0f, 1.0f};
};

void marchBatch(const MarchScene& scene, const MarchRay* rays, MarchResult* results, MarchRecord* records,
                std::size_t count) {
  for (std::size_t i = 0; i != count; ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    if (records) records[i].clear();
    Marcher marcher(scene, rays[i], results[i], records ? records + i : nullptr);
    detail::forEachRun(scene, rays[i], [&](float s, float ds, int n, float density) {
      return marcher.take(s, ds, n, density);
    });
    marcher.finish();
  }
}

void marchStepsBatch(const MarchScene& scene, const MarchRay* rays, const std::span<const MarchStep>* steps,
                     MarchResult* results, MarchRecord* records, std::size_t count) {
  for (std::size_t i = 0; i != count; ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    if (records) records[i].clear();
    Marcher marcher(scene, rays[i], results[i], records ? records + i : nullptr);
    for (const MarchStep& step : steps[i])
      if (!marcher.take(step)) break;
    marcher.finish();
  }
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include "nephele/modeling/base/error.h"

namespace nephele {

HWY_EXPORT(marchBatch);
HWY_EXPORT(marchStepsBatch);

void marchRays(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results,
               std::span<MarchRecord> records) {
  require(rays.size() == results.size(), "march: as many results as rays are needed");
  require(records.empty() || records.size() == rays.size(), "march: as many records as rays are needed");
  HWY_DYNAMIC_DISPATCH(marchBatch)
  (scene, rays.data(), results.data(), records.empty() ? nullptr : records.data(), rays.size());
}

void marchSteps(const MarchScene& scene, std::span<const MarchRay> rays,
                std::span<const std::span<const MarchStep>> steps, std::span<MarchResult> results,
                std::span<MarchRecord> records) {
  require(rays.size() == results.size(), "march: as many results as rays are needed");
  require(rays.size() == steps.size(), "march: as many lists of steps as rays are needed");
  require(records.empty() || records.size() == rays.size(), "march: as many records as rays are needed");
  HWY_DYNAMIC_DISPATCH(marchStepsBatch)
  (scene, rays.data(), steps.data(), results.data(), records.empty() ? nullptr : records.data(), rays.size());
}

namespace {

float sample(const float* block, const Vec3f& p, int strideY, int strideZ) {
  const Vec3i cell{int(p.x), int(p.y), int(p.z)};
  const Vec3f f = p - Vec3f(cell);
  const float* at = block + cell.z * strideZ + cell.y * strideY + cell.x;
  const auto edge = [&](int offset) { return at[offset] + f.x * (at[offset + 1] - at[offset]); };
  const float near = edge(0) + f.y * (edge(strideY) - edge(0));
  const float far = edge(strideZ) + f.y * (edge(strideZ + strideY) - edge(strideZ));
  return near + f.z * (far - near);
}

float sample(const MarchScene::Bricks& bricks, const Vec3f& p, int width, int before) {
  Vec3i brick;
  Vec3f local;
  for (int axis = 0; axis != 3; ++axis) {
    brick[axis] = std::clamp(int(std::floor(p[axis] * 0.125f)), 0, bricks.count[axis] - 1);
    local[axis] = std::clamp(p[axis] - 8.0f * float(brick[axis]), 0.0f, 7.9999995f);
  }
  const std::size_t pool = std::size_t(
      bricks.table[(std::size_t(brick.z) * bricks.count.y + std::size_t(brick.y)) * bricks.count.x +
                   std::size_t(brick.x)]);
  const int plane = width * width;
  return sample(bricks.values + pool * std::size_t(plane * width) + before * (plane + width + 1), local,
                width, plane);
}

float localColumn(const MarchScene::Local& light, const MarchRay::Local& line, const Vec3f& q) {
  const Vec3f size{std::fabs(q.x), std::fabs(q.y), std::fabs(q.z)};
  const int axis = light.faces.size() == 1                ? light.faces[0].axis
                   : size.x >= size.y && size.x >= size.z ? 0
                   : size.y >= size.z                     ? 1
                                                          : 2;
  for (const MarchScene::Local::Face& face : light.faces) {
    if (face.axis != axis || !(q[axis] * face.side > 0)) continue;
    const float depth = std::max(q[axis] * face.side, light.least);
    const Vec3f p{q[(axis + 1) % 3] * face.perTangent / depth, q[(axis + 2) % 3] * face.perTangent / depth,
                  depth * face.perDepth};
    return sample(face, p + line.shift - face.corner, LightVolume::kWidth, 0);
  }
  return 0.0f;
}

// The light of a local over one step: see Marcher.
void addLocal(const MarchScene& scene, const MarchRay& ray, std::size_t index, float s, float ds,
              const float (&weight)[3], float (&result)[3]) {
  const MarchScene::Local& light = scene.locals[index];
  const MarchRay::Local& line = ray.locals[index];
  const double length = double(std::max(ds, light.least)), away = std::sqrt(double(line.distance2));
  const double along = double(s) - double(line.closest);
  const double first = along - double(ray.jitter) * length, last = first + length;
  const double r = std::hypot(along, away), a = std::atan2(first, away), b = std::atan2(last, away);
  double decay = 1;
  if (light.decay == 2)
    decay = light.decayStart > 0 && r < double(light.decayStart)
                ? 1 / (double(light.decayStart) * double(light.decayStart))
                : (b - a) / (away * length);
  if (light.decay == 1) decay = 1 / std::max(r, double(std::max(light.decayStart, light.least)));
  const Vec3f q = line.frame.origin + line.frame.direction * s;
  if (light.hasCone) {
    const float c = dot(q, light.axis) / std::max(float(r), light.least);
    const float t = std::clamp((c - light.outerCosine) * light.perCosine, 0.0f, 1.0f);
    decay *= double(t * t * (3 - 2 * t));
  }
  const float column = scene.extinction * std::max(localColumn(light, line, q), 0.0f);
  constexpr int nodes = MarchScene::Local::kPhaseNodes;
  const double sine = std::sin((a + b) / 2);
  const float place = float(std::sqrt(std::clamp((1 + sine) / 2, 0.0, 1.0))) * (float(nodes) - 0.001f);
  const int node = int(place);
  for (int n = 0; n != scene.octaves; ++n) {
    const float* table = light.phase + n * (nodes + 1) + node;
    const float phase = table[0] + (place - float(node)) * (table[1] - table[0]);
    for (int c = 0; c != scene.colours; ++c)
      result[c] += weight[c] * light.albedo[c] * phase * float(decay) *
                   std::exp(-std::min(
                       column * scene.attenuation[n] * scene.extinctionColour[c] * light.shadow[c], 80.0f));
  }
}

// One step; false once the ray is as good as opaque.
bool stepScalar(const MarchScene& scene, const MarchRay& ray, float s, float ds, MarchResult& result) {
  std::size_t cursor = 0;
  const float seen =
      ray.holdout.transmittance((ray.start + s + (0.5f - ray.jitter) * ds) * ray.cosine, cursor);
  const auto at = [s](const LatticeRay& line) { return line.origin + line.direction * s; };
  ++result.samples;
  const float density =
      std::max(sample(scene.density, at(ray.density), BrickGrid::kWidth, BrickGrid::kBefore), 0.0f);
  if (density == 0 && !scene.emission.table) return true;
  const float depthBefore = result.opticalDepth;
  result.opticalDepth += scene.extinction * density * ds;
  const auto through = [&](float depth, int c) {
    return std::exp(-std::min(depth * scene.extinctionColour[c], 80.0f));
  };
  const auto threeAt = [&](const MarchScene::ColourBricks& bricks, int c) {
    return std::max(sample({bricks.values[c], bricks.table, bricks.count}, at(ray.density), BrickGrid::kWidth,
                           BrickGrid::kBefore),
                    0.0f);
  };
  float weight[3], after = 0.0f;
  for (int c = 0; c != 3; ++c) {
    const float before = through(depthBefore, c), behind = through(result.opticalDepth, c);
    weight[c] = (before - behind) * seen;
    result.heldOpacity[c] += weight[c];
    after = std::max(after, behind);
    if (scene.emission.table) {
      const double t = double(scene.extinction) * density * ds * scene.extinctionColour[c];
      const double mean = t > 0 ? double(before) * -std::expm1(-t) / t : double(before);
      result.emission[c] +=
          scene.extinction * scene.emissionScale * ds * threeAt(scene.emission, c) * float(mean) * seen;
    }
    if (scene.colour.table) weight[c] *= density > 0 ? threeAt(scene.colour, c) / density : 0.0f;
  }
  const float* held = result.heldOpacity;
  if (std::isinf(result.distance) &&
      (ray.holdout.empty() ? result.opticalDepth > detail::kVisibleDepth
                           : held[0] + held[1] + held[2] > 3 * detail::kVisibleOpacity))
    result.distance = ray.start + s;
  for (std::size_t sun = 0; sun != scene.suns.size(); ++sun) {
    const float column =
        scene.extinction * std::max(sample(scene.suns[sun], at(ray.suns[sun]), LightVolume::kWidth, 0), 0.0f);
    for (int c = 0; c != scene.colours; ++c)
      for (int n = 0; n != scene.octaves; ++n)
        result.suns[sun][c] += weight[c] * ray.weight[sun][c][n] *
                               std::exp(-std::min(column * scene.attenuation[n] * scene.extinctionColour[c] *
                                                      scene.suns[sun].shadow[c],
                                                  80.0f));
  }
  for (std::size_t i = 0; i != scene.locals.size(); ++i)
    addLocal(scene, ray, i, s, ds, weight, result.suns[scene.suns.size() + i]);
  if (!scene.scattered.empty()) {
    const Vec3i size = scene.scatteredSize;
    Vec3f p = at(ray.scattered);
    for (int axis = 0; axis != 3; ++axis) p[axis] = std::clamp(p[axis], 0.0f, float(size[axis] - 1) - 1e-3f);
    std::size_t lattice = 0;
    for (std::size_t light = 0; light <= scene.lightCount(); ++light)
      for (int c = 0; c != scene.colours; ++c)
        if (const float* values = scene.scattered[lattice++])
          (light < scene.lightCount() ? result.suns[light] : result.sky)[c] +=
              weight[c] * sample(values, p, size.x, size.x * size.y);
  }
  if (scene.glow[0]) {
    const Vec3i size = scene.scatteredSize;
    Vec3f p = at(ray.scattered);
    for (int axis = 0; axis != 3; ++axis) p[axis] = std::clamp(p[axis], 0.0f, float(size[axis] - 1) - 1e-3f);
    for (int c = 0; c != 3; ++c)
      result.emission[c] += weight[c] * sample(scene.glow[c], p, size.x, size.x * size.y);
  }
  return after > scene.cutoff;
}

}  // namespace

void marchRaysScalar(const MarchScene& scene, std::span<const MarchRay> rays,
                     std::span<MarchResult> results) {
  require(rays.size() == results.size(), "march: as many results as rays are needed");
  for (std::size_t i = 0; i != rays.size(); ++i) {
    results[i] = {};
    results[i].distance = std::numeric_limits<float>::infinity();
    detail::forEachRun(scene, rays[i], [&](float start, float ds, int count, float) {
      for (int n = 0; n != count; ++n)
        if (!stepScalar(scene, rays[i], start + (float(n) + rays[i].jitter) * ds, ds, results[i]))
          return false;
      return true;
    });
  }
}

}  // namespace nephele

#endif  // HWY_ONCE
