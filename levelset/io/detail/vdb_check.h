#pragma once

#include <openvdb/openvdb.h>

#include <cstdint>
#include <string>
#include <vector>

#include "nephele/levelset/io/file_bytes.h"

namespace nephele::detail {

// What OpenVDB would read next, followed ahead of it with every length, count and place compared with what
// the file can hold; OpenVDB itself trusts them. Each function begins at the present position and returns to
// it. All throw Error, without the path.

/// The longest text of a file that is read, in bytes. Those that people wrote are far shorter; OpenVDB holds
/// each twice while it reads.
inline constexpr std::int64_t kLongestText = std::int64_t{64} << 20;

/// The shortest edge of a voxel whose cube single precision holds well.
inline constexpr double kLeastEdge = 1e-12;

/// Names and values of metadata: lengths that do not fit are found before anything is allocated for them.
/// What tells where delayed loading finds its blocks is hidden from OpenVDB, which would trust its contents.
void checkMetadata(FileBytes& bytes);

/// The names and offsets of a grid in the table of contents.
void checkDescriptor(FileBytes& bytes);

/// Whether the values of such grids can be followed: numbers, vectors, booleans and masks, not points.
bool isCheckable(const openvdb::GridBase& grid);

/// Compression, metadata and transform of a grid and, with `hasTree`, the tree with all its blocks. `grid`
/// has the type of the one to be read, which must be checkable then. Returns where the leaves begin, in the
/// order of the tree.
std::vector<std::int64_t> checkGrid(FileBytes& bytes, const openvdb::GridBase& grid, bool hasTree);

}  // namespace nephele::detail
