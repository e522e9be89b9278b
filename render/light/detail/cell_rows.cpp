#include "nephele/render/light/detail/cell_rows.h"

#include <algorithm>

namespace nephele::detail {

CellRows::CellRows(const Vec3i& size, const std::vector<std::uint8_t>& matters)
    : size_(size), rows_(std::size_t(size.y) * std::size_t(size.z)) {
  for (std::size_t r = 0; r != rows_.size(); ++r) {
    const auto from = matters.begin() + std::ptrdiff_t(r) * size.x, to = from + size.x;
    const auto holds = [](std::uint8_t value) { return value != 0; };
    const auto first = std::find_if(from, to, holds);
    if (first == to) continue;
    auto last = to;
    while (!holds(*(last - 1))) --last;
    Row& row = rows_[r];
    row.begin = std::uint16_t((first - from) / kVector * kVector);
    row.end = std::uint16_t((last - from + kVector - 1) / kVector * kVector);
    row.first = std::int32_t(count_) - row.begin;
    count_ += std::size_t(row.end - row.begin);
  }
}

std::vector<float> CellRows::kept(const std::vector<float>& whole) const {
  std::vector<float> result(count_);
  forEachRow([&](int y, int z, const Row& row) {
    const std::size_t from = (std::size_t(z) * std::size_t(size_.y) + std::size_t(y)) * std::size_t(size_.x);
    std::copy(whole.begin() + std::ptrdiff_t(from) + row.begin,
              whole.begin() + std::ptrdiff_t(from) + row.end, result.begin() + row.first + row.begin);
  });
  return result;
}

}  // namespace nephele::detail
