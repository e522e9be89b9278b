// What pieces take over from the mesh that they were cut from.
//
// A corner of an outer face lies in a triangle of the source; its attributes are those of the triangle's
// corners, weighted by barycentric coordinates, or those of the corner itself where it is one. Inner faces
// get the place on their plane in a frame that depends on the plane's normal alone.
#include "levelset/cut_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "modeling/error.h"

namespace nephele::detail {
namespace {

/// Edges without as many faces one way as the other.
std::size_t openEdges(const std::vector<TriangleIndices>& triangles) {
  std::vector<std::pair<std::uint64_t, int>> edges;
  edges.reserve(3 * triangles.size());
  for (const TriangleIndices& t : triangles)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      edges.push_back({std::uint64_t(std::min(a, b)) << 32 | std::max(a, b), a < b ? 1 : -1});
    }
  std::sort(edges.begin(), edges.end());
  std::size_t open = 0;
  for (std::size_t i = 0, end = 0; i < edges.size(); i = end) {
    int net = 0;
    for (end = i; end < edges.size() && edges[end].first == edges[i].first; ++end) net += edges[end].second;
    open += std::size_t(std::abs(net));
  }
  return open;
}

bool hasUv(const Mesh& mesh) {
  return std::any_of(mesh.attributes.begin(), mesh.attributes.end(),
                     [](const MeshAttribute& a) { return a.name == "uv" && a.width == 2; });
}

}  // namespace

CutSource::CutSource(const Mesh& mesh) : mesh_(triangulated(mesh)) {
  require(mesh_.faceCount() > 0, "cut: the mesh has no faces");
  require(mesh_.faceCount() < kSourceEdge, "cut: the mesh has more than 1 073 741 823 triangles");
  for (const Vec3d& p : mesh_.positions)
    require(isFinite(p), "cut: the mesh has a position that is not finite");
  const auto take = [&](const std::vector<std::uint32_t>& same) {
    triangles_.clear();
    faceOf_.clear();
    for (std::uint32_t f = 0; f < mesh_.faceCount(); ++f) {
      TriangleIndices t{mesh_.corners[3 * f], mesh_.corners[3 * f + 1], mesh_.corners[3 * f + 2]};
      if (!same.empty()) t = {same[t[0]], same[t[1]], same[t[2]]};
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      triangles_.push_back(t);
      faceOf_.push_back(f);
    }
    return openEdges(triangles_);
  };
  if (take({}) != 0) {
    const std::size_t open = take(firstEqualPosition(mesh_.positions));
    require(open == 0, fmt::format("cut: the mesh is open: {} edges have no face on their other side", open));
  }
  require(!triangles_.empty(), "cut: the mesh has no faces with an area");
  volume_ = signedVolume(mesh_);
  require(volume_ > 0,
          fmt::format("cut: the mesh must enclose a volume, facing outwards; its volume is {}", volume_));
  Vec3d low = positions()[triangles_[0][0]], high = low, far{};
  for (const TriangleIndices& t : triangles_)
    for (const std::uint32_t v : t) {
      const Vec3d& p = positions()[v];
      low = min(low, p);
      high = max(high, p);
      far = max(far, max(p, -p));
    }
  tolerance_ = 1e-11 * length(high - low) + 4e-16 * length(far);
  groups_.assign(mesh_.faceCount(), 0);
  for (std::uint32_t g = 0; g < mesh_.groups.size(); ++g)
    std::fill_n(groups_.begin() + mesh_.groups[g].firstFace, mesh_.groups[g].faceCount, g + 1);
}

std::uint32_t CutSource::groupOf(std::uint32_t face) const {
  return face & kOnPlane ? std::uint32_t(mesh_.groups.size() + 1) : groups_[faceOf_[face]];
}

