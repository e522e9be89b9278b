// Level sets parted by knives, in tetrahedra of their own lattice.
//
// Bricks that neither the surface nor a knife enters are told by ranges; first for blocks of 4^3 of them.
// Those that are left are carved, each for itself (brick_carver.cpp). Every vertex belongs to the brick of
// the first sample of its edge, face or tetrahedron, which numbers and places it.
//
// Limit: blades are as coarse as the lattice; waves below two voxels are lost.
#include "nephele/levelset/cut/detail/tetrahedra/lattice_carve.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "nephele/levelset/cut/detail/solids/solid_split.h"
#include "nephele/levelset/cut/detail/tetrahedra/brick_carver.h"
#include "nephele/levelset/grid/brick_box.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {
namespace {

constexpr int kBrick = BrickGrid::kBrick;
/// Bricks along a block.
constexpr int kBlock = 4;
constexpr std::size_t kMostFunctions = (1 << 14) - 2;

class LatticeCarver {
 public:
  LatticeCarver(const BrickGrid& level, std::span<const LatticeKnife> knives, float kerf,
                const Progress& progress)
      : carving_{.level = level, .knives = knives, .halfKerf = double(kerf) / 2}, progress_(progress) {
    require(knives.size() * carving_.functionsPerKnife() < kMostFunctions,
            fmt::format("cut: too many knives for a level set: {}", knives.size()));
    require(level.background() <= 0, "cut: the level set does not end: its background is inside");
    for (unsigned corner = 1; corner < 8; ++corner)
      carving_.longestEdge = std::max(
          carving_.longestEdge, length(carving_.world(Vec3d(cornerOffset(corner))) - carving_.world({})));
    for (const LatticeKnife& knife : knives) {
      carving_.firstFrame.push_back(std::uint32_t(result_.frames.size()));
      if (knife.frame) {
        result_.frames.push_back(*knife.frame);
      } else {
        for (const Vec3d& axis : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
          result_.frames.push_back(PlaneFrame::of(axis));
      }
    }
    // One layer of bricks before the table: its last cells lie between the background and the table.
    places_ = {level.firstBrick() - Vec3i{1, 1, 1}, level.brickCount() + Vec3i{1, 1, 1}};
  }

  Carved run() {
    findBricks();
    parallelFor(
        bricks_.size(), 8,
        [&](std::size_t begin, std::size_t end) {
          const auto carver = std::make_unique<BrickCarver>(carving_);
          for (std::size_t i = begin; i < end; ++i) carver->carve(bricks_[i]);
        },
        progress_);
    number();
    collect();
    return std::move(result_);
  }

 private:
  struct Block {
    std::vector<CarvedBrick> bricks;
    double largest = 0.0;
  };

  void findBricks() {
    const BrickBox blocks{{}, (places_.count + Vec3i{kBlock - 1, kBlock - 1, kBlock - 1}) / kBlock};
    std::vector<Block> found(blocks.size());
    parallelFor(
        found.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) found[i] = blockAt(blocks.at(i) * kBlock + places_.first);
        },
        progress_);
    carving_.largest = double(std::numeric_limits<float>::min());
    for (Block& block : found) {
      carving_.largest = std::max(carving_.largest, block.largest);
      std::move(block.bricks.begin(), block.bricks.end(), std::back_inserter(bricks_));
    }
    carving_.margin = kZeroMargin * std::min(double(carving_.level.voxelSize()), carving_.largest);
    table_.assign(places_.size(), -1);
    for (std::size_t i = 0; i < bricks_.size(); ++i)
      table_[places_.numberOf(bricks_[i].at)] = std::int32_t(i);
  }

  /// Samples -1 to 9 of the bricks, in the world.
  Box boxOf(const Vec3i& firstBrick, int bricks) const {
    const Vec3d low(firstBrick * kBrick - Vec3i{1, 1, 1}), size = Vec3d{1, 1, 1} * (kBrick * bricks + 2.0);
    Box box;
    for (unsigned corner = 0; corner < 8; ++corner)
      box = box.including(Vec3f(carving_.world(low + Vec3d(cornerOffset(corner)) * size)));
    const float far = std::max(length(box.min), length(box.max));
    return box.expanded(4e-7f * far);
  }

  Block blockAt(const Vec3i& firstBrick) const {
    Block block;
    CarvedBrick all;
    all.undecided.resize(carving_.knives.size());
    all.isPositive.assign(carving_.knives.size(), 0);
    for (std::uint32_t k = 0; k < all.undecided.size(); ++k) all.undecided[k] = k;
    bool isDecided = false;
    std::array<float, kRingSamples> samples;
    const Vec3i end = min(firstBrick + Vec3i{kBlock, kBlock, kBlock}, places_.first + places_.count);
    for (int z = firstBrick.z; z < end.z; ++z)
      for (int y = firstBrick.y; y < end.y; ++y)
        for (int x = firstBrick.x; x < end.x; ++x) {
          const Vec3i at{x, y, z};
          const Interval range = rangeOfCells(at);
          const bool hasSurface = !(double(range.min) > kZeroMargin * double(carving_.level.voxelSize()));
          if (!(range.max > 0) && !std::isnan(range.max)) continue;
          if (!isDecided) decide(all, boxOf(firstBrick, kBlock));
          isDecided = true;
          CarvedBrick brick = all;
          brick.at = at;
          if (!all.undecided.empty()) decide(brick, boxOf(at, 1));
          if (!hasSurface && brick.undecided.empty()) continue;
          if (hasSurface) {
            gather(carving_.level, at, samples);
            block.largest = std::max(block.largest, largestAtSurface(samples));
          }
          block.bricks.push_back(std::move(brick));
        }
    return block;
  }

