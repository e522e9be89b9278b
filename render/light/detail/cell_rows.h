#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/math.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

/// Moments of light in the cells of CellRows, see CellRows::momentsAt.
using Moments = UnsetVector<float>;

/// The cells of a lattice that matter, side by side: of every row along the first axis those from the first
/// to the last that do, as whole vectors.
class CellRows {
 public:
  /// Cells of a vector: what rows begin and end at are multiples of it.
  static constexpr int kVector = 8;

  /// Where the first of `moments` values of a cell is, of which the others follow every kVector floats:
  /// values of neighbours lie side by side, and all of a vector of cells near each other.
  static constexpr std::size_t momentsAt(std::size_t cell, std::size_t moments) {
    return cell / kVector * kVector * moments + cell % kVector;
  }

  /// Cell x, from begin to end - 1, is number first + x of all that are kept.
  struct Row {
    std::int32_t first = 0;
    std::uint16_t begin = 0, end = 0;

    bool holds(int x) const { return x >= begin && x < end; }
  };

  CellRows() = default;
  /// `matters`: not 0 for cells that do, the first axis fastest. Rows are a number of whole vectors long.
  CellRows(const Vec3i& size, const std::vector<std::uint8_t>& matters);

  const Vec3i& size() const { return size_; }
  /// Of all cells that are kept.
  std::size_t count() const { return count_; }
  /// One row per place along the second axis, then along the third.
  const std::vector<Row>& rows() const { return rows_; }
  const Row& row(int y, int z) const { return rows_[std::size_t(z) * std::size_t(size_.y) + std::size_t(y)]; }
  /// Copies the values of the cells that are kept out of a whole lattice.
  std::vector<float> kept(const std::vector<float>& whole) const;

  /// Calls each(y, z, row) for rows that are not empty; slices along the third axis are shared out among the
  /// cores.
  template <class Each>
  void forEachRow(Each&& each) const {
    parallelFor(std::size_t(size_.z), 4, [&](std::size_t begin, std::size_t end) {
      for (int z = int(begin); z != int(end); ++z)
        for (int y = 0; y != size_.y; ++y)
          if (const Row& r = row(y, z); r.begin < r.end) each(y, z, r);
    });
  }
  /// Calls each(cell, its number among those kept, its place) for all that are kept.
  template <class Each>
  void forEachCell(Each&& each) const {
    forEachRow([&](int y, int z, const Row& row) {
      const std::size_t first =
          (std::size_t(z) * std::size_t(size_.y) + std::size_t(y)) * std::size_t(size_.x);
      for (int x = row.begin; x != row.end; ++x)
        each(first + std::size_t(x), std::size_t(row.first + x), Vec3f(Vec3i{x, y, z}));
    });
  }

 private:
  Vec3i size_{0, 0, 0};
  std::size_t count_ = 0;
  std::vector<Row> rows_;
};

}  // namespace nephele::detail
