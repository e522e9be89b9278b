// The walk over the bricks of a shape that is cut.
//
// From coarse cubes of bricks to single ones, every knife is asked for its range: one that keeps away from a
// cube is decided for all of it. Cubes deep inside the shape with all knives decided are settled whole; the
// bricks that are left are sampled, once, into one array, and their samples inside the shape are parted by
// one undecided knife after the other, as sets of bits. Of Voronoi cells those stay that can be the nearest,
// or whose boundary can be near.
#include "nephele/levelset/cut/detail/cut_bricks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "nephele/levelset/cut/detail/cut_kernels.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/field_node.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr std::size_t kSamples = CutBrick::kSamples;
constexpr std::size_t kCubesPerTask = 8, kBricksPerTask = 16;

/// A cube of bricks during the walk: its first brick, and what its parent knew.
struct Cube {
  Vec3i brick;
  const CutKnowledge* known;
  ScalarField shape;
};

/// A brick that the walk left.
struct Candidate {
  Cube cube;
  bool isUniform;
  std::size_t firstSample = 0;
};

/// The samples of a brick as points, and their coordinates on each axis.
struct BrickPoints {
  std::array<std::array<float, kBrick>, 3> along;
  std::array<PointBlock, 2> blocks;

  BrickPoints(const Vec3i& brick, float h, Scratch& scratch, Scratch::Frame& frame) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < kBrick; ++i)
        along[std::size_t(axis)][std::size_t(i)] = float(brick[axis] * 8 + i) * h;
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
};
static_assert(kSamples == 2 * kBlockSize);

/// The grid behind a shape if its voxels stand where those of the cut do, or null.
std::shared_ptr<const BrickGrid> gridInPlace(const ScalarField& shape, float voxelSize) {
  std::shared_ptr<const BrickGrid> grid = gridOf(shape);
  const Affine places{Mat3f::scaling(voxelSize), {}};
  const bool isInPlace = grid && !grid->isPacked() && grid->indexToWorld.linear == places.linear &&
                         grid->indexToWorld.translation == places.translation;
  return isInPlace ? grid : nullptr;
}

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

/// Samples of one combination, while a brick is parted.
struct OpenMember {
  CutCode code;
  BrickMask samples;
};

/// What a block of bricks became.
struct SampledBlock {
  MemoryChunks chunks;
  std::vector<CutBrick> bricks;
  std::vector<OpenMember> members;
};

/// Parts the samples of one brick after the other.
class Sampler {
 public:
  /// `grid` holds the samples of `shape`, or is null.
  Sampler(const ScalarField& shape, const BrickGrid* grid, const CutPlan& plan, SampledBlock& block)
      : shape_(shape),
        grid_(grid),
        plan_(plan),
        block_(block),
        h_(plan.lattice.voxelSize),
        band_(plan.band()),
        halfKerf_(plan.halfKerf()) {}

  /// `samples` has room for them.
  void add(const Candidate& candidate, float* samples) {
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

 private:
  /// False if the brick has nothing to say.
  bool sample(const Candidate& candidate, float* samples) {
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

  void split(std::uint32_t knife, const float* values) {
    if (open_.empty()) return;
    const Sides sides = sidesOf(values, halfKerf_);
    next_.clear();
    for (const OpenMember& member : open_) {
      const BrickMask high = member.samples & sides.above, low = member.samples & sides.below;
      if (!low.isEmpty()) next_.push_back({member.code, low});
      if (high.isEmpty()) continue;
      const std::span<std::uint64_t> bits = block_.chunks.copyOf(member.code.sides);
      bits[knife / 64] |= std::uint64_t(1) << (knife % 64);
      next_.push_back({{bits, member.code.cell}, high});
    }
    open_.swap(next_);
  }

  void splitByCell(const CutKnowledge& known, const BrickPoints& points) {
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
      if (std::all_of(sides.begin(), sides.end(),
                      [&](const Bisector& side) { return side.at(p) > halfKerf_; }))
        ofCell[nearest].add(int(s));
    }
    next_.clear();
    for (const OpenMember& member : open_)
      for (std::size_t c = 0; c < count; ++c)
        if (const BrickMask shared = member.samples & ofCell[c]; !shared.isEmpty())
          next_.push_back({{member.code.sides, known.cells[c]}, shared});
    open_.swap(next_);
  }

  const ScalarField& shape_;
  const BrickGrid* grid_;
  const CutPlan& plan_;
  SampledBlock& block_;
  float h_, band_, halfKerf_;
  std::vector<OpenMember> open_, next_;
};

/// Numbers codes as they come.
class CodeNumbers {
 public:
  explicit CodeNumbers(std::vector<CutCode>& codes) : codes_(codes), slots_(1024, kEmpty) {}

