// OpenVDB trees to bricks and back.
//
// Reading: the dense table of brick positions is first filled with codes (a leaf, or one of the few constants
// that tiles hold). A position needs bricks of its own exactly if the 27 positions around it do not all hold
// one constant and its 11^3 samples differ: so a brick beside a leaf exists where interpolation reaches into
// that leaf. Leaves store z fastest, bricks x fastest: copies transpose. All passes but the filling of the
// table run on all cores, each piece writes its own places, and pool order is table order: the result does
// not depend on the threads.
//
// Writing builds each node of 16^3 leaves on its own, straight from the table, constant positions as tiles,
// so that no pruning or flood fill is needed.
//
// Limits: the table is dense, so two far-apart voxels cost the box between them; a limit refuses such grids.
#include <fmt/format.h>
#include <openvdb/tools/Count.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "nephele/levelset/grid/brick_table.h"
#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/levelset/io/detail/vdb_assembly.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kWidth = BrickGrid::kWidth;

using FloatTree = openvdb::FloatTree;

Vec3i brickOf(const openvdb::Coord& c) {
  return {c.x() >> 3, c.y() >> 3, c.z() >> 3};
}

std::string displayName(const openvdb::GridBase& grid) {
  return grid.getName().empty() ? "without a name" : "'" + grid.getName() + "'";
}

/// What stands at each brick position of a tree: code > 0 is leaf code - 1, code <= 0 is constant -code.
class TreeTable {
 public:
  TreeTable(const FloatTree& tree, const std::string& name) : background_(tree.background()) {
    require(std::isfinite(background_),
            fmt::format("grid {} has a background of {}, which must be finite", name, background_));
    constants_.push_back(background_);
    collect(tree);
    if (empty()) return;
    first_ -= Vec3i{1, 1, 1};
    last_ += Vec3i{1, 1, 1};
    requireHoldable("grid " + name, double(last_.x) - first_.x + 1, double(last_.y) - first_.y + 1,
                    double(last_.z) - first_.z + 1);
    codes_.assign(BrickBox{first(), count()}.size(), 0);
    fill(tree);
  }

  bool empty() const { return first_.x > last_.x; }
  Vec3i first() const { return first_; }
  Vec3i count() const { return empty() ? Vec3i{} : last_ - first_ + Vec3i{1, 1, 1}; }
  const std::vector<std::int32_t>& codes() const { return codes_; }
  const std::vector<float>& constants() const { return constants_; }
  const float* leaf(std::int32_t code) const { return leaves_[std::size_t(code) - 1]; }
  float constant(std::int32_t code) const { return constants_[std::size_t(-code)]; }

 private:
  void include(const Vec3i& low, const Vec3i& high) {
    first_ = min(first_, low);
    last_ = max(last_, high);
  }

