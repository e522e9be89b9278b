#include "nephele/levelset/io/moved.h"

#include <fmt/format.h>
#include <openvdb/tree/NodeManager.h>

#include <cmath>

#include "nephele/levelset/io/detail/openvdb_grid.h"

namespace nephele {

namespace {

/// Changes every value of a tree, active or not, and its background.
template <class Tree, class Change>
void changeValues(Tree& tree, const Change& change) {
  using Value = typename Tree::ValueType;
  const auto inNode = [&change](auto& node, std::size_t) {
    using Node = std::decay_t<decltype(node)>;
    if constexpr (Node::LEVEL == 0) {
      Value* values = node.buffer().data();
      for (openvdb::Index i = 0; i != Node::SIZE; ++i) values[i] = change(values[i]);
    } else {
      for (auto value = node.beginValueAll(); value; ++value) value.setValue(change(*value));
    }
    return true;
  };
  for (auto value = tree.root().beginValueAll(); value; ++value) value.setValue(change(*value));
  openvdb::tree::DynamicNodeManager<Tree>(tree).foreachTopDown(inNode);
  tree.root().setBackground(change(tree.background()), /*updateChildNodes=*/false);
}

template <class Grid, class Change>
openvdb::GridBase::Ptr changed(const openvdb::GridBase& grid, const Change& change) {
  const auto result = openvdb::gridPtrCast<Grid>(grid.deepCopyGrid());
  changeValues(result->tree(), change);
  return result;
}

openvdb::GridBase::Ptr withValuesOf(const openvdb::GridBase& grid, const Similarity& by) {
  const std::string name = detail::displayName(grid);
  if (grid.getGridClass() == openvdb::GRID_LEVEL_SET && by.scale != 1) {
    if (grid.isType<openvdb::FloatGrid>())
      return changed<openvdb::FloatGrid>(grid, [&](float value) { return float(double(value) * by.scale); });
    if (grid.isType<openvdb::DoubleGrid>())
      return changed<openvdb::DoubleGrid>(grid, [&](double value) { return value * by.scale; });
  }
  const bool turns = by.turn != Similarity{}.turn;
  const bool isStaggered = grid.getGridClass() == openvdb::GRID_STAGGERED;
  if (isStaggered && turns)
    throw Error(fmt::format(
        "grid {} is staggered: its components stand on the faces of voxels and cannot be turned", name));
  const bool isNormals = isNormal(grid.getName()) || grid.getVectorType() == openvdb::VEC_COVARIANT_NORMALIZE;
  const bool isMotion = isStaggered || isVelocity(grid.getName()) ||
                        grid.getVectorType() == openvdb::VEC_CONTRAVARIANT_RELATIVE;
  if ((isMotion && by.scale != 1) || ((isMotion || isNormals) && turns)) {
    const double scale = isMotion ? by.scale : 1;
    const auto turn = [&]<class T>(const openvdb::math::Vec3<T>& v) {
      const Vec3d r = by.turned({double(v.x()), double(v.y()), double(v.z())}) * scale;
      return openvdb::math::Vec3<T>(T(r.x), T(r.y), T(r.z));
    };
    if (grid.isType<openvdb::Vec3SGrid>()) return changed<openvdb::Vec3SGrid>(grid, turn);
    if (grid.isType<openvdb::Vec3DGrid>()) return changed<openvdb::Vec3DGrid>(grid, turn);
  }
  // Shares the tree.
  return std::const_pointer_cast<openvdb::GridBase>(grid.copyGrid());
}

}  // namespace

VdbGrid moved(const VdbGrid& grid, const Similarity& by) {
  const openvdb::GridBase& from = *grid.impl().grid;
  require(
      from.transform().isLinear(),
      fmt::format("grid {} has a frustum transform; resample it to a linear one", detail::displayName(from)));
  require(by.scale > 0 && std::isfinite(by.scale),
          fmt::format("grid {}: expected a scale that is > 0 and finite, got {}", detail::displayName(from),
                      by.scale));
  const openvdb::GridBase::Ptr result = withValuesOf(from, by);
  // OpenVDB multiplies row vectors from the left.
  openvdb::Mat4d map = openvdb::Mat4d::identity();
  for (int row = 0; row != 3; ++row)
    for (int column = 0; column != 3; ++column)
      map(column, row) = by.scale * by.turn[std::size_t(row * 3 + column)];
  for (int c = 0; c != 3; ++c) map(3, c) = by.shift[c];
  const openvdb::Mat4d whole = detail::matrixOf(from.transform()) * map;
  const openvdb::Mat3d linear = whole.getMat3();
  const bool isUniform = linear(0, 0) > 0 && linear == openvdb::Mat3d::identity() * linear(0, 0);
  result->setTransform(isUniform ? detail::uniformTransform(linear(0, 0), whole.getTranslation())
                                 : openvdb::math::Transform::createLinearTransform(whole));
  return detail::wrapGrid(result);
}

}  // namespace nephele
