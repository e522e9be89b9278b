// Taubin's filter on the neighbours that OpenMesh knows. Every step reads all positions before it writes any.
#include "nephele/levelset/mesh/smoothing.h"

#include <fmt/format.h>

#include "nephele/levelset/mesh/detail/half_edge_mesh.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

using detail::HalfEdgeMesh;

// How far a step goes towards the mean of the neighbours, and back: waves below 0.1, in the eigenvalues of
// the mean, pass, as 1 / 0.5 - 1 / 0.5263 = 0.1.
constexpr double kShrink = 0.5;
constexpr double kSwell = -0.5263157894736842;

// Neighbours of all vertices one after the other: those of v from start[v] on. Vertices of a border have
// their neighbours on it alone.
struct Neighbours {
  std::vector<std::uint32_t> start{0}, list;

  explicit Neighbours(const HalfEdgeMesh& mesh) {
    for (const auto v : mesh.vertices()) {
      const bool isBorder = mesh.is_boundary(v);
      if (!mesh.is_isolated(v))
        for (const auto h : mesh.voh_range(v))
          if (!isBorder || mesh.is_boundary(mesh.edge_handle(h)))
            list.push_back(std::uint32_t(mesh.to_vertex_handle(h).idx()));
      start.push_back(std::uint32_t(list.size()));
    }
  }
};

}  // namespace

Mesh smoothed(const Mesh& mesh, const SmoothingOptions& options, const Progress& progress) {
  require(options.rounds >= 1, fmt::format("smoothing: rounds must be >= 1, got {}", options.rounds));
  progress.begin("smooth");
  const Mesh welded = detail::weldedTriangles(mesh, progress);
  require(welded.faceCount() > 0, "smoothing: the mesh has no faces");
  const Neighbours neighbours(detail::halfEdgesOf(welded, {.what = "smoothing"}, progress));
  std::vector<Vec3d> positions = mesh.positions, next = positions;
  for (int step = 0; step < 2 * options.rounds; ++step) {
    progress.check();
    const double weight = step % 2 == 0 ? kShrink : kSwell;
    parallelFor(positions.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        const std::uint32_t from = neighbours.start[v], to = neighbours.start[v + 1];
        if (from == to) continue;
        // Relative to the vertex, so that a mesh far from the origin keeps its digits.
        Vec3d sum;
        for (std::uint32_t i = from; i < to; ++i) sum += positions[neighbours.list[i]] - positions[v];
        next[v] = positions[v] + sum * (weight / double(to - from));
      }
    });
    positions.swap(next);
    progress.advance(double(step + 1) / (2 * options.rounds));
  }
  Mesh result = mesh;
  const std::vector<std::uint32_t> first = firstEqualPosition(mesh.positions);
  for (std::size_t v = 0; v < first.size(); ++v) result.positions[v] = positions[first[v]];
  return result;
}

}  // namespace nephele
