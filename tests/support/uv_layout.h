#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "tests/support/mesh_attributes.h"

namespace nephele::test {

/// Every triangle split in four at the middles of its sides, with its attributes, which stay linear.
inline Mesh midpointSplit(const Mesh& mesh) {
  Mesh result;
  result.positions = mesh.positions;
  for (const MeshAttribute& a : mesh.attributes) result.attributes.push_back({a.name, a.domain, a.width, {}});
  std::vector<std::vector<float>> vertexValues;
  for (const MeshAttribute& a : mesh.attributes)
    vertexValues.push_back(a.domain == MeshAttribute::Domain::vertex ? a.values : std::vector<float>{});
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    std::uint32_t ids[6];
    for (std::size_t i = 0; i < 3; ++i) {
      ids[i] = face[i];
      const std::uint32_t a = face[i], b = face[(i + 1) % 3];
      const auto [entry, added] =
          middles.try_emplace(std::minmax(a, b), std::uint32_t(result.positions.size()));
      if (added) {
        result.positions.push_back((mesh.positions[a] + mesh.positions[b]) * 0.5);
        for (std::size_t k = 0; k < mesh.attributes.size(); ++k)
          if (mesh.attributes[k].domain == MeshAttribute::Domain::vertex)
            for (std::size_t c = 0; c < std::size_t(mesh.attributes[k].width); ++c) {
              const std::size_t w = std::size_t(mesh.attributes[k].width);
              vertexValues[k].push_back(0.5f * (vertexValues[k][a * w + c] + vertexValues[k][b * w + c]));
            }
      }
      ids[3 + i] = entry->second;
    }
    // Corners of the four, as pairs of corners of the face whose mean they are.
    static constexpr int kPlaces[4][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}};
    static constexpr int kEnds[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};
    for (const auto& places : kPlaces) {
      result.addFace(std::array<std::uint32_t, 3>{ids[places[0]], ids[places[1]], ids[places[2]]});
      for (std::size_t k = 0; k < mesh.attributes.size(); ++k) {
        const MeshAttribute& a = mesh.attributes[k];
        if (a.domain == MeshAttribute::Domain::vertex) continue;
        const auto width = std::size_t(a.width);
        for (const int place : places)
          for (std::size_t c = 0; c < width; ++c) {
            const auto at = [&](int end) {
              return a.values[(mesh.faceStart[f] + std::size_t(kEnds[place][end])) * width + c];
            };
            result.attributes[k].values.push_back(0.5f * (at(0) + at(1)));
          }
      }
    }
  }
  for (std::size_t k = 0; k < mesh.attributes.size(); ++k)
    if (mesh.attributes[k].domain == MeshAttribute::Domain::vertex)
      result.attributes[k].values = vertexValues[k];
  return result;
}

