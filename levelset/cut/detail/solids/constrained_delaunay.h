#pragma once

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

/// Holds CGAL: for sources of the target nephele_levelset_exact only.
namespace nephele::detail {

/// As `delaunayTriangles` of cap_triangles.h, with the points of a CGAL kernel.
template <class Kernel>
std::optional<std::vector<std::array<std::uint32_t, 3>>> constrainedDelaunay(
    std::span<const typename Kernel::Point_2> points, std::span<const std::array<std::uint32_t, 2>> edges) {
  using Vertex = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
  using Face = CGAL::Triangulation_face_base_with_info_2<int, Kernel,
                                                         CGAL::Constrained_triangulation_face_base_2<Kernel>>;
  using Storage = CGAL::Triangulation_data_structure_2<Vertex, Face>;
  using Triangulation =
      CGAL::Constrained_Delaunay_triangulation_2<Kernel, Storage, CGAL::No_constraint_intersection_tag>;
  constexpr int kUnvisited = -1000000;
  const auto edgeKey = [](std::uint32_t a, std::uint32_t b) {
    return std::uint64_t(std::min(a, b)) << 32 | std::max(a, b);
  };

  Triangulation triangulation;
  std::vector<typename Triangulation::Vertex_handle> handles;
  handles.reserve(points.size());
  typename Triangulation::Face_handle hint;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const auto handle = triangulation.insert(points[i], hint);
    if (triangulation.number_of_vertices() != i + 1) return {};
    handle->info() = i;
    hint = handle->face();
    handles.push_back(handle);
  }
  // How often each edge runs from its lower to its higher index.
  std::unordered_map<std::uint64_t, int> net;
  try {
    for (const auto& [from, to] : edges) {
      const auto [entry, isNew] = net.try_emplace(edgeKey(from, to), 0);
      if (isNew) triangulation.insert_constraint(handles[from], handles[to]);
      entry->second += from < to ? 1 : -1;
    }
  } catch (const typename Triangulation::Intersection_of_constraints_exception&) {
    return {};
  }
  if (triangulation.dimension() < 2) return {};
  for (const auto face : triangulation.all_face_handles()) face->info() = kUnvisited;
  std::vector<typename Triangulation::Face_handle> open{triangulation.infinite_face()};
  open[0]->info() = 0;
  while (!open.empty()) {
    const auto face = open.back();
    open.pop_back();
    for (int k = 0; k < 3; ++k) {
      const auto other = face->neighbor(k);
      if (other->info() != kUnvisited) continue;
      other->info() = face->info();
      if (face->is_constrained(k)) {
        const std::uint32_t a = face->vertex(face->cw(k))->info(), b = face->vertex(face->ccw(k))->info();
        const auto found = net.find(edgeKey(a, b));
        if (found == net.end()) return {};
        // The other face is on the left of the edge from a to b.
        other->info() += b < a ? -found->second : found->second;
      }
      open.push_back(other);
    }
  }
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto face : triangulation.finite_face_handles()) {
    const std::array<std::uint32_t, 3> t{face->vertex(0)->info(), face->vertex(1)->info(),
                                         face->vertex(2)->info()};
    for (int i = 0; i < face->info(); ++i) triangles.push_back(t);
    for (int i = 0; i > face->info(); --i) triangles.push_back({t[0], t[2], t[1]});
  }
  return triangles;
}

}  // namespace nephele::detail
