// Pseudo-normals of a closed triangle mesh.
//
// Twins of half-edges are found among the half-edges that leave their end. Seams of texture coordinates split
// vertices: only if a twin is missing are vertices of bit-equal position merged, and the search repeated. A
// mesh that has an edge with any other number of faces than two is reported as not closed.
#include "nephele/levelset/mesh/surface_geometry.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

namespace {

constexpr std::size_t kGrain = 4096;

/// Half-edges (3 * triangle + side) by the vertex they leave.
struct OutgoingEdges {
  std::vector<std::uint32_t> start;
  std::vector<std::uint32_t> edges;
};

OutgoingEdges outgoingEdges(const std::vector<std::uint32_t>& corners, std::size_t vertexCount) {
  OutgoingEdges result;
  result.start.assign(vertexCount + 1, 0);
  for (const std::uint32_t v : corners) ++result.start[v + 1];
  std::partial_sum(result.start.begin(), result.start.end(), result.start.begin());
  result.edges.resize(corners.size());
  std::vector<std::uint32_t> next(result.start.begin(), result.start.end() - 1);
  for (std::uint32_t e = 0; e < corners.size(); ++e) result.edges[next[corners[e]]++] = e;
  return result;
}

std::uint32_t endOf(const std::vector<std::uint32_t>& corners, std::uint32_t edge) {
  return corners[edge % 3 == 2 ? edge - 2 : edge + 1];
}

struct Twins {
  /// The half-edge that runs the other way, for each; only where manifold.
  std::vector<std::uint32_t> edges;
  bool manifold = false;
  bool balanced = false;
};

Twins findTwins(const std::vector<std::uint32_t>& corners, std::size_t vertexCount) {
  const OutgoingEdges outgoing = outgoingEdges(corners, vertexCount);
  Twins result;
  result.edges.resize(corners.size());
  std::atomic<bool> manifold{true}, balanced{true};
  parallelFor(corners.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end && balanced; ++e) {
      const std::uint32_t from = corners[e], to = endOf(corners, std::uint32_t(e));
      int found = 0, same = 0;
      for (std::uint32_t i = outgoing.start[to]; i < outgoing.start[to + 1]; ++i)
        if (endOf(corners, outgoing.edges[i]) == from) {
          result.edges[e] = outgoing.edges[i];
          ++found;
        }
      for (std::uint32_t i = outgoing.start[from]; i < outgoing.start[from + 1]; ++i)
        same += endOf(corners, outgoing.edges[i]) == to;
      if (found != 1 || same != 1) manifold = false;
      if (found != same) balanced = false;
    }
  });
  result.manifold = manifold && balanced;
  result.balanced = balanced;
  return result;
}

/// Corners with each position named by the lowest vertex that has it.
std::vector<std::uint32_t> weldedCorners(const Mesh& mesh) {
  std::vector<std::uint32_t> order(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const auto compared = mesh.positions[a] <=> mesh.positions[b];
    return compared != 0 ? compared < 0 : a < b;
  });
  std::vector<std::uint32_t> name(order.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    name[order[i]] =
        i > 0 && mesh.positions[order[i]] == mesh.positions[order[i - 1]] ? name[order[i - 1]] : order[i];
  std::vector<std::uint32_t> corners(mesh.corners.size());
  std::transform(mesh.corners.begin(), mesh.corners.end(), corners.begin(),
                 [&](std::uint32_t v) { return name[v]; });
  return corners;
}

double angleAt(const Vec3d& p, const Vec3d& a, const Vec3d& b) {
  const Vec3d u = a - p, v = b - p;
  return std::atan2(length(cross(u, v)), dot(u, v));
}

}  // namespace

SurfaceGeometry surfaceGeometry(const Mesh& mesh) {
  SurfaceGeometry result;
  result.mesh = &mesh;
  std::vector<std::uint32_t> corners = mesh.corners;
  Twins twins = findTwins(corners, mesh.positions.size());
  if (!twins.manifold) {
    corners = weldedCorners(mesh);
    twins = findTwins(corners, mesh.positions.size());
  }
  const std::size_t count = mesh.faceCount();
  result.manifold = twins.manifold;
  result.closed = twins.balanced;
  if (!result.manifold) return result;
  result.normals.resize(count);

  std::vector<Vec3d> faceNormals(count);
  std::vector<double> angles(3 * count);
  parallelFor(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Vec3d &a = result.corner(t, 0), &b = result.corner(t, 1), &c = result.corner(t, 2);
      faceNormals[t] = normalize(cross(b - a, c - a));
      angles[3 * t] = angleAt(a, b, c);
      angles[3 * t + 1] = angleAt(b, c, a);
      angles[3 * t + 2] = angleAt(c, a, b);
    }
  });
  // In index order: the same sums at any thread count.
  std::vector<Vec3d> vertexNormals(mesh.positions.size());
  for (std::size_t e = 0; e < corners.size(); ++e)
    vertexNormals[corners[e]] += faceNormals[e / 3] * angles[e];
  parallelFor(count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      auto& normals = result.normals[t];
      normals[0] = Vec3f(faceNormals[t]);
      for (std::size_t i = 0; i < 3; ++i) {
        normals[1 + i] = Vec3f(faceNormals[t] + faceNormals[twins.edges[3 * t + i] / 3]);
        normals[4 + i] = Vec3f(vertexNormals[corners[3 * t + i]]);
      }
    }
  });
  return result;
}

}  // namespace nephele::detail