  std::uint32_t numberOf(const CutCode& code) {
    if (2 * codes_.size() >= slots_.size()) grow();
    const std::size_t at = slotOf(code);
    if (slots_[at] == kEmpty) {
      slots_[at] = std::uint32_t(codes_.size());
      codes_.push_back(code);
    }
    return slots_[at];
  }

 private:
  static constexpr std::uint32_t kEmpty = 0xFFFFFFFFu;

  std::size_t slotOf(const CutCode& code) const {
    std::uint64_t hash = code.cell;
    for (const std::uint64_t word : code.sides) {
      hash = (hash ^ word) * 0x9E3779B97F4A7C15ull;
      hash ^= hash >> 32;
    }
    std::size_t at = hash % slots_.size();
    while (slots_[at] != kEmpty && !isSame(codes_[slots_[at]], code)) at = (at + 1) % slots_.size();
    return at;
  }

  static bool isSame(const CutCode& a, const CutCode& b) {
    return a.cell == b.cell && std::equal(a.sides.begin(), a.sides.end(), b.sides.begin());
  }

  void grow() {
    slots_.assign(2 * slots_.size(), kEmpty);
    for (std::uint32_t i = 0; i < codes_.size(); ++i) slots_[slotOf(codes_[i])] = i;
  }

  std::vector<CutCode>& codes_;
  std::vector<std::uint32_t> slots_;
};

class Walk {
 public:
  Walk(const ScalarField& shape, const CutPlan& plan, const Progress& progress)
      : shape_(shape),
        plan_(plan),
        progress_(progress),
        h_(plan.lattice.voxelSize),
        band_(plan.band()),
        halfKerf_(plan.halfKerf()) {}

  CutBricks run() {
    findCandidates();
    std::sort(candidates_.begin(), candidates_.end(),
              [](const Candidate& a, const Candidate& b) { return comesBefore(a.cube.brick, b.cube.brick); });
    return sampleAll();
  }

 private:
  void findCandidates() {
    const Box box = plan_.lattice.box.expanded(band_);
    const float width = h_ * kBrick;
    const auto brickOfPoint = [width](const Vec3f& p) {
      return Vec3i{int(std::floor(p.x / width)), int(std::floor(p.y / width)), int(std::floor(p.z / width))};
    };
    constexpr double kMostBricks = double(1 << 28), kLargestIndex = 1e9;
    const Vec3d bricks = Vec3d(box.size()) / double(width) + Vec3d{2, 2, 2};
    require(bricks.x * bricks.y * bricks.z < kMostBricks &&
                double(length(max(box.max, -box.min))) / double(h_) < kLargestIndex,
            fmt::format("cut: voxelSize {} is too small for a shape {} wide", h_, box.longestSide()));
    const Vec3i first = brickOfPoint(box.min), last = brickOfPoint(box.max);
    constexpr int kFirstEdge = 16;
    const CutKnowledge* nothing = knowNothing();
    std::vector<Cube> cubes;
    for (int z = first.z; z <= last.z; z += kFirstEdge)
      for (int y = first.y; y <= last.y; y += kFirstEdge)
        for (int x = first.x; x <= last.x; x += kFirstEdge) cubes.push_back({{x, y, z}, nothing, shape_});

    struct Visited {
      MemoryChunks chunks;
      std::vector<Cube> halves;
      std::vector<Candidate> candidates;
    };
    for (int edge = kFirstEdge; edge >= 1; edge /= 2) {
      std::vector<Visited> blocks((cubes.size() + kCubesPerTask - 1) / kCubesPerTask);
      parallelFor(
          cubes.size(), kCubesPerTask,
          [&](std::size_t begin, std::size_t end) {
            Visited& block = blocks[begin / kCubesPerTask];
            for (std::size_t i = begin; i < end; ++i)
              visit(cubes[i], edge, block.chunks, block.halves, block.candidates);
          },
          progress_);
      cubes.clear();
      for (Visited& block : blocks) {
        std::move(block.halves.begin(), block.halves.end(), std::back_inserter(cubes));
        std::move(block.candidates.begin(), block.candidates.end(), std::back_inserter(candidates_));
        chunks_.push_back(std::move(block.chunks));
      }
    }
  }

