// OpenVDB declares its usual trees as instantiated in its library, which hides their inline members; g++
// makes those again where they are used, clang does not.
#include <openvdb/openvdb.h>

#define NEPHELE_INSTANTIATE(Grid)                                           \
  template const openvdb::Name& openvdb::Grid::TreeType::treeType();        \
  template void openvdb::Grid::TreeType::voxelizeActiveTiles(bool);         \
  template const openvdb::Grid::TreeType& openvdb::Grid::constTree() const; \
  template openvdb::Grid::ConstAccessor openvdb::Grid::getConstAccessor() const;

NEPHELE_INSTANTIATE(FloatGrid)
NEPHELE_INSTANTIATE(DoubleGrid)
NEPHELE_INSTANTIATE(Vec3SGrid)
NEPHELE_INSTANTIATE(Vec3DGrid)
