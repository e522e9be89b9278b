#include "nephele/levelset/cut/detail/solids/polygon_fans.h"

#include <algorithm>
#include <cstddef>

namespace nephele::detail {
namespace {

constexpr std::uint32_t kNone = PolygonFans::Whole::kNone;

std::uint32_t nextCorner(std::uint32_t corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

/// The corners of the polygon that triangles with these first corners make; none where they have no vertices
/// in common.
std::vector<std::uint32_t> joined(const Mesh& mesh, std::span<const std::uint32_t> firstCorners) {
  std::vector<std::uint32_t> polygon{firstCorners[0], nextCorner(firstCorners[0])};
  for (const std::uint32_t first : firstCorners) {
    const std::uint32_t second = nextCorner(first);
    if (mesh.corners[first] != mesh.corners[polygon[0]] ||
        mesh.corners[second] != mesh.corners[polygon.back()])
      return {};
    polygon.push_back(nextCorner(second));
  }
  return polygon;
}

}  // namespace

PolygonFans::PolygonFans(const Mesh& mesh) {
  if (mesh.isTriangles()) return;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const std::size_t corners = mesh.face(f).size();
    if (corners < 3) continue;
    start_.push_back(std::uint32_t(fanOf_.size()));
    fanOf_.insert(fanOf_.end(), corners - 2, std::uint32_t(start_.size() - 1));
  }
  start_.push_back(std::uint32_t(fanOf_.size()));
}

std::vector<std::uint32_t> PolygonFans::join(Mesh& mesh, std::span<const Whole> wholes) const {
  // By triangle of the source, its face here.
  std::vector<std::uint32_t> faceOf(fanOf_.size(), kNone);
  for (std::uint32_t f = 0; f < wholes.size(); ++f)
    if (wholes[f].triangle != kNone) faceOf[wholes[f].triangle] = f;

  std::vector<std::uint32_t> before{0}, faceStart{0}, corners;
  std::vector<std::uint32_t> firstCorners;
  std::vector<bool> isTaken(wholes.size());
  for (std::uint32_t f = 0; f < wholes.size(); ++f) {
    std::vector<std::uint32_t> polygon;
    if (wholes[f].triangle != kNone && !isTaken[f]) {
      const std::uint32_t fan = fanOf_[wholes[f].triangle];
      const auto faces = std::span(faceOf).subspan(start_[fan], start_[fan + 1] - start_[fan]);
      if (faces.size() > 1 && std::ranges::find(faces, kNone) == faces.end()) {
        firstCorners.clear();
        for (const std::uint32_t face : faces) firstCorners.push_back(wholes[face].firstCorner);
        polygon = joined(mesh, firstCorners);
        if (!polygon.empty())
          for (const std::uint32_t face : faces) isTaken[face] = true;
      }
    }
    if (polygon.empty() && !isTaken[f]) polygon = {3 * f, 3 * f + 1, 3 * f + 2};
    corners.insert(corners.end(), polygon.begin(), polygon.end());
    if (!polygon.empty()) faceStart.push_back(std::uint32_t(corners.size()));
    before.push_back(std::uint32_t(faceStart.size() - 1));
  }

  for (MeshGroup& group : mesh.groups) {
    const std::uint32_t first = before[group.firstFace];
    group.faceCount = before[group.firstFace + group.faceCount] - first;
    group.firstFace = first;
  }
  for (MeshAttribute& attribute : mesh.attributes) {
    if (attribute.domain != MeshAttribute::Domain::corner) continue;
    const auto width = std::size_t(attribute.width);
    std::vector<float> values;
    values.reserve(width * corners.size());
    for (const std::uint32_t c : corners)
      values.insert(values.end(), attribute.values.begin() + std::ptrdiff_t(width * c),
                    attribute.values.begin() + std::ptrdiff_t(width * (c + 1)));
    attribute.values = std::move(values);
  }
  for (std::uint32_t& c : corners) c = mesh.corners[c];
  mesh.corners = std::move(corners);
  mesh.faceStart = std::move(faceStart);
  return before;
}

}  // namespace nephele::detail
