#include "tests/bench/corefined_cells.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/clip.h>
#include <CGAL/Polygon_mesh_processing/measure.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <vector>

namespace nephele {
namespace {

namespace processing = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

}  // namespace

struct CorefinedCells::Source {
  Surface surface;
};

CorefinedCells::CorefinedCells(const Mesh& mesh) : source_(std::make_unique<Source>()) {
  std::vector<Kernel::Point_3> points;
  for (const Vec3d& p : mesh.positions) points.emplace_back(p.x, p.y, p.z);
  std::vector<std::array<std::size_t, 3>> faces;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto v = mesh.face(f);
    faces.push_back({v[0], v[1], v[2]});
  }
  processing::polygon_soup_to_polygon_mesh(points, faces, source_->surface);
}

CorefinedCells::~CorefinedCells() = default;

double CorefinedCells::volumeOf(std::span<const Vec3f> points, std::uint32_t index) const {
  Surface surface = source_->surface;
  const Vec3d centre(points[index]);
  std::vector<std::uint32_t> others;
  for (std::uint32_t j = 0; j < points.size(); ++j)
    if (j != index) others.push_back(j);
  const auto distance = [&](std::uint32_t j) { return length(Vec3d(points[j]) - centre); };
  std::sort(others.begin(), others.end(),
            [&](std::uint32_t a, std::uint32_t b) { return distance(a) < distance(b); });
  for (const std::uint32_t other : others) {
    if (num_vertices(surface) == 0) return 0;
    double reach = 0;
    for (const auto v : surface.vertices()) {
      const auto& p = surface.point(v);
      reach = std::max(reach, length(Vec3d{p.x(), p.y(), p.z()} - centre));
    }
    if (distance(other) > 2 * reach) break;
    const Vec3d normal = Vec3d(points[other]) - centre, middle = (Vec3d(points[other]) + centre) * 0.5;
    processing::clip(surface, Kernel::Plane_3(normal.x, normal.y, normal.z, -dot(normal, middle)),
                     CGAL::parameters::clip_volume(true));
    surface.collect_garbage();
  }
  return num_vertices(surface) == 0 ? 0 : CGAL::to_double(processing::volume(surface));
}

}  // namespace nephele
