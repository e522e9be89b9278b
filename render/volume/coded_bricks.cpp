// Bricks in 16 bits per node.
//
// A code is the nearest whole number to value / unit, above kZero: with the unit a share of the brick's
// largest value, codes hold 15.8 bits. That is relative to the brick, not to the volume, so that thin fringes
// are as fine as dense cores; and to 0, not to the brick's smallest value, so that 0 is exact and one number
// per brick is enough. An error of half a unit in a column of optical depth t changes the light that passes
// by t / 114686 of it.
//
// Limits: bricks are addressed by 32 bits.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/volume/coded_bricks.cpp"
#include "nephele/render/volume/coded_bricks.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Codes the nodes of a brick, of which rows begin `row` and planes `plane` apart, and returns their unit.
float codeBrick(const float* nodes, std::size_t row, std::size_t plane, std::int16_t* out) {
  using Lanes = hn::CappedTag<float, 16>;
  using Bits = hn::RebindToSigned<Lanes>;
  const Lanes d;
  constexpr std::size_t kWidth = CodedBricks::kWidth;
  constexpr std::size_t lanes = hn::MaxLanes(Lanes());
  constexpr std::size_t kRoom = CodedBricks::kNodes + lanes;
  // Side by side, and one of them again behind, so that all are whole vectors.
  alignas(64) float packed[kRoom];
  for (std::size_t z = 0; z != kWidth; ++z)
    for (std::size_t y = 0; y != kWidth; ++y)
      for (std::size_t x = 0; x != kWidth; ++x)
        packed[(z * kWidth + y) * kWidth + x] = nodes[z * plane + y * row + x];
  for (std::size_t n = CodedBricks::kNodes; n != kRoom; ++n) packed[n] = packed[0];

  auto most = hn::Load(d, packed), least = most;
  for (std::size_t n = 0; n < CodedBricks::kNodes; n += lanes) {
    most = hn::Max(hn::Load(d, packed + n), most);
    least = hn::Min(hn::Load(d, packed + n), least);
  }
  const float high = hn::GetLane(hn::MaxOfLanes(d, most)), low = hn::GetLane(hn::MinOfLanes(d, least));
  const float largest = high > 0 ? high : 0.0f, smallest = low < 0 ? -low : 0.0f;
  constexpr float kBelowZero = CodedBricks::kZero - CodedBricks::kLeast;
  float unit = largest / CodedBricks::kLargest;
  if (smallest > unit * kBelowZero) unit = smallest / kBelowZero;
  if (!(unit > 1e-30f / CodedBricks::kLargest)) unit = 0.0f;
  if (unit > 1e30f / CodedBricks::kLargest) unit = 1e30f / CodedBricks::kLargest;
  const auto inverse = hn::Set(d, unit > 0 ? 1 / unit : 0.0f), zero = hn::Set(d, CodedBricks::kZero);
  const hn::Rebind<std::int16_t, Bits> narrow;
  alignas(64) std::int16_t codes[kRoom];
  for (std::size_t n = 0; n < CodedBricks::kNodes; n += lanes) {
    const auto scaled = hn::Add(hn::Mul(hn::Load(d, packed + n), inverse), zero);
    const auto code =
        hn::Min(hn::Max(scaled, hn::Set(d, CodedBricks::kLeast)), hn::Set(d, CodedBricks::kMost));
    hn::StoreU(hn::DemoteTo(narrow, hn::NearestInt(code)), narrow, codes + n);
  }
  for (const std::size_t half : {std::size_t(0), std::size_t(CodedBricks::kHalfCells)})
    for (std::size_t n = 0; n != kWidth * kWidth; ++n, out += CodedBricks::kRow)
      std::copy_n(codes + n * kWidth + half, CodedBricks::kRow, out);
  return unit;
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <utility>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

HWY_EXPORT(codeBrick);

CodedBricks::CodedBricks(std::size_t bricks) : units_(bricks) {
  const std::size_t count = bricks * kCodes;
  require(count <= std::size_t(UINT32_MAX), "march: more bricks than can be addressed");
  codes_ = std::make_shared_for_overwrite<std::int16_t[]>(count + kBehind);
  detail::useHugePages(codes_.get(), codes_.get() + count);
}

// From nodesOf(pool), of which rows and planes begin `strides` apart. In parts, done(begin, end) being told
// of the bricks of each.
template <class NodesOf, class Done>
void CodedBricks::setAll(const std::size_t (&strides)[2], const NodesOf& nodesOf, const Done& done) {
  constexpr std::size_t kTogether = 8192;
  for (std::size_t first = 0; first < units_.size(); first += kTogether) {
    const std::size_t last = std::min(first + kTogether, units_.size());
    parallelFor(last - first, 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pool = first + begin; pool != first + end; ++pool)
        units_[pool] = HWY_DYNAMIC_DISPATCH(codeBrick)(nodesOf(pool), strides[0], strides[1],
                                                       codes_.get() + pool * kCodes);
    });
    done(first, last);
  }
}

CodedBricks::CodedBricks(const BrickGrid& grid) : CodedBricks(grid.poolSize()) {
  constexpr std::size_t row = BrickGrid::kWidth;
  setAll(
      {row, row * row},
      [&](std::size_t pool) { return grid.brick(std::int32_t(pool)) + sampleOffset(0, 0, 0); },
      [](std::size_t, std::size_t) {});
  setTable(grid.table());
}

CodedBricks CodedBricks::inPlaceOf(BrickGrid& grid) {
  constexpr std::size_t row = BrickGrid::kWidth;
  CodedBricks result(grid.poolSize());
  result.setAll(
      {row, row * row},
      [&](std::size_t pool) { return grid.brick(std::int32_t(pool)) + sampleOffset(0, 0, 0); },
      [&](std::size_t begin, std::size_t end) {
        detail::releasePages(grid.brick(std::int32_t(begin)), grid.brick(std::int32_t(end)));
      });
  result.setTable(grid.table());
  return result;
}

CodedBricks::CodedBricks(detail::UnsetVector<float> nodes, std::span<const std::int32_t> table)
    : CodedBricks(nodes.size() / kNodes) {
  setAll(
      {kWidth, kWidth * kWidth}, [&](std::size_t pool) { return nodes.data() + pool * kNodes; },
      [&](std::size_t begin, std::size_t end) {
        detail::releasePages(nodes.data() + begin * kNodes, nodes.data() + end * kNodes);
      });
  setTable(table);
}

void CodedBricks::set(std::int32_t pool, const float* nodes, int row) {
  units_[std::size_t(pool)] = HWY_DYNAMIC_DISPATCH(codeBrick)(nodes, std::size_t(row), std::size_t(row * row),
                                                              codes_.get() + std::size_t(pool) * kCodes);
}

void CodedBricks::setTable(std::span<const std::int32_t> table) {
  entries_.clear();
  entries_.reserve(table.size());
  for (const std::int32_t pool : table)
    entries_.push_back({std::uint32_t(std::size_t(pool) * kCodes), units_[std::size_t(pool)]});
}

}  // namespace nephele

#endif  // HWY_ONCE
