// Grids of files: where names, classes and OpenVDB's sign are turned into ours and back.
#include <fmt/format.h>
#include <openvdb/tree/NodeManager.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/levelset/io/detail/vdb_check.h"
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
                                          detail::displayName(name), background));
  return detail::TreeValues::fog();
}

/// Of the active values of a tree.
struct FiniteValues {
  FiniteValues() = default;
  FiniteValues(const FiniteValues&, tbb::split) {}

  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  /// Voxels whose value is infinite or not a number.
  std::uint64_t notFinite = 0;

  template <class Node>
  bool operator()(const Node& node, std::size_t) {
    for (auto value = node.cbeginValueOn(); value; ++value)
      if (!add(*value)) notFinite += voxelsOf(node);
    return true;
  }
  void join(const FiniteValues& other) {
    min = std::min(min, other.min);
    max = std::max(max, other.max);
    notFinite += other.notFinite;
  }

 private:
  /// Returns whether it is finite.
  bool add(double value) {
    if (!std::isfinite(value)) return false;
    min = std::min(min, value);
    max = std::max(max, value);
    return true;
  }
  template <class T>
  bool add(const openvdb::math::Vec3<T>& value) {
    const bool x = add(double(value.x())), y = add(double(value.y())), z = add(double(value.z()));
    return x && y && z;
  }

  /// Of one of its values.
  template <class Node>
  static std::uint64_t voxelsOf(const Node&) {
    if constexpr (Node::LEVEL == 0)
      return 1;
    else
      return std::uint64_t(Node::ChildNodeType::NUM_VOXELS);
  }
};

template <class Tree>
FiniteValues finiteValues(const Tree& tree) {
  FiniteValues result;
  openvdb::tree::DynamicNodeManager<const Tree>(tree).reduceTopDown(result);
  return result;
}

