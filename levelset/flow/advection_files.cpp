// Volume files to what advection works on, and back. Scalars and vectors become bricks, vectors one grid for
// each component; what they were is kept beside them, so that results carry the same names and metadata.
//
// The file of a map keeps every brick whole, those beside the matter too: a map that is read back continues
// exactly as the one that was written. Its displacement is 0 where nothing is kept, so that others can
// interpolate it.
#include "nephele/levelset/flow/advection_files.h"

#include <fmt/format.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>

#include "nephele/levelset/grid/brick_growth.h"
#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

using openvdb::Vec3SGrid;
using Leaf = Vec3SGrid::TreeType::LeafNodeType;

constexpr const char* kMapGrid = "displacement";
constexpr const char* kRestGrid = "rest";
constexpr const char* kMapKind = "map_kind";
constexpr const char* kMapKindValue = "X - x, world units";

bool isVector(const openvdb::GridBase& grid) {
  return grid.isType<Vec3SGrid>() || grid.isType<openvdb::Vec3DGrid>();
}

bool isScalar(const openvdb::GridBase& grid) {
  return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>();
}

std::string listOf(const std::vector<VdbGrid>& grids) {
  std::string list;
  for (const VdbGrid& grid : grids)
    list += fmt::format("{}'{}' ({})", list.empty() ? "" : ", ", grid.impl().grid->getName(),
                        grid.impl().grid->valueType());
  return list.empty() ? "it holds no grid" : "it holds " + list;
}

/// A grid of vectors without voxels, standing like `indexToWorld`.
Vec3SGrid::Ptr emptyVectors(const Affine& indexToWorld, const openvdb::Vec3s& background,
                            const std::string& name) {
  BrickGrid none;
  none.indexToWorld = indexToWorld;
  none.ranges = {Interval::of(0.0f)};
  const VdbGrid scalar = toVdb(none, {});
  const auto grid = Vec3SGrid::create(background);
  grid->setTransform(scalar.impl().grid->transform().copy());
  grid->setName(name);
  return grid;
}

/// Leaves at `bricks`, each filled by body(brick, leaf), which says whether to keep it.
template <class Body>
void addLeaves(Vec3SGrid& grid, const std::vector<Vec3i>& bricks, const Body& body) {
  std::vector<std::unique_ptr<Leaf>> leaves(bricks.size());
  parallelFor(bricks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3i origin = bricks[i] * BrickGrid::kBrick;
      auto leaf = std::make_unique<Leaf>(openvdb::Coord(origin.x, origin.y, origin.z), grid.background());
      if (body(bricks[i], *leaf)) leaves[i] = std::move(leaf);
    }
  });
  for (auto& leaf : leaves)
    if (leaf) grid.tree().addLeaf(leaf.release());
}

openvdb::Index leafOffset(int x, int y, int z) {
  return openvdb::Index((x * BrickGrid::kBrick + y) * BrickGrid::kBrick + z);
}

/// Calls body(x, y, z) for the voxels of a brick.
template <class Body>
void forVoxels(const Body& body) {
  for (int z = 0; z < BrickGrid::kBrick; ++z)
    for (int y = 0; y < BrickGrid::kBrick; ++y)
      for (int x = 0; x < BrickGrid::kBrick; ++x) body(x, y, z);
}

std::vector<Vec3i> bricksOf(const VectorGrids& grids) {
  detail::BrickTable seen("advection");
  std::vector<Vec3i> bricks;
  for (const auto& grid : grids)
    for (int z = 0; z < grid->brickCount.z; ++z)
      for (int y = 0; y < grid->brickCount.y; ++y)
        for (int x = 0; x < grid->brickCount.x; ++x) {
          const Vec3i brick = grid->firstBrick + Vec3i{x, y, z};
          if (grid->poolIndex(brick) == 0 || seen.at(brick) >= 0) continue;
          seen.set(brick, 0);
          bricks.push_back(brick);
        }
  return bricks;
}

VdbGridLabel labelOf(const VdbGrid& original, const BrickGrid& bricks) {
  const VdbGridInfo info = describe(original);
  VdbGridLabel label{info.name, info.gridClass, info.halfFloat};
  // Fog that is not 0 outside keeps its values; its class comes back with the metadata.
  if (label.gridClass == VdbGridInfo::Class::fogVolume && bricks.background != 0)
    label.gridClass = VdbGridInfo::Class::unknown;
  return label;
}

}  // namespace

