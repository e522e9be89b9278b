#pragma once

#include <optional>
#include <string>

#include "levelset/solid_split.h"
#include "levelset/solid_triangles.h"
#include "modeling/mesh.h"

namespace nephele::detail {

/// A closed mesh that is to be cut, and what its pieces take over from it.
class CutSource {
 public:
  /// @throws Error if the mesh has no faces, is open or inside out, or a position is not finite.
  explicit CutSource(const Mesh& mesh);

  const std::vector<Vec3d>& positions() const { return mesh_.positions; }
  const std::vector<TriangleIndices>& triangles() const { return triangles_; }
  double volume() const { return volume_; }
  /// How near to a plane a point is on it: 1e-11 of the size, and above rounding.
  double tolerance() const { return tolerance_; }

  /// A shell as a mesh, with attributes and groups. `firstInside` is its first face made by a plane.
  Mesh meshOf(const SolidSplitter& splitter, const Shell& shell, std::size_t& firstInside) const;

 private:
  using Weights = std::array<double, 3>;

  std::uint32_t groupOf(std::uint32_t face) const;
  Weights weightsAt(std::uint32_t triangle, std::uint32_t vertex, const Vec3d& p) const;
  void addAttribute(const MeshAttribute& attribute, const SolidSplitter& splitter, const Shell& shell,
                    const std::vector<std::uint32_t>& order, Mesh& mesh) const;

  /// Triangulated, as it came.
  Mesh mesh_;
  /// Of `mesh_`, without those that have no area by their indices, with equal positions merged if that closes
  /// the mesh.
  std::vector<TriangleIndices> triangles_;
  std::vector<std::uint32_t> faceOf_;
  /// 0: none; 1 and up: the groups of `mesh_`.
  std::vector<std::uint32_t> groups_;
  double volume_ = 0.0;
  double tolerance_ = 0.0;
};

}  // namespace nephele::detail
