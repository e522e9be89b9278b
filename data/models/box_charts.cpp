#include "data/models/box_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

namespace nephele {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t(0);
using Neighbours = std::array<std::uint32_t, 3>;

// The face on the other side of each edge.
std::vector<Neighbours> neighboursOf(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> cornerOfEdge;
  for (std::uint32_t c = 0; c < mesh.corners.size(); ++c) {
    const std::uint32_t next = c - c % 3 + (c + 1) % 3;
    cornerOfEdge[{mesh.corners[c], mesh.corners[next]}] = c;
  }
  std::vector<Neighbours> neighbours(mesh.faceCount(), {kNone, kNone, kNone});
  for (const auto& [edge, corner] : cornerOfEdge) {
    const auto other = cornerOfEdge.find({edge.second, edge.first});
    if (other != cornerOfEdge.end()) neighbours[corner / 3][corner % 3] = other->second / 3;
  }
  return neighbours;
}

// Which of +x, -x, +y, -y, +z, -z a direction is nearest to.
int sideOf(const Vec3d& n) {
  int axis = 0;
  for (int a = 1; a < 3; ++a)
    if (std::abs(n[a]) > std::abs(n[axis])) axis = a;
  return 2 * axis + (n[axis] < 0 ? 1 : 0);
}

std::vector<Vec3d> smoothNormals(const Mesh& mesh, const std::vector<Neighbours>& neighbours, int rounds) {
  std::vector<Vec3d> normals(mesh.faceCount());
  for (std::size_t f = 0; f < normals.size(); ++f) {
    const auto face = mesh.face(f);
    const Vec3d& a = mesh.positions[face[0]];
    normals[f] = cross(mesh.positions[face[1]] - a, mesh.positions[face[2]] - a);
  }
  for (int round = 0; round < rounds; ++round) {
    std::vector<Vec3d> smooth = normals;
    for (std::size_t f = 0; f < normals.size(); ++f)
      for (const std::uint32_t n : neighbours[f]) smooth[f] += n == kNone ? Vec3d{} : normals[n];
    normals = smooth;
    for (Vec3d& n : normals) n *= 0.25;
  }
  return normals;
}

// The number of a chart for each face: neighbours that look to the same side are in one.
std::vector<std::uint32_t> chartsOf(const std::vector<int>& sides,
                                    const std::vector<Neighbours>& neighbours) {
  std::vector<std::uint32_t> charts(sides.size(), kNone);
  std::uint32_t count = 0;
  for (std::uint32_t seed = 0; seed < sides.size(); ++seed) {
    if (charts[seed] != kNone) continue;
    std::vector<std::uint32_t> open{seed};
    charts[seed] = count;
    while (!open.empty()) {
      const std::uint32_t f = open.back();
      open.pop_back();
      for (const std::uint32_t n : neighbours[f]) {
        if (n == kNone || charts[n] != kNone || sides[n] != sides[f]) continue;
        charts[n] = count;
        open.push_back(n);
      }
    }
    ++count;
  }
  return charts;
}

struct Chart {
  double lowU = 1e30, lowV = 1e30, highU = -1e30, highV = -1e30;
  double atU = 0, atV = 0;
  double width() const { return highU - lowU; }
  double height() const { return highV - lowV; }
};

// Puts charts in rows of this width, in that order; returns the side of the square that holds them.
double inRows(std::vector<Chart>& charts, const std::vector<std::size_t>& order, double width, double gap) {
  double u = gap, v = gap, rowHeight = 0;
  for (const std::size_t i : order) {
    Chart& chart = charts[i];
    if (u + chart.width() + gap > width && u > gap) {
      u = gap;
      v += rowHeight + gap;
      rowHeight = 0;
    }
    chart.atU = u;
    chart.atV = v;
    u += chart.width() + gap;
    width = std::max(width, u);
    rowHeight = std::max(rowHeight, chart.height());
  }
  return std::max(width, v + rowHeight + gap);
}

// In rows, the highest first, of the width that makes the smallest square; returns its side.
double laidOut(std::vector<Chart>& charts, double gap) {
  double area = 0;
  for (const Chart& chart : charts) area += (chart.width() + gap) * (chart.height() + gap);
  std::vector<std::size_t> order(charts.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return charts[a].height() > charts[b].height(); });
  double best = std::sqrt(area);
  for (int i = 1; i <= 40; ++i) {
    const double width = std::sqrt(area) * (1 + 0.025 * i);
    if (i == 1 || inRows(charts, order, width, gap) < inRows(charts, order, best, gap)) best = width;
  }
  return inRows(charts, order, best, gap);
}

}  // namespace

void addBoxCharts(Mesh& mesh) {
  constexpr int kSmoothing = 24;
  const std::vector<Neighbours> neighbours = neighboursOf(mesh);
  std::vector<int> sides;
  for (const Vec3d& n : smoothNormals(mesh, neighbours, kSmoothing)) sides.push_back(sideOf(n));
  const std::vector<std::uint32_t> chartOfFace = chartsOf(sides, neighbours);

  // Seen from outside, u to the right and v up, or to the back.
  const auto flat = [&](std::size_t f, const Vec3d& p) {
    const int axis = sides[f] / 2;
    const double turned = sides[f] % 2 == 0 ? 1 : -1;
    if (axis == 0) return std::pair(-turned * p.z, p.y);
    if (axis == 1) return std::pair(p.x, -turned * p.z);
    return std::pair(turned * p.x, p.y);
  };
  std::vector<Chart> charts(1 + *std::max_element(chartOfFace.begin(), chartOfFace.end()));
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
    const auto [u, v] = flat(c / 3, mesh.positions[mesh.corners[c]]);
    Chart& chart = charts[chartOfFace[c / 3]];
    chart.lowU = std::min(chart.lowU, u);
    chart.lowV = std::min(chart.lowV, v);
    chart.highU = std::max(chart.highU, u);
    chart.highV = std::max(chart.highV, v);
  }
  const Box box = boundingBox(mesh);
  const double side = laidOut(charts, 0.01 * double(box.max.x - box.min.x));
  MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}};
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
    const auto [u, v] = flat(c / 3, mesh.positions[mesh.corners[c]]);
    const Chart& chart = charts[chartOfFace[c / 3]];
    uv.values.push_back(float((u - chart.lowU + chart.atU) / side));
    uv.values.push_back(float((v - chart.lowV + chart.atV) / side));
  }
  mesh.attributes.push_back(uv);
}

}  // namespace nephele
