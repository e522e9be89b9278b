// OpenVDB's library hides the inline members of the trees that it instantiates; g++ makes those again where
// they are used, clang does not.
#include "nephele/levelset/grid/openvdb_instances.h"

#define NEPHELE_INSTANTIATE(GridTree)                                                                \
  template openvdb::Grid<openvdb::GridTree>::Grid(const openvdb::GridTree::ValueType&);              \
  template openvdb::GridTree& openvdb::Grid<openvdb::GridTree>::tree();                              \
  template const openvdb::GridTree& openvdb::Grid<openvdb::GridTree>::tree() const;                  \
  template const openvdb::GridTree& openvdb::Grid<openvdb::GridTree>::constTree() const;             \
  template const openvdb::GridTree::ValueType& openvdb::Grid<openvdb::GridTree>::background() const; \
  template openvdb::Grid<openvdb::GridTree>::ConstAccessor                                           \
  openvdb::Grid<openvdb::GridTree>::getConstAccessor() const;                                        \
  template const openvdb::GridTree::ValueType&                                                       \
  openvdb::tree::Tree<openvdb::GridTree::RootNodeType>::background() const;                          \
  template const openvdb::Name& openvdb::tree::Tree<openvdb::GridTree::RootNodeType>::treeType();    \
  template void openvdb::tree::Tree<openvdb::GridTree::RootNodeType>::getNodeLog2Dims(               \
      std::vector<openvdb::Index>&);                                                                 \
  template void openvdb::tree::Tree<openvdb::GridTree::RootNodeType>::voxelizeActiveTiles(bool);

NEPHELE_INSTANTIATE(FloatTree)
NEPHELE_INSTANTIATE(DoubleTree)
NEPHELE_INSTANTIATE(Int32Tree)
NEPHELE_INSTANTIATE(Vec3STree)
NEPHELE_INSTANTIATE(Vec3DTree)
