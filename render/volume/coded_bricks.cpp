// Bricks in 16 bits per node, two planes side by side.
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

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Codes the nodes of a brick, of which rows begin `row` and planes `plane` apart, and returns their unit.
// `pairs` may be the nodes' own memory.
float codeBrick(const float* nodes, std::size_t row, std::size_t plane, float* pairs) {
  using Lanes = hn::CappedTag<float, 16>;
  using Bits = hn::RebindToSigned<Lanes>;
  const Lanes d;
  const Bits i;
  constexpr std::size_t kWidth = CodedBricks::kWidth, kPlane = CodedBricks::kPlane;
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
  float unit = largest / CodedBricks::kLargest;
  if (smallest > unit * CodedBricks::kZero) unit = smallest / CodedBricks::kZero;
  if (!(unit > 1e-30f / CodedBricks::kLargest)) unit = 0.0f;
  if (unit > 1e30f / CodedBricks::kLargest) unit = 1e30f / CodedBricks::kLargest;
  const auto inverse = hn::Set(d, unit > 0 ? 1 / unit : 0.0f), zero = hn::Set(d, CodedBricks::kZero);
  alignas(64) std::int32_t codes[kRoom];
  for (std::size_t n = 0; n < CodedBricks::kNodes; n += lanes) {
    const auto scaled = hn::Add(hn::Mul(hn::Load(d, packed + n), inverse), zero);
    const auto code = hn::Min(hn::Max(scaled, hn::Zero(d)), hn::Set(d, 65535.0f));
    hn::Store(hn::NearestInt(code), i, codes + n);
  }
  std::size_t n = 0;
  for (; n + lanes <= CodedBricks::kPairs; n += lanes)
    hn::StoreU(
        hn::BitCast(d, hn::Or(hn::Load(i, codes + n), hn::ShiftLeft<16>(hn::LoadU(i, codes + n + kPlane)))),
        d, pairs + n);
  for (const hn::CappedTag<float, 1> one; n != CodedBricks::kPairs; ++n) {
    const hn::RebindToSigned<decltype(one)> bits;
    hn::StoreU(hn::BitCast(one, hn::Set(bits, codes[n] | codes[n + kPlane] << 16)), one, pairs + n);
  }
  return unit;
}

// The same for as many bricks as there are units. Strides are those of bricks, rows and planes.
void codeBricks(const float* nodes, const std::size_t (&strides)[3], float* pairs, std::size_t pairStride,
                std::span<float> units) {
  const auto [brick, row, plane] = strides;
  for (std::size_t n = 0; n != units.size(); ++n)
    units[n] = codeBrick(nodes + n * brick, row, plane, pairs + n * pairStride);
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <algorithm>
#include <bit>
#include <utility>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

HWY_EXPORT(codeBricks);

namespace {

// Units of the bricks.
std::vector<float> code(const float* nodes, const std::size_t (&strides)[3], float* pairs,
                        std::size_t pairStride, std::size_t count) {
  std::vector<float> units(count);
  parallelFor(count, 16, [&](std::size_t begin, std::size_t end) {
    HWY_DYNAMIC_DISPATCH(codeBricks)
    (nodes + begin * strides[0], strides, pairs + begin * pairStride, pairStride,
     std::span(units).subspan(begin, end - begin));
  });
  return units;
}

}  // namespace

CodedBricks::CodedBricks(const BrickGrid& grid) : CodedBricks(grid, [](std::size_t, std::size_t) {}) {}

CodedBricks CodedBricks::inPlaceOf(BrickGrid& grid) {
  return CodedBricks(grid, [&](std::size_t begin, std::size_t end) {
    detail::releasePages(grid.brick(std::int32_t(begin)), grid.brick(std::int32_t(end)));
  });
}

// In parts, `done(begin, end)` being told of the bricks of each.
template <class Done>
CodedBricks::CodedBricks(const BrickGrid& grid, const Done& done) : floatCount_(grid.poolSize() * kPairs) {
  constexpr std::size_t row = BrickGrid::kWidth, kTogether = 8192;
  const std::shared_ptr<float[]> pairs = std::make_shared_for_overwrite<float[]>(floatCount_);
  detail::useHugePages(pairs.get(), pairs.get() + floatCount_);
  std::vector<float> units;
  units.reserve(grid.poolSize());
  for (std::size_t begin = 0; begin != grid.poolSize();) {
    const std::size_t end = std::min(begin + kTogether, grid.poolSize());
    const std::vector<float> some =
        code(grid.brick(std::int32_t(begin)) + sampleOffset(0, 0, 0), {BrickGrid::kVolume, row, row * row},
             pairs.get() + begin * kPairs, kPairs, end - begin);
    units.insert(units.end(), some.begin(), some.end());
    done(begin, end);
    begin = end;
  }
  pairs_ = {pairs, pairs.get()};
  enter(grid.table(), units, kPairs);
}

CodedBricks::CodedBricks(detail::UnsetVector<float> nodes, std::span<const std::int32_t> table)
    : floatCount_(nodes.size()) {
  const auto pairs = std::make_shared<detail::UnsetVector<float>>(std::move(nodes));
  float* data = pairs->data();
  const std::vector<float> units = code(data, {kNodes, kWidth, kPlane}, data, kNodes, floatCount_ / kNodes);
  pairs_ = {pairs, data};
  enter(table, units, kNodes);
}

void CodedBricks::enter(std::span<const std::int32_t> table, const std::vector<float>& units,
                        std::size_t stride) {
  require(floatCount_ <= std::size_t(UINT32_MAX), "march: more bricks than can be addressed");
  entries_.reserve(table.size());
  for (const std::int32_t pool : table)
    entries_.push_back({std::uint32_t(std::size_t(pool) * stride), units[std::size_t(pool)]});
}

float CodedBricks::at(std::size_t place, const Vec3i& node) const {
  const Entry& entry = entries_[place];
  const int plane = std::min(node.z, kWidth - 2);
  const auto bits = std::bit_cast<std::uint32_t>(
      pairs_.get()[entry.first + std::size_t((plane * kWidth + node.y) * kWidth + node.x)]);
  return (float(node.z == plane ? bits & 0xffffu : bits >> 16) - kZero) * entry.unit;
}

std::size_t CodedBricks::estimateBytes(const BrickGrid& grid) {
  return grid.poolSize() * kPairs * sizeof(float) + grid.table().size() * sizeof(Entry);
}

}  // namespace nephele

#endif  // HWY_ONCE
