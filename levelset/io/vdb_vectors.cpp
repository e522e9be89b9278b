// Grids of vectors: three grids of numbers to us, one to OpenVDB.
#include <fmt/format.h>
#include <openvdb/tools/Prune.h>

#include "nephele/levelset/grid/openvdb_assembly.h"
#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

// One float grid per component, with the tree's own tiles.
template <class VectorGrid>
std::array<VdbGrid, 3> components(const VectorGrid& grid) {
  const auto component = [&](int axis) {
    const auto background = float(grid.background()[axis]);
    const auto tree = std::make_shared<openvdb::FloatTree>(grid.tree(), background, openvdb::TopologyCopy());
    const auto values = grid.getConstAccessor();
    for (auto voxel = tree->beginValueOn(); voxel; ++voxel)
      voxel.setValue(float(values.getValue(voxel.getCoord())[axis]));
    const auto scalar = openvdb::FloatGrid::create(tree);
    scalar->insertMeta(grid);
    scalar->setGridClass(openvdb::GRID_UNKNOWN);
    const auto transform = grid.transform().copy();
    if (grid.getGridClass() == openvdb::GRID_STAGGERED) {
      openvdb::Vec3d shift(0, 0, 0);
      shift[axis] = -0.5;
      transform->preTranslate(shift);
    }
    scalar->setTransform(transform);
    scalar->setName(fmt::format("{}.{}", grid.getName(), "xyz"[axis]));
    return detail::wrapGrid(scalar);
  };
  return {component(0), component(1), component(2)};
}

/// A box around the bricks of all three.
BrickBox boxOf(const VectorGrids& grids) {
  Vec3i first = grids[0]->firstBrick(), end = first + grids[0]->brickCount();
  for (const auto& grid : grids) {
    first = min(first, grid->firstBrick());
    end = max(end, grid->firstBrick() + grid->brickCount());
  }
  return {first, end - first};
}

}  // namespace

std::array<VdbGrid, 3> vectorComponents(const VdbGrid& handle) {
  const openvdb::GridBase::Ptr& grid = handle.impl().grid;
  if (grid->isType<openvdb::Vec3SGrid>()) return components(*openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid));
  if (grid->isType<openvdb::Vec3DGrid>()) return components(*openvdb::gridPtrCast<openvdb::Vec3DGrid>(grid));
  throw Error(fmt::format("grid {} holds {} values; a grid of vectors is needed", detail::displayName(*grid),
                          grid->valueType()));
}

VdbGrid toVdb(const VectorGrids& grids, const VdbGridLabel& label) {
  detail::initializeOpenVdb();
  const bool isStaggered = label.gridClass == VdbGridInfo::Class::staggered;
  Lattice lattice = grids[0]->lattice();
  if (isStaggered) lattice.indexToWorld.translation += lattice.indexToWorld.linear * Vec3f{0.5f, 0, 0};
  const openvdb::Vec3s background(grids[0]->background(), grids[1]->background(), grids[2]->background());
  const auto grid = openvdb::Vec3SGrid::create(background);
  grid->setTransform(detail::transformOf(lattice, double(lattice.voxelSize)));
  grid->setName(label.name);
  if (isStaggered) grid->setGridClass(openvdb::GRID_STAGGERED);
  grid->setSaveFloatAsHalf(label.halfFloat);
  const BrickBox box = boxOf(grids);
  using Entry = detail::LeafOrTile<openvdb::Vec3s>;
  detail::assembleTree(
      grid->tree(), box.first, box.count, [&](const Vec3i& brick, const openvdb::Coord& origin) -> Entry {
        const float* own[3];
        bool isBackground = true;
        for (std::size_t c = 0; c < 3; ++c) {
          const std::int32_t pool = grids[c]->poolIndex(brick);
          isBackground &= pool == 0;
          own[c] = grids[c]->brick(pool);
        }
        if (isBackground) return {nullptr, background, false};
        openvdb::Vec3s values[kBrickSamples];
        for (int z = 0; z < kBrickSide; ++z)
          for (int y = 0; y < kBrickSide; ++y)
            for (int x = 0; x < kBrickSide; ++x) {
              const int o = sampleOffset(x, y, z);
              values[detail::leafOffset(x, y, z)] = openvdb::Vec3s(own[0][o], own[1][o], own[2][o]);
            }
        return detail::leafOf(values, origin,
                              [&](const openvdb::Vec3s& value) { return value != background; });
      });
  return detail::wrapGrid(grid);
}

VoxelGrid<Vec3f> toVectorVoxels(const VdbGrid& handle) {
  const openvdb::GridBase& grid = *handle.impl().grid;
  require(grid.isType<openvdb::Vec3SGrid>(),
          fmt::format("grid {} holds {} values; a grid of vectors of float is needed",
                      detail::displayName(grid), grid.valueType()));
  return detail::voxelsOf(static_cast<const openvdb::Vec3SGrid&>(grid));
}

}  // namespace nephele