VdbGrid labelled(const openvdb::GridBase::Ptr& grid, const VdbGridLabel& label) {
  grid->setName(label.name);
  if (label.gridClass != VdbGridInfo::Class::unknown) grid->setGridClass(fileClass(label.gridClass));
  grid->setSaveFloatAsHalf(label.halfFloat);
  for (const auto& [key, value] : label.metadata) {
    require(!key.empty(), fmt::format("grid {}: metadata needs names", detail::displayName(label.name)));
    grid->insertMeta(key, openvdb::StringMetadata(value));
  }
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

std::shared_ptr<BrickGrid> toBricks(const VdbGrid& grid, const BrickSink& made) {
  const openvdb::FloatGrid::ConstPtr source = detail::floatGrid(grid);
  return detail::bricksOf(*source, signOf(*source), made);
}

VdbGrid toVdb(const BrickGrid& bricks, const VdbGridLabel& label) {
  const detail::TreeValues values =
      label.gridClass == VdbGridInfo::Class::levelSet    ? detail::TreeValues::levelSet(bricks, label.name)
      : label.gridClass == VdbGridInfo::Class::fogVolume ? fogValues(bricks.background(), label.name)
                                                         : detail::TreeValues::asTheyAre(bricks.background());
  return labelled(detail::toOpenVdb(bricks, values, detail::displayName(label.name)), label);
}

VdbGrid toVdb(VoxelGrid<float> voxels, const VdbGridLabel& label) {
  const float background = voxels.background();
  const detail::TreeValues values =
      label.gridClass == VdbGridInfo::Class::levelSet    ? detail::TreeValues::levelSet(voxels, label.name)
      : label.gridClass == VdbGridInfo::Class::fogVolume ? fogValues(background, label.name)
                                                         : detail::TreeValues::asTheyAre(background);
  return labelled(detail::toOpenVdb(std::move(voxels), values, detail::displayName(label.name)), label);
}

VdbGrid toVdb(VoxelGrid<Vec3f> voxels, const VdbGridLabel& label) {
  return labelled(detail::toOpenVdb(std::move(voxels), detail::displayName(label.name)), label);
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

namespace {

/// Grows a box by places of a grid.
class PlacesBox {
 public:
  explicit PlacesBox(const openvdb::math::Transform& transform) : transform_(transform) {}

  void include(const openvdb::Vec3d& index) {
    const openvdb::Vec3d p = transform_.indexToWorld(index);
    box_ = box_.including(Vec3f{float(p.x()), float(p.y()), float(p.z())});
  }
  void includeCorners(const openvdb::CoordBBox& voxels) {
    for (int corner = 0; corner < 8; ++corner)
      include(openvdb::Vec3d(corner & 1 ? voxels.max().x() : voxels.min().x(),
                             corner & 2 ? voxels.max().y() : voxels.min().y(),
                             corner & 4 ? voxels.max().z() : voxels.min().z()));
  }
  const Box& box() const { return box_; }

 private:
  const openvdb::math::Transform& transform_;
  Box box_;
};

/// The vertices of its marching cubes.
template <class Grid>
Box surfaceBox(const Grid& grid) {
  PlacesBox places(grid.transform());
  const auto accessor = grid.getConstAccessor();
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf)
    for (auto voxel = leaf->cbeginValueOn(); voxel; ++voxel)
      for (int axis = 0; axis != 3; ++axis) {
        openvdb::Coord next = voxel.getCoord();
        ++next[axis];
        const double from = double(*voxel), to = double(accessor.getValue(next));
        if ((from < 0) == (to < 0)) continue;
        openvdb::Vec3d place = voxel.getCoord().asVec3d();
        place[axis] += from / (from - to);
        places.include(place);
      }
  return places.box();
}

template <class Grid>
Box voxelsBox(const Grid& grid) {
  PlacesBox places(grid.transform());
  for (auto value = grid.tree().cbeginValueOn(); value; ++value) {
    openvdb::CoordBBox voxels;
    value.getBoundingBox(voxels);
    voxels.volume() == 1 ? places.include(voxels.min().asVec3d()) : places.includeCorners(voxels);
  }
  return places.box();
}

bool isAlongAxes(const openvdb::math::Transform& transform) {
  const openvdb::Mat3d linear = detail::matrixOf(transform).getMat3();
  for (int row = 0; row != 3; ++row)
    for (int column = 0; column != 3; ++column)
      if (row != column && linear(row, column) != 0) return false;
  return true;
}

}  // namespace

Box contentBox(const VdbGrid& grid) {
  using Numbers = openvdb::TypeList<openvdb::FloatGrid, openvdb::DoubleGrid>;
  using Values = Numbers::Append<openvdb::Vec3SGrid, openvdb::Vec3DGrid>;
  const openvdb::GridBase& base = *grid.impl().grid;
  Box box;
  if (base.getGridClass() == openvdb::GRID_LEVEL_SET)
    base.apply<Numbers>([&](const auto& level) { box = surfaceBox(level); });
  if (box.isEmpty() && base.transform().isLinear() && !isAlongAxes(base.transform()))
    base.apply<Values>([&](const auto& values) { box = voxelsBox(values); });
  if (!box.isEmpty()) return box;
  PlacesBox corners(base.transform());
  if (const openvdb::CoordBBox voxels = base.evalActiveVoxelBoundingBox(); !voxels.empty())
    corners.includeCorners(voxels);
  return corners.box();
}

VdbGridInfo describe(const VdbGrid& handle) {
  const openvdb::GridBase& grid = *handle.impl().grid;
  VdbGridInfo info;
  info.name = grid.getName();
  info.type = grid.valueType();
  info.gridClass = classOf(grid);
  info.activeVoxels = grid.activeVoxelCount();
  info.memoryBytes = grid.memUsage();
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  if (!detail::isCheckable(grid)) {
    // Their values are not read; the file tells of them.
    using openvdb::GridBase;
    const auto count = grid.getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_VOXEL_COUNT);
    const auto bytes = grid.getMetadata<openvdb::Int64Metadata>(GridBase::META_FILE_MEM_BYTES);
    const auto low = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MIN);
    const auto high = grid.getMetadata<openvdb::Vec3IMetadata>(GridBase::META_FILE_BBOX_MAX);
    if (count) info.activeVoxels = std::uint64_t(std::max<std::int64_t>(0, count->value()));
    if (bytes) info.memoryBytes = std::uint64_t(std::max<std::int64_t>(0, bytes->value()));
    if (low && high) box = {openvdb::Coord(low->value()), openvdb::Coord(high->value())};
  }
  if (!box.empty()) {
    info.indexMin = {box.min().x(), box.min().y(), box.min().z()};
    info.indexMax = {box.max().x(), box.max().y(), box.max().z()};
  }
  const openvdb::Vec3d size = grid.voxelSize();
  info.voxelSize = {float(size.x()), float(size.y()), float(size.z())};
  if (grid.transform().isLinear()) {
    const openvdb::Mat3d m = detail::matrixOf(grid.transform()).getMat3();
    const openvdb::Mat3d difference = m - openvdb::Mat3d::identity() * m(0, 0);
    info.uniform = difference.absMax() <= 1e-9 * std::abs(m(0, 0));
  } else {
    info.uniform = false;
  }
  if (grid.isType<openvdb::FloatGrid>())
    info.background = static_cast<const openvdb::FloatGrid&>(grid).background();
  if (grid.isType<openvdb::DoubleGrid>())
    info.background = float(static_cast<const openvdb::DoubleGrid&>(grid).background());
  info.halfFloat = grid.saveFloatAsHalf();
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry)
    info.metadata[entry->first] = entry->second->str();
  return info;
}

VdbValueRange valueRange(const VdbGrid& handle) {
  using namespace openvdb;
  FiniteValues values;
  handle.impl().grid->apply<TypeList<FloatGrid, DoubleGrid, Vec3SGrid, Vec3DGrid>>(
      [&](const auto& grid) { values = finiteValues(grid.tree()); });
  if (!(values.min <= values.max)) return {0.0f, 0.0f, values.notFinite};
  return {float(values.min), float(values.max), values.notFinite};
}

}  // namespace nephele
