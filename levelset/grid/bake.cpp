// Baking: from an expression to sparse bricks.
//
// The walk: an octree over brick positions, breadth first down to cells of 8^3 bricks. A cell whose range is
// settled (beyond one end of the band, or a single value) becomes a constant; others restrict the expression
// to their box and split. The cells that are left run in parallel and share nothing: each walks on depth
// first to single bricks and evaluates the unsettled ones in blocks of 256 points. The pool: bricks that turn
// out settled by their samples become constants too. The others get their places in the order of the walk (a
// Z-order curve), so results do not depend on threads. Samples move to the pool piece by piece while the
// cells' stores are given back: the peak stays close to the finished grid.
//
// A brick is settled if the field is on all samples that its cells interpolate between, not just its own:
// then nothing inside the band is lost on its far faces. Limit: a feature so thin that samples miss it is
// missed.

#include "nephele/levelset/grid/bake.h"

#include <fmt/format.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/field/constant_node.h"

namespace nephele {

namespace {

using detail::BrickSamples;
using detail::SampleStore;

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kOwn = kBrick * kBrick * kBrick;
/// Bricks per edge of the cells that threads share out among themselves.
constexpr int kCellSize = 8;
/// Bricks moved to the pool at a time.
constexpr std::size_t kBatch = 4096;
/// Beyond this many voxels from the origin floats cannot tell neighbouring voxels apart.
constexpr double kFarthestVoxel = (1 << 24) - 64;

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

Interval including(const Interval& r, float v) {
  return v == v ? r.hull(Interval::of(v)) : Interval::everything();
}

void requireSane(const BakeOptions& options) {
  const Box& box = options.box;
  require(options.voxelSize > 0 && std::isfinite(options.voxelSize),
          fmt::format("bake: voxelSize must be > 0 and finite, got {:g}", options.voxelSize));
  require(!box.isEmpty() && isFinite(box.min) && isFinite(box.max),
          "bake: the box must be bounded and not empty");
  require(options.band.min <= options.band.max, "bake: the band must have min <= max");
  require(!options.background || std::isfinite(*options.background), "bake: the background must be finite");
  for (int axis = 0; axis < 3; ++axis) {
    const double farthest = std::max(std::abs(double(box.min[axis])), std::abs(double(box.max[axis])));
    require(
        farthest / options.voxelSize < kFarthestVoxel,
        fmt::format(
            "bake: the box reaches {:g} from the origin, voxels of {:g} hold up to 16.7 million voxels only",
            farthest, options.voxelSize));
  }
}

template <class T>
class Baker {
 public:
  static constexpr int kLanes = kComponents<T>;
  using Values = std::array<float, kLanes>;
  using Ranges = std::array<Interval, kLanes>;
  using Grids = std::array<std::shared_ptr<BrickGrid>, kLanes>;

  Baker(const BakeOptions& options, const Progress& progress)
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

  Grids grids(const NodePtr<T>& node) {
    std::vector<CellResult> results = evaluated(node);
    return assemble(results);
  }

  /// Of a field of numbers.
  BrickSamples samples(const NodePtr<T>& node) {
    std::vector<CellResult> results = evaluated(node);
    std::stable_sort(results.begin(), results.end(),
                     [](const CellResult& a, const CellResult& b) { return a.firstZ < b.firstZ; });
    return withoutBorders(results);
  }

 private:
  /// size^3 bricks from `brick` on, and an expression that holds there.
  struct Cell {
    Vec3i brick;
    int size;
    NodePtr<T> node;
  };
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
  /// What stands at a brick position: a constant, an evaluated brick, or neither where it is not known yet.
  struct Standing {
    const Values* constant = nullptr;
    const Leaf* leaf = nullptr;
  };

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