  /// Finds the leaves and the box of everything that is not background.
  void collect(const FloatTree& tree) {
    for (auto upper = tree.root().cbeginChildOn(); upper; ++upper) {
      includeTiles(*upper);
      for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
        includeTiles(*lower);
        for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf) {
          const Vec3i b = brickOf(leaf->origin());
          include(b, b);
          leaves_.push_back(leaf->buffer().data());
        }
      }
    }
    for (auto tile = tree.root().cbeginValueAll(); tile; ++tile) {
      if (*tile == background_) continue;
      const Vec3i b = brickOf(tile.getCoord());
      include(b, b + Vec3i{511, 511, 511});
    }
  }

  template <class Node>
  void includeTiles(const Node& node) {
    constexpr int span = int(Node::ChildNodeType::DIM) / kBrick - 1;
    for (auto tile = node.cbeginValueAll(); tile; ++tile) {
      if (*tile == background_) continue;
      const Vec3i b = brickOf(tile.getCoord());
      include(b, b + Vec3i{span, span, span});
    }
  }

  void fill(const FloatTree& tree) {
    std::int32_t nextLeaf = 1;
    for (auto upper = tree.root().cbeginChildOn(); upper; ++upper) {
      fillTiles(*upper);
      for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
        fillTiles(*lower);
        for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf)
          codes_[index(brickOf(leaf->origin()))] = nextLeaf++;
      }
    }
    for (auto tile = tree.root().cbeginValueAll(); tile; ++tile)
      fillTile(brickOf(tile.getCoord()), 512, *tile);
  }

  template <class Node>
  void fillTiles(const Node& node) {
    constexpr int span = int(Node::ChildNodeType::DIM) / kBrick;
    for (auto tile = node.cbeginValueAll(); tile; ++tile) fillTile(brickOf(tile.getCoord()), span, *tile);
  }

  void fillTile(const Vec3i& low, int span, float value) {
    if (value == background_) return;
    const std::int32_t code = codeOf(value);
    for (int z = low.z; z < low.z + span; ++z)
      for (int y = low.y; y < low.y + span; ++y)
        std::fill_n(codes_.begin() + std::ptrdiff_t(index({low.x, y, z})), span, code);
  }

  std::int32_t codeOf(float value) {
    if (constants_[lastConstant_] != value) {
      const auto found = constantCodes_.find(value);
      lastConstant_ = found != constantCodes_.end() ? found->second : constants_.size();
      if (lastConstant_ == constants_.size()) {
        constantCodes_[value] = lastConstant_;
        constants_.push_back(value);
      }
    }
    return -std::int32_t(lastConstant_);
  }

  std::size_t index(const Vec3i& b) const {
    const Vec3i n = count();
    return (std::size_t(b.z - first_.z) * std::size_t(n.y) + std::size_t(b.y - first_.y)) * std::size_t(n.x) +
           std::size_t(b.x - first_.x);
  }

  float background_;
  Vec3i first_{std::numeric_limits<int>::max(), std::numeric_limits<int>::max(),
               std::numeric_limits<int>::max()};
  Vec3i last_{std::numeric_limits<int>::lowest(), std::numeric_limits<int>::lowest(),
              std::numeric_limits<int>::lowest()};
  std::vector<const float*> leaves_;
  std::vector<std::int32_t> codes_;
  std::vector<float> constants_;
  std::map<float, std::size_t> constantCodes_;
  std::size_t lastConstant_ = 0;
};

/// The codes of the 27 positions around one, x fastest.
using Neighbours = std::array<std::int32_t, 27>;

Neighbours neighboursOf(const TreeTable& tree, const Vec3i& p) {
  const Vec3i n = tree.count();
  Neighbours result;
  int k = 0;
  for (int dz = -1; dz <= 1; ++dz)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx, ++k) {
        const int x = p.x + dx, y = p.y + dy, z = p.z + dz;
        const bool inside = x >= 0 && y >= 0 && z >= 0 && x < n.x && y < n.y && z < n.z;
        result[std::size_t(k)] =
            inside ? tree.codes()[(std::size_t(z) * std::size_t(n.y) + std::size_t(y)) * std::size_t(n.x) +
                                  std::size_t(x)]
                   : 0;
      }
  return result;
}

/// Where the samples of a brick lie along one axis: in the neighbour before, in the brick, in the one after.
struct AxisPart {
  int target, source, count;
};
constexpr AxisPart kAxisParts[3] = {{0, kBrick - 1, 1}, {1, 0, kBrick}, {1 + kBrick, 0, 2}};

/// Copies the 11^3 samples around one position, times `sign`. The own 8^3 are done last and unrolled.
void gather(const TreeTable& tree, const Neighbours& around, float sign, float* target) {
  for (int k = 0; k < 27; ++k) {
    const AxisPart px = kAxisParts[k % 3], py = kAxisParts[k / 3 % 3], pz = kAxisParts[k / 9];
    const std::int32_t code = around[std::size_t(k)];
    float* out = target + (pz.target * kWidth + py.target) * kWidth + px.target;
    if (code <= 0) {
      const float value = sign * tree.constant(code);
      for (int z = 0; z < pz.count; ++z)
        for (int y = 0; y < py.count; ++y)
          for (int x = 0; x < px.count; ++x) out[(z * kWidth + y) * kWidth + x] = value;
    } else {
      const float* in = tree.leaf(code) + (px.source * kBrick + py.source) * kBrick + pz.source;
      for (int z = 0; z < pz.count; ++z)
        for (int y = 0; y < py.count; ++y)
          for (int x = 0; x < px.count; ++x)
            out[(z * kWidth + y) * kWidth + x] = sign * in[(x * kBrick + y) * kBrick + z];
    }
  }
}

