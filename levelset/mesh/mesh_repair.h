#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

/// What a mesh is and what is wrong with it. Counts are after merging bit-equal positions.
struct MeshDiagnosis {
  std::size_t vertices = 0;  ///< Distinct positions that faces use.
  std::size_t faces = 0;
  std::size_t triangles = 0;
  std::size_t mergedVertices = 0;  ///< Used positions that equal another one.
  std::size_t unusedVertices = 0;
  std::size_t boundaryEdges = 0;  ///< One face.
  std::size_t boundaryLoops = 0;
  std::size_t nonManifoldEdges = 0;     ///< More than two faces.
  std::size_t nonManifoldVertices = 0;  ///< Several fans of faces that share no edge there.
  std::size_t misorientedEdges = 0;     ///< Two faces that run the same way.
  std::size_t unbalancedEdges = 0;      ///< Run more often one way than the other.
  std::size_t duplicateFaces = 0;
  std::size_t degenerateFaces = 0;  ///< A corner twice, in a row or about one other, or no area.
  std::size_t components = 0;       ///< Parts that share no vertex.
  long eulerCharacteristic = 0;
  double volume = 0;  ///< Signed; meaningful where closed.
  double area = 0;
  Box box;

  /// Every edge is run as often one way as the other, so the mesh bounds a volume. Two faces per edge are the
  /// usual case; solids that touch along an edge (four faces) are closed too.
  bool closed() const { return faces > 0 && unbalancedEdges == 0; }
  /// Closed with two faces on every edge and one fan around every vertex.
  bool manifold() const { return closed() && nonManifoldEdges == 0 && nonManifoldVertices == 0; }
  bool inward() const { return closed() && volume < 0; }
  /// Handles, summed over components; meaningful for a closed manifold.
  long genus() const { return static_cast<long>(components) - eulerCharacteristic / 2; }
  /// The defects in words, one entry each; empty for a good mesh.
  std::vector<std::string> problems() const;
};

/// Linear in the size of the mesh; self-intersections are not looked for here. `progress` only cancels.
/// @throws Cancelled
MeshDiagnosis diagnose(const Mesh& mesh, const Progress& progress = silent());

/// Pairs of triangles that intersect beyond what they share (exact predicates; triangles without area left
/// out). Any soup. Nothing where the library was built without CGAL, or where more pairs than a million and
/// `mostPairsPerTriangle` for each triangle have boxes that meet: thirteen do in a good mesh. About 5
/// microseconds per triangle.
std::optional<std::size_t> countSelfIntersections(
    const Mesh& mesh, double mostPairsPerTriangle = std::numeric_limits<double>::infinity());

/// Volume of the points that a closed mesh winds around at least once: what a level set of it encloses, also
/// where parts overlap or the surface intersects itself. Without such overlaps it equals signedVolume, within
/// about 1e-3 (quadrature with 1024 rays along the longest side). About 0.1 s.
/// @throws Error if there are no faces.
double solidVolume(const Mesh& mesh);

struct MeshRepairOptions {
  enum class Mode {
    automatic,  ///< Weld, drop degenerates, orient, fill holes; wrap what is still not closed.
    off,        ///< Refuse a mesh that is not closed.
    wrap        ///< Alpha wrapping always.
  };
  Mode mode = Mode::automatic;
  /// Alpha and offset of the wrap as a share of the bounding box's longest side.
  double wrapAlpha = 1.0 / 100;
  double wrapOffset = 1.0 / 600;
  /// Edge of the voxels that the mesh is for, world units. Alpha is then no finer than they are, the offset
  /// in proportion. Where the wrap of an open surface would be a shell that they cannot hold, one up to four
  /// times as coarse that is a solid takes its place; where there is none, the mesh is refused.
  std::optional<double> voxelSize{};
  /// Leaves polygons as they are where nothing has to be repaired.
  bool keepPolygons = false;
};

/// A closed, outward-oriented mesh without equal positions, of triangles unless polygons were to be kept, and
/// what was done to get there, in words.
struct RepairedMesh {
  Mesh mesh;
  std::vector<std::string> repairs;
  MeshDiagnosis before;
  MeshDiagnosis after;
};

/// The repair ladder. A good mesh passes through triangulated, untouched otherwise but for equal positions,
/// which become one vertex (vertex attributes of the first; corner attributes stay). Vertex attributes always
/// survive: holes are filled between the vertices of their rims, and a wrap takes those of the closest point
/// of the mesh. Corner attributes and groups survive until faces are added: a mesh with filled holes or
/// wrapped has none.
/// @throws Error saying what is wrong and which option would allow it (mode off on an open mesh; a flat mesh
/// without volume; a shell thinner than voxels; a longest side outside 1e-9 to 1e12; nothing left);
/// Cancelled.
RepairedMesh repairMesh(const Mesh& mesh, const MeshRepairOptions& options = {},
                        const Progress& progress = silent());

}  // namespace nephele
