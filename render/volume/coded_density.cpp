#include "nephele/render/volume/coded_density.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

BrickMeasures BrickMeasures::of(const float* brick) {
  BrickMeasures result;
  for (int z = 0; z != BrickGrid::kBrick; ++z)
    for (int y = 0; y != BrickGrid::kBrick; ++y) {
      const float* row = brick + sampleOffset(0, y, z);
      float sum = 0, squares = 0;
      for (int x = 0; x != BrickGrid::kBrick; ++x) {
        const float value = std::max(row[x], 0.0f);
        sum += value;
        squares += value * value;
      }
      result.density += double(sum);
      result.squares += double(squares);
    }
  // By a bit for every node of a row, row and plane.
  std::array<unsigned, 3> some{};
  for (int z = 0; z <= BrickGrid::kBrick; ++z) {
    unsigned inPlane = 0;
    for (int y = 0; y <= BrickGrid::kBrick; ++y) {
      const float* row = brick + sampleOffset(0, y, z);
      unsigned inRow = 0;
      for (int x = 0; x <= BrickGrid::kBrick; ++x) inRow |= unsigned(row[x] > 0) << x;
      some[0] |= inRow;
      some[1] |= unsigned(inRow != 0) << y;
      inPlane |= inRow;
    }
    some[2] |= unsigned(inPlane != 0) << z;
  }
  for (std::size_t axis = 0; axis != 3; ++axis)
    if (some[axis] != 0) {
      result.first[axis] = std::int8_t(std::countr_zero(some[axis]));
      result.last[axis] = std::int8_t(std::bit_width(some[axis]) - 1);
    }
  return result;
}

void CodedDensity::take(BrickGrid& grid, std::int32_t begin, std::int32_t end) {
  if (measures_.empty()) {
    measures_.resize(grid.poolSize());
    codes_ = CodedBricks(grid.poolSize());
  }
  parallelFor(std::size_t(end - begin), 16, [&](std::size_t first, std::size_t last) {
    for (std::int32_t pool = begin + std::int32_t(first); pool != begin + std::int32_t(last); ++pool) {
      measures_[std::size_t(pool)] = BrickMeasures::of(grid.brick(pool));
      codes_.set(pool, grid.brick(pool) + sampleOffset(0, 0, 0), BrickGrid::kWidth);
    }
  });
  detail::releasePages(grid.brick(begin), grid.brick(end));
}

CodedBricks CodedDensity::codes(const BrickGrid& grid) {
  codes_.setTable(grid.table());
  return std::exchange(codes_, {});
}

}  // namespace nephele
