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

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/detail/bake_walk.h"
#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

using detail::BrickSamples;
using detail::SampleStore;

constexpr int kBrick = BrickGrid::kBrick;
/// Bricks moved to the pool at a time.
constexpr std::size_t kBatch = 4096;
/// Beyond this many voxels from the origin floats cannot tell neighbouring voxels apart.
constexpr double kFarthestVoxel = (1 << 24) - 64;

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

/// What a walk found, as grids.
template <class T>
class Baker {
 public:
  using Walk = detail::BakeWalk<T>;
  using Values = typename Walk::Values;
  using Settled = typename Walk::Settled;
  using Leaf = typename Walk::Leaf;
  using CellResult = typename Walk::CellResult;
  using Standing = typename Walk::Standing;
  using Grids = std::array<std::shared_ptr<BrickGrid>, Walk::kLanes>;

  Baker(const BakeOptions& options, const Progress& progress)
      : walk_(options, progress), progress_(progress) {}

  Grids grids(const NodePtr<T>& node) {
    std::vector<CellResult> results = walk_.evaluated(node, settled_);
    return assemble(results);
  }

  /// Of a field of numbers.
  BrickSamples samples(const NodePtr<T>& node) {
    std::vector<CellResult> results = walk_.evaluated(node, settled_);
    std::stable_sort(results.begin(), results.end(),
                     [](const CellResult& a, const CellResult& b) { return a.firstZ < b.firstZ; });
    return withoutBorders(results);
  }

 private:
  /// Number of a constant in the pool; a new one follows the others.
  std::int32_t constant(const Values& value) {
    const auto [found, isNew] = constantNumbers_.try_emplace(value, std::int32_t(constants_.size()));
    if (isNew) constants_.push_back(value);
    return found->second;
  }

  void enter(const Settled& settled) {
    const std::int32_t entry = constant(settled.value);
    const Vec3i end = min(settled.brick + Vec3i{settled.size, settled.size, settled.size},
                          walk_.places().first + walk_.places().count);
    table_.fill(settled.brick, end, entry);
  }

  /// The bricks that are no constants, in order; fills the table, for a pool in which they follow the
  /// constants.
  std::vector<Leaf> judged(const std::vector<CellResult>& results) {
    table_ = FlatBrickTable(walk_.places());
    constant(walk_.background());
    for (const Settled& s : settled_) enter(s);
    std::vector<Leaf> leaves;
    for (const CellResult& result : results) {
      for (const Settled& s : result.settled) enter(s);
      for (const Leaf& leaf : result.leaves) {
        table_[leaf.brick] = std::int32_t(-1 - std::int64_t(leaves.size()));
        leaves.push_back(leaf);
      }
    }
    // Table entries are constants, or -1 - leaf, until all leaves are judged.
    std::vector<std::optional<Values>> constants(leaves.size());
    parallelFor(leaves.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        constants[i] = walk_.collapsed(leaves[i], [&](const Vec3i& b) {
          const std::int32_t entry = table_[b];
          return entry >= 0 ? Standing{&constants_[std::size_t(entry)]}
                            : Standing{nullptr, &leaves[std::size_t(-1 - entry)]};
        });
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < leaves.size(); ++i) {
      if (constants[i])
        table_[leaves[i].brick] = constant(*constants[i]);
      else
        leaves[kept++] = leaves[i];
    }
    leaves.resize(kept);
    const std::size_t poolSize = constants_.size() + leaves.size();
    require(double(poolSize) < kMostBricks, "bake: too many bricks; use larger voxels");
    for (std::size_t i = 0; i < leaves.size(); ++i)
      table_[leaves[i].brick] = std::int32_t(constants_.size() + i);
    return leaves;
  }

  Grids assemble(std::vector<CellResult>& results) {
    const std::vector<Leaf> leaves = judged(results);
    Grids grids;
    for (int c = 0; c < Walk::kLanes; ++c) grids[c] = emptyGrid(c, constants_.size() + leaves.size());
    move(leaves, results, grids);
    for (int c = 0; c < Walk::kLanes; ++c) {
      grids[c]->setTable(c + 1 < Walk::kLanes ? table_.entries : std::move(table_.entries));
      fillBorders(*grids[c]);
    }
    return grids;
  }

  BrickSamples withoutBorders(std::vector<CellResult>& results) {
    const std::vector<Leaf> leaves = judged(results);
    BrickSamples all;
    all.voxelSize = walk_.options().voxelSize;
    all.background = walk_.background()[0];
    all.table = std::move(table_);
    SampleStore constants(constants_.size() * Walk::kOwn);
    for (std::size_t i = 0; i < constants_.size(); ++i) {
      all.pool.push_back(constants.data() + i * Walk::kOwn);
      std::fill_n(all.pool.back(), Walk::kOwn, constants_[i][0]);
      all.ranges.push_back(Interval::of(constants_[i][0]));
    }
    all.stores.push_back({std::move(constants), std::numeric_limits<int>::max()});
    for (const Leaf& leaf : leaves) {
      all.placed.push_back({std::int32_t(all.pool.size()), leaf.brick});
      all.pool.push_back(walk_.isShared(leaf) ? all.pool[0] : leaf.samples);
      all.ranges.push_back(leaf.range[0]);
    }
    for (CellResult& result : results)
      all.stores.push_back({std::move(result.samples), result.firstZ + Walk::kCellSize - 1});
    return all;
  }

  /// Everything but the table and the bricks that are not constant, for which room is reserved.
  std::shared_ptr<BrickGrid> emptyGrid(int component, std::size_t poolSize) const {
    auto grid = std::make_shared<BrickGrid>(Lattice::uniform(walk_.options().voxelSize), walk_.places(),
                                            walk_.background()[component]);
    grid->reserve(poolSize);
    for (std::size_t c = 1; c < constants_.size(); ++c) grid->appendConstant(constants_[c][component]);
    return grid;
  }

  /// Moves the samples of `leaves` into the pools and frees the cells' stores as they are done.
  void move(const std::vector<Leaf>& leaves, std::vector<CellResult>& results, Grids& grids) const {
    std::size_t cell = 0;
    for (std::size_t first = 0; first < leaves.size(); first += kBatch) {
      progress_.check();
      const std::size_t last = std::min(first + kBatch, leaves.size());
      for (auto& grid : grids) grid->append(last - first);
      parallelFor(last - first, 64, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = first + begin; i < first + end; ++i)
          for (int c = 0; c < Walk::kLanes; ++c) {
            float* brick = grids[c]->brick(std::int32_t(constants_.size() + i));
            const float* own = leaves[i].samples + c * Walk::kOwn;
            for (int row = 0; row < kBrick * kBrick; ++row)
              std::copy_n(own + row * kBrick, kBrick, brick + sampleOffset(0, row % kBrick, row / kBrick));
          }
      });
      std::size_t next = last;
      while (next < leaves.size() && walk_.isShared(leaves[next])) ++next;
      const auto holdsNext = [&](const CellResult& r) {
        return next < leaves.size() && r.samples.contains(leaves[next].samples);
      };
      for (; cell < results.size() && !holdsNext(results[cell]); ++cell) results[cell].samples = {};
    }
  }

  Walk walk_;
  const Progress& progress_;
  std::vector<Settled> settled_;
  FlatBrickTable table_;
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
