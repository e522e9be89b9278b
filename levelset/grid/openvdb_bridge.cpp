// Reading: the dense table of brick positions is filled with codes (a leaf, or one of the few constants that
// tiles hold), from which bricks are gathered. Leaves store z fastest, bricks x fastest: copies transpose.
//
// Writing builds each node of 16^3 leaves on its own, straight from the table, constant positions as tiles,
// so that no pruning or flood fill is needed.
//
// Limits: the table is dense, so two far-apart voxels cost the box between them; limits refuse such grids.
#include "nephele/levelset/grid/openvdb_bridge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <sstream>

#include "nephele/levelset/grid/detail/block_table.h"
#include "nephele/levelset/grid/openvdb_assembly.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::detail {

namespace {

using openvdb::FloatTree;

constexpr int kBrick = BrickGrid::kBrick;
constexpr int kWidth = BrickGrid::kWidth;
constexpr double kMostInTiles = 1e8;
/// Places of a table that any grid may have, 256 MB of them, and those for each of its leaves and tiles: a
/// small file must not take the memory of a large one.
constexpr double kPlaces = 1 << 26, kPlacesOfAPart = 256;

Vec3i brickOf(const openvdb::Coord& c) {
  return {c.x() >> 3, c.y() >> 3, c.z() >> 3};
}

bool holdsAnything(const FloatTree::LeafNodeType& leaf, float background) {
  const float* values = leaf.buffer().data();
  return !leaf.isEmpty() ||
         std::any_of(values, values + leaf.SIZE, [&](float value) { return value != background; });
}

/// visitTile(first brick, bricks along an axis, value), for all tiles that are not background, and
/// visitLeaf(brick, leaf), likewise. Inactive tiles are the inside of level sets, and in fog they are
/// nothing.
template <class VisitTile, class VisitLeaf>
void forEachPart(const openvdb::FloatGrid& grid, const VisitTile& visitTile, const VisitLeaf& visitLeaf) {
  const FloatTree& tree = grid.tree();
  const float background = tree.background();
  const bool isFog = grid.getGridClass() == openvdb::GRID_FOG_VOLUME;
  const auto visitTiles = [&](const auto& node, int span) {
    for (auto tile = node.cbeginValueAll(); tile; ++tile)
      if (*tile != background && (tile.isValueOn() || !isFog))
        visitTile(brickOf(tile.getCoord()), span, *tile);
  };
  for (auto upper = tree.root().cbeginChildOn(); upper; ++upper) {
    visitTiles(*upper, 16);
    for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
      visitTiles(*lower, 1);
      for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf)
        if (holdsAnything(*leaf, background)) visitLeaf(brickOf(leaf->origin()), *leaf);
    }
  }
  visitTiles(tree.root(), 512);
}