CarriedGrids carriedGrids(const std::vector<VdbGrid>& grids) {
  CarriedGrids result;
  for (const VdbGrid& grid : grids) {
    const openvdb::GridBase& base = *grid.impl().grid;
    if (isVector(base)) {
      for (const VdbGrid& component : vectorComponents(grid)) result.bricks.push_back(toBricks(component));
    } else if (isScalar(base)) {
      result.bricks.push_back(toBricks(grid));
    } else {
      result.leftOut.push_back(fmt::format("{} ({})", base.getName(), base.valueType()));
      continue;
    }
    result.originals.push_back(grid);
    const openvdb::CoordBBox voxels = base.evalActiveVoxelBoundingBox();
    if (voxels.empty()) continue;
    for (int corner = 0; corner < 8; ++corner) {
      const auto p = base.transform().indexToWorld(openvdb::Vec3d(
          corner & 1 ? voxels.max().x() : voxels.min().x(), corner & 2 ? voxels.max().y() : voxels.min().y(),
          corner & 4 ? voxels.max().z() : voxels.min().z()));
      result.box = result.box.including(Vec3f{float(p.x()), float(p.y()), float(p.z())});
    }
  }
  return result;
}

std::vector<VdbGrid> toVdb(const CarriedGrids& like,
                           const std::vector<std::shared_ptr<const BrickGrid>>& bricks) {
  require(bricks.size() == like.bricks.size(), "toVdb: one grid of bricks is needed for each that was read");
  std::vector<VdbGrid> result;
  std::size_t next = 0;
  for (const VdbGrid& original : like.originals) {
    const VdbGridLabel label = labelOf(original, *bricks[next]);
    if (isVector(*original.impl().grid)) {
      result.push_back(toVdb(VectorGrids{bricks[next], bricks[next + 1], bricks[next + 2]}, label));
      next += 3;
    } else {
      result.push_back(toVdb(*bricks[next], label));
      next += 1;
    }
    result.back().impl().grid->insertMeta(*original.impl().grid);
  }
  return result;
}

VdbGrid toVdb(const VectorGrids& grids, const VdbGridLabel& label) {
  detail::initializeOpenVdb();
  Affine indexToWorld = grids[0]->indexToWorld;
  if (label.gridClass == VdbGridInfo::Class::staggered)
    indexToWorld.translation += indexToWorld.linear * Vec3f{0.5f, 0, 0};
  const openvdb::Vec3s background(grids[0]->background, grids[1]->background, grids[2]->background);
  const auto grid = emptyVectors(indexToWorld, background, label.name);
  if (label.gridClass == VdbGridInfo::Class::staggered) grid->setGridClass(openvdb::GRID_STAGGERED);
  grid->setSaveFloatAsHalf(label.halfFloat);
  addLeaves(*grid, bricksOf(grids), [&](const Vec3i& brick, Leaf& leaf) {
    const float* own[3];
    for (std::size_t c = 0; c < 3; ++c) own[c] = grids[c]->brick(grids[c]->poolIndex(brick));
    bool holdsAny = false;
    forVoxels([&](int x, int y, int z) {
      const int o = sampleOffset(x, y, z);
      const openvdb::Vec3s value(own[0][o], own[1][o], own[2][o]);
      if (value == background) return;
      leaf.setValueOn(leafOffset(x, y, z), value);
      holdsAny = true;
    });
    return holdsAny;
  });
  openvdb::tools::prune(grid->tree());
  return detail::wrapGrid(grid);
}

