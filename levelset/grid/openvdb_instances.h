#pragma once

#include <openvdb/openvdb.h>

// The grids that openvdb::initialize() registers are compiled in OpenVDB's library: sources need not compile
// all that their trees can do once more.
namespace openvdb {
OPENVDB_USE_VERSION_NAMESPACE
namespace OPENVDB_VERSION_NAME {

extern template class Grid<BoolTree>;
extern template class Grid<MaskTree>;
extern template class Grid<FloatTree>;
extern template class Grid<DoubleTree>;
extern template class Grid<Int32Tree>;
extern template class Grid<Int64Tree>;
extern template class Grid<Vec3ITree>;
extern template class Grid<Vec3STree>;
extern template class Grid<Vec3DTree>;

namespace tree {

extern template class Tree<BoolTree::RootNodeType>;
extern template class Tree<MaskTree::RootNodeType>;
extern template class Tree<FloatTree::RootNodeType>;
extern template class Tree<DoubleTree::RootNodeType>;
extern template class Tree<Int32Tree::RootNodeType>;
extern template class Tree<Int64Tree::RootNodeType>;
extern template class Tree<Vec3ITree::RootNodeType>;
extern template class Tree<Vec3STree::RootNodeType>;
extern template class Tree<Vec3DTree::RootNodeType>;

}  // namespace tree
}  // namespace OPENVDB_VERSION_NAME
}  // namespace openvdb