/// What stands at each brick position of a grid.
BlockTable blocksOf(const openvdb::FloatGrid& grid, const std::string& name) {
  const FloatTree& tree = grid.tree();
  BlockTable result;
  result.order = BlockTable::Order::zFastest;
  require(std::isfinite(tree.background()),
          fmt::format("grid {} has a background of {}, which must be finite", name, tree.background()));
  result.constants = {tree.background()};
  constexpr int kFar = std::numeric_limits<int>::max();
  Vec3i first{kFar, kFar, kFar}, last{-kFar, -kFar, -kFar};
  double parts = 0;
  const auto include = [&](const Vec3i& low, int span) {
    ++parts;
    first = min(first, low);
    last = max(last, low + Vec3i{span - 1, span - 1, span - 1});
  };
  forEachPart(
      grid, [&](const Vec3i& low, int span, float) { include(low, span); },
      [&](const Vec3i& brick, const auto& leaf) {
        include(brick, 1);
        result.blocks.push_back(leaf.buffer().data());
      });
  if (first.x > last.x) return result;
  const Vec3i one{1, 1, 1};
  first -= one;
  last += one;
  const Vec3d sides = Vec3d(last) - Vec3d(first) + Vec3d{1, 1, 1};
  requireHoldable("grid " + name, sides.x, sides.y, sides.z);
  require(
      sides.x * sides.y * sides.z <= kPlaces + kPlacesOfAPart * parts,
      fmt::format(
          "grid {} has {:.0f} bricks and tiles in a box of {:.0f} x {:.0f} x {:.0f} voxels, which are too "
          "few for one so large; split it into grids of what lies together",
          name, parts, sides.x * kBrick, sides.y * kBrick, sides.z * kBrick));
  result.codes = FlatBrickTable({first, last - first + one});

  std::map<float, std::int32_t> codes;
  const auto codeOf = [&](float value) {
    const auto [found, isNew] = codes.try_emplace(value, -std::int32_t(result.constants.size()));
    if (isNew) result.constants.push_back(value);
    return found->second;
  };
  std::int32_t nextLeaf = 1;
  float lastValue = tree.background();
  std::int32_t lastCode = 0;
  forEachPart(
      grid,
      [&](const Vec3i& low, int span, float value) {
        if (value != lastValue) {
          lastValue = value;
          lastCode = codeOf(value);
        }
        result.codes.fill(low, low + Vec3i{span, span, span}, lastCode);
      },
      [&](const Vec3i& brick, const auto&) { result.codes[brick] = nextLeaf++; });
  return result;
}

/// Places in the world are floats: where these are coarse beside the voxels between `first` and `last`, the
/// grid would lie elsewhere, and its voxels upon each other.
void requireResolvedVoxels(const openvdb::GridBase& grid, const Vec3i& first, const Vec3i& last) {
  constexpr double kMostOfAVoxel = 0.125;
  const openvdb::Mat4d m = matrixOf(grid.transform());
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

/// x fastest to z fastest.
template <class Target, class Source>
void transpose(const Source* samples, int rowLength, int sliceLength, Target* leaf) {
  for (int z = 0; z < kBrick; ++z)
    for (int y = 0; y < kBrick; ++y)
      for (int x = 0; x < kBrick; ++x)
        leaf[leafOffset(x, y, z)] = Target(samples[z * sliceLength + y * rowLength + x]);
}

/// A leaf or a tile of samples whose rows and slices follow at these distances.
LeafOrTile<float> leafOfSamples(const float* samples, int rowLength, int sliceLength,
                                const openvdb::Coord& origin, const TreeValues& treeValues,
                                const std::string& name) {
  float values[kBrickSamples];
  transpose(samples, rowLength, sliceLength, values);
  for (float& value : values) value = treeValues(value);
  requireFinite(values, kBrickSamples, name);
  return leafOf(values, origin, [&](float value) { return treeValues.isActive(value); });
}

LeafOrTile<float> tileOf(float constant, const TreeValues& values, const std::string& name) {
  const float value = values(constant);
  requireFinite(&value, 1, name);
  return {nullptr, value, values.isActive(value)};
}

TreeValues levelSetOf(float background, float halfWidth, const std::string& name) {
  require(background < 0.0f,
          fmt::format("grid {}: a level set must be negative outside, but its background is {}",
                      displayName(name), background));
  return {-1.0f, -halfWidth, halfWidth, halfWidth, TreeValues::Active::insideBand};
}

openvdb::Coord originOf(const Vec3i& brick) {
  return {brick.x * kBrick, brick.y * kBrick, brick.z * kBrick};
}

/// Fills `tree` with voxels, `makeLeaf(samples, origin)` and `makeTile(constant)` being what bricks become.
/// The samples of a part are given back once its leaves are made, so that there is never room needed for
/// both.
template <class Tree, class Value, class MakeLeaf, class MakeTile>
void assemble(Tree& tree, VoxelGrid<Value>& voxels, const MakeLeaf& makeLeaf, const MakeTile& makeTile) {
  using Entry = LeafOrTile<typename Tree::ValueType>;
  std::vector<std::optional<Vec3i>> bricks(voxels.sampledBricks());
  voxels.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    if (entry >= 0) bricks[std::size_t(entry)] = brick;
  });
  std::vector<Entry> leaves(bricks.size());
  constexpr std::size_t kTogether = VoxelGrid<Value>::kTogether;
  parallelFor((bricks.size() + kTogether - 1) / kTogether, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      const std::size_t first = part * kTogether, last = std::min(first + kTogether, bricks.size());
      for (std::size_t i = first; i < last; ++i)
        if (bricks[i]) leaves[i] = makeLeaf(voxels.samples(std::int32_t(i)), originOf(*bricks[i]));
      voxels.releaseSamples(first, last);
    }
  });
  const BrickBox box = voxels.box();
  assembleTree(tree, box.first, box.count, [&](const Vec3i& brick, const openvdb::Coord&) -> Entry {
    const std::int32_t entry = voxels.entryAt(brick);
    if (entry < 0) return makeTile(voxels.constants()[std::size_t(-1 - entry)]);
    return std::move(leaves[std::size_t(entry)]);
  });
}

}  // namespace

void initializeOpenVdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

std::string displayName(const std::string& name) {
  return name.empty() ? "without a name" : "'" + printable(name, 80) + "'";
}

std::string displayName(const openvdb::GridBase& grid) {
  return displayName(grid.getName());
}

openvdb::Mat4d matrixOf(const openvdb::math::Transform& transform) {
  const openvdb::math::MapBase& map = *transform.baseMap();
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  for (int axis = 0; axis < 3; ++axis) {
    openvdb::Vec3d unit(0.0);
    unit[axis] = 1.0;
    const openvdb::Vec3d side = map.applyJacobian(unit);
    for (int c = 0; c < 3; ++c) matrix(axis, c) = side[c];
  }
  const openvdb::Vec3d origin = map.applyMap(openvdb::Vec3d(0.0));
  for (int c = 0; c < 3; ++c) matrix(3, c) = origin[c];
  return matrix;
}

openvdb::math::Transform::Ptr uniformTransform(double voxelSize, const openvdb::Vec3d& translation) {
  using openvdb::math::Transform, openvdb::math::UniformScaleMap, openvdb::math::UniformScaleTranslateMap;
  // Below it OpenVDB takes the volume of a voxel for zero.
  constexpr double kLeast = 2e-5;
  if (voxelSize >= kLeast) {
    auto transform = Transform::createLinearTransform(voxelSize);
    if (!translation.isZero()) transform->postTranslate(translation);
    return transform;
  }
  // As it would be read from a file, which needs no constructor.
  std::stringstream bytes;
  const double inverse = 1 / voxelSize;
  if (!translation.isZero()) translation.write(bytes);
  for (const double value : {voxelSize, voxelSize, inverse, inverse * inverse, inverse / 2})
    openvdb::Vec3d(value).write(bytes);
  const openvdb::math::MapBase::Ptr map =
      translation.isZero() ? UniformScaleMap::create() : UniformScaleTranslateMap::create();
  map->read(bytes);
  return std::make_shared<Transform>(map);
}

Lattice latticeOf(const openvdb::GridBase& grid) {
  require(grid.transform().isLinear(),
          fmt::format("grid {} has a frustum transform; resample it to a linear one", displayName(grid)));
  const openvdb::Mat4d m = matrixOf(grid.transform());
  Affine map;
  // OpenVDB multiplies row vectors from the left.
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) map.linear(r, c) = float(m(c, r));
    map.translation[r] = float(m(3, r));
  }
  const float d = determinant(map.linear);
  require(std::isfinite(d) && d != 0.0f && isFinite(map.translation),
          fmt::format("grid {} has a transform that is singular or not finite", displayName(grid)));
  return {map, inverse(map), std::cbrt(std::abs(d))};
}

