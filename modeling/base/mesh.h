#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nephele/modeling/base/box.h"

namespace nephele {

/// Named data on a mesh: `width` floats per vertex or per corner (UVs are width 2 per corner, colours 3 or
/// 4).
struct MeshAttribute {
  enum class Domain { vertex, corner };

  std::string name;
  Domain domain = Domain::vertex;
  int width = 1;
  std::vector<float> values;
};

/// A run of faces under one name, as an OBJ group.
struct MeshGroup {
  std::string name;
  std::uint32_t firstFace = 0;
  std::uint32_t faceCount = 0;
  /// What its faces are made of, by name; empty: not said.
  std::string material{};
};

/// A plain indexed polygon mesh; any soup fits. World units, right-handed, counter-clockwise front faces.
///
/// Face f has the corners faceStart[f] .. faceStart[f + 1] - 1, each an index into positions.
struct Mesh {
  std::vector<Vec3d> positions;
  std::vector<std::uint32_t> corners;
  std::vector<std::uint32_t> faceStart{0};
  std::vector<MeshAttribute> attributes;
  std::vector<MeshGroup> groups;
  /// Where the materials of groups are described: paths of .mtl files, which need not exist.
  std::vector<std::string> materialFiles{};

  std::size_t faceCount() const { return faceStart.size() - 1; }
  std::span<const std::uint32_t> face(std::size_t f) const {
    return {corners.data() + faceStart[f], corners.data() + faceStart[f + 1]};
  }
  void addFace(std::span<const std::uint32_t> indices) {
    corners.insert(corners.end(), indices.begin(), indices.end());
    faceStart.push_back(static_cast<std::uint32_t>(corners.size()));
  }
  bool isTriangles() const { return corners.size() == 3 * faceCount(); }
};

/// What every function that takes a mesh relies on: face starts begin at 0, never decrease and end at the
/// number of corners; every corner is the index of a position; every attribute has `width` values for each
/// position or corner; groups lie within the faces. Positions may be anything, faces of any length, also 0.
/// Returns `mesh`, so that members can be made from what has been checked. Linear, cheap.
/// @throws Error that says what is wrong, and with which face, attribute or group.
const Mesh& requireValid(const Mesh& mesh);

/// Box of the positions that faces use.
Box boundingBox(const Mesh& mesh);

/// The same surface with triangles only: polygons become fans from their first corner; attributes and groups
/// follow. Faces with fewer than three corners are left out.
/// @throws Error unless the mesh is valid.
Mesh triangulated(const Mesh& mesh);

/// For each position the lowest index of a position equal to it (-0 equals 0); itself where there is none
/// before. Linear in the number of positions.
std::vector<std::uint32_t> firstEqualPosition(std::span<const Vec3d> positions);

/// Volume enclosed by a closed, outward-oriented mesh (negative if inward): sum of signed tetrahedra over
/// fans.
double signedVolume(const Mesh& mesh);

/// Area of all faces, fan-triangulated.
double surfaceArea(const Mesh& mesh);

}  // namespace nephele