/// The islands of texture coordinates of a triangle mesh, found by comparing them exactly, and which of them
/// hold a point.
class UvIslands {
 public:
  explicit UvIslands(const Mesh& mesh) : uv_(attributeOf(mesh, "uv").values), grid_(kCells * kCells) {
    const std::vector<std::uint32_t> vertex = firstEqualPosition(mesh.positions);
    using Key = std::array<float, 3>;
    std::map<std::array<Key, 2>, std::uint32_t> sides;
    island_.resize(mesh.faceCount());
    std::iota(island_.begin(), island_.end(), 0u);
    for (std::uint32_t t = 0; t < mesh.faceCount(); ++t)
      for (std::uint32_t i = 0; i < 3; ++i) {
        const auto key = [&](std::uint32_t c) {
          return Key{float(vertex[mesh.corners[3 * t + c]]), uv_[2 * (3 * t + c)], uv_[2 * (3 * t + c) + 1]};
        };
        std::array<Key, 2> side{key(i), key((i + 1) % 3)};
        if (side[1] < side[0]) std::swap(side[0], side[1]);
        const auto [entry, added] = sides.try_emplace(side, t);
        if (!added) island_[root(t)] = root(entry->second);
      }
    for (std::size_t i = 0; i < uv_.size(); ++i) {
      low_[i % 2] = std::min(low_[i % 2], uv_[i]);
      high_[i % 2] = std::max(high_[i % 2], uv_[i]);
    }
    for (std::uint32_t t = 0; t < mesh.faceCount(); ++t) {
      const float* p = &uv_[6 * std::size_t(t)];
      const int x0 = cell(std::min({p[0], p[2], p[4]}), 0), x1 = cell(std::max({p[0], p[2], p[4]}), 0);
      const int y0 = cell(std::min({p[1], p[3], p[5]}), 1), y1 = cell(std::max({p[1], p[3], p[5]}), 1);
      for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) grid_[std::size_t(y * kCells + x)].push_back(t);
    }
  }

  std::size_t count() {
    std::size_t roots = 0;
    for (std::uint32_t t = 0; t < island_.size(); ++t) roots += root(t) == t;
    return roots;
  }

  /// Islands with a triangle that holds (u, v), or has it within 1e-5.
  std::vector<std::uint32_t> at(float u, float v) {
    std::vector<std::uint32_t> found;
    for (const std::uint32_t t : grid_[std::size_t(cell(v, 1) * kCells + cell(u, 0))])
      if (holds(t, u, v)) found.push_back(root(t));
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  /// Faces of `object`, a triangle mesh, whose corners do not all lie in one island.
  std::size_t mixedFaces(const Mesh& object) {
    const std::vector<float>& uv = attributeOf(object, "uv").values;
    std::size_t mixed = 0;
    for (std::size_t f = 0; f < object.faceCount(); ++f) {
      std::vector<std::uint32_t> common = at(uv[6 * f], uv[6 * f + 1]);
      for (std::size_t i = 1; i < 3; ++i) {
        const std::vector<std::uint32_t> other = at(uv[6 * f + 2 * i], uv[6 * f + 2 * i + 1]);
        std::vector<std::uint32_t> both;
        std::set_intersection(common.begin(), common.end(), other.begin(), other.end(),
                              std::back_inserter(both));
        common = std::move(both);
      }
      mixed += common.empty();
    }
    return mixed;
  }

 private:
  static constexpr int kCells = 128;

  std::uint32_t root(std::uint32_t t) {
    while (island_[t] != t) t = island_[t] = island_[island_[t]];
    return t;
  }
  int cell(float x, std::size_t axis) const {
    return std::clamp(int((x - low_[axis]) / (high_[axis] - low_[axis]) * kCells), 0, kCells - 1);
  }
  bool holds(std::uint32_t t, float u, float v) const {
    const float* p = &uv_[6 * std::size_t(t)];
    // Distance to each side, towards the inside of the triangle.
    const double area =
        (double(p[2]) - p[0]) * (double(p[5]) - p[1]) - (double(p[4]) - p[0]) * (double(p[3]) - p[1]);
    for (int i = 0; i < 3; ++i) {
      const float *a = p + 2 * i, *b = p + 2 * ((i + 1) % 3);
      const double x = double(b[0]) - a[0], y = double(b[1]) - a[1], side = std::hypot(x, y);
      const double inside = (x * (double(v) - a[1]) - y * (double(u) - a[0])) * (area < 0 ? -1 : 1);
      if (inside < -1e-5 * side - 1e-12) return false;
    }
    return true;
  }

  const std::vector<float>& uv_;
  std::vector<std::uint32_t> island_;
  std::vector<std::vector<std::uint32_t>> grid_;
  float low_[2] = {INFINITY, INFINITY}, high_[2] = {-INFINITY, -INFINITY};
};

/// The largest extent of each face of `mesh` in its texture coordinates.
inline std::vector<float> uvExtents(const Mesh& mesh) {
  const std::vector<float>& uv = attributeOf(mesh, "uv").values;
  std::vector<float> extents;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    float extent = 0;
    for (std::size_t a = mesh.faceStart[f]; a < mesh.faceStart[f + 1]; ++a)
      for (std::size_t b = mesh.faceStart[f]; b < a; ++b)
        for (std::size_t k = 0; k < 2; ++k)
          extent = std::max(extent, std::abs(uv[2 * a + k] - uv[2 * b + k]));
    extents.push_back(extent);
  }
  return extents;
}

}  // namespace nephele::test