Interval rangeOfSamples(const float* samples, int count) {
  // Independent lanes let the compiler keep minima and maxima in vector registers.
  constexpr int kLanes = 16;
  float low[kLanes], high[kLanes];
  std::fill_n(low, kLanes, std::numeric_limits<float>::infinity());
  std::fill_n(high, kLanes, -std::numeric_limits<float>::infinity());
  int i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (int l = 0; l < kLanes; ++l) {
      low[l] = samples[i + l] < low[l] ? samples[i + l] : low[l];
      high[l] = samples[i + l] > high[l] ? samples[i + l] : high[l];
    }
  for (; i < count; ++i) {
    low[0] = std::min(low[0], samples[i]);
    high[0] = std::max(high[0], samples[i]);
  }
  return {*std::min_element(low, low + kLanes), *std::max_element(high, high + kLanes)};
}

void requireFinite(const float* samples, int count, const std::string& gridName) {
  std::uint32_t bad = 0;
  for (int i = 0; i < count; ++i)
    bad |= std::uint32_t((std::bit_cast<std::uint32_t>(samples[i]) & 0x7f800000u) == 0x7f800000u);
  if (bad) throw Error(fmt::format("grid '{}' holds values that are not finite", gridName));
}

}  // namespace

namespace detail {

openvdb::FloatGrid::Ptr toFloatGrid(const openvdb::GridBase::Ptr& grid) {
  if (grid->isType<openvdb::FloatGrid>()) return openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
  if (grid->isType<openvdb::DoubleGrid>())
    return std::make_shared<openvdb::FloatGrid>(*openvdb::gridConstPtrCast<openvdb::DoubleGrid>(grid));
  return nullptr;
}

openvdb::FloatGrid::ConstPtr floatGrid(const VdbGrid& grid) {
  const openvdb::FloatGrid::Ptr result = toFloatGrid(grid.impl().grid);
  require(result != nullptr, fmt::format("grid {} holds {} values; a scalar (float or double) grid is needed",
                                         displayName(*grid.impl().grid), grid.impl().grid->valueType()));
  return result;
}

Affine affineOf(const openvdb::GridBase& grid) {
  require(grid.transform().isLinear(),
          fmt::format("grid {} has a frustum transform; resample it to a linear one", displayName(grid)));
  const openvdb::Mat4d m = grid.transform().baseMap()->getAffineMap()->getMat4();
  Affine result;
  // OpenVDB multiplies row vectors from the left.
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) result.linear(r, c) = float(m(c, r));
    result.translation[r] = float(m(3, r));
  }
  const float d = determinant(result.linear);
  require(std::isfinite(d) && d != 0.0f && isFinite(result.translation),
          fmt::format("grid {} has a transform that is singular or not finite", displayName(grid)));
  return result;
}

}  // namespace detail

namespace {

/// Places in the world are floats: where these are coarse beside the voxels between `first` and `last`, the
/// grid would lie elsewhere, and its voxels upon each other.
void requireResolvedVoxels(const openvdb::GridBase& grid, const Vec3i& first, const Vec3i& last) {
  constexpr double kMostOfAVoxel = 0.125;
  const openvdb::Mat4d m = grid.transform().baseMap()->getAffineMap()->getMat4();
  double farthest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    double reach = std::abs(m(3, axis));
    for (int c = 0; c < 3; ++c)
      reach += std::abs(m(c, axis)) * std::max(std::abs(double(first[c])), std::abs(double(last[c])));
    farthest = std::max(farthest, reach);
  }
  const double voxel = std::cbrt(std::abs(m.det()));
  const double error = farthest * double(std::numeric_limits<float>::epsilon()) / 2 / voxel;
  require(
      error <= kMostOfAVoxel,
      fmt::format("grid {} lies as far as {:.6g} from the origin, with voxels of {:.6g}: single precision "
                  "would move them by up to {:.2g} of their size; move the grid nearer to the origin",
                  displayName(grid), farthest, voxel, error));
}

}  // namespace

