// Taubin's filter on the neighbours that OpenMesh knows. Every step reads all positions before it writes any.
// The filter alone shrinks coarse shapes, whose whole is a short wave, and swells others over hundreds of
// rounds; so closed parts are brought back to their volume along their normals, which unlike a change of
// scale does not make thin parts longer.
#include "nephele/levelset/mesh/smoothing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/levelset/grid/disjoint_sets.h"
#include "nephele/levelset/mesh/detail/half_edge_mesh.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {
namespace {

using detail::HalfEdgeMesh;

// How far a step goes towards the mean of the neighbours.
constexpr double kShrink = 0.5;
// Waves below this, in the eigenvalues of the mean, pass.
constexpr double kPassBand = 0.1;

// How far the step back goes, which decides what passes: no wave may grow by more than half a percent in all
// rounds, and the one in the middle of the band grows by kShrink * step * band^2 / 4 in each.
double swell(int rounds) {
  const double band = std::min(kPassBand, std::sqrt(4 * 0.005 / (kShrink * 0.5 * rounds)));
  return 1 / (band - 1 / kShrink);
}

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

// The closed parts of a mesh, and what they enclose.
class ClosedParts {
 public:
  ClosedParts(const HalfEdgeMesh& mesh, const Mesh& welded) : corners_(welded.corners) {
    detail::DisjointSets parts(welded.positions.size());
    for (std::size_t c = 0; c < corners_.size(); c += 3)
      parts.join(corners_[c], corners_[c + 1]), parts.join(corners_[c], corners_[c + 2]);
    for (std::size_t v = 0; v < welded.positions.size(); ++v) root_.push_back(parts.root(std::uint32_t(v)));
    isClosed_.assign(root_.size(), 1);
    for (const auto v : mesh.vertices())
      if (mesh.is_boundary(v)) isClosed_[root_[std::size_t(v.idx())]] = 0;
    measure(welded.positions);
    wanted_ = volume_;
  }

  /// Moves the vertices of each along their normals until it encloses what it did at first.
  void restore(std::vector<Vec3d>& positions) {
    constexpr double kExact = 1e-9;
    constexpr int kMostSteps = 8;
    for (int step = 0; step < kMostSteps; ++step) {
      measure(positions);
      const auto missing = [&](std::uint32_t part) { return wanted_[part] - volume_[part]; };
      bool isDone = true;
      for (std::uint32_t part = 0; part < wanted_.size(); ++part)
        isDone = isDone && std::abs(missing(part)) <= kExact * std::abs(wanted_[part]);
      if (isDone) return;
      parallelFor(positions.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t v = begin; v < end; ++v) {
          const std::uint32_t part = root_[v];
          const double size = length(gradient_[v]);
          if (isClosed_[part] && size > 0)
            positions[v] += gradient_[v] * (missing(part) / (area_[part] * size));
        }
      });
    }
  }

 private:
  // Volumes, how they change with each vertex, and the sum of the sizes of that: the area.
  void measure(const std::vector<Vec3d>& positions) {
    volume_.assign(positions.size(), 0);
    area_.assign(positions.size(), 0);
    gradient_.assign(positions.size(), {});
    for (std::size_t c = 0; c < corners_.size(); c += 3) {
      const std::uint32_t part = root_[corners_[c]];
      if (!isClosed_[part]) continue;
      const Vec3d &a = positions[corners_[c]], &b = positions[corners_[c + 1]],
                  &d = positions[corners_[c + 2]];
      const Vec3d twiceArea = cross(b - a, d - a);
      volume_[part] += dot(a - positions[part], twiceArea) / 6;
      for (std::size_t k = 0; k < 3; ++k) gradient_[corners_[c + k]] += twiceArea / 6;
    }
    for (std::size_t v = 0; v < positions.size(); ++v) area_[root_[v]] += length(gradient_[v]);
  }

  const std::vector<std::uint32_t>& corners_;
  // Of each vertex the one that stands for its part; of these the rest.
  std::vector<std::uint32_t> root_;
  std::vector<char> isClosed_;
  std::vector<double> wanted_, volume_, area_;
  std::vector<Vec3d> gradient_;
};

}  // namespace

Mesh smoothed(const Mesh& mesh, const SmoothingOptions& options, const Progress& progress) {
  require(options.rounds >= 1, fmt::format("smoothing: rounds must be >= 1, got {}", options.rounds));
  progress.begin("smooth");
  const Mesh welded = detail::weldedTriangles(mesh, progress);
  require(welded.faceCount() > 0, "smoothing: the mesh has no faces");
  const HalfEdgeMesh halfEdges = detail::halfEdgesOf(welded, {.what = "smoothing"}, progress);
  const Neighbours neighbours(halfEdges);
  ClosedParts parts(halfEdges, welded);
  std::vector<Vec3d> positions = mesh.positions, next = positions;
  for (int step = 0; step < 2 * options.rounds; ++step) {
    progress.check();
    const double weight = step % 2 == 0 ? kShrink : swell(options.rounds);
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
    if (step % 2 == 1) parts.restore(positions);
    progress.advance(double(step + 1) / (2 * options.rounds));
  }
  Mesh result = mesh;
  const std::vector<std::uint32_t> first = firstEqualPosition(mesh.positions);
  for (std::size_t v = 0; v < first.size(); ++v) result.positions[v] = positions[first[v]];
  return result;
}

}  // namespace nephele