  std::vector<Cell> cellsToEvaluate(const NodePtr<T>& node) {
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
      for (const auto& s : settled) settled_.insert(settled_.end(), s.begin(), s.end());
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

  std::vector<CellResult> evaluated(const NodePtr<T>& node) {
    std::vector<Cell> cells = cellsToEvaluate(node);
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
  bool isShared(const Leaf& leaf) const { return leaf.samples == backgroundSamples_.data(); }

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

  /// Number of a constant in the pool; a new one follows the others.
  std::int32_t constant(const Values& value) {
    const auto [found, isNew] = constantNumbers_.try_emplace(value, std::int32_t(constants_.size()));
    if (isNew) constants_.push_back(value);
    return found->second;
  }

  void enter(const Settled& settled) {
    const std::int32_t entry = constant(settled.value);
    const Vec3i end =
        min(settled.brick + Vec3i{settled.size, settled.size, settled.size}, places_.first + places_.count);
    for (int z = settled.brick.z; z < end.z; ++z)
      for (int y = settled.brick.y; y < end.y; ++y)
        std::fill_n(table_.begin() + std::ptrdiff_t(places_.numberOf({settled.brick.x, y, z})),
                    end.x - settled.brick.x, entry);
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

  /// The bricks that are no constants, in order; fills the table, for a pool in which they follow the
  /// constants.
  std::vector<Leaf> judged(const std::vector<CellResult>& results) {
    table_.assign(places_.size(), 0);
    constant(background_);
    for (const Settled& s : settled_) enter(s);
    std::vector<Leaf> leaves;
    for (const CellResult& result : results) {
      for (const Settled& s : result.settled) enter(s);
      for (const Leaf& leaf : result.leaves) {
        table_[places_.numberOf(leaf.brick)] = std::int32_t(-1 - std::int64_t(leaves.size()));
        leaves.push_back(leaf);
      }
    }
    // Table entries are constants, or -1 - leaf, until all leaves are judged.
    std::vector<std::optional<Values>> constants(leaves.size());
    parallelFor(leaves.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        constants[i] = collapsed(leaves[i], [&](const Vec3i& b) {
          const std::int32_t entry = table_[places_.numberOf(b)];
          return entry >= 0 ? Standing{&constants_[std::size_t(entry)]}
                            : Standing{nullptr, &leaves[std::size_t(-1 - entry)]};
        });
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      if (constants[i])
        table_[places_.numberOf(leaves[i].brick)] = constant(*constants[i]);
      else
        leaves[kept++] = leaves[i];
    }
    leaves.resize(kept);
    const std::size_t poolSize = constants_.size() + leaves.size();
    require(double(poolSize) < kMostBricks, "bake: too many bricks; use larger voxels");
    for (std::size_t i = 0; i < leaves.size(); ++i)
      table_[places_.numberOf(leaves[i].brick)] = std::int32_t(constants_.size() + i);
    return leaves;
  }

  Grids assemble(std::vector<CellResult>& results) {
    const std::vector<Leaf> leaves = judged(results);
    Grids grids;
    for (int c = 0; c < kLanes; ++c) grids[c] = emptyGrid(c, constants_.size() + leaves.size());
    move(leaves, results, grids);
    for (int c = 0; c < kLanes; ++c) {
      grids[c]->table = c + 1 < kLanes ? table_ : std::move(table_);
      fillBorders(*grids[c]);
    }
    return grids;
  }

  BrickSamples withoutBorders(std::vector<CellResult>& results) {
    const std::vector<Leaf> leaves = judged(results);
    BrickSamples all;
    all.voxelSize = options_.voxelSize;
    all.background = background_[0];
    all.places = places_;
    all.table = std::move(table_);
    SampleStore constants(constants_.size() * kOwn);
    for (std::size_t i = 0; i < constants_.size(); ++i) {
      all.pool.push_back(constants.data() + i * kOwn);
      std::fill_n(all.pool.back(), kOwn, constants_[i][0]);
      all.ranges.push_back(Interval::of(constants_[i][0]));
    }
    all.stores.push_back({std::move(constants), std::numeric_limits<int>::max()});
    for (const Leaf& leaf : leaves) {
      all.placed.push_back({std::int32_t(all.pool.size()), leaf.brick});
      all.pool.push_back(isShared(leaf) ? all.pool[0] : leaf.samples);
      all.ranges.push_back(leaf.range[0]);
    }
    for (CellResult& result : results)
      all.stores.push_back({std::move(result.samples), result.firstZ + kCellSize - 1});
    return all;
  }

  /// Everything but the table and the bricks that are not constant, for which room is reserved.
  std::shared_ptr<BrickGrid> emptyGrid(int component, std::size_t poolSize) const {
    auto grid = std::make_shared<BrickGrid>();
    grid->voxelSize = options_.voxelSize;
    grid->indexToWorld.linear = Mat3f::scaling(options_.voxelSize);
    grid->worldToIndex.linear = Mat3f::scaling(1.0f / options_.voxelSize);
    grid->background = background_[component];
    grid->firstBrick = places_.first;
    grid->brickCount = places_.count;
    detail::reserveLarge(grid->values, poolSize * BrickGrid::kVolume);
    for (const Values& value : constants_)
      grid->values.insert(grid->values.end(), BrickGrid::kVolume, value[component]);
    return grid;
  }

  /// Moves the samples of `leaves` into the pools and frees the cells' stores as they are done.
  void move(const std::vector<Leaf>& leaves, std::vector<CellResult>& results, Grids& grids) const {
    std::size_t cell = 0;
    for (std::size_t first = 0; first < leaves.size(); first += kBatch) {
      progress_.check();
      const std::size_t last = std::min(first + kBatch, leaves.size());
      for (auto& grid : grids) grid->values.resize((constants_.size() + last) * BrickGrid::kVolume);
      parallelFor(last - first, 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = first + begin; i < first + end; ++i)
          for (int c = 0; c < kLanes; ++c) {
            float* brick = grids[c]->brick(std::int32_t(constants_.size() + i));
            const float* own = leaves[i].samples + c * kOwn;
            for (int row = 0; row < kBrick * kBrick; ++row)
              std::copy_n(own + row * kBrick, kBrick, brick + sampleOffset(0, row % kBrick, row / kBrick));
          }
      });
      std::size_t next = last;
      while (next < leaves.size() && isShared(leaves[next])) ++next;
      const auto holdsNext = [&](const CellResult& r) {
        return next < leaves.size() && r.samples.contains(leaves[next].samples);
      };
      for (; cell < results.size() && !holdsNext(results[cell]); ++cell) results[cell].samples = {};
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
  std::vector<Settled> settled_;
  std::vector<std::int32_t> table_;
  std::vector<Values> constants_;
  std::map<Values, std::int32_t> constantNumbers_;
};

}  // namespace

std::shared_ptr<BrickGrid> bakeGrid(const ScalarField& field, const BakeOptions& options,
                                    const Progress& progress) {
  requireSane(options);
  return Baker<float>(options, progress).grids(field.node())[0];
}

BrickSamples detail::bakeSamples(const ScalarField& field, const BakeOptions& options,
                                 const Progress& progress) {
  requireSane(options);
  return Baker<float>(options, progress).samples(field.node());
}

ScalarField bake(const ScalarField& field, const BakeOptions& options, const Progress& progress) {
  return gridField(bakeGrid(field, options, progress), options.interpolation);
}

VectorField bake(const VectorField& field, const BakeOptions& options, const Progress& progress) {
  requireSane(options);
  require(options.band == Interval::everything(), "bake: a band has no meaning for vectors");
  const auto grids = Baker<Vec3f>(options, progress).grids(field.node());
  return gridField(VectorGrids{grids[0], grids[1], grids[2]}, options.interpolation);
}

}  // namespace nephele
