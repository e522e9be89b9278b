// Charts by union of neighbours.
//
// Edges are sorted by their ends, so that the triangles on either side stand next to each other; where more
// than two meet, they are taken in pairs. A first pass joins triangles whose values agree, a second one finds
// the seams that wrap, which is known only once the charts are.
//
// Known limit: a seam between two charts never wraps, even where their values would go on. Layouts over
// several tiles have such seams, and there the neighbour has another picture.
#include "nephele/levelset/warp/detail/attribute_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

#include "nephele/levelset/grid/disjoint_sets.h"

namespace nephele::detail {

namespace {

struct Edge {
  std::uint32_t low, high;
  /// 3 * triangle + number of its first corner.
  std::uint32_t corner;
};

std::vector<Edge> sortedEdges(const Mesh& mesh, const std::vector<std::uint32_t>& vertex) {
  std::vector<Edge> edges;
  edges.reserve(mesh.corners.size());
  for (std::uint32_t c = 0; c < mesh.corners.size(); ++c) {
    const std::uint32_t next = c % 3 == 2 ? c - 2 : c + 1;
    const auto [low, high] = std::minmax(vertex[mesh.corners[c]], vertex[mesh.corners[next]]);
    if (low != high) edges.push_back({low, high, c});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::array{a.low, a.high, a.corner} < std::array{b.low, b.high, b.corner};
  });
  return edges;
}

}  // namespace

AttributeCharts::AttributeCharts(const Mesh& mesh, const MeshAttribute& attribute) {
  const auto width = std::size_t(attribute.width);
  const std::size_t cornerCount = mesh.corners.size(), triangleCount = cornerCount / 3;
  const auto value = [&](std::size_t corner, std::size_t k) { return attribute.values[corner * width + k]; };
  float spread = 0;
  for (std::size_t k = 0; k < width; ++k) {
    float low = value(0, k), high = low;
    for (std::size_t c = 0; c < cornerCount; ++c)
      low = std::min(low, value(c, k)), high = std::max(high, value(c, k));
    spread = std::max(spread, high - low);
  }
  constexpr float kTolerance = 1e-5f;
  tolerance_ = kTolerance * spread;

  const std::vector<std::uint32_t> vertex = firstEqualPosition(mesh.positions);
  if (width == 2) findPoles(mesh, attribute, vertex);
  const std::vector<Edge> edges = sortedEdges(mesh, vertex);
  beyond_.assign(cornerCount, kNone);
  const auto nextCorner = [](std::uint32_t c) { return c % 3 == 2 ? c - 2 : c + 1; };
  // The corners of two edges that stand at the same place.
  const auto ends = [&](std::uint32_t a, std::uint32_t b) {
    std::array<std::uint32_t, 4> pairs{a, b, nextCorner(a), nextCorner(b)};
    if (vertex[mesh.corners[a]] != vertex[mesh.corners[b]]) std::swap(pairs[1], pairs[3]);
    return pairs;
  };
  const auto agree = [&](std::uint32_t a, std::uint32_t b, const Offset& offset) {
    for (std::size_t k = 0; k < width; ++k) {
      const float shift = k == 0 ? float(offset.u) : k == 1 ? float(offset.v) : 0.0f;
      if (!(std::abs(value(a, k) - value(b, k) - shift) <= tolerance_)) return false;
    }
    return true;
  };
  const auto isPole = [&](std::uint32_t a) { return poleComponent(a) >= 0; };
  const auto hang = [&](std::uint32_t a, std::uint32_t b, const Offset& offset) {
    const auto [a0, b0, a1, b1] = ends(a, b);
    const bool first = agree(a0, b0, offset), second = agree(a1, b1, offset);
    return (first && second) || (first && isPole(a1)) || (second && isPole(a0));
  };

  const auto wholeOffset = [&](std::uint32_t from, std::uint32_t to) {
    const auto whole = [&](std::size_t k) {
      return int(std::lround(std::clamp(value(from, k) - value(to, k), -1e6f, 1e6f)));
    };
    return Offset{whole(0), whole(1)};
  };
  const auto isPairAt = [&edges](std::size_t e) {
    return e + 1 < edges.size() && edges[e].low == edges[e + 1].low && edges[e].high == edges[e + 1].high;
  };
  if (!poles_.empty()) {
    // Around a pole the other ends of all edges go on, but where a turn ends; where charts merely meet they
    // do not, though all their values may be whole numbers.
    std::vector<std::uint32_t> breaks(mesh.positions.size());
    const auto look = [&](std::uint32_t pole, std::uint32_t a, std::uint32_t b) {
      if (!isPole(pole)) return;
      const Offset offset = wholeOffset(a, b);
      breaks[vertex[mesh.corners[pole]]] += !agree(a, b, offset) ? 2u : offset != Offset{} ? 1u : 0u;
    };
    for (std::size_t e = 0; e < edges.size(); ++e) {
      if (!isPairAt(e)) continue;
      const auto [a0, b0, a1, b1] = ends(edges[e].corner, edges[e + 1].corner);
      look(a0, a1, b1);
      look(a1, a0, b0);
      ++e;
    }
    for (std::size_t c = 0; c < cornerCount; ++c)
      if (breaks[vertex[mesh.corners[c]]] > 1) poles_[c] = -1;
  }

  DisjointSets charts(triangleCount);
  std::vector<std::array<std::uint32_t, 2>> apart;
  for (std::size_t e = 0; e < edges.size();) {
    if (!isPairAt(e)) {
      ++e;
      continue;
    }
    const std::uint32_t a = edges[e].corner, b = edges[e + 1].corner;
    e += 2;
    if (!hang(a, b, {})) {
      apart.push_back({a, b});
      continue;
    }
    beyond_[a] = b / 3;
    beyond_[b] = a / 3;
    charts.join(a / 3, b / 3);
  }

  // The root of a chart is its first triangle.
  chart_.resize(triangleCount);
  for (std::uint32_t t = 0; t < triangleCount; ++t) {
    const std::uint32_t root = charts.root(t);
    chart_[t] = root == t ? std::uint32_t(chartCount_++) : chart_[root];
  }

  for (const auto& [a, b] : apart) {
    seams_.push_back(mesh.corners[a]);
    seams_.push_back(mesh.corners[nextCorner(a)]);
    if (width != 2 || chart_[a / 3] != chart_[b / 3]) continue;
    const auto [a0, b0, a1, b1] = ends(a, b);
    const bool atSecond = isPole(a0);
    const Offset offset = wholeOffset(atSecond ? a1 : a0, atSecond ? b1 : b0);
    if (offset == Offset{} || !hang(a, b, offset)) continue;
    if (offsets_.empty()) offsets_.resize(cornerCount);
    beyond_[a] = b / 3;
    beyond_[b] = a / 3;
    offsets_[a] = offset;
    offsets_[b] = {-offset.u, -offset.v};
    for (const auto& [component, by] : {std::array{0, offset.u}, std::array{1, offset.v}})
      if (by != 0)
        period_[component] =
            period_[component] == 0 ? std::abs(by) : std::min(period_[component], std::abs(by));
  }
}

