#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "nephele/render/volume/coded_density.cpp"
#include "nephele/render/volume/coded_density.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace nephele::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Sums are by place along the row first, so that every width of vectors gives the same bits, and in double
// from plane to plane.
BrickMeasures measuresOf(const float* brick) {
  constexpr int kBrick = BrickGrid::kBrick, kNodes = kBrick + 1;
  using Lanes = hn::CappedTag<float, std::size_t(kBrick)>;
  constexpr int lanes = int(hn::MaxLanes(Lanes()));
  const Lanes d;
  double sums[kBrick] = {}, sumsOfSquares[kBrick] = {};
  // Of the values of a plane, their squares, and the largest of every row and plane.
  alignas(64) float sum[kBrick], squares[kBrick], most[kBrick], ofRow[kNodes][kBrick],
      ofPlane[kNodes][kBrick];
  float lastOfRow[kNodes] = {}, lastOfPlane[kNodes] = {};
  for (int x = 0; x < kBrick; x += lanes) {
    auto ownMost = hn::Zero(d);
    for (auto& row : ofRow) hn::Store(hn::Zero(d), d, row + x);
    for (int z = 0; z != kNodes; ++z) {
      auto plane = hn::Zero(d), ownSum = hn::Zero(d), ownSquares = hn::Zero(d);
      for (int y = 0; y != kNodes; ++y) {
        const auto value = hn::Max(hn::LoadU(d, brick + sampleOffset(x, y, z)), hn::Zero(d));
        plane = hn::Max(plane, value);
        hn::Store(hn::Max(value, hn::Load(d, ofRow[y] + x)), d, ofRow[y] + x);
        if (y == kBrick || z == kBrick) continue;
        ownSum = hn::Add(ownSum, value);
        ownSquares = hn::Add(ownSquares, hn::Mul(value, value));
      }
      hn::Store(plane, d, ofPlane[z] + x);
      ownMost = hn::Max(ownMost, plane);
      hn::Store(ownSum, d, sum + x);
      hn::Store(ownSquares, d, squares + x);
      for (int lane = x; lane != x + lanes; ++lane) {
        sums[lane] += double(sum[lane]);
        sumsOfSquares[lane] += double(squares[lane]);
      }
    }
    hn::Store(ownMost, d, most + x);
  }
  float last = 0;
  for (int z = 0; z != kNodes; ++z)
    for (int y = 0; y != kNodes; ++y) {
      const float value = brick[sampleOffset(kBrick, y, z)];
      lastOfRow[y] = std::max(lastOfRow[y], value);
      lastOfPlane[z] = std::max(lastOfPlane[z], value);
      last = std::max(last, value);
    }
  BrickMeasures result;
  const auto note = [&result](std::size_t axis, int node, bool isAbove0) {
    if (!isAbove0) return;
    result.first[axis] = std::min(result.first[axis], std::int8_t(node));
    result.last[axis] = std::max(result.last[axis], std::int8_t(node));
  };
  for (int x = 0; x != kBrick; ++x) {
    result.density += sums[x];
    result.squares += sumsOfSquares[x];
    note(0, x, most[x] > 0);
  }
  note(0, kBrick, last > 0);
  const auto any = [](const float* row) {
    return std::any_of(row, row + kBrick, [](float value) { return value > 0; });
  };
  for (int node = 0; node != kNodes; ++node) {
    note(1, node, lastOfRow[node] > 0 || any(ofRow[node]));
    note(2, node, lastOfPlane[node] > 0 || any(ofPlane[node]));
  }
  return result;
}

}  // namespace nephele::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <utility>

namespace nephele {

HWY_EXPORT(measuresOf);

BrickMeasures BrickMeasures::of(const float* brick) {
  return HWY_DYNAMIC_DISPATCH(measuresOf)(brick);
}

void CodedDensity::begin(std::size_t bricks) {
  measures_.resize(bricks);
  codes_ = CodedBricks(bricks);
}

void CodedDensity::take(std::int32_t pool, const float* samples) {
  measures_[std::size_t(pool)] = BrickMeasures::of(samples);
  codes_.set(pool, samples + sampleOffset(0, 0, 0), BrickGrid::kWidth);
}

BrickSink CodedDensity::sink() {
  return {[this](std::size_t bricks, std::size_t) { begin(bricks); },
          [this](std::int32_t pool, const float* samples) { take(pool, samples); }};
}

CodedBricks CodedDensity::codes(const BrickGrid& grid) {
  codes_.setTable(grid.table());
  return std::exchange(codes_, {});
}

}  // namespace nephele

#endif  // HWY_ONCE