  /// Of all samples of the brick's cells.
  Interval rangeOfCells(const Vec3i& at) const {
    Interval range = carving_.level.ranges()[std::size_t(carving_.level.poolIndex(at))];
    for (unsigned corner = 1; corner < 8; ++corner) {
      const Interval other =
          carving_.level.ranges()[std::size_t(carving_.level.poolIndex(at + cornerOffset(corner)))];
      range = {std::min(range.min, other.min), std::max(range.max, other.max)};
    }
    return range;
  }

  /// The largest value in cells that the surface meets; 0 if it meets none.
  static double largestAtSurface(const std::array<float, kRingSamples>& samples) {
    double largest = 0;
    for (int z = 0; z < kBrick; ++z)
      for (int y = 0; y < kBrick; ++y)
        for (int x = 0; x < kBrick; ++x) {
          float low = std::numeric_limits<float>::infinity(), high = -low;
          for (unsigned c = 0; c < 8; ++c) {
            const float v = samples[std::size_t(ringIndex(x, y, z) + ringStep(c))];
            require(!std::isnan(v), "cut: the level set holds samples that are not numbers (NaN)");
            low = std::min(low, v);
            high = std::max(high, v);
          }
          if (!(low <= 0 && high > 0)) continue;
          constexpr double kMost = std::numeric_limits<float>::max();
          largest = std::max(largest, std::min(double(std::max(high, -low)), kMost));
        }
    return largest;
  }

  void decide(CarvedBrick& brick, const Box& box) const {
    std::erase_if(brick.undecided, [&](std::uint32_t k) {
      const Knife& knife = carving_.knives[k].knife;
      const bool isDivided = carving_.halfKerf > 0 && knife.steepest > 1;
      const double reach = (isDivided ? double(knife.steepest) : 1.0) * carving_.halfKerf +
                           2 * double(knife.steepest) * carving_.longestEdge * kZeroMargin;
      const Interval range = knife.field.range(box);
      if (!(double(range.min) > reach) && !(double(range.max) < -reach)) return false;
      brick.isPositive[k] = double(range.min) > reach;
      return true;
    });
  }

  void number() {
    std::size_t vertices = 0, triangles = 0;
    for (CarvedBrick& brick : bricks_) {
      brick.firstVertex = vertices;
      vertices += brick.positions.size();
      triangles += brick.triangles.size();
    }
    require(triangles < kSourceEdge && vertices < kSourceEdge,
            fmt::format("cut: more than {} triangles", kSourceEdge - 1));
    result_.positions.resize(vertices);
    result_.triangles.resize(triangles);
    result_.parents.resize(triangles);
  }

  std::uint32_t vertexOf(const CarvedBrick& brick, const VertexKey& key) const {
    const CarvedBrick& owner =
        key.isOwn() ? brick : bricks_[std::size_t(table_[places_.numberOf(brick.at + key.owner())])];
    const auto at = std::lower_bound(owner.keys.begin(), owner.keys.end(), key.inOwner());
    return std::uint32_t(owner.firstVertex + std::size_t(at - owner.keys.begin()));
  }

  void collect() {
    std::map<std::vector<bool>, std::uint32_t> parts;
    for (const CarvedBrick& brick : bricks_)
      for (const auto& code : brick.codes) parts.emplace(code, 0);
    for (auto& [sides, number] : parts) {
      number = std::uint32_t(result_.parts.size());
      result_.parts.push_back({.sides = sides, .triangles = {}});
    }
    std::uint32_t next = 0;
    std::vector<std::uint32_t> firstTriangle;
    for (const CarvedBrick& brick : bricks_) {
      firstTriangle.push_back(next);
      std::vector<std::uint32_t> partOf;
      for (const auto& code : brick.codes) partOf.push_back(parts.at(code));
      for (const KeyedTriangle& t : brick.triangles)
        result_.parts[partOf[t.code]].triangles.push_back(next++);
    }
    parallelFor(bricks_.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const CarvedBrick& brick = bricks_[i];
        std::copy(brick.positions.begin(), brick.positions.end(),
                  result_.positions.begin() + std::ptrdiff_t(brick.firstVertex));
        std::size_t t = firstTriangle[i];
        for (const KeyedTriangle& triangle : brick.triangles) {
          for (std::size_t k = 0; k < 3; ++k) result_.triangles[t][k] = vertexOf(brick, triangle.corners[k]);
          result_.parents[t++] = triangle.parent;
        }
      }
    });
    std::erase_if(result_.parts, [](const Carved::Part& part) { return part.triangles.empty(); });
    bricks_ = {};
  }

  Carving carving_;
  const Progress& progress_;
  BrickBox places_;
  std::vector<CarvedBrick> bricks_;
  /// The number of the brick at each place of the table, or -1.
  std::vector<std::int32_t> table_;
  Carved result_;
};

}  // namespace

Carved carveLattice(const BrickGrid& level, std::span<const LatticeKnife> knives, float kerf,
                    const Progress& progress) {
  return LatticeCarver(level, knives, kerf, progress).run();
}

}  // namespace nephele::detail