void AttributeCharts::findPoles(const Mesh& mesh, const MeshAttribute& attribute,
                                const std::vector<std::uint32_t>& vertex) {
  // Corners in the order of their vertices.
  std::vector<std::uint32_t> order(mesh.corners.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::array{vertex[mesh.corners[a]], a} < std::array{vertex[mesh.corners[b]], b};
  });
  std::vector<float> values;
  const auto differentOnes = [&](std::span<const std::uint32_t> corners, std::size_t k) {
    values.clear();
    for (const std::uint32_t c : corners) values.push_back(attribute.values[2 * std::size_t(c) + k]);
    std::sort(values.begin(), values.end());
    int count = 1;
    for (std::size_t i = 1; i < values.size(); ++i) count += values[i] - values[i - 1] > tolerance_;
    return count;
  };
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && vertex[mesh.corners[order[end]]] == vertex[mesh.corners[order[begin]]])
      ++end;
    if (end - begin < 3) continue;
    const std::span<const std::uint32_t> corners(order.data() + begin, end - begin);
    const int u = differentOnes(corners, 0), v = differentOnes(corners, 1);
    if (!((u == 1 && v >= 3) || (v == 1 && u >= 3))) continue;
    if (poles_.empty()) poles_.assign(mesh.corners.size(), std::int8_t(-1));
    for (const std::uint32_t c : corners) poles_[c] = std::int8_t(u == 1 ? 1 : 0);
  }
}

std::optional<AttributeCharts::Step> AttributeCharts::across(std::uint32_t triangle, int edge) const {
  const std::size_t at = 3 * std::size_t(triangle) + std::size_t(edge);
  if (beyond_[at] == kNone) return std::nullopt;
  return Step{beyond_[at], offsets_.empty() ? Offset{} : offsets_[at]};
}

bool AttributeCharts::hangsTogetherAs(const AttributeCharts& other) const {
  return beyond_ == other.beyond_ && offsets_ == other.offsets_ && poles_ == other.poles_;
}

}  // namespace nephele::detail
