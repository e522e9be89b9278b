#include "nephele/levelset/mesh/detail/wedges.h"

#include <algorithm>

namespace nephele::detail {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

bool haveEqualValues(const MeshAttribute& a, std::uint32_t corner, std::uint32_t other) {
  const auto width = std::ptrdiff_t(a.width);
  const auto first = a.values.begin() + std::ptrdiff_t(corner) * width;
  return std::equal(first, first + width, a.values.begin() + std::ptrdiff_t(other) * width);
}

// Per face 1 more than the index of its group; 0: none.
std::vector<std::uint32_t> groupsOf(const Mesh& mesh) {
  std::vector<std::uint32_t> groupOf(mesh.faceCount());
  for (std::size_t g = 0; g < mesh.groups.size(); ++g)
    std::fill_n(groupOf.begin() + mesh.groups[g].firstFace, mesh.groups[g].faceCount, std::uint32_t(g + 1));
  return groupOf;
}

}  // namespace

Wedges::Wedges(const Mesh& triangles) {
  std::vector<const MeshAttribute*> ofCorners;
  for (const MeshAttribute& a : triangles.attributes)
    if (a.domain == MeshAttribute::Domain::corner) {
      ofCorners.push_back(&a);
      if (a.name == "uv" && a.width == 2) coordinates_ = &a;
    }
  const std::vector<std::uint32_t> groupOf = groupsOf(triangles);
  // Wedges of a vertex, as a list: the first, and after each the next.
  std::vector<std::uint32_t> first(triangles.positions.size(), kNone), next(triangles.corners.size(), kNone);
  for (std::uint32_t c = 0; c < triangles.corners.size(); ++c) {
    if (c % 3 == 0) {
      vertices_.push_back({triangles.corners[c], triangles.corners[c + 1], triangles.corners[c + 2]});
      wedges_.emplace_back();
    }
    const auto isSame = [&](std::uint32_t other) {
      return groupOf[c / 3] == groupOf[other / 3] &&
             std::ranges::all_of(ofCorners,
                                 [&](const MeshAttribute* a) { return haveEqualValues(*a, c, other); });
    };
    std::uint32_t* wedge = &first[triangles.corners[c]];
    while (*wedge != kNone && !isSame(*wedge)) wedge = &next[*wedge];
    if (*wedge == kNone) {
      *wedge = c;
      hasSeams_ = hasSeams_ || c != first[triangles.corners[c]];
    }
    wedges_.back()[c % 3] = *wedge;
  }
}

bool Wedges::turns(int face, int vertex, std::uint32_t wedge) const {
  if (!coordinates_) return false;
  const auto areaOf = [&](const Corners& corners) {
    const auto at = [&](std::size_t k, std::size_t axis) {
      return double(coordinates_->values[2 * std::size_t{corners[k]} + axis]);
    };
    return (at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(1, 1) - at(0, 1)) * (at(2, 0) - at(0, 0));
  };
  Corners after = of(face);
  after[place(face, vertex)] = wedge;
  const double before = areaOf(of(face));
  return before != 0 && !(before * areaOf(after) > 0);
}

}  // namespace nephele::detail
