// Bricks are sampled, once, and their samples inside the shape are parted by one undecided knife after the
// other, as sets of bits.
#include "nephele/levelset/cut/detail/level_sets/cut_sampler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/cut/detail/level_sets/cut_kernels.h"
#include "nephele/levelset/grid/grid_field.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr std::size_t kSamples = CutBrick::kSamples;
static_assert(kSamples == 2 * kBlockSize);

void copyBrick(const BrickGrid& grid, const Vec3i& brick, float* samples) {
  const float* stored = grid.brick(grid.poolIndex(brick));
  for (int row = 0; row < kBrick * kBrick; ++row)
    std::copy_n(stored + sampleOffset(0, row % kBrick, row / kBrick), kBrick, samples + row * kBrick);
}

void divideBySlope(std::span<float> values, const std::array<const float*, 3>& slopes) {
  for (std::size_t s = 0; s < values.size(); ++s) {
    const float slope = length(Vec3f{slopes[0][s], slopes[1][s], slopes[2][s]});
    if (slope > 0) values[s] /= slope;
  }
}

void evaluateKnife(const Knife& knife, const PointBlock& points, float* values, Scratch& scratch) {
  const FieldNode<float>& node = *knife.field.node();
  if (!(knife.steepest > 1)) {
    node.eval(points, {values}, scratch);
    return;
  }
  Scratch::Frame frame(scratch);
  const BlockLanes<3> slopes = frame.lanes<3>();
  node.evalGrad(points, {values}, slopes, scratch);
  divideBySlope({values, std::size_t(points.count)}, {slopes[0], slopes[1], slopes[2]});
}

}  // namespace

BrickPoints::BrickPoints(const Vec3i& brick, float voxelSize, Scratch& scratch, Scratch::Frame& frame) {
  for (int axis = 0; axis < 3; ++axis)
    for (int i = 0; i < kBrick; ++i)
      along[std::size_t(axis)][std::size_t(i)] = float(brick[axis] * 8 + i) * voxelSize;
  for (std::size_t half = 0; half < 2; ++half) {
    const BlockLanes<3> lanes = frame.lanes<3>();
    for (std::size_t row = 0; row < kBlockSize / kBrick; ++row) {
      const std::size_t i = row * kBrick;
      std::copy_n(along[0].data(), kBrick, lanes[0] + i);
      std::fill_n(lanes[1] + i, kBrick, along[1][row % kBrick]);
      std::fill_n(lanes[2] + i, kBrick, along[2][4 * half + row / kBrick]);
    }
    blocks[half] = scratch.pointBlock(lanes, kBlockSize);
  }
}

std::shared_ptr<const BrickGrid> gridInPlace(const ScalarField& shape, float voxelSize) {
  std::shared_ptr<const BrickGrid> grid = gridOf(shape);
  const Affine places{Mat3f::scaling(voxelSize), {}};
  const bool isInPlace = grid && grid->indexToWorld().linear == places.linear &&
                         grid->indexToWorld().translation == places.translation;
  return isInPlace ? grid : nullptr;
}

void CutSampler::add(const CutCandidate& candidate, float* samples) {
  const CutKnowledge& known = *candidate.cube.known;
  CutBrick brick{candidate.cube.brick, candidate.isUniform, &known, samples, block_.members.size()};
  if (candidate.isUniform) {
    const std::uint32_t cell = known.cells.empty() ? CutCode::kNoCell : known.cells.front();
    block_.members.push_back({{known.sides, cell}, BrickMask::all()});
  } else if (!sample(candidate, samples)) {
    return;
  }
  block_.bricks.push_back(brick);
}

bool CutSampler::sample(const CutCandidate& candidate, float* samples) {
  Scratch& scratch = Scratch::local();
  Scratch::Frame frame(scratch);
  const BrickPoints points(candidate.cube.brick, h_, scratch, frame);
  const auto& shape = candidate.cube.shape.node();
  if (grid_ && shape == shape_.node())
    copyBrick(*grid_, candidate.cube.brick, samples);
  else
    for (std::size_t half = 0; half < 2; ++half)
      shape->eval(points.blocks[half], {samples + half * kBlockSize}, scratch);
  if (sidesOf(samples, -band_).above.isEmpty()) return false;
  const CutKnowledge& known = *candidate.cube.known;
  open_.clear();
  if (const BrickMask solid = sidesOf(samples, 0).above; !solid.isEmpty())
    open_.push_back({{known.sides, CutCode::kNoCell}, solid});
  for (const std::uint32_t knife : known.undecided) {
    samples += kSamples;
    for (std::size_t half = 0; half < 2; ++half)
      evaluateKnife(plan_.knives[knife], points.blocks[half], samples + half * kBlockSize, scratch);
    split(knife, samples);
  }
  if (!known.cells.empty()) splitByCell(known, points);
  block_.members.insert(block_.members.end(), open_.begin(), open_.end());
  return true;
}

void CutSampler::split(std::uint32_t knife, const float* values) {
  if (open_.empty()) return;
  const Sides sides = sidesOf(values, halfKerf_);
  next_.clear();
  for (const OpenCutMember& member : open_) {
    const BrickMask high = member.samples & sides.above, low = member.samples & sides.below;
    if (!low.isEmpty()) next_.push_back({member.code, low});
    if (high.isEmpty()) continue;
    const std::span<std::uint64_t> bits = block_.chunks.copyOf(member.code.sides);
    bits[knife / 64] |= std::uint64_t(1) << (knife % 64);
    next_.push_back({{bits, member.code.cell}, high});
  }
  open_.swap(next_);
}

void CutSampler::splitByCell(const CutKnowledge& known, const BrickPoints& points) {
  const std::size_t count = known.cells.size();
  std::vector<BrickMask> ofCell(count);
  std::vector<std::vector<Bisector>> around(count);
  for (std::size_t s = 0; s < kSamples; ++s) {
    const Vec3f p{points.along[0][s & 7], points.along[1][s >> 3 & 7], points.along[2][s >> 6]};
    std::size_t nearest = 0;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t c = 0; c < count; ++c) {
      const Vec3f away = plan_.cells[known.cells[c]] - p;
      if (const float squared = dot(away, away); squared < least) least = squared, nearest = c;
    }
    std::vector<Bisector>& sides = around[nearest];
    if (sides.empty())
      for (const std::uint32_t other : known.cells)
        if (other != known.cells[nearest])
          sides.emplace_back(plan_.cells[known.cells[nearest]], plan_.cells[other]);
    if (std::all_of(sides.begin(), sides.end(), [&](const Bisector& side) { return side.at(p) > halfKerf_; }))
      ofCell[nearest].add(int(s));
  }
  next_.clear();
  for (const OpenCutMember& member : open_)
    for (std::size_t c = 0; c < count; ++c)
      if (const BrickMask shared = member.samples & ofCell[c]; !shared.isEmpty())
        next_.push_back({{member.code.sides, known.cells[c]}, shared});
  open_.swap(next_);
}

void evaluateKnife(const Knife& knife, const PointSpans& points, std::span<float> values) {
  if (!(knife.steepest > 1)) {
    knife.field.eval(points, values);
    return;
  }
  std::array<std::vector<float>, 3> slopes;
  for (auto& lane : slopes) lane.resize(points.size());
  knife.field.evalGrad(points, values, {{slopes[0], slopes[1], slopes[2]}});
  divideBySlope(values, {slopes[0].data(), slopes[1].data(), slopes[2].data()});
}

}  // namespace nephele::detail
