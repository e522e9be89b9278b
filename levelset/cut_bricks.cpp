// The walk over the bricks of a shape that is cut.
//
// From coarse cubes of bricks to single ones, every knife is asked for its range: one that keeps away from a
// cube is decided for all of it. Cubes deep inside the shape with all knives decided are settled whole; the
// bricks that are left are sampled, once, and their samples inside the shape are parted by one undecided
// knife after the other, as sets of bits. Of Voronoi cells those stay that can be the nearest, or whose
// boundary can be near.
#include "levelset/cut_bricks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>

#include "levelset/lattice.h"
#include "modeling/error.h"
#include "modeling/parallel.h"

namespace nephele::detail {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr std::size_t kSamples = CutBrick::kSamples;

void setBit(KnifeBits& bits, std::uint32_t k) {
  bits[k / 64] |= std::uint64_t(1) << (k % 64);
}

/// The samples where sign * value > limit.
BrickMask samplesAbove(std::span<const float> values, float limit, float sign) {
  BrickMask mask;
  for (std::size_t z = 0; z < 8; ++z) {
    std::uint64_t slice = 0;
    for (std::size_t i = 0; i < 64; ++i) slice |= std::uint64_t(sign * values[64 * z + i] > limit) << i;
    mask.slices[z] = slice;
  }
  return mask;
}

/// A cube of bricks during the walk.
struct Cube {
  CutBrick leaf;  ///< Its first brick and what is known of all of them.
  int edge;
  ScalarField shape;
};

class Walk {
 public:
  Walk(const ScalarField& shape, const CutOptions& options, const Progress& progress)
      : shape_(shape),
        options_(options),
        progress_(progress),
        h_(options.voxelSize),
        band_(options.bandVoxels * options.voxelSize),
        halfKerf_(options.kerf / 2) {}

  std::vector<CutBrick> run() {
    const Box box = options_.box.expanded(band_);
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
    const std::size_t words = (options_.knives.size() + 63) / 64;
    CutBrick everything;
    everything.decided.assign(words, 0);
    everything.sides.assign(words, 0);
    everything.undecided.resize(options_.knives.size());
    std::iota(everything.undecided.begin(), everything.undecided.end(), 0u);
    everything.cells.resize(options_.cells.size());
    std::iota(everything.cells.begin(), everything.cells.end(), 0u);
    std::vector<Cube> cubes;
    for (int z = first.z; z <= last.z; z += kFirstEdge)
      for (int y = first.y; y <= last.y; y += kFirstEdge)
        for (int x = first.x; x <= last.x; x += kFirstEdge) {
          everything.brick = {x, y, z};
          cubes.push_back({everything, kFirstEdge, shape_});
        }

    for (int edge = kFirstEdge; edge >= 1; edge /= 2) {
      std::vector<std::vector<Cube>> halves(cubes.size());
      std::vector<std::vector<CutBrick>> leaves(cubes.size());
      parallelFor(
          cubes.size(), 8,
          [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) visit(std::move(cubes[i]), halves[i], leaves[i]);
          },
          progress_);
      std::vector<Cube> next;
      for (auto& list : halves) std::move(list.begin(), list.end(), std::back_inserter(next));
      for (auto& list : leaves) std::move(list.begin(), list.end(), std::back_inserter(bricks_));
      cubes = std::move(next);
    }
    std::sort(bricks_.begin(), bricks_.end(),
              [](const CutBrick& a, const CutBrick& b) { return comesBefore(a.brick, b.brick); });
    return std::move(bricks_);
  }

 private:
  Vec3f position(const Vec3i& voxel) const { return Vec3f(voxel) * h_; }

  void visit(Cube cube, std::vector<Cube>& halves, std::vector<CutBrick>& leaves) const {
    CutBrick& leaf = cube.leaf;
    const Vec3i firstVoxel = leaf.brick * kBrick;
    const int lastStep = cube.edge * kBrick - 1;
    const Box box{position(firstVoxel), position(firstVoxel + Vec3i{lastStep, lastStep, lastStep})};
    const Interval range = cube.shape.range(box);
    if (range.max <= -band_) return;
    decide(leaf, box);
    // The last bit of a band's end is lost on its way through other grids.
    constexpr float kNearly = 0.999f;
    leaf.isUniform = range.min >= kNearly * band_ && leaf.undecided.empty() && leaf.cells.size() <= 1;
    if (cube.edge > 1 && !leaf.isUniform) {
      const ScalarField local = cube.shape.restrictedTo(box);
      const int half = cube.edge / 2;
      for (int i = 0; i < 8; ++i) {
        halves.push_back({leaf, half, local});
        halves.back().leaf.brick = leaf.brick + Vec3i{i & 1, i >> 1 & 1, i >> 2} * half;
      }
      return;
    }
    if (!leaf.isUniform) {
      if (sample(leaf, cube.shape)) leaves.push_back(std::move(leaf));
      return;
    }
    leaf.members.emplace_back(CutCode{leaf.sides, leaf.cells.empty() ? CutCode::kNoCell : leaf.cells.front()},
                              BrickMask::all());
    // The code says it all.
    leaf.decided.clear();
    leaf.sides.clear();
    leaf.cells.clear();
    const Vec3i origin = leaf.brick;
    for (int z = 0; z < cube.edge; ++z)
      for (int y = 0; y < cube.edge; ++y)
        for (int x = 0; x < cube.edge; ++x) {
          leaves.push_back(leaf);
          leaves.back().brick = origin + Vec3i{x, y, z};
        }
  }