std::shared_ptr<BrickGrid> toBricks(const VdbGrid& grid) {
  const openvdb::FloatGrid::ConstPtr source = detail::floatGrid(grid);
  const std::string name = displayName(*source);
  const float sign = source->getGridClass() == openvdb::GRID_LEVEL_SET ? -1.0f : 1.0f;
  const TreeTable tree(source->tree(), name);

  auto result = std::make_shared<BrickGrid>();
  result->indexToWorld = detail::affineOf(*source);
  if (!tree.empty())
    requireResolvedVoxels(*source, tree.first() * kBrick, (tree.first() + tree.count()) * kBrick);
  result->worldToIndex = inverse(result->indexToWorld);
  result->voxelSize = std::cbrt(std::abs(determinant(result->indexToWorld.linear)));
  result->background = sign * source->background();
  result->firstBrick = tree.empty() ? Vec3i{} : tree.first();
  result->brickCount = tree.count();

  // A constant that tiles hold keeps its code; positions with samples of their own come after the constants.
  const Vec3i n = tree.count();
  const std::vector<float>& constants = tree.constants();
  const std::size_t rowLength = std::size_t(n.x);
  const std::size_t rowCount = std::size_t(n.y) * std::size_t(n.z);
  result->table.resize(rowLength * rowCount);
  std::vector<std::uint32_t> rowStart(rowCount + 1, 0);
  parallelFor(rowCount, 16, [&](std::size_t begin, std::size_t end) {
    float samples[BrickGrid::kVolume];
    std::vector<std::uint8_t> mixed(rowLength);
    for (std::size_t row = begin; row < end; ++row) {
      const int y = int(row % std::size_t(n.y)), z = int(row / std::size_t(n.y));
      const std::int32_t* own = tree.codes().data() + row * rowLength;
      std::fill(mixed.begin(), mixed.end(), std::uint8_t(0));
      const auto compare = [&](const std::int32_t* other) {
        for (std::size_t x = 0; x < rowLength; ++x)
          mixed[x] |= std::uint8_t((other ? other[x] : 0) != own[x]) |
                      std::uint8_t((other && x > 0 ? other[x - 1] : 0) != own[x]) |
                      std::uint8_t((other && x + 1 < rowLength ? other[x + 1] : 0) != own[x]);
      };
      for (int dz = -1; dz <= 1; ++dz)
        for (int dy = -1; dy <= 1; ++dy) {
          const bool inside = y + dy >= 0 && y + dy < n.y && z + dz >= 0 && z + dz < n.z;
          compare(inside ? own + (std::ptrdiff_t(dz) * n.y + dy) * n.x : nullptr);
        }
      std::uint32_t used = 0;
      for (std::size_t x = 0; x < rowLength; ++x) {
        std::int32_t& entry = result->table[row * rowLength + x];
        entry = own[x] > 0 ? 0 : -own[x];
        if (!mixed[x]) continue;
        if (own[x] <= 0) {
          // Beside a leaf: only needed if a sample that interpolation reads differs.
          gather(tree, neighboursOf(tree, {int(x), y, z}), 1.0f, samples);
          const float value = tree.constant(own[x]);
          if (std::all_of(samples, samples + BrickGrid::kVolume, [&](float s) { return s == value; }))
            continue;
        }
        entry = -1;
        ++used;
      }
      rowStart[row + 1] = used;
    }
  });
  for (std::size_t row = 0; row < rowCount; ++row) rowStart[row + 1] += rowStart[row];

  const std::size_t pool = constants.size() + rowStart[rowCount];
  require(pool <= std::size_t(std::numeric_limits<std::int32_t>::max()),
          fmt::format("grid {} has more bricks than can be numbered; use a coarser voxel size", name));
  detail::resizeLarge(result->values, pool * BrickGrid::kVolume);
  result->ranges.resize(pool);
  for (std::size_t c = 0; c < constants.size(); ++c) {
    std::fill_n(result->brick(std::int32_t(c)), BrickGrid::kVolume, sign * constants[c]);
    result->ranges[c] = Interval::of(sign * constants[c]);
    requireFinite(&constants[c], 1, source->getName());
  }
  parallelFor(rowCount, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      auto next = std::int32_t(constants.size() + rowStart[row]);
      if (rowStart[row + 1] == rowStart[row]) continue;
      for (std::size_t x = 0; x < rowLength; ++x) {
        std::int32_t& entry = result->table[row * rowLength + x];
        if (entry != -1) continue;
        entry = next++;
        const Vec3i p{int(x), int(row % std::size_t(n.y)), int(row / std::size_t(n.y))};
        float* samples = result->brick(entry);
        gather(tree, neighboursOf(tree, p), sign, samples);
        requireFinite(samples, BrickGrid::kVolume, source->getName());
        result->ranges[std::size_t(entry)] = rangeOfSamples(samples, BrickGrid::kVolume);
      }
    }
  });
  return result;
}