  const CutKnowledge* knowNothing() {
    MemoryChunks& chunks = chunks_.emplace_back();
    const auto none = chunks.take<std::uint64_t>((plan_.knives.size() + 63) / 64);
    std::fill(none.begin(), none.end(), 0);
    const auto knives = chunks.take<std::uint32_t>(plan_.knives.size());
    std::iota(knives.begin(), knives.end(), 0u);
    const auto cells = chunks.take<std::uint32_t>(plan_.cells.size());
    std::iota(cells.begin(), cells.end(), 0u);
    return &(chunks.take<CutKnowledge>(1)[0] = {none, none, knives, cells});
  }

  void visit(const Cube& cube, int edge, MemoryChunks& chunks, std::vector<Cube>& halves,
             std::vector<Candidate>& candidates) const {
    const Vec3i firstVoxel = cube.brick * kBrick;
    const int lastStep = edge * kBrick - 1;
    const Box box{Vec3f(firstVoxel) * h_, Vec3f(firstVoxel + Vec3i{lastStep, lastStep, lastStep}) * h_};
    const Interval range = cube.shape.range(box);
    if (range.max <= -band_) return;
    const CutKnowledge* known = decide(*cube.known, box, chunks);
    // The last bit of a band's end is lost on its way through other grids.
    constexpr float kNearly = 0.999f;
    const bool isUniform =
        range.min >= kNearly * band_ && known->undecided.empty() && known->cells.size() <= 1;
    if (edge > 1 && !isUniform) {
      const ScalarField local = cube.shape.restrictedTo(box);
      for (int i = 0; i < 8; ++i)
        halves.push_back({cube.brick + Vec3i{i & 1, i >> 1 & 1, i >> 2} * (edge / 2), known, local});
      return;
    }
    // Deep inside, a grid is one value.
    const ScalarField local = range.isPoint() ? ScalarField(range.min) : cube.shape;
    for (int z = 0; z < edge; ++z)
      for (int y = 0; y < edge; ++y)
        for (int x = 0; x < edge; ++x)
          candidates.push_back({{cube.brick + Vec3i{x, y, z}, known, local}, isUniform});
  }

