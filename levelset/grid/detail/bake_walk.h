#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/constant_node.h"

namespace nephele::detail {

/// Voxels [first, last], both included.
struct VoxelBox {
  Vec3i first, last;

  bool isEmpty() const { return first.x > last.x || first.y > last.y || first.z > last.z; }
  bool contains(const Vec3i& v) const {
    return v.x >= first.x && v.y >= first.y && v.z >= first.z && v.x <= last.x && v.y <= last.y &&
           v.z <= last.z;
  }
  bool contains(const VoxelBox& b) const { return contains(b.first) && contains(b.last); }
  VoxelBox intersection(const VoxelBox& b) const { return {max(first, b.first), min(last, b.last)}; }
};

inline Interval including(const Interval& r, float v) {
  return v == v ? r.hull(Interval::of(v)) : Interval::everything();
}

/// The walk of a bake from an expression to constants and bricks of samples.
template <class T>
class BakeWalk {
 public:
  static constexpr int kBrick = BrickGrid::kBrick;
  /// Samples of a brick's own.
  static constexpr int kOwn = kBrick * kBrick * kBrick;
  /// Bricks per edge of the cells that threads share out among themselves.
  static constexpr int kCellSize = 8;
  static constexpr int kLanes = kComponents<T>;
  using Values = std::array<float, kLanes>;
  using Ranges = std::array<Interval, kLanes>;

  struct Settled {
    Vec3i brick;
    int size;
    Values value;
  };
  /// A brick that was evaluated: kLanes * kOwn samples. Bricks of nothing but the background share theirs.
  struct Leaf {
    Vec3i brick;
    float* samples;
    Ranges range;
  };
  /// What one cell of the octree gave.
  struct CellResult {
    int firstZ = 0;
    std::vector<Settled> settled;
    std::vector<Leaf> leaves;
    SampleStore samples;
  };
  /// What stands at a brick position: a constant, an evaluated brick, or neither where it is not known yet.
  struct Standing {
    const Values* constant = nullptr;
    const Leaf* leaf = nullptr;
  };

  BakeWalk(const BakeOptions& options, const Progress& progress)
      : options_(options),
        progress_(progress),
        margin_(options.interpolation == Interpolation::tricubic ? 1 : 0) {
    background_.fill(options.background.value_or(std::isfinite(options.band.min) ? options.band.min : 0.0f));
    for (const float value : background_) backgroundSamples_.insert(backgroundSamples_.end(), kOwn, value);
    for (int axis = 0; axis < 3; ++axis) {
      voxels_.first[axis] = int(std::floor(double(options.box.min[axis]) / options.voxelSize));
      voxels_.last[axis] = int(std::ceil(double(options.box.max[axis]) / options.voxelSize));
      // Cells that touch these voxels, so that values fall off to the background without a jump.
      places_.first[axis] = brickOf(voxels_.first[axis] - 2);
      places_.count[axis] = brickOf(voxels_.last[axis] + 1) - places_.first[axis] + 1;
    }
    requireHoldable("bake", places_);
  }

  const BakeOptions& options() const { return options_; }
  const Values& background() const { return background_; }
  const BrickBox& places() const { return places_; }
  /// Whether a brick is all background.
  bool isShared(const Leaf& leaf) const { return leaf.samples == backgroundSamples_.data(); }