openvdb::math::Transform::Ptr transformOf(const Lattice& lattice, double voxelSize) {
  const Mat3f& a = lattice.indexToWorld.linear;
  const Vec3f& translation = lattice.indexToWorld.translation;
  const openvdb::Vec3d t(translation.x, translation.y, translation.z);
  const float s = a(0, 0);
  if (s > 0.0f && a == Mat3f::scaling(s))
    return uniformTransform(s == float(voxelSize) ? voxelSize : double(s), t);
  openvdb::Mat4d matrix = openvdb::Mat4d::identity();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) matrix(c, r) = a(r, c);
    matrix(3, r) = t[r];
  }
  return openvdb::math::Transform::createLinearTransform(matrix);
}

std::shared_ptr<BrickGrid> bricksOf(const openvdb::FloatGrid& grid, float sign, const BrickSink& made) {
  const std::string name = displayName(grid);
  BlockTable blocks = blocksOf(grid, name);
  blocks.sign = sign;
  const Lattice lattice = latticeOf(grid);
  if (const BrickBox& box = blocks.codes.box; box.size() > 0)
    requireResolvedVoxels(grid, box.first * kBrick, (box.first + box.count) * kBrick);
  return gatherBricks(blocks, lattice, Beside::varying, name, made);
}

VoxelGrid<float> voxelsOf(const openvdb::FloatGrid& grid, double voxelSize, const Vec3i& origin, float sign) {
  VoxelGrid<float> result(displayName(grid), voxelSize, sign * grid.background());
  forEachPart(
      grid,
      [&](const Vec3i& low, int span, float value) {
        for (int z = 0; z < span; ++z)
          for (int y = 0; y < span; ++y)
            for (int x = 0; x < span; ++x) result.setConstant(origin + low + Vec3i{x, y, z}, sign * value);
      },
      [&](const Vec3i& brick, const auto& leaf) {
        float* target = result.add(origin + brick);
        const float* values = leaf.buffer().data();
        for (int z = 0; z < kBrick; ++z)
          for (int y = 0; y < kBrick; ++y)
            for (int x = 0; x < kBrick; ++x) *target++ = sign * values[leafOffset(x, y, z)];
      });
  return result;
}

VoxelGrid<Vec3f> voxelsOf(const openvdb::Vec3SGrid& grid) {
  const std::string name = displayName(grid);
  const openvdb::Vec3s& background = grid.background();
  VoxelGrid<Vec3f> result(name, latticeOf(grid), Vec3f{background.x(), background.y(), background.z()});
  const auto inTiles = double(grid.activeVoxelCount() - grid.tree().activeLeafVoxelCount());
  require(inTiles <= kMostInTiles,
          fmt::format("grid {} has tiles of {:.3g} voxels, which are held one by one in grids of vectors; "
                      "allowed: up to {:.3g}",
                      name, inTiles, kMostInTiles));
  // A copy, for tiles become leaves.
  const auto whole = grid.deepCopy();
  whole->tree().voxelizeActiveTiles();
  for (auto leaf = whole->tree().cbeginLeaf(); leaf; ++leaf) {
    Vec3f* target = result.add(brickOf(leaf->origin()));
    for (int z = 0; z < kBrick; ++z)
      for (int y = 0; y < kBrick; ++y)
        for (int x = 0; x < kBrick; ++x) {
          const openvdb::Vec3s& v = leaf->getValue(openvdb::Index(leafOffset(x, y, z)));
          require(v.isFinite(), fmt::format("grid {} holds values that are not finite", name));
          *target++ = {v.x(), v.y(), v.z()};
        }
  }
  return result;
}

TreeValues TreeValues::levelSet(const BrickGrid& bricks, const std::string& name) {
  // Where the band ends earlier on the inside, it ends there on both sides.
  float halfWidth = -bricks.background();
  for (const Interval& r : bricks.ranges())
    if (r.isPoint() && r.min > 0.0f) halfWidth = std::min(halfWidth, r.min);
  return levelSetOf(bricks.background(), halfWidth, name);
}