CutSource::Weights CutSource::weightsAt(std::uint32_t triangle, std::uint32_t vertex, const Vec3d& p) const {
  const TriangleIndices& v = triangles_[triangle];
  for (std::size_t k = 0; k < 3; ++k)
    if (v[k] == vertex) return {k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
  const Vec3d &a = positions()[v[0]], &b = positions()[v[1]], &c = positions()[v[2]];
  const Vec3d normal = cross(b - a, c - a);
  const double area = dot(normal, normal);
  if (area == 0) return {1, 0, 0};
  const double wb = std::clamp(dot(normal, cross(p - a, c - a)) / area, 0.0, 1.0);
  const double wc = std::clamp(dot(normal, cross(b - a, p - a)) / area, 0.0, 1.0 - wb);
  return {1 - wb - wc, wb, wc};
}

Mesh CutSource::meshOf(const SolidSplitter& splitter, const Shell& shell, std::size_t& firstInside) const {
  std::vector<std::uint32_t> order(shell.triangles.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return groupOf(shell.triangles[a].face) < groupOf(shell.triangles[b].face);
  });
  Mesh mesh;
  mesh.positions.reserve(shell.vertices.size());
  for (const std::uint32_t v : shell.vertices) mesh.positions.push_back(splitter.position(v));
  firstInside = order.size();
  std::uint32_t group = 0;
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    const std::uint32_t here = groupOf(shell.triangles[order[i]].face);
    if (here != group) {
      const bool isInside = here > mesh_.groups.size();
      mesh.groups.push_back({isInside ? "inside" : mesh_.groups[here - 1].name, i, 0});
      if (isInside) firstInside = i;
      group = here;
    }
    if (group != 0) ++mesh.groups.back().faceCount;
    mesh.addFace(std::span(shell.corners).subspan(3 * std::size_t(order[i]), 3));
  }
  for (const MeshAttribute& attribute : mesh_.attributes)
    addAttribute(attribute, splitter, shell, order, mesh);
  if (!hasUv(mesh_)) addAttribute({"uv", MeshAttribute::Domain::corner, 2, {}}, splitter, shell, order, mesh);
  return mesh;
}

void CutSource::addAttribute(const MeshAttribute& attribute, const SolidSplitter& splitter,
                             const Shell& shell, const std::vector<std::uint32_t>& order, Mesh& mesh) const {
  const bool isUv = attribute.name == "uv" && attribute.width == 2;
  const bool perVertex = attribute.domain == MeshAttribute::Domain::vertex && !isUv;
  const auto width = std::size_t(attribute.width);
  const auto valueAt = [&](std::uint32_t face, std::size_t k) {
    const std::size_t corner = 3 * std::size_t(faceOf_[face]) + k;
    const bool isVertex = attribute.domain == MeshAttribute::Domain::vertex;
    return attribute.values.data() + width * (isVertex ? mesh_.corners[corner] : corner);
  };
  MeshAttribute result{
      attribute.name, perVertex ? attribute.domain : MeshAttribute::Domain::corner, attribute.width, {}};
  result.values.assign(width * (perVertex ? mesh.positions.size() : mesh.corners.size()), 0.0f);
  std::vector<bool> isSet(perVertex ? mesh.positions.size() : 0);
  for (std::size_t f = 0; f < order.size(); ++f) {
    const SolidTriangle& t = shell.triangles[order[f]];
    Vec3d u{}, v{};
    if (t.face & kOnPlane) {
      if (!isUv) continue;
      const Vec3d& n = splitter.planes()[t.face & ~kOnPlane].normal;
      u = normalize(std::abs(n.y) < 0.9 ? cross(Vec3d{0, 1, 0}, n) : cross(Vec3d{0, 0, 1}, n));
      v = cross(n, u);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = t.vertices[k], number = mesh.corners[3 * f + k];
      const Vec3d& p = splitter.position(vertex);
      float* value = result.values.data() + width * (perVertex ? number : 3 * f + k);
      if (t.face & kOnPlane) {
        value[0] = float(dot(p, u));
        value[1] = float(dot(p, v));
      } else if (!attribute.values.empty() && !(perVertex && isSet[number])) {
        const Weights w = weightsAt(t.face, vertex, p);
        for (std::size_t i = 0; i < width; ++i)
          value[i] = float(w[0] * double(valueAt(t.face, 0)[i]) + w[1] * double(valueAt(t.face, 1)[i]) +
                           w[2] * double(valueAt(t.face, 2)[i]));
        if (perVertex) isSet[number] = true;
      }
    }
  }
  if (perVertex && !mesh_.positions.empty()) {
    std::vector<double> mean(width);
    for (std::size_t i = 0; i < attribute.values.size(); ++i)
      mean[i % width] += double(attribute.values[i]) / double(mesh_.positions.size());
    for (std::size_t n = 0; n < isSet.size(); ++n)
      for (std::size_t i = 0; i < width && !isSet[n]; ++i) result.values[width * n + i] = float(mean[i]);
  }
  mesh.attributes.push_back(std::move(result));
}

}  // namespace nephele::detail
