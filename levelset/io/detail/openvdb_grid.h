#pragma once

// OpenVDB stays behind this header: only .cpp files of this folder include it.
#include <openvdb/openvdb.h>

#include <functional>
#include <string>
#include <vector>

#include "nephele/levelset/grid/openvdb_bridge.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele {

struct VdbGrid::Impl {
  openvdb::GridBase::Ptr grid;
};

namespace detail {

inline VdbGrid wrapGrid(openvdb::GridBase::Ptr grid) {
  return VdbGrid(std::make_shared<VdbGrid::Impl>(VdbGrid::Impl{std::move(grid)}));
}

/// As that of VdbGrid.
VdbValues valuesOf(const openvdb::GridBase& grid);

/// The grid as float values. @throws Error naming the grid and its type if it is not a float grid.
openvdb::FloatGrid::ConstPtr floatGrid(const VdbGrid& grid);

/// A double grid as float, a float grid as it is, null for any other type.
openvdb::FloatGrid::Ptr toFloatGrid(const openvdb::GridBase::Ptr& grid);

/// Whether the values of a grid of a file are wanted, by its type and name.
using WantedGrid = std::function<bool(const openvdb::GridBase& type, const std::string& name)>;

/// Every grid of a .vdb file in its order; those that are not wanted without their values.
/// @throws std::exception, Error; the caller adds the path.
std::vector<openvdb::GridBase::Ptr> readOpenVdb(const std::string& path, const WantedGrid& wanted);

/// As readOpenVdb, of a NanoVDB file.
std::vector<openvdb::GridBase::Ptr> readNanoVdb(const std::string& path, const WantedGrid& wanted);

}  // namespace detail
}  // namespace nephele
