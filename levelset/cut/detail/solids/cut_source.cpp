// What pieces take over from the mesh that they were cut from.
//
// A corner of an outer face lies in a triangle of the source; its attributes are those of the triangle's
// corners, weighted by barycentric coordinates, or those of the corner itself where it is one. Inner faces
// get the place on their plane in a frame that depends on the plane's normal alone.
#include "nephele/levelset/cut/detail/solids/cut_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/cut/detail/edge_counts.h"
#include "nephele/levelset/cut/detail/solids/carve.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

bool hasUv(const Mesh& mesh) {
  return std::any_of(mesh.attributes.begin(), mesh.attributes.end(),
                     [](const MeshAttribute& a) { return a.name == "uv" && a.width == 2; });
}

}  // namespace

std::size_t openEdges(const std::vector<TriangleIndices>& triangles) {
  std::uint32_t vertexCount = 0;
  for (const TriangleIndices& t : triangles)
    vertexCount = std::max({vertexCount, t[0] + 1, t[1] + 1, t[2] + 1});
  std::size_t open = 0;
  countEdges(
      vertexCount,
      [&](const auto& add) {
        for (const TriangleIndices& t : triangles)
          for (int k = 0; k < 3; ++k) add(t[k], t[(k + 1) % 3]);
      },
      [&](int up, int down) { open += std::size_t(std::abs(up - down)); });
  return open;
}

CutSource::CutSource(const Mesh& mesh, const std::string& name) : mesh_(triangulated(mesh)), polygons_(mesh) {
  require(mesh_.faceCount() > 0, fmt::format("cut: {} has no faces", name));
  require(mesh_.faceCount() < kSourceEdge,
          fmt::format("cut: {} has more than 1 073 741 823 triangles", name));
  for (const Vec3d& p : mesh_.positions)
    require(isFinite(p), fmt::format("cut: {} has a position that is not finite", name));
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
    require(open == 0, fmt::format("cut: {} is open: {} edges have no face on their other side", name, open));
  }
  require(!triangles_.empty(), fmt::format("cut: {} has no faces with an area", name));
  volume_ = signedVolume(mesh_);
  require(volume_ > 0,
          fmt::format("cut: {} must enclose a volume, facing outwards; its volume is {}", name, volume_));
  positions_ = mesh_.positions;
  Vec3d far{};
  low_ = high_ = positions_[triangles_[0][0]];
  for (const TriangleIndices& t : triangles_)
    for (const std::uint32_t v : t) {
      const Vec3d& p = positions()[v];
      low_ = min(low_, p);
      high_ = max(high_, p);
      far = max(far, max(p, -p));
    }
  tolerance_ = 1e-11 * length(high_ - low_) + 4e-16 * length(far);
  groups_.assign(mesh_.faceCount(), 0);
  for (std::uint32_t g = 0; g < mesh_.groups.size(); ++g)
    std::fill_n(groups_.begin() + mesh_.groups[g].firstFace, mesh_.groups[g].faceCount, g + 1);
}

std::uint32_t CutSource::groupOf(std::uint32_t face) const {
  return isInner(face) ? std::uint32_t(mesh_.groups.size() + 1) : groups_[faceOf_[face]];
}

void CutSource::refine(Carved&& carved) {
  positions_ = std::move(carved.positions);
  triangles_ = std::move(carved.triangles);
  frames_ = std::move(carved.frames);
  std::vector<std::uint32_t> faces;
  faces.reserve(carved.parents.size());
  for (const std::uint32_t parent : carved.parents)
    faces.push_back(parent & kOnPlane ? parent : faceOf_[parent]);
  faceOf_ = std::move(faces);
}

PlaneFrame CutSource::frameOf(const SolidSplitter& splitter, std::uint32_t face) const {
  if (face & kOnPlane) return PlaneFrame::of(splitter.planes()[face & ~kOnPlane].normal);
  return frames_[faceOf_[face] & ~kOnPlane];
}

