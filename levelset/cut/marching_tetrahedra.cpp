#include "nephele/levelset/cut/marching_tetrahedra.h"

#include <vector>

#include "nephele/levelset/cut/detail/tetrahedra/lattice_carve.h"

namespace nephele {
namespace {

using detail::Carved;

Mesh meshOf(const Carved& carved) {
  constexpr std::uint32_t kUnused = ~0u;
  std::vector<std::uint32_t> numbers(carved.positions.size(), kUnused);
  Mesh mesh;
  mesh.corners.reserve(3 * carved.triangles.size());
  mesh.faceStart.reserve(carved.triangles.size() + 1);
  for (const detail::TriangleIndices& t : carved.triangles) mesh.addFace(t);
  for (const std::uint32_t v : mesh.corners) numbers[v] = 0;
  for (std::size_t v = 0; v < numbers.size(); ++v) {
    if (numbers[v] == kUnused) continue;
    numbers[v] = std::uint32_t(mesh.positions.size());
    mesh.positions.push_back(carved.positions[v]);
  }
  for (std::uint32_t& v : mesh.corners) v = numbers[v];
  return mesh;
}

}  // namespace

Mesh marchingTetrahedra(const BrickGrid& level, const Progress& progress) {
  progress.begin("triangles");
  Mesh mesh = meshOf(detail::carveLattice(level, {}, 0, progress));
  progress.count("triangles", double(mesh.faceCount()));
  return mesh;
}

}  // namespace nephele
