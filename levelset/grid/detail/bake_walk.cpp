#include "nephele/levelset/grid/detail/bake_walk.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

template <class T>
BakeWalk<T>::BakeWalk(const BakeOptions& options, const Progress& progress)
    : options_(options),
      progress_(progress),
      margin_(options.interpolation == Interpolation::tricubic ? 1 : 0) {
  background_.fill(options.background.value_or(std::isfinite(options.band.min) ? options.band.min : 0.0f));
  for (const float value : background_) backgroundSamples_.insert(backgroundSamples_.end(), kOwn, value);
  for (int axis = 0; axis < 3; ++axis) {
    voxels_.first[axis] = int(std::floor(double(options.box.min[axis]) / options.voxelSize)) - margin_;
    voxels_.last[axis] = int(std::ceil(double(options.box.max[axis]) / options.voxelSize)) + margin_;
    // Cells that touch these voxels, so that values fall off to the background without a jump.
    places_.first[axis] = brickOf(voxels_.first[axis] - 2);
    places_.count[axis] = brickOf(voxels_.last[axis] + 1) - places_.first[axis] + 1;
  }
  requireHoldable("bake", places_);
}

template <class T>
template <class Take>
void BakeWalk<T>::split(const Cell& cell, const Take& take) const {
  const int half = cell.size / 2;
  const Vec3i end = places_.first + places_.count;
  for (int i = 0; i < 8; ++i) {
    const Vec3i b = cell.brick + Vec3i{i & 1, i >> 1 & 1, i >> 2} * half;
    if (b.x < end.x && b.y < end.y && b.z < end.z) take(Cell{b, half, cell.node});
  }
}

template <class T>
VoxelBox BakeWalk<T>::ownVoxels(const Vec3i& brick, int size) const {
  const int last = size * kBrick - 1;
  return {brick * kBrick, brick * kBrick + Vec3i{last, last, last}};
}

template <class T>
VoxelBox BakeWalk<T>::readVoxels(const Vec3i& brick, int size) const {
  const VoxelBox own = ownVoxels(brick, size);
  const Vec3i before{margin_, margin_, margin_}, after{1 + margin_, 1 + margin_, 1 + margin_};
  return {own.first - before, own.last + after};
}

template <class T>
bool BakeWalk<T>::mayStand(const Values& value, const Vec3i& brick, int size) const {
  return value == background_ || voxels_.contains(ownVoxels(brick, size));
}

template <class T>
std::vector<typename BakeWalk<T>::CellResult> BakeWalk<T>::evaluated(const NodePtr<T>& node,
                                                                     std::vector<Settled>& settled) {
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

template <class T>
typename BakeWalk<T>::Ranges BakeWalk<T>::includingRead(Ranges ranges, const Leaf& leaf,
                                                        const Vec3i& side) const {
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

template <class T>
std::optional<typename BakeWalk<T>::Values> BakeWalk<T>::settledValue(const Ranges& ranges) const {
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

template <class T>
bool BakeWalk<T>::settle(Cell& cell, std::vector<Settled>& settled) const {
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

template <class T>
std::vector<typename BakeWalk<T>::Cell> BakeWalk<T>::cellsToEvaluate(const NodePtr<T>& node,
                                                                     std::vector<Settled>& all) const {
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

template <class T>
void BakeWalk<T>::collect(Cell cell, std::vector<Cell>& bricks, std::vector<Settled>& settled) const {
  if (settle(cell, settled)) return;
  if (cell.size == 1)
    bricks.push_back(std::move(cell));
  else
    split(cell, [&](Cell&& part) { collect(std::move(part), bricks, settled); });
}

template <class T>
typename BakeWalk<T>::CellResult BakeWalk<T>::evaluate(const Cell& cell, SampleBuffer& buffer) {
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

template <class T>
void BakeWalk<T>::keepUnsettled(const Vec3i& cell, const std::vector<Leaf>& leaves, CellResult& result) {
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

template <class T>
bool BakeWalk<T>::isBackground(const Leaf& leaf) const {
  bool is = true;
  for (int c = 0; c < kLanes; ++c) is &= leaf.range[c] == Interval::of(background_[c]);
  return is;
}

template <class T>
void BakeWalk<T>::evaluate(const FieldNode<T>& node, const Vec3i& brick, float* samples,
                           Scratch& scratch) const {
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
    if (voxels_.contains(own.first + Vec3i{s % kBrick, s / kBrick % kBrick, s / (kBrick * kBrick)})) continue;
    for (int c = 0; c < kLanes; ++c) samples[c * kOwn + s] = background_[c];
  }
}

template class BakeWalk<float>;
template class BakeWalk<Vec3f>;

}  // namespace nephele::detail