namespace {

/// How a stored sample becomes a value of the file, and which values are active.
struct FileValues {
  float sign = 1.0f;
  float low = 0.0f;
  float high = 0.0f;
  float background = 0.0f;
  VdbGridInfo::Class gridClass = VdbGridInfo::Class::unknown;

  float operator()(float sample) const { return std::clamp(sign * sample, low, high); }
  bool isActive(float value) const {
    switch (gridClass) {
      case VdbGridInfo::Class::levelSet:
        return value > low && value < high;
      case VdbGridInfo::Class::fogVolume:
        return value > 0.0f;
      default:
        return value != background;
    }
  }
};

FileValues fileValuesOf(const BrickGrid& bricks, const VdbGridLabel& label) {
  constexpr float kUnbounded = std::numeric_limits<float>::infinity();
  const std::string name = label.name.empty() ? "without a name" : "'" + label.name + "'";
  switch (label.gridClass) {
    case VdbGridInfo::Class::levelSet: {
      require(bricks.background < 0.0f,
              fmt::format("grid {}: a level set must be negative outside, but its background is {}", name,
                          bricks.background));
      // Where the band ends earlier on the inside, the file's band ends there on both sides.
      float halfWidth = -bricks.background;
      for (const Interval& r : bricks.ranges)
        if (r.isPoint() && r.min > 0.0f) halfWidth = std::min(halfWidth, r.min);
      return {-1.0f, -halfWidth, halfWidth, halfWidth, label.gridClass};
    }
    case VdbGridInfo::Class::fogVolume:
      require(bricks.background == 0.0f,
              fmt::format("grid {}: a fog volume must be 0 outside, but its background is {}", name,
                          bricks.background));
      return {1.0f, 0.0f, kUnbounded, 0.0f, label.gridClass};
    default:
      return {1.0f, -kUnbounded, kUnbounded, bricks.background, label.gridClass};
  }
}

openvdb::math::Transform::Ptr transformOf(const Affine& map) {
  const Mat3f& a = map.linear;
  const openvdb::Vec3d t(map.translation.x, map.translation.y, map.translation.z);
  const float s = a(0, 0);
  if (s > 0.0f && a == Mat3f::scaling(s)) {
    auto transform = openvdb::math::Transform::createLinearTransform(double(s));
    if (!t.isZero()) transform->postTranslate(t);
    return transform;
  }
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) matrix(c, r) = a(r, c);
    matrix(3, r) = t[r];
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

openvdb::GridClass fileClass(VdbGridInfo::Class gridClass) {
  switch (gridClass) {
    case VdbGridInfo::Class::levelSet:
      return openvdb::GRID_LEVEL_SET;
    case VdbGridInfo::Class::fogVolume:
      return openvdb::GRID_FOG_VOLUME;
    case VdbGridInfo::Class::staggered:
      return openvdb::GRID_STAGGERED;
    default:
      return openvdb::GRID_UNKNOWN;
  }
}

}  // namespace

