#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nephele/modeling/base/mesh.h"

namespace nephele::detail {

/// Corners of triangles by what they carry: those at one vertex whose faces are in the same group and that
/// have the same attributes are a wedge, known by the lowest of them. Vertices of faces may be replaced.
class Wedges {
 public:
  using Corners = std::array<std::uint32_t, 3>;

  /// Keeps a reference to `triangles`.
  explicit Wedges(const Mesh& triangles);

  /// Whether any vertex has several wedges.
  bool hasSeams() const { return hasSeams_; }
  const Corners& vertices(int face) const { return vertices_[std::size_t(face)]; }
  const Corners& of(int face) const { return wedges_[std::size_t(face)]; }
  /// The wedge at a vertex of a face.
  std::uint32_t at(int face, int vertex) const { return of(face)[place(face, vertex)]; }
  /// Whether two faces have different wedges at one of the vertices, which both have.
  bool differ(int face, int other, int vertex, int otherVertex) const {
    return hasSeams_ &&
           (at(face, vertex) != at(other, vertex) || at(face, otherVertex) != at(other, otherVertex));
  }
  /// Whether the face would turn over, or lose its area, in its texture coordinates if its wedge at `vertex`
  /// became `wedge`.
  bool turns(int face, int vertex, std::uint32_t wedge) const;
  void replace(int face, int vertex, int otherVertex, std::uint32_t wedge) {
    const std::size_t k = place(face, vertex);
    vertices_[std::size_t(face)][k] = std::uint32_t(otherVertex);
    wedges_[std::size_t(face)][k] = wedge;
  }

 private:
  std::size_t place(int face, int vertex) const {
    const Corners& corners = vertices(face);
    return corners[0] == std::uint32_t(vertex) ? 0 : corners[1] == std::uint32_t(vertex) ? 1 : 2;
  }

  std::vector<Corners> vertices_, wedges_;
  const MeshAttribute* coordinates_ = nullptr;
  bool hasSeams_ = false;
};

}  // namespace nephele::detail
