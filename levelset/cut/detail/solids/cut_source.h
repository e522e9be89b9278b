#pragma once

#include <optional>
#include <string>

#include "nephele/levelset/cut/detail/solids/knife_sheets.h"
#include "nephele/levelset/cut/detail/solids/polygon_fans.h"
#include "nephele/levelset/cut/detail/solids/solid_split.h"
#include "nephele/levelset/cut/detail/solids/solid_triangles.h"
#include "nephele/modeling/base/mesh.h"

namespace nephele::detail {

struct Carved;

/// Edges that do not have as many faces one way as the other.
std::size_t openEdges(const std::vector<TriangleIndices>& triangles);

struct ShellMesh {
  Mesh mesh;
  /// The first face that a knife made.
  std::size_t firstInside = 0;
  /// As `Shell::crowded`, for the corners of the mesh.
  std::vector<CornerPair> crowded{};
};

/// A closed mesh that is to be cut, and what its pieces take over from it.
class CutSource {
 public:
  /// `name`: what errors call it.
  /// @throws Error if the mesh has no faces, is open or inside out, or a position is not finite.
  explicit CutSource(const Mesh& mesh, const std::string& name = "the mesh");

  /// From here on positions and triangles are those of what knives made of this solid.
  void refine(Carved&& carved);

  const std::vector<Vec3d>& positions() const { return positions_; }
  const std::vector<TriangleIndices>& triangles() const { return triangles_; }
  const Vec3d& low() const { return low_; }
  const Vec3d& high() const { return high_; }
  double volume() const { return volume_; }
  /// How near to a plane a point is on it: 1e-11 of the size, and above rounding.
  double tolerance() const { return tolerance_; }

  /// A shell as a mesh, with attributes and groups. Polygons of the source that it holds whole are polygons
  /// again.
  ShellMesh meshOf(const SolidSplitter& splitter, const Shell& shell) const;

 private:
  using Weights = std::array<double, 3>;

  bool isInner(std::uint32_t face) const { return (face & kOnPlane) != 0 || (faceOf_[face] & kOnPlane) != 0; }
  std::uint32_t groupOf(std::uint32_t face) const;
  PlaneFrame frameOf(const SolidSplitter& splitter, std::uint32_t face) const;
  PolygonFans::Whole wholeAt(const SolidSplitter& splitter, const SolidTriangle& t, std::uint32_t face) const;
  Weights weightsAt(std::uint32_t triangle, const Vec3d& p) const;
  void addAttribute(const MeshAttribute& attribute, const SolidSplitter& splitter, const Shell& shell,
                    const std::vector<std::uint32_t>& order, Mesh& mesh) const;

  /// Triangulated, as it came.
  Mesh mesh_;
  PolygonFans polygons_;
  std::vector<Vec3d> positions_;
  /// Of `mesh_`, without those that have no area by their indices, with equal positions merged if that closes
  /// the mesh; or what was carved.
  std::vector<TriangleIndices> triangles_;
  /// Per triangle: its face of `mesh_`, or kOnPlane | a frame for one that a knife made.
  std::vector<std::uint32_t> faceOf_;
  std::vector<PlaneFrame> frames_;
  /// 0: none; 1 and up: the groups of `mesh_`.
  std::vector<std::uint32_t> groups_;
  Vec3d low_{}, high_{};
  double volume_ = 0.0;
  double tolerance_ = 0.0;
};

}  // namespace nephele::detail
