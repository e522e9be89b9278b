#pragma once

// NanoVDB stays behind this header: only nano_vdb.cpp and tests include it.
#include <nanovdb/NanoVDB.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <type_traits>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {

/// Checks the nodes of a NanoVDB grid before anything follows its offsets: every node lies within the grid,
/// belongs to one parent, is where its parent says, and there are as many as the tree counts. Nodes without
/// active values may know no place of their own; they get it here.
template <class Build>
class NanoNodes {
  using Grid = nanovdb::NanoGrid<Build>;
  using Root = typename Grid::RootType;
  using Coord = nanovdb::Coord;

 public:
  /// `size`: of the whole grid, in bytes. @throws Error
  NanoNodes(void* grid, std::uint64_t size) : grid_(static_cast<Grid*>(grid)), size_(size) {}

  void check() {
    using RootData = typename Root::DataType;
    auto* const tree = at<nanovdb::TreeData<3>>(grid_, sizeof(Grid));
    auto* const data = at<RootData>(tree, tree->mNodeOffset[3]);
    const std::uint64_t tableSize = data->mTableSize;
    at<typename RootData::Tile>(data, sizeof(RootData), tableSize * sizeof(typename RootData::Tile));
    std::set<Coord> origins;
    for (std::uint32_t i = 0; i < tableSize; ++i) {
      auto* tile = data->tile(i);
      if (!origins.insert(tile->origin()).second) throw Error("damaged: two nodes begin at the same voxel");
      if (tile->isChild())
        checkNode(*at<typename Root::ChildNodeType>(data, std::uint64_t(tile->child)), tile->origin());
    }
    for (int level = 0; level < 3; ++level) checkLevel(level);
  }

 private:
  /// What lies `offset` bytes from a place in the grid, if there is room for `bytes` of it.
  template <class T>
  T* at(const void* from, std::uint64_t offset, std::uint64_t bytes = sizeof(T)) const {
    auto* const begin = reinterpret_cast<char*>(grid_);
    const std::uint64_t place = std::uint64_t(static_cast<const char*>(from) - begin) + offset;
    if (place > size_ || bytes > size_ - place || place % NANOVDB_DATA_ALIGNMENT != 0)
      throw Error("damaged: an offset leads out of its grid");
    return reinterpret_cast<T*>(begin + place);
  }

  template <class Node>
  static std::uint64_t bytesOf(const Node& node) {
    if constexpr (std::is_same_v<typename Node::BuildType, nanovdb::FpN> && Node::LEVEL == 0) {
      // One to 16 bits for each value.
      constexpr int kMostBits = 16;
      if (node.data()->bitWidth() > kMostBits) throw Error("damaged: values of more bits than there are");
      return node.data()->memUsage();
    } else {
      return sizeof(Node);
    }
  }

  template <class Node>
  void checkNode(Node& node, const Coord& origin) {
    const std::uint64_t bytes = bytesOf(node);
    at<Node>(&node, 0, bytes);
    auto& all = nodes_[Node::LEVEL];
    all.push_back({reinterpret_cast<std::uintptr_t>(&node), bytes});
    // Found here, before the children of a node with many parents are followed again and again.
    if (all.size() > size_ / sizeof(Node)) throw Error("damaged: a node has two parents");
    if (node.origin() != origin) {
      if (!node.valueMask().isOff() || (Node::LEVEL > 0 && hasChildren(node)))
        throw Error("damaged: a node is not where its parent says");
      node.data()->setOrigin(origin);
    }
    if constexpr (Node::LEVEL > 0) {
      auto* data = node.data();
      constexpr std::uint32_t kMask = (1u << Node::LOG2DIM) - 1;
      for (std::uint32_t n = 0; n < Node::SIZE; ++n) {
        if (!data->mChildMask.isOn(n)) continue;
        if (data->mValueMask.isOn(n)) throw Error("damaged: a value is where a node is");
        constexpr int kSide = int(Node::ChildNodeType::DIM);
        const Coord offset(int(n >> (2 * Node::LOG2DIM)) * kSide, int((n >> Node::LOG2DIM) & kMask) * kSide,
                           int(n & kMask) * kSide);
        checkNode(*at<typename Node::ChildNodeType>(data, std::uint64_t(data->mTable[n].child)),
                  origin + offset);
      }
    }
  }

  template <class Node>
  static bool hasChildren(const Node& node) {
    if constexpr (Node::LEVEL > 0)
      return !node.childMask().isOff();
    else
      return false;
  }

  void checkLevel(int level) {
    auto& all = nodes_[level];
    const auto* tree = reinterpret_cast<const nanovdb::TreeData<3>*>(grid_ + 1);
    if (all.size() != tree->mNodeCount[level]) throw Error("damaged: its nodes are not as many as it says");
    std::sort(all.begin(), all.end(), [](const Place& a, const Place& b) { return a.address < b.address; });
    for (std::size_t i = 1; i < all.size(); ++i)
      if (all[i].address - all[i - 1].address < all[i - 1].bytes)
        throw Error("damaged: a node has two parents");
    // Checksums are taken over the nodes in their order.
    if (grid_->isBreadthFirst() && !all.empty()) {
      const auto first = reinterpret_cast<std::uintptr_t>(tree) + tree->mNodeOffset[level];
      if (all.front().address != first ||
          all.back().address - first != (all.size() - 1) * all.front().bytes) {
        if (!(level == 0 && std::is_same_v<Build, nanovdb::FpN>))
          throw Error("damaged: its nodes are not in a row");
      }
    }
  }

  struct Place {
    std::uintptr_t address;
    std::uint64_t bytes;
  };

  Grid* grid_;
  std::uint64_t size_;
  std::vector<Place> nodes_[3];
};

}  // namespace nephele::detail
