// Grids of files: where names, classes and OpenVDB's sign are turned into ours and back.
#include <fmt/format.h>
#include <openvdb/tools/Count.h>

#include <cmath>

#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

namespace {

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

VdbGridInfo::Class classOf(const openvdb::GridBase& grid) {
  switch (grid.getGridClass()) {
    case openvdb::GRID_LEVEL_SET:
      return VdbGridInfo::Class::levelSet;
    case openvdb::GRID_FOG_VOLUME:
      return VdbGridInfo::Class::fogVolume;
    case openvdb::GRID_STAGGERED:
      return VdbGridInfo::Class::staggered;
    default:
      return VdbGridInfo::Class::unknown;
  }
}

float signOf(const openvdb::GridBase& grid) {
  return grid.getGridClass() == openvdb::GRID_LEVEL_SET ? -1.0f : 1.0f;
}

detail::TreeValues fogValues(float background, const std::string& name) {
  require(background == 0.0f, fmt::format("grid {}: a fog volume must be 0 outside, but its background is {}",
                                          name.empty() ? "without a name" : "'" + name + "'", background));
  return detail::TreeValues::fog();
}

VdbGrid labelled(const openvdb::GridBase::Ptr& grid, const VdbGridLabel& label) {
  grid->setName(label.name);
  if (label.gridClass != VdbGridInfo::Class::unknown) grid->setGridClass(fileClass(label.gridClass));
  grid->setSaveFloatAsHalf(label.halfFloat);
  for (const auto& [key, value] : label.metadata) grid->insertMeta(key, openvdb::StringMetadata(value));
  return detail::wrapGrid(grid);
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

}  // namespace detail

std::shared_ptr<BrickGrid> toBricks(const VdbGrid& grid) {
  const openvdb::FloatGrid::ConstPtr source = detail::floatGrid(grid);
  return detail::bricksOf(*source, signOf(*source));
}

VdbGrid toVdb(const BrickGrid& bricks, const VdbGridLabel& label) {
  const detail::TreeValues values =
      label.gridClass == VdbGridInfo::Class::levelSet    ? detail::TreeValues::levelSet(bricks, label.name)
      : label.gridClass == VdbGridInfo::Class::fogVolume ? fogValues(bricks.background(), label.name)
                                                         : detail::TreeValues::asTheyAre(bricks.background());
  return labelled(detail::toOpenVdb(bricks, values, label.name), label);
}

VdbGrid toVdb(VoxelGrid<float> voxels, const VdbGridLabel& label) {
  const float background = voxels.background();
  const detail::TreeValues values =
      label.gridClass == VdbGridInfo::Class::levelSet    ? detail::TreeValues::levelSet(voxels, label.name)
      : label.gridClass == VdbGridInfo::Class::fogVolume ? fogValues(background, label.name)
                                                         : detail::TreeValues::asTheyAre(background);
  return labelled(detail::toOpenVdb(std::move(voxels), values, label.name), label);
}

VdbGrid toVdb(VoxelGrid<Vec3f> voxels, const VdbGridLabel& label) {
  return labelled(detail::toOpenVdb(std::move(voxels), label.name), label);
}

VdbGridLabel labelOf(const VdbGrid& grid) {
  const openvdb::GridBase& base = *grid.impl().grid;
  return {base.getName(), classOf(base), base.saveFloatAsHalf(), {}};
}

std::optional<std::string> metadataOf(const VdbGrid& grid, const std::string& key) {
  const auto found = grid.impl().grid->getMetadata<openvdb::StringMetadata>(key);
  return found ? std::optional(found->value()) : std::nullopt;
}

void copyMetadata(const VdbGrid& from, VdbGrid& to) {
  to.impl().grid->insertMeta(*from.impl().grid);
}

VdbValues detail::valuesOf(const openvdb::GridBase& base) {
  if (base.isType<openvdb::FloatGrid>() || base.isType<openvdb::DoubleGrid>()) return VdbValues::scalar;
  if (base.isType<openvdb::Vec3SGrid>() || base.isType<openvdb::Vec3DGrid>()) return VdbValues::vector;
  return VdbValues::other;
}

VdbValues valuesOf(const VdbGrid& grid) {
  return detail::valuesOf(*grid.impl().grid);
}

Box activeBox(const VdbGrid& grid) {
  const openvdb::GridBase& base = *grid.impl().grid;
  const openvdb::CoordBBox voxels = base.evalActiveVoxelBoundingBox();
  Box box;
  if (voxels.empty()) return box;
  for (int corner = 0; corner < 8; ++corner) {
    const auto p = base.transform().indexToWorld(openvdb::Vec3d(
        corner & 1 ? voxels.max().x() : voxels.min().x(), corner & 2 ? voxels.max().y() : voxels.min().y(),
        corner & 4 ? voxels.max().z() : voxels.min().z()));
    box = box.including(Vec3f{float(p.x()), float(p.y()), float(p.z())});
  }
  return box;
}

VdbGridInfo describe(const VdbGrid& handle) {
  const openvdb::GridBase& grid = *handle.impl().grid;
  VdbGridInfo info;
  info.name = grid.getName();
  info.type = grid.valueType();
  info.gridClass = classOf(grid);
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