VdbGrid toVdb(const BrickGrid& bricks, const VdbGridLabel& label) {
  require(!bricks.isPacked(), "toVdb: the grid must not be packed");
  detail::initializeOpenVdb();
  const FileValues fileValues = fileValuesOf(bricks, label);
  auto grid = openvdb::FloatGrid::create(fileValues.background);
  grid->setName(label.name);
  grid->setGridClass(fileClass(label.gridClass));
  grid->setSaveFloatAsHalf(label.halfFloat);
  grid->setTransform(transformOf(bricks.indexToWorld));

  detail::assembleTree(grid->tree(), bricks.firstBrick, bricks.brickCount,
                       [&](const Vec3i& position, const openvdb::Coord& origin) -> detail::LeafOrTile {
                         const std::int32_t pool = bricks.table[bricks.tableIndex(position)];
                         const auto isActive = [&](float value) { return fileValues.isActive(value); };
                         if (bricks.ranges[std::size_t(pool)].isPoint()) {
                           const float constant = fileValues(bricks.brick(pool)[0]);
                           requireFinite(&constant, 1, label.name);
                           return {nullptr, constant, isActive(constant)};
                         }
                         const float* own = bricks.brick(pool) + (kWidth + 1) * kWidth + 1;
                         float values[detail::FloatLeaf::SIZE];
                         for (int z = 0; z < kBrick; ++z)
                           for (int y = 0; y < kBrick; ++y)
                             for (int x = 0; x < kBrick; ++x)
                               values[(x * kBrick + y) * kBrick + z] =
                                   fileValues(own[(z * kWidth + y) * kWidth + x]);
                         requireFinite(values, int(detail::FloatLeaf::SIZE), label.name);
                         return detail::leafOf(values, origin, isActive);
                       });
  return detail::wrapGrid(grid);
}

VdbGridInfo describe(const VdbGrid& handle) {
  const openvdb::GridBase& grid = *handle.impl().grid;
  VdbGridInfo info;
  info.name = grid.getName();
  info.type = grid.valueType();
  switch (grid.getGridClass()) {
    case openvdb::GRID_LEVEL_SET:
      info.gridClass = VdbGridInfo::Class::levelSet;
      break;
    case openvdb::GRID_FOG_VOLUME:
      info.gridClass = VdbGridInfo::Class::fogVolume;
      break;
    case openvdb::GRID_STAGGERED:
      info.gridClass = VdbGridInfo::Class::staggered;
      break;
    default:
      break;
  }
  info.activeVoxels = grid.activeVoxelCount();
  if (const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox(); !box.empty()) {
    info.indexMin = {box.min().x(), box.min().y(), box.min().z()};
    info.indexMax = {box.max().x(), box.max().y(), box.max().z()};
  }
  const openvdb::Vec3d size = grid.voxelSize();
  info.voxelSize = {float(size.x()), float(size.y()), float(size.z())};
  if (const auto linear =
          grid.transform().isLinear() ? grid.transform().baseMap()->getAffineMap() : nullptr) {
    const openvdb::Mat3d m = linear->getMat4().getMat3();
    const openvdb::Mat3d difference = m - openvdb::Mat3d::identity() * m(0, 0);
    info.uniform = difference.absMax() <= 1e-9 * std::abs(m(0, 0));
  } else {
    info.uniform = false;
  }
  const auto scalar = [&](const auto& typed) {
    info.background = float(typed.background());
    const auto extrema = openvdb::tools::minMax(typed.tree());
    info.valueMin = info.activeVoxels > 0 ? float(extrema.min()) : 0.0f;
    info.valueMax = info.activeVoxels > 0 ? float(extrema.max()) : 0.0f;
  };
  if (grid.isType<openvdb::FloatGrid>()) scalar(static_cast<const openvdb::FloatGrid&>(grid));
  if (grid.isType<openvdb::DoubleGrid>()) scalar(static_cast<const openvdb::DoubleGrid&>(grid));
  info.halfFloat = grid.saveFloatAsHalf();
  info.memoryBytes = grid.memUsage();
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry)
    info.metadata[entry->first] = entry->second->str();
  return info;
}

}  // namespace nephele