  /// Cells that are settled by their ranges go to `settled`, the others are evaluated, in parallel.
  std::vector<CellResult> evaluated(const NodePtr<T>& node, std::vector<Settled>& settled) {
    std::vector<Cell> cells = cellsToEvaluate(node, settled);
    std::vector<CellResult> results(cells.size());
    Buffers buffers;
    parallelFor(
        cells.size(), 1,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            results[i] = evaluate(cells[i], buffers.local());
            cells[i].node = nullptr;
          }
        },
        progress_);
    return results;
  }

  /// The constant that an evaluated brick may become, given what stands at the positions around it. None
  /// while one of them is not known. That a brick beside it was collapsed before does not matter: the
  /// constant settles the same.
  template <class StandingAt>
  std::optional<Values> collapsed(const Leaf& leaf, const StandingAt& standingAt) const {
    Ranges ranges = leaf.range;
    std::optional<Values> value = settledValue(ranges);
    for (int z = -margin_; value && z <= 1; ++z)
      for (int y = -margin_; value && y <= 1; ++y)
        for (int x = -margin_; value && x <= 1; ++x) {
          const Vec3i side{x, y, z};
          if (side == Vec3i{}) continue;
          const Standing s =
              places_.covers(leaf.brick + side) ? standingAt(leaf.brick + side) : Standing{&background_};
          if (!s.constant && !s.leaf) return std::nullopt;
          if (s.constant)
            for (int c = 0; c < kLanes; ++c) ranges[c] = including(ranges[c], (*s.constant)[c]);
          else
            ranges = includingRead(ranges, *s.leaf, side);
          value = settledValue(ranges);
        }
    return value && mayStand(*value, leaf.brick, 1) ? value : std::nullopt;
  }

  /// `ranges` and the samples of the leaf on `side` that interpolation in a brick reads.
  Ranges includingRead(Ranges ranges, const Leaf& leaf, const Vec3i& side) const {
    Ranges all = ranges;
    for (int c = 0; c < kLanes; ++c) all[c] = all[c].hull(leaf.range[c]);
    if (settledValue(all)) return all;
    VoxelBox read{{0, 0, 0}, {kBrick - 1, kBrick - 1, kBrick - 1}};
    for (int axis = 0; axis < 3; ++axis) {
      if (side[axis] < 0) read.first[axis] = kBrick - 1;
      if (side[axis] > 0) read.last[axis] = margin_;
    }
    for (int z = read.first.z; z <= read.last.z; ++z)
      for (int y = read.first.y; y <= read.last.y; ++y)
        for (int x = read.first.x; x <= read.last.x; ++x)
          for (int c = 0; c < kLanes; ++c)
            ranges[c] = including(ranges[c], leaf.samples[c * kOwn + (z * kBrick + y) * kBrick + x]);
    return ranges;
  }

 private:
  /// size^3 bricks from `brick` on, and an expression that holds there.
  struct Cell {
    Vec3i brick;
    int size;
    NodePtr<T> node;
  };
  /// Room for samples that lasts from cell to cell.
  struct Buffer {
    std::unique_ptr<float[]> samples;
    std::size_t size = 0;

    float* of(std::size_t count) {
      if (count > size) {
        samples = std::make_unique_for_overwrite<float[]>(count);
        size = count;
      }
      return samples.get();
    }
  };
  using Buffers = tbb::enumerable_thread_specific<Buffer>;

  Vec3f position(const Vec3i& voxel) const { return Vec3f(voxel) * options_.voxelSize; }

  /// The constant that stands for values in `ranges`, if one may.
  std::optional<Values> settledValue(const Ranges& ranges) const {
    Values value;
    for (int c = 0; c < kLanes; ++c) {
      const Interval& r = ranges[c];
      if (r.min >= options_.band.max)
        value[c] = options_.band.max;
      else if (r.max <= options_.band.min)
        value[c] = options_.band.min;
      else if (r.isPoint())
        value[c] = r.min;
      else
        return std::nullopt;
    }
    return value;
  }

  /// The samples that size^3 bricks own.
  VoxelBox ownVoxels(const Vec3i& brick, int size) const {
    const int last = size * kBrick - 1;
    return {brick * kBrick, brick * kBrick + Vec3i{last, last, last}};
  }

  /// The samples that interpolation in the bricks' cells reads.
  VoxelBox readVoxels(const Vec3i& brick, int size) const {
    const VoxelBox own = ownVoxels(brick, size);
    const Vec3i before{margin_, margin_, margin_}, after{1 + margin_, 1 + margin_, 1 + margin_};
    return {own.first - before, own.last + after};
  }

  /// Whether a constant may stand for bricks that reach out of the box, where the background is due.
  bool mayStand(const Values& value, const Vec3i& brick, int size) const {
    return value == background_ || voxels_.contains(ownVoxels(brick, size));
  }

  /// Settles `cell` by range; else restricts its expression and returns false.
  bool settle(Cell& cell, std::vector<Settled>& settled) const {
    const VoxelBox inside = readVoxels(cell.brick, cell.size).intersection(voxels_);
    if (inside.isEmpty()) {
      settled.push_back({cell.brick, cell.size, background_});
      return true;
    }
    const Box box{position(inside.first), position(inside.last)};
    const RangeOf<T> range = RangeMemo().of(cell.node, box);
    Ranges ranges;
    for (int c = 0; c < kLanes; ++c) ranges[c] = detail::rangeComponent(range, c);
    const std::optional<Values> value = settledValue(ranges);
    if (value && mayStand(*value, cell.brick, cell.size)) {
      settled.push_back({cell.brick, cell.size, *value});
      return true;
    }
    // A single brick costs less to evaluate than to simplify once more.
    if (cell.size > 1) {
      RestrictionMemo memo;
      Restriction restriction{box, memo};
      cell.node = restrictNode(cell.node, restriction);
    }
    return false;
  }

  /// The eight parts of a cell that touch the table, in Z order.
  template <class Take>
  void split(const Cell& cell, const Take& take) const {
    const int half = cell.size / 2;
    const Vec3i end = places_.first + places_.count;
    for (int i = 0; i < 8; ++i) {
      const Vec3i b = cell.brick + Vec3i{i & 1, i >> 1 & 1, i >> 2} * half;
      if (b.x < end.x && b.y < end.y && b.z < end.z) take(Cell{b, half, cell.node});
    }
  }

  std::vector<Cell> cellsToEvaluate(const NodePtr<T>& node, std::vector<Settled>& all) const {
    int size = kCellSize;
    while (size < std::max({places_.count.x, places_.count.y, places_.count.z})) size *= 2;
    std::vector<Cell> level{{places_.first, size, node}};
    for (; size > kCellSize && !level.empty(); size /= 2) {
      std::vector<std::vector<Cell>> parts(level.size());
      std::vector<std::vector<Settled>> settled(level.size());
      parallelFor(level.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          progress_.check();
          if (!settle(level[i], settled[i]))
            split(level[i], [&](Cell&& cell) { parts[i].push_back(std::move(cell)); });
        }
      });
      level.clear();
      for (auto& p : parts) std::move(p.begin(), p.end(), std::back_inserter(level));
      for (const auto& s : settled) all.insert(all.end(), s.begin(), s.end());
    }
    return level;
  }

  /// Bricks of `cell` that range does not settle.
  void collect(Cell cell, std::vector<Cell>& bricks, std::vector<Settled>& settled) const {
    if (settle(cell, settled)) return;
    if (cell.size == 1)
      bricks.push_back(std::move(cell));
    else
      split(cell, [&](Cell&& part) { collect(std::move(part), bricks, settled); });
  }

  CellResult evaluate(const Cell& cell, Buffer& buffer) {
    CellResult result;
    result.firstZ = cell.brick.z;
    std::vector<Cell> bricks;
    collect(cell, bricks, result.settled);
    if (bricks.empty()) return result;
    float* samples = buffer.of(bricks.size() * kLanes * kOwn);
    Scratch& scratch = Scratch::local();
    std::vector<Leaf> leaves(bricks.size());
    for (std::size_t i = 0; i < bricks.size(); ++i) {
      progress_.check();
      float* own = samples + i * kLanes * kOwn;
      evaluate(*bricks[i].node, bricks[i].brick, own, scratch);
      leaves[i] = {bricks[i].brick, own, {}};
      for (int c = 0; c < kLanes; ++c) leaves[i].range[c] = rangeOfSamples({own + c * kOwn, kOwn});
      bricks[i].node = nullptr;
    }
    keepUnsettled(cell.brick, leaves, result);
    return result;
  }

  /// Collapses the bricks that can be judged within their cell, and copies the others to a store of just
  /// their size.
  void keepUnsettled(const Vec3i& cell, const std::vector<Leaf>& leaves, CellResult& result) {
    std::array<Standing, kCellSize * kCellSize * kCellSize> standing{};
    const auto place = [&](const Vec3i& b) -> Standing* {
      const Vec3i d = b - cell;
      if (std::min({d.x, d.y, d.z}) < 0 || std::max({d.x, d.y, d.z}) >= kCellSize) return nullptr;
      return &standing[std::size_t((d.z * kCellSize + d.y) * kCellSize + d.x)];
    };
    for (const Settled& s : result.settled)
      for (int i = 0; i < s.size * s.size * s.size; ++i)
        place(s.brick + Vec3i{i % s.size, i / s.size % s.size, i / (s.size * s.size)})->constant = &s.value;
    for (const Leaf& leaf : leaves) place(leaf.brick)->leaf = &leaf;
    std::vector<Settled> collapsedHere;
    for (const Leaf& leaf : leaves) {
      const auto value = collapsed(leaf, [&](const Vec3i& b) {
        const Standing* s = place(b);
        return s ? *s : Standing{};
      });
      if (value)
        collapsedHere.push_back({leaf.brick, 1, *value});
      else
        result.leaves.push_back(leaf);
    }
    result.settled.insert(result.settled.end(), collapsedHere.begin(), collapsedHere.end());
    std::size_t stored = 0;
    for (Leaf& leaf : result.leaves) {
      if (isBackground(leaf))
        leaf.samples = backgroundSamples_.data();
      else
        ++stored;
    }
    result.samples = SampleStore(stored * kLanes * kOwn);
    float* to = result.samples.data();
    for (Leaf& leaf : result.leaves) {
      if (isShared(leaf)) continue;
      std::copy_n(leaf.samples, kLanes * kOwn, to);
      leaf.samples = to;
      to += kLanes * kOwn;
    }
  }

  bool isBackground(const Leaf& leaf) const {
    bool is = true;
    for (int c = 0; c < kLanes; ++c) is &= leaf.range[c] == Interval::of(background_[c]);
    return is;
  }

  /// The own samples of one brick, component by component.
  void evaluate(const FieldNode<T>& node, const Vec3i& brick, float* samples, Scratch& scratch) const {
    const VoxelBox own = ownVoxels(brick, 1);
    if (voxels_.intersection(own).isEmpty()) {
      for (int c = 0; c < kLanes; ++c) std::fill_n(samples + c * kOwn, kOwn, background_[c]);
      return;
    }
    Scratch::Frame frame(scratch);
    const BlockLanes<3> xyz = frame.template lanes<3>();
    const BlockLanes<kLanes> out = frame.template lanes<kLanes>();
    // Voxels outside the box are asked for at its edge, since restricted expressions hold only inside.
    Vec3f positions[kBrick];
    for (int i = 0; i < kBrick; ++i)
      positions[i] = position(min(max(own.first + Vec3i{i, i, i}, voxels_.first), voxels_.last));
    for (int done = 0; done < kOwn; done += kBlockSize) {
      constexpr int kPlanes = kBlockSize / (kBrick * kBrick);
      const int z = own.first.z + done / (kBrick * kBrick);
      // Blocks wholly outside are filled below.
      if (z > voxels_.last.z || z + kPlanes - 1 < voxels_.first.z) continue;
      for (int row = 0; row < kBlockSize / kBrick; ++row) {
        const int y = row % kBrick, plane = (done / kBrick + row) / kBrick;
        for (int x = 0; x < kBrick; ++x) {
          xyz[0][row * kBrick + x] = positions[x].x;
          xyz[1][row * kBrick + x] = positions[y].y;
          xyz[2][row * kBrick + x] = positions[plane].z;
        }
      }
      node.eval(scratch.pointBlock(xyz, kBlockSize), out, scratch);
      for (int c = 0; c < kLanes; ++c) std::copy_n(out[c], kBlockSize, samples + c * kOwn + done);
    }
    if (voxels_.contains(own)) return;
    for (int s = 0; s < kOwn; ++s) {
      if (voxels_.contains(own.first + Vec3i{s % kBrick, s / kBrick % kBrick, s / (kBrick * kBrick)}))
        continue;
      for (int c = 0; c < kLanes; ++c) samples[c * kOwn + s] = background_[c];
    }
  }

  const BakeOptions& options_;
  const Progress& progress_;
  /// Samples beyond a cell's corners that interpolation reads.
  int margin_;
  Values background_;
  std::vector<float> backgroundSamples_;
  VoxelBox voxels_;
  BrickBox places_;
};

}  // namespace nephele::detail
