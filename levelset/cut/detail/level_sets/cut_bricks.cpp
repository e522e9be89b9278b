// The walk over the bricks of a shape that is cut.
//
// From coarse cubes of bricks to single ones, every knife is asked for its range: one that keeps away from a
// cube is decided for all of it. Cubes deep inside the shape with all knives decided are settled whole; the
// bricks that are left are sampled, once, into one array, and their samples inside the shape are parted by
// one undecided knife after the other, as sets of bits. Of Voronoi cells those stay that can be the nearest,
// or whose boundary can be near.
#include "nephele/levelset/cut/detail/level_sets/cut_bricks.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "nephele/levelset/cut/detail/level_sets/cut_sampler.h"
#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/lattice.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/field_node.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr std::size_t kSamples = CutBrick::kSamples;
constexpr std::size_t kCubesPerTask = 8, kBricksPerTask = 16;

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
    std::sort(candidates_.begin(), candidates_.end(), [](const CutCandidate& a, const CutCandidate& b) {
      return comesBefore(a.cube.brick, b.cube.brick);
    });
    return sampleAll();
  }

 private:
  void findCandidates() {
    const Box box = plan_.lattice.box.expanded(band_);
    const float width = h_ * kBrick;
    const auto brickOfPoint = [width](const Vec3f& p) {
      return Vec3i{int(std::floor(p.x / width)), int(std::floor(p.y / width)), int(std::floor(p.z / width))};
    };
    requireHoldable("cut", box, h_);
    const Vec3i first = brickOfPoint(box.min), last = brickOfPoint(box.max);
    constexpr int kFirstEdge = 16;
    const CutKnowledge* nothing = knowNothing();
    std::vector<CutCube> cubes;
    for (int z = first.z; z <= last.z; z += kFirstEdge)
      for (int y = first.y; y <= last.y; y += kFirstEdge)
        for (int x = first.x; x <= last.x; x += kFirstEdge) cubes.push_back({{x, y, z}, nothing, shape_});

    struct Visited {
      MemoryChunks chunks;
      std::vector<CutCube> halves;
      std::vector<CutCandidate> candidates;
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

  void visit(const CutCube& cube, int edge, MemoryChunks& chunks, std::vector<CutCube>& halves,
             std::vector<CutCandidate>& candidates) const {
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
    for (CutCandidate& candidate : candidates_) {
      candidate.firstSample = count;
      if (!candidate.isUniform) count += (1 + candidate.cube.known->undecided.size()) * kSamples;
    }
    result.samples = LargeArray(count);
    const std::shared_ptr<const BrickGrid> grid = gridInPlace(shape_, h_);
    std::vector<SampledCutBlock> blocks((candidates_.size() + kBricksPerTask - 1) / kBricksPerTask);
    parallelFor(
        candidates_.size(), kBricksPerTask,
        [&](std::size_t begin, std::size_t end) {
          CutSampler sampler(shape_, grid.get(), plan_, blocks[begin / kBricksPerTask]);
          for (std::size_t i = begin; i < end; ++i)
            sampler.add(candidates_[i], result.samples.data() + candidates_[i].firstSample);
        },
        progress_);
    gather(blocks, result);
    return result;
  }

  void gather(std::vector<SampledCutBlock>& blocks, CutBricks& result) {
    std::size_t bricks = 1, members = 0;
    for (const SampledCutBlock& block : blocks)
      bricks += block.bricks.size(), members += block.members.size();
    result.bricks.reserve(bricks);
    result.members.reserve(members);
    CodeNumbers numbers(result.codes);
    result.chunks = std::move(chunks_);
    for (SampledCutBlock& block : blocks) {
      for (CutBrick& brick : block.bricks) {
        brick.firstMember += result.members.size();
        result.bricks.push_back(brick);
      }
      for (const OpenCutMember& member : block.members)
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
  std::vector<CutCandidate> candidates_;
};

}  // namespace

CutBricks cutBricks(const ScalarField& shape, const CutPlan& plan, const Progress& progress) {
  return Walk(shape, plan, progress).run();
}

}  // namespace nephele::detail