TreeValues TreeValues::levelSet(const VoxelGrid<float>& voxels, const std::string& name) {
  float halfWidth = -voxels.background();
  for (const float constant : voxels.constants())
    if (constant > 0.0f) halfWidth = std::min(halfWidth, constant);
  return levelSetOf(voxels.background(), halfWidth, name);
}

TreeValues TreeValues::fog() {
  return {1.0f, 0.0f, std::numeric_limits<float>::infinity(), 0.0f, Active::positive};
}

TreeValues TreeValues::asTheyAre(float background) {
  constexpr float kUnbounded = std::numeric_limits<float>::infinity();
  return {1.0f, -kUnbounded, kUnbounded, background, Active::notBackground};
}

TreeValues TreeValues::negated(float background) {
  TreeValues result = asTheyAre(-background);
  result.sign = -1.0f;
  return result;
}

openvdb::FloatGrid::Ptr toOpenVdb(const BrickGrid& bricks, const TreeValues& values,
                                  const std::string& name) {
  initializeOpenVdb();
  auto grid = openvdb::FloatGrid::create(values.background);
  grid->setTransform(transformOf(bricks.lattice(), double(bricks.voxelSize())));
  assembleTree(grid->tree(), bricks.firstBrick(), bricks.brickCount(),
               [&](const Vec3i& brick, const openvdb::Coord& origin) {
                 const std::int32_t pool = bricks.table()[bricks.tableIndex(brick)];
                 if (bricks.ranges()[std::size_t(pool)].isPoint())
                   return tileOf(bricks.brick(pool)[0], values, name);
                 return leafOfSamples(bricks.brick(pool) + sampleOffset(0, 0, 0), kWidth, kWidth * kWidth,
                                      origin, values, name);
               });
  return grid;
}

openvdb::FloatGrid::Ptr toOpenVdb(VoxelGrid<float>&& voxels, const TreeValues& values,
                                  const std::string& name) {
  initializeOpenVdb();
  auto grid = openvdb::FloatGrid::create(values.background);
  grid->setTransform(transformOf(voxels.lattice(), voxels.voxelSize()));
  assemble(
      grid->tree(), voxels,
      [&](const float* samples, const openvdb::Coord& origin) {
        return leafOfSamples(samples, kBrick, kBrick * kBrick, origin, values, name);
      },
      [&](float constant) { return tileOf(constant, values, name); });
  return grid;
}

openvdb::Vec3SGrid::Ptr toOpenVdb(VoxelGrid<Vec3f>&& voxels, const std::string& name) {
  initializeOpenVdb();
  const auto turned = [](const Vec3f& v) { return openvdb::Vec3s(v.x, v.y, v.z); };
  auto grid = openvdb::Vec3SGrid::create(turned(voxels.background()));
  grid->setTransform(transformOf(voxels.lattice(), voxels.voxelSize()));
  using Entry = LeafOrTile<openvdb::Vec3s>;
  assemble(
      grid->tree(), voxels,
      [&](const Vec3f* samples, const openvdb::Coord& origin) -> Entry {
        auto leaf = std::make_unique<TreeParts<openvdb::Vec3s>::Leaf>(origin, grid->background(), true);
        for (int z = 0; z < kBrick; ++z)
          for (int y = 0; y < kBrick; ++y)
            for (int x = 0; x < kBrick; ++x, ++samples) {
              requireFinite(&samples->x, 3, name);
              leaf->buffer().setValue(openvdb::Index(leafOffset(x, y, z)), turned(*samples));
            }
        return {std::move(leaf), {}, false};
      },
      [&](const Vec3f& constant) -> Entry {
        const openvdb::Vec3s value = turned(constant);
        return {nullptr, value, value != grid->background()};
      });
  return grid;
}

}  // namespace nephele::detail
