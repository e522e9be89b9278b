#pragma once

#include <cmath>
#include <map>
#include <utility>

#include "nephele/modeling/base/mesh.h"

namespace nephele::test {

/// An icosahedron split `levels` times and moved onto a sphere: 20 * 4^levels triangles, outward.
inline Mesh icosphere(double radius, int levels, const Vec3d& centre = {}) {
  const double t = (1.0 + std::sqrt(5.0)) / 2.0;
  std::vector<Vec3d> points{{-1, t, 0},  {1, t, 0},  {-1, -t, 0}, {1, -t, 0}, {0, -1, t},  {0, 1, t},
                            {0, -1, -t}, {0, 1, -t}, {t, 0, -1},  {t, 0, 1},  {-t, 0, -1}, {-t, 0, 1}};
  std::vector<std::uint32_t> triangles{0, 11, 5,  0, 5,  1, 0, 1, 7, 0, 7,  10, 0, 10, 11, 1, 5, 9, 5, 11,
                                       4, 11, 10, 2, 10, 7, 6, 7, 1, 8, 3,  9,  4, 3,  4,  2, 3, 2, 6, 3,
                                       6, 8,  3,  8, 9,  4, 9, 5, 2, 4, 11, 6,  2, 10, 8,  6, 7, 9, 8, 1};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, added] = middles.try_emplace(std::minmax(a, b), std::uint32_t(points.size()));
      if (added) points.push_back((points[a] + points[b]) * 0.5);
      return entry->second;
    };
    std::vector<std::uint32_t> split;
    for (std::size_t i = 0; i < triangles.size(); i += 3) {
      const std::uint32_t a = triangles[i], b = triangles[i + 1], c = triangles[i + 2];
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      split.insert(split.end(), {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca});
    }
    triangles = std::move(split);
  }
  Mesh mesh;
  for (const Vec3d& p : points) mesh.positions.push_back(centre + normalize(p) * radius);
  for (std::size_t i = 0; i < triangles.size(); i += 3)
    mesh.addFace(std::array<std::uint32_t, 3>{triangles[i], triangles[i + 1], triangles[i + 2]});
  return mesh;
}

/// A torus about z of `around` x `along` quads, each split in two, outward.
inline Mesh torusMesh(double major, double minor, int around, int along) {
  Mesh mesh;
  const auto id = [&](int i, int j) { return std::uint32_t((i % around) * along + j % along); };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < along; ++j) {
      const double u = 2 * M_PI * i / around, v = 2 * M_PI * j / along;
      const double ring = major + minor * std::cos(v);
      mesh.positions.push_back({ring * std::cos(u), ring * std::sin(u), minor * std::sin(v)});
    }
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < along; ++j) {
      mesh.addFace(std::array<std::uint32_t, 3>{id(i, j), id(i + 1, j), id(i + 1, j + 1)});
      mesh.addFace(std::array<std::uint32_t, 3>{id(i, j), id(i + 1, j + 1), id(i, j + 1)});
    }
  return mesh;
}

/// A box with 12 triangles, outward.
inline Mesh boxMesh(const Vec3d& low, const Vec3d& high) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  for (const auto& face : {std::array<std::uint32_t, 4>{0, 2, 3, 1},
                           {4, 5, 7, 6},
                           {0, 1, 5, 4},
                           {2, 6, 7, 3},
                           {0, 4, 6, 2},
                           {1, 3, 7, 5}}) {
    mesh.addFace(std::array<std::uint32_t, 3>{face[0], face[1], face[2]});
    mesh.addFace(std::array<std::uint32_t, 3>{face[0], face[2], face[3]});
  }
  return mesh;
}

/// An octahedron with corners at distance 1.
inline Mesh octahedron() {
  Mesh mesh;
  mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (const auto& t : {std::array<std::uint32_t, 3>{0, 2, 4},
                        {2, 1, 4},
                        {1, 3, 4},
                        {3, 0, 4},
                        {2, 0, 5},
                        {1, 2, 5},
                        {3, 1, 5},
                        {0, 3, 5}})
    mesh.addFace(t);
  return mesh;
}

/// The cube of edge 2 about the origin.
inline Mesh cube() {
  return boxMesh({-1, -1, -1}, {1, 1, 1});
}

/// Both surfaces as one mesh.
inline Mesh joined(Mesh a, const Mesh& b) {
  const auto offset = std::uint32_t(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (std::size_t f = 0; f < b.faceCount(); ++f) {
    std::vector<std::uint32_t> face(b.face(f).begin(), b.face(f).end());
    for (std::uint32_t& v : face) v += offset;
    a.addFace(face);
  }
  return a;
}

/// The same surface with vertices of its own for every face, as an STL file holds it.
inline Mesh unshared(const Mesh& mesh) {
  Mesh result;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    std::vector<std::uint32_t> face;
    for (const std::uint32_t v : mesh.face(f)) {
      face.push_back(std::uint32_t(result.positions.size()));
      result.positions.push_back(mesh.positions[v]);
    }
    result.addFace(face);
  }
  return result;
}

}  // namespace nephele::test
