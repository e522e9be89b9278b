#pragma once

#include <map>
#include <memory>

#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/modeling/base/parallel.h"

/// Building an OpenVDB tree from a dense table of bricks, on all cores, without pruning or flood fill.
namespace nephele::detail {

using FloatLeaf = openvdb::FloatTree::LeafNodeType;
using FloatLower = openvdb::FloatTree::RootNodeType::ChildNodeType::ChildNodeType;
using FloatUpper = openvdb::FloatTree::RootNodeType::ChildNodeType;

/// What stands at one brick position: a leaf, or a constant.
struct LeafOrTile {
  std::unique_ptr<FloatLeaf> leaf;
  float constant = 0.0f;
  bool active = false;
};

/// A leaf of `values` (z fastest), active where isActive(value); a tile where all are equal.
template <class IsActive>
LeafOrTile leafOf(const float* values, const openvdb::Coord& origin, const IsActive& isActive) {
  bool equal = true;
  for (openvdb::Index i = 1; i < FloatLeaf::SIZE; ++i) equal &= values[i] == values[0];
  if (equal) return {nullptr, values[0], isActive(values[0])};
  auto leaf = std::make_unique<FloatLeaf>(openvdb::PartialCreate(), origin, 0.0f, false);
  leaf->allocate();
  std::copy_n(values, FloatLeaf::SIZE, leaf->buffer().data());
  FloatLeaf::NodeMaskType mask;
  for (openvdb::Index word = 0; word < FloatLeaf::NodeMaskType::WORD_COUNT; ++word) {
    openvdb::Index64 bits = 0;
    for (openvdb::Index b = 0; b < 64; ++b) bits |= openvdb::Index64(isActive(values[word * 64 + b])) << b;
    mask.getWord<openvdb::Index64>(word) = bits;
  }
  leaf->setValueMask(mask);
  return {std::move(leaf), 0.0f, false};
}

/// The node of 16^3 bricks from `node` * 16, or null if all are background. See assembleTree.
template <class Content>
std::unique_ptr<FloatLower> assembleNode(const Vec3i& node, const Vec3i& first, const Vec3i& count,
                                         float background, const Content& content) {
  constexpr int kSpan = int(FloatLower::DIM) / int(FloatLeaf::DIM);
  const Vec3i start{node.x * kSpan, node.y * kSpan, node.z * kSpan};
  const Vec3i low = max(start, first), high = min(start + Vec3i{kSpan, kSpan, kSpan}, first + count);
  std::unique_ptr<FloatLower> result;
  for (int z = low.z; z < high.z; ++z)
    for (int y = low.y; y < high.y; ++y)
      for (int x = low.x; x < high.x; ++x) {
        const openvdb::Coord origin(x * int(FloatLeaf::DIM), y * int(FloatLeaf::DIM),
                                    z * int(FloatLeaf::DIM));
        LeafOrTile entry = content(Vec3i{x, y, z}, origin);
        if (!entry.leaf && entry.constant == background && !entry.active) continue;
        if (!result)
          result =
              std::make_unique<FloatLower>(openvdb::Coord(start.x, start.y, start.z) << 3, background, false);
        if (entry.leaf)
          result->addLeaf(entry.leaf.release());
        else
          result->addTile(FloatLower::coordToOffset(origin), entry.constant, entry.active);
      }
  return result;
}

/// True if all places of a node hold one constant and one state.
inline bool isOneTile(const FloatLower& node) {
  if (!node.getChildMask().isOff() || !(node.isValueMaskOn() || node.isValueMaskOff())) return false;
  const float value = node.getTable()[0].getValue();
  return std::all_of(node.getTable(), node.getTable() + FloatLower::NUM_VALUES,
                     [&](const auto& entry) { return entry.getValue() == value; });
}

/// Fills `tree` with the bricks at positions first .. first + count - 1; content(position, origin) gives each
/// as a LeafOrTile and is called from several threads.
template <class Content>
void assembleTree(openvdb::FloatTree& tree, const Vec3i& first, const Vec3i& count, const Content& content) {
  if (count.x <= 0 || count.y <= 0 || count.z <= 0) return;
  constexpr int kShift = 4;
  const float background = tree.background();
  const Vec3i last = first + count - Vec3i{1, 1, 1};
  const Vec3i low{first.x >> kShift, first.y >> kShift, first.z >> kShift};
  const Vec3i high{last.x >> kShift, last.y >> kShift, last.z >> kShift};
  const auto nx = std::size_t(high.x - low.x + 1), ny = std::size_t(high.y - low.y + 1),
             nz = std::size_t(high.z - low.z + 1);
  std::vector<std::unique_ptr<FloatLower>> nodes(nx * ny * nz);
  parallelFor(nodes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      nodes[i] = assembleNode(low + Vec3i{int(i % nx), int(i / nx % ny), int(i / nx / ny)}, first, count,
                              background, content);
  });
  std::map<openvdb::Coord, std::unique_ptr<FloatUpper>> uppers;
  for (std::unique_ptr<FloatLower>& node : nodes) {
    if (!node) continue;
    const openvdb::Coord origin = node->origin() & ~openvdb::Int32(FloatUpper::DIM - 1);
    std::unique_ptr<FloatUpper>& upper = uppers[origin];
    if (!upper) upper = std::make_unique<FloatUpper>(origin, background, false);
    if (isOneTile(*node))
      upper->addTile(FloatUpper::coordToOffset(node->origin()), node->getTable()[0].getValue(),
                     node->isValueMaskOn());
    else
      upper->addChild(node.release());
  }
  for (auto& [origin, upper] : uppers) tree.root().addChild(upper.release());
}

}  // namespace nephele::detail