CutSource::Weights CutSource::weightsAt(std::uint32_t triangle, const Vec3d& p) const {
  const std::size_t corner = 3 * std::size_t(faceOf_[triangle]);
  const Vec3d &a = mesh_.positions[mesh_.corners[corner]], &b = mesh_.positions[mesh_.corners[corner + 1]],
              &c = mesh_.positions[mesh_.corners[corner + 2]];
  if (p == a) return {1, 0, 0};
  if (p == b) return {0, 1, 0};
  if (p == c) return {0, 0, 1};
  const Vec3d normal = cross(b - a, c - a);
  const double area = dot(normal, normal);
  if (area == 0) return {1, 0, 0};
  const double wb = std::clamp(dot(normal, cross(p - a, c - a)) / area, 0.0, 1.0);
  const double wc = std::clamp(dot(normal, cross(b - a, p - a)) / area, 0.0, 1.0 - wb);
  return {1 - wb - wc, wb, wc};
}

PolygonFans::Whole CutSource::wholeAt(const SolidSplitter& splitter, const SolidTriangle& t,
                                      std::uint32_t face) const {
  if (isInner(t.face)) return {};
  const std::uint32_t triangle = faceOf_[t.face];
  for (std::uint32_t first = 0; first < 3; ++first) {
    bool isSame = true;
    for (std::uint32_t k = 0; k < 3; ++k)
      isSame &= splitter.position(t.vertices[(first + k) % 3]) ==
                mesh_.positions[mesh_.corners[3 * std::size_t(triangle) + k]];
    if (isSame) return {triangle, 3 * face + first};
  }
  return {};
}

ShellMesh CutSource::meshOf(const SolidSplitter& splitter, const Shell& shell) const {
  std::vector<std::uint32_t> order(shell.triangles.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return groupOf(shell.triangles[a].face) < groupOf(shell.triangles[b].face);
  });
  ShellMesh result;
  Mesh& mesh = result.mesh;
  mesh.positions.reserve(shell.vertices.size());
  for (const std::uint32_t v : shell.vertices) mesh.positions.push_back(splitter.position(v));
  result.firstInside = order.size();
  std::uint32_t group = 0;
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    const std::uint32_t here = groupOf(shell.triangles[order[i]].face);
    if (here != group) {
      const bool isInside = here > mesh_.groups.size();
      if (isInside)
        mesh.groups.push_back({"inside", i, 0});
      else
        mesh.groups.push_back({mesh_.groups[here - 1].name, i, 0, mesh_.groups[here - 1].material});
      if (isInside) result.firstInside = i;
      group = here;
    }
    if (group != 0) ++mesh.groups.back().faceCount;
    mesh.addFace(std::span(shell.corners).subspan(3 * std::size_t(order[i]), 3));
  }
  for (const MeshAttribute& attribute : mesh_.attributes)
    addAttribute(attribute, splitter, shell, order, mesh);
  if (!hasUv(mesh_)) addAttribute({"uv", MeshAttribute::Domain::corner, 2, {}}, splitter, shell, order, mesh);
  // What touches itself is split along edges of triangles.
  if (shell.crowded.empty() && polygons_.any()) {
    std::vector<PolygonFans::Whole> wholes;
    for (std::uint32_t i = 0; i < order.size(); ++i)
      wholes.push_back(wholeAt(splitter, shell.triangles[order[i]], i));
    result.firstInside = polygons_.join(mesh, wholes)[result.firstInside];
  }
  if (shell.crowded.empty()) return result;
  std::vector<std::uint32_t> placeOf(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) placeOf[order[i]] = i;
  const auto cornerOf = [&](std::uint32_t c) { return 3 * placeOf[c / 3] + c % 3; };
  for (const CornerPair& pair : shell.crowded)
    result.crowded.push_back({cornerOf(pair[0]), cornerOf(pair[1])});
  return result;
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
    const bool inner = isInner(t.face);
    if (inner && !isUv) continue;
    const PlaneFrame frame = inner ? frameOf(splitter, t.face) : PlaneFrame{};
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = t.vertices[k], number = mesh.corners[3 * f + k];
      const Vec3d& p = splitter.position(vertex);
      float* value = result.values.data() + width * (perVertex ? number : 3 * f + k);
      if (inner) {
        value[0] = float(dot(p, frame.u));
        value[1] = float(dot(p, frame.v));
      } else if (!attribute.values.empty() && !(perVertex && isSet[number])) {
        const Weights w = weightsAt(t.face, p);
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
