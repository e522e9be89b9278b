#pragma once

#include <openvdb/openvdb.h>

#include <algorithm>
#include <map>
#include <memory>

#include "nephele/modeling/base/math.h"
#include "nephele/modeling/base/parallel.h"

/// Building OpenVDB trees from a box of bricks, on all cores, without pruning or flood fill.
namespace nephele::detail {

template <class Value>
struct TreeParts {
  using Tree = typename openvdb::tree::Tree4<Value, 5, 4, 3>::Type;
  using Leaf = typename Tree::LeafNodeType;
  using Upper = typename Tree::RootNodeType::ChildNodeType;
  using Lower = typename Upper::ChildNodeType;
};

/// What stands at one brick position: a leaf, or a constant.
template <class Value>
struct LeafOrTile {
  std::unique_ptr<typename TreeParts<Value>::Leaf> leaf;
  Value constant{};
  bool active = false;
};

/// Where sample (x, y, z) stands in a leaf.
constexpr int leafOffset(int x, int y, int z) {
  return (x * 8 + y) * 8 + z;
}

/// A leaf of `values` (z fastest), active where isActive(value); a tile where all are equal.
template <class Value, class IsActive>
LeafOrTile<Value> leafOf(const Value* values, const openvdb::Coord& origin, const IsActive& isActive) {
  using Leaf = typename TreeParts<Value>::Leaf;
  bool equal = true;
  for (openvdb::Index i = 1; i < Leaf::SIZE; ++i) equal &= values[i] == values[0];
  if (equal) return {nullptr, values[0], isActive(values[0])};
  auto leaf = std::make_unique<Leaf>(openvdb::PartialCreate(), origin, Value(0.0f), false);
  leaf->allocate();
  std::copy_n(values, Leaf::SIZE, leaf->buffer().data());
  typename Leaf::NodeMaskType mask;
  for (openvdb::Index word = 0; word < Leaf::NodeMaskType::WORD_COUNT; ++word) {
    openvdb::Index64 bits = 0;
    for (openvdb::Index b = 0; b < 64; ++b) bits |= openvdb::Index64(isActive(values[word * 64 + b])) << b;
    mask.template getWord<openvdb::Index64>(word) = bits;
  }
  leaf->setValueMask(mask);
  return {std::move(leaf), Value(0.0f), false};
}

/// The node of 16^3 bricks from `node` * 16, or null if all are background. See assembleTree.
template <class Value, class Content>
std::unique_ptr<typename TreeParts<Value>::Lower> assembleNode(const Vec3i& node, const Vec3i& first,
                                                               const Vec3i& count, const Value& background,
                                                               const Content& content) {
  using Lower = typename TreeParts<Value>::Lower;
  constexpr int kSpan = 16, kLeaf = 8;
  const Vec3i start{node.x * kSpan, node.y * kSpan, node.z * kSpan};
  const Vec3i low = max(start, first), high = min(start + Vec3i{kSpan, kSpan, kSpan}, first + count);
  std::unique_ptr<Lower> result;
  for (int z = low.z; z < high.z; ++z)
    for (int y = low.y; y < high.y; ++y)
      for (int x = low.x; x < high.x; ++x) {
        const openvdb::Coord origin(x * kLeaf, y * kLeaf, z * kLeaf);
        LeafOrTile<Value> entry = content(Vec3i{x, y, z}, origin);
        if (!entry.leaf && entry.constant == background && !entry.active) continue;
        if (!result)
          result = std::make_unique<Lower>(openvdb::Coord(start.x, start.y, start.z) << 3, background, false);
        if (entry.leaf)
          result->addLeaf(entry.leaf.release());
        else
          result->addTile(Lower::coordToOffset(origin), entry.constant, entry.active);
      }
  return result;
}

/// True if all places of a node hold one constant and one state.
template <class Lower>
bool isOneTile(const Lower& node) {
  if (!node.getChildMask().isOff() || !(node.isValueMaskOn() || node.isValueMaskOff())) return false;
  const auto value = node.getTable()[0].getValue();
  return std::all_of(node.getTable(), node.getTable() + Lower::NUM_VALUES,
                     [&](const auto& entry) { return entry.getValue() == value; });
}

/// Fills `tree` with the bricks at positions first .. first + count - 1; content(position, origin) gives each
/// as a LeafOrTile and is called once for each, from several threads.
template <class Tree, class Content>
void assembleTree(Tree& tree, const Vec3i& first, const Vec3i& count, const Content& content) {
  using Value = typename Tree::ValueType;
  using Upper = typename TreeParts<Value>::Upper;
  using Lower = typename TreeParts<Value>::Lower;
  if (count.x <= 0 || count.y <= 0 || count.z <= 0) return;
  constexpr int kShift = 4;
  const Value background = tree.background();
  const Vec3i last = first + count - Vec3i{1, 1, 1};
  const Vec3i low{first.x >> kShift, first.y >> kShift, first.z >> kShift};
  const Vec3i high{last.x >> kShift, last.y >> kShift, last.z >> kShift};
  const auto nx = std::size_t(high.x - low.x + 1), ny = std::size_t(high.y - low.y + 1),
             nz = std::size_t(high.z - low.z + 1);
  std::vector<std::unique_ptr<Lower>> nodes(nx * ny * nz);
  parallelFor(nodes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      nodes[i] = assembleNode(low + Vec3i{int(i % nx), int(i / nx % ny), int(i / nx / ny)}, first, count,
                              background, content);
  });
  std::map<openvdb::Coord, std::unique_ptr<Upper>> uppers;
  for (std::unique_ptr<Lower>& node : nodes) {
    if (!node) continue;
    const openvdb::Coord origin = node->origin() & ~openvdb::Int32(Upper::DIM - 1);
    std::unique_ptr<Upper>& upper = uppers[origin];
    if (!upper) upper = std::make_unique<Upper>(origin, background, false);
    if (isOneTile(*node))
      upper->addTile(Upper::coordToOffset(node->origin()), node->getTable()[0].getValue(),
                     node->isValueMaskOn());
    else
      upper->addChild(node.release());
  }
  for (auto& [origin, upper] : uppers) tree.root().addChild(upper.release());
}

}  // namespace nephele::detail
