#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace nephele::detail {

/// Every edge once, with how often faces run along it from its lower vertex to its higher one (`up`) and back
/// (`down`): `visit(up, down)`. `eachEdge(add)` calls `add(from, to)` for each corner of each face, and is
/// called twice. Linear: edges are gathered by their lower vertex, where only a few have to be sorted.
template <class EachEdge, class Visit>
void countEdges(std::size_t vertexCount, const EachEdge& eachEdge, const Visit& visit) {
  std::vector<std::size_t> ends(vertexCount + 1);
  eachEdge([&](std::uint32_t from, std::uint32_t to) { ++ends[std::min(from, to) + 1]; });
  for (std::size_t v = 0; v < vertexCount; ++v) ends[v + 1] += ends[v];
  // Twice the higher vertex, and one more where the edge runs up.
  std::vector<std::uint64_t> edges(ends.back());
  eachEdge([&](std::uint32_t from, std::uint32_t to) {
    edges[ends[std::min(from, to)]++] = std::uint64_t(std::max(from, to)) << 1 | (from < to ? 1 : 0);
  });
  for (std::size_t v = 0, begin = 0; v < vertexCount; begin = ends[v++]) {
    const std::size_t end = ends[v];
    std::sort(edges.begin() + std::ptrdiff_t(begin), edges.begin() + std::ptrdiff_t(end));
    for (std::size_t i = begin; i < end;) {
      int counts[2] = {};
      const std::uint64_t other = edges[i] >> 1;
      for (; i < end && edges[i] >> 1 == other; ++i) ++counts[edges[i] & 1];
      visit(counts[1], counts[0]);
    }
  }
}

}  // namespace nephele::detail