  /// Moves knives that keep away from the box to the decided ones, and drops cells that do.
  const CutKnowledge* decide(const CutKnowledge& before, const Box& box, MemoryChunks& chunks) const {
    CutKnowledge known = before;
    std::span<std::uint64_t> decided, sides;
    std::span<std::uint32_t> undecided;
    std::size_t kept = 0;
    for (std::size_t u = 0; u < before.undecided.size(); ++u) {
      const std::uint32_t k = before.undecided[u];
      const Knife& knife = plan_.knives[k];
      const float reach = knife.steepest * (band_ + halfKerf_);
      const Interval range = knife.field.range(box);
      const bool isAbove = range.min > reach;
      if (!isAbove && !(range.max < -reach)) {
        if (!undecided.empty()) undecided[kept] = k;
        ++kept;
        continue;
      }
      if (undecided.empty()) {
        undecided = chunks.copyOf(before.undecided);
        decided = chunks.copyOf(before.decided);
        sides = chunks.copyOf(before.sides);
        known = {decided, sides, undecided, before.cells};
      }
      decided[k / 64] |= std::uint64_t(1) << (k % 64);
      if (isAbove) sides[k / 64] |= std::uint64_t(1) << (k % 64);
    }
    known.undecided = known.undecided.first(kept);
    if (known.cells.size() >= 2) known.cells = cellsNear(known.cells, box, chunks);
    return &(chunks.take<CutKnowledge>(1)[0] = known);
  }

  std::span<const std::uint32_t> cellsNear(std::span<const std::uint32_t> cells, const Box& box,
                                           MemoryChunks& chunks) const {
    const Vec3f centre = box.center();
    float nearest = std::numeric_limits<float>::infinity();
    for (const std::uint32_t c : cells) nearest = std::min(nearest, length(plan_.cells[c] - centre));
    // Farther than the nearest point from everywhere in the box by twice the band: its boundary is not near.
    const float reach = (nearest + length(box.size()) + 2 * (band_ + halfKerf_)) * (1 + 1e-5f);
    std::vector<std::uint32_t> near;
    for (const std::uint32_t c : cells)
      if (!(length(plan_.cells[c] - centre) > reach)) near.push_back(c);
    return near.size() == cells.size() ? cells : chunks.copyOf(std::span<const std::uint32_t>(near));
  }

  CutBricks sampleAll() {
    CutBricks result;
    std::size_t count = 0;
    for (Candidate& candidate : candidates_) {
      candidate.firstSample = count;
      if (!candidate.isUniform) count += (1 + candidate.cube.known->undecided.size()) * kSamples;
    }
    result.samples = LargeArray(count);
    const std::shared_ptr<const BrickGrid> grid = gridInPlace(shape_, h_);
    std::vector<SampledBlock> blocks((candidates_.size() + kBricksPerTask - 1) / kBricksPerTask);
    parallelFor(
        candidates_.size(), kBricksPerTask,
        [&](std::size_t begin, std::size_t end) {
          Sampler sampler(shape_, grid.get(), plan_, blocks[begin / kBricksPerTask]);
          for (std::size_t i = begin; i < end; ++i)
            sampler.add(candidates_[i], result.samples.data() + candidates_[i].firstSample);
        },
        progress_);
    gather(blocks, result);
    return result;
  }

  void gather(std::vector<SampledBlock>& blocks, CutBricks& result) {
    std::size_t bricks = 1, members = 0;
    for (const SampledBlock& block : blocks) bricks += block.bricks.size(), members += block.members.size();
    result.bricks.reserve(bricks);
    result.members.reserve(members);
    CodeNumbers numbers(result.codes);
    result.chunks = std::move(chunks_);
    for (SampledBlock& block : blocks) {
      for (CutBrick& brick : block.bricks) {
        brick.firstMember += result.members.size();
        result.bricks.push_back(brick);
      }
      for (const OpenMember& member : block.members)
        result.members.push_back({numbers.numberOf(member.code), member.samples});
      result.chunks.push_back(std::move(block.chunks));
    }
    result.bricks.push_back({.brick = {}, .firstMember = members});
  }

  const ScalarField& shape_;
  const CutPlan& plan_;
  const Progress& progress_;
  float h_, band_, halfKerf_;
  std::vector<MemoryChunks> chunks_;
  std::vector<Candidate> candidates_;
};

}  // namespace

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

CutBricks cutBricks(const ScalarField& shape, const CutPlan& plan, const Progress& progress) {
  return Walk(shape, plan, progress).run();
}

}  // namespace nephele::detail
