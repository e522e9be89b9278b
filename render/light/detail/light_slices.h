#pragma once

#include <array>

namespace nephele::detail {

/// Nodes of a brick's slice in LightVolume, in rows that are a round number of the widest vectors; what lies
/// behind the ninth of a row does not matter.
inline constexpr int kSliceNodes = 9, kSliceRow = 16, kSliceArea = kSliceNodes * kSliceRow;
/// Floats from one row of density samples to the next.
inline constexpr int kSampleRow = 24;
struct alignas(64) SliceNodes : std::array<float, kSliceArea> {};

/// What four samples in a row count for, across the light.
struct SliceWeights {
  std::array<float, 4> u, v;
};

/// Mixes 12 x 12 samples, `kSampleRow` apart from row to row and readable for `kSliceRow` each, into the
/// nodes of a slice; samples below 0 count as 0, and those above `most` as that.
void mixSlice(const float* samples, const SliceWeights& weights, float most, SliceNodes& out);

/// out = end (a + b) + middle (c + d): Simpson's rule with its middle in two halves.
void addSlices(float end, const SliceNodes& a, const SliceNodes& b, float middle, const SliceNodes& c,
               const SliceNodes& d, SliceNodes& out);

/// sum += after
void addSlice(const SliceNodes& after, SliceNodes& sum);

/// Writes the 9 x 9 nodes of a slice side by side, as bentColumn(sum, bend).
void storeSlice(const SliceNodes& sum, float bend, float* out);

/// Calls visit(first, end) for the runs of bricks with density among the `count` of a column, whose pool
/// bricks poolAt(n) tells: 0 where there is none.
template <class PoolAt, class Visit>
void forEachFilledRun(int count, PoolAt&& poolAt, Visit&& visit) {
  for (int n = 0; n != count;) {
    const int first = n;
    while (n != count && poolAt(n)) ++n;
    if (n > first)
      visit(first, n);
    else
      ++n;
  }
}

}  // namespace nephele::detail