  /// Moves knives that keep away from the box to the decided ones, and drops cells that do.
  void decide(CutBrick& leaf, const Box& box) const {
    std::erase_if(leaf.undecided, [&](std::uint32_t k) {
      const Knife& knife = options_.knives[k];
      const float reach = knife.steepest * (band_ + halfKerf_);
      const Interval range = knife.field.range(box);
      if (!(range.min > reach) && !(range.max < -reach)) return false;
      setBit(leaf.decided, k);
      if (range.min > reach) setBit(leaf.sides, k);
      return true;
    });
    if (leaf.cells.size() < 2) return;
    const Vec3f centre = box.center();
    float nearest = std::numeric_limits<float>::infinity();
    for (const std::uint32_t c : leaf.cells) nearest = std::min(nearest, length(options_.cells[c] - centre));
    // Farther than the nearest point from everywhere in the box by twice the band: its boundary is not near.
    const float reach = (nearest + length(box.size()) + 2 * (band_ + halfKerf_)) * (1 + 1e-5f);
    std::erase_if(leaf.cells, [&](std::uint32_t c) { return length(options_.cells[c] - centre) > reach; });
  }

  /// Evaluates the samples of a brick and parts those inside the shape. False if it has nothing to say.
  bool sample(CutBrick& leaf, const ScalarField& shape) const {
    std::array<std::vector<float>, 3> lanes;
    for (int axis = 0; axis < 3; ++axis) {
      lanes[std::size_t(axis)].resize(kSamples);
      for (std::size_t s = 0; s < kSamples; ++s) lanes[std::size_t(axis)][s] = leaf.position(s, h_)[axis];
    }
    const PointSpans points{lanes[0], lanes[1], lanes[2]};
    leaf.samples.resize((1 + leaf.undecided.size()) * kSamples);
    const std::span<float> all(leaf.samples);
    const std::span<float> inside = all.first(kSamples);
    shape.eval(points, inside);
    if (samplesAbove(inside, -band_, 1).isEmpty()) return false;
    const BrickMask solid = samplesAbove(inside, 0, 1);
    if (!solid.isEmpty()) leaf.members.emplace_back(CutCode{leaf.sides, CutCode::kNoCell}, solid);
    for (std::size_t u = 0; u < leaf.undecided.size(); ++u) {
      const std::span<float> values = all.subspan((1 + u) * kSamples, kSamples);
      evaluateKnife(options_.knives[leaf.undecided[u]], points, values);
      split(leaf, leaf.undecided[u], values);
    }
    if (!leaf.cells.empty()) splitByCell(leaf);
    return true;
  }

  void split(CutBrick& leaf, std::uint32_t knife, std::span<const float> values) const {
    const BrickMask above = samplesAbove(values, halfKerf_, 1), below = samplesAbove(values, halfKerf_, -1);
    std::vector<std::pair<CutCode, BrickMask>> members;
    for (auto& [code, samples] : leaf.members) {
      const BrickMask high = samples & above, low = samples & below;
      if (!low.isEmpty()) members.emplace_back(code, low);
      if (high.isEmpty()) continue;
      setBit(code.sides, knife);
      members.emplace_back(std::move(code), high);
    }
    leaf.members = std::move(members);
  }

  void splitByCell(CutBrick& leaf) const {
    std::vector<BrickMask> ofCell(leaf.cells.size());
    for (std::size_t s = 0; s < kSamples; ++s) {
      const Vec3f p = leaf.position(s, h_);
      std::size_t nearest = 0;
      float least = std::numeric_limits<float>::infinity();
      for (std::size_t c = 0; c < leaf.cells.size(); ++c) {
        const Vec3f away = options_.cells[leaf.cells[c]] - p;
        if (const float squared = dot(away, away); squared < least) least = squared, nearest = c;
      }
      if (leaf.cells.size() == 1 || insideCell(leaf, leaf.cells[nearest], p) > halfKerf_)
        ofCell[nearest].add(int(s));
    }
    std::vector<std::pair<CutCode, BrickMask>> members;
    for (const auto& [code, samples] : leaf.members)
      for (std::size_t c = 0; c < leaf.cells.size(); ++c)
        if (const BrickMask shared = samples & ofCell[c]; !shared.isEmpty())
          members.emplace_back(CutCode{code.sides, leaf.cells[c]}, shared);
    leaf.members = std::move(members);
  }

  /// Distance to the sides of a cell that are near the brick.
  float insideCell(const CutBrick& leaf, std::uint32_t cell, const Vec3f& p) const {
    float least = std::numeric_limits<float>::infinity();
    for (const std::uint32_t other : leaf.cells)
      if (other != cell) least = std::min(least, Bisector(options_.cells[cell], options_.cells[other]).at(p));
    return least;
  }

  const ScalarField& shape_;
  const CutOptions& options_;
  const Progress& progress_;
  float h_, band_, halfKerf_;
  std::vector<CutBrick> bricks_;
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
  for (std::size_t s = 0; s < points.size(); ++s) {
    const float slope = length(Vec3f{slopes[0][s], slopes[1][s], slopes[2][s]});
    if (slope > 0) values[s] /= slope;
  }
}

std::vector<CutBrick> cutBricks(const ScalarField& shape, const CutOptions& options,
                                const Progress& progress) {
  return Walk(shape, options, progress).run();
}

}  // namespace nephele::detail