std::vector<VdbGrid> toVdb(const FlowMap& map) {
  detail::initializeOpenVdb();
  const auto displacement = emptyVectors(map.lattice.indexToWorld, openvdb::Vec3s(0.0f), kMapGrid);
  const auto rest = emptyVectors(map.lattice.indexToWorld, openvdb::Vec3s(0.0f), kRestGrid);
  displacement->insertMeta(kMapKind, openvdb::StringMetadata(kMapKindValue));
  const auto fill = [&](bool isRest) {
    return [&map, isRest](const Vec3i& brick, Leaf& leaf) {
      const float* own[3];
      for (std::size_t c = 0; c < 3; ++c)
        own[c] = map.displacement[c]->brick(map.displacement[c]->poolIndex(brick));
      forVoxels([&](int x, int y, int z) {
        const int o = sampleOffset(x, y, z);
        Vec3f value{own[0][o], own[1][o], own[2][o]};
        if (isRest) value += map.lattice.indexToWorld(Vec3f(brick * BrickGrid::kBrick + Vec3i{x, y, z}));
        leaf.setValueOn(leafOffset(x, y, z), openvdb::Vec3s(value.x, value.y, value.z));
      });
      return true;
    };
  };
  addLeaves(*displacement, map.bricks, fill(false));
  addLeaves(*rest, map.bricks, fill(true));
  return {detail::wrapGrid(displacement), detail::wrapGrid(rest)};
}

FlowMap readFlowMap(const std::string& path) {
  const std::vector<VdbGrid> grids = readVdbFile(path);
  for (const VdbGrid& handle : grids) {
    const openvdb::GridBase& base = *handle.impl().grid;
    const auto kind = base.getMetadata<openvdb::StringMetadata>(kMapKind);
    if (base.getName() != kMapGrid || !base.isType<Vec3SGrid>() || !kind || kind->value() != kMapKindValue)
      continue;
    FlowMap map;
    map.lattice.indexToWorld = detail::affineOf(base);
    map.lattice = coarser(map.lattice, 1.0f);
    const auto grid = static_cast<const Vec3SGrid&>(base).deepCopy();
    grid->tree().voxelizeActiveTiles();
    detail::GrownBricks grown;
    grown.components = 3;
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
      const openvdb::Coord origin = leaf->origin();
      grown.bricks.push_back(brickOf(Vec3i{origin.x(), origin.y(), origin.z()}));
      const std::size_t start = grown.samples.size();
      grown.samples.resize(start + 3 * detail::kOwnSamples);
      int i = 0;
      forVoxels([&](int x, int y, int z) {
        const openvdb::Vec3s value = leaf->getValue(leafOffset(x, y, z));
        require(value.isFinite(), path + ": the map holds values that are not finite");
        for (int c = 0; c < 3; ++c)
          grown.samples[start + std::size_t(c * detail::kOwnSamples + i)] = value[c];
        ++i;
      });
    }
    if (grown.bricks.empty()) return map;
    const float zero[3] = {};
    const auto parts = detail::assembleGrids(grown, map.lattice, zero, detail::Beyond::nearest);
    map.displacement = {parts[0], parts[1], parts[2]};
    map.bricks = std::move(grown.bricks);
    std::sort(map.bricks.begin(), map.bricks.end(), comesBefore);
    return map;
  }
  throw Error(fmt::format("{}: no map of a flow, which has a grid '{}'; {}", path, kMapGrid, listOf(grids)));
}

VectorField readVelocity(const std::string& path, const std::string& name) {
  std::string wanted = name;
  if (wanted.empty()) {
    const std::vector<VdbGrid> grids = readVdbFile(path);
    std::vector<std::string> vectors;
    for (const VdbGrid& grid : grids)
      if (isVector(*grid.impl().grid)) vectors.push_back(grid.impl().grid->getName());
    for (const std::string usual : {"velocity", "vel", "v"})
      if (std::count(vectors.begin(), vectors.end(), usual) > 0) wanted = usual;
    if (wanted.empty()) {
      if (vectors.empty())
        throw Error(
            fmt::format("{}: no velocity, which is a grid of vectors (vec3s); {}", path, listOf(grids)));
      if (vectors.size() > 1)
        throw Error(fmt::format("{}: several grids of vectors, none called v, vel or velocity; {}; say which",
                                path, listOf(grids)));
      wanted = vectors.front();
    }
  }
  const std::array<VdbGrid, 3> parts = readVectorGrid(path, wanted);
  VectorGrids grids;
  for (std::size_t c = 0; c < 3; ++c) grids[c] = toBricks(parts[c]);
  return gridField(std::move(grids), Interpolation::trilinear);
}

}  // namespace nephele
