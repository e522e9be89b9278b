#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "modeling/knives.h"
#include "modeling/mesh.h"
#include "modeling/progress.h"

namespace nephele {

/// What a closed mesh would weigh if it were solid, of density 1.
struct MassProperties {
  /// World units cubed; negative if the mesh is inside out.
  double volume = 0.0;
  double area = 0.0;
  /// Centre of mass. Of a mesh without volume: the middle of its positions.
  Vec3d centroid{};
  /// About the centroid, row-major and symmetric: I = integral of |r|^2 1 - r r^T.
  std::array<double, 9> inertia{};
};

/// Integrals over the solid by the divergence theorem, exact for flat faces up to rounding. Polygons count as
/// fans from their first corner. Cost: one pass.
MassProperties massProperties(const Mesh& mesh);

struct MeshCutOptions {
  /// Flat blades without width. Kerf, rough blades, other shapes and meshes as knives are for level sets only
  /// (`cutIntoPieces`).
  std::vector<BladePlane> planes{};
  /// Points whose Voronoi cells part the solid, too. Empty: none.
  std::vector<Vec3f> cells{};
  /// Pieces with less volume are left out, world units cubed, >= 0. Those below 1e-12 of the whole always
  /// are.
  double minVolume = 0.0;
};

/// Where two pieces touch.
struct PieceContact {
  /// Index of the other piece.
  std::uint32_t piece = 0;
  double area = 0.0;
};

/// A connected part of a solid that was cut.
struct MeshPiece {
  /// Closed triangles, every edge with two faces and every vertex with one fan. Outer faces come first, by
  /// the groups of the source; what the knives made is the last group, `inside`.
  ///
  /// Corner attributes are those of the source, on cut faces read at the place of the corner in its source
  /// triangle, so that seams stay. Vertex attributes likewise; vertices on inner faces alone have the mean of
  /// the source. `uv` is there always: on inner faces it is the place on the knife in world units, the same
  /// from both sides; on outer faces of a source without `uv` it is 0, as are other corner attributes inside.
  Mesh mesh;
  /// The sides of the planes, in their order: true where (x - point) . normal > 0.
  PieceCode code;
  /// Which of the cells, if there are any.
  std::optional<std::uint32_t> cell;
  MassProperties mass;
  Vec3d boxMin{}, boxMax{};
  /// In the order of their indices.
  std::vector<PieceContact> neighbours;
};

struct MeshPieces {
  /// By cell, then by code with the negative side first, then by the order of the source's faces.
  std::vector<MeshPiece> pieces;
  /// Parts below `minVolume`, and the volume that went with them.
  std::size_t slivers = 0;
  double sliverVolume = 0.0;
};

/// Cuts a solid, the inside of a closed mesh, exactly into closed meshes.
///
/// Each piece is split by each plane that passes through it, each cell by the bisectors of points near
/// enough to reach it, so that cost follows the pieces that there are. Cut points depend on the edge and the
/// plane alone: both sides of a cut have the same points, bit for bit, and the same triangles. Points closer
/// to a plane than 1e-11 of the solid's size count as on it, and are not moved; a face in a plane goes with
/// the solid below it, and is no cut. A plane that misses the solid leaves it as it is.
///
/// Order of the planes: the same pieces in another order, up to rounding. Limits: a mesh that crosses itself
/// is cut as it is: its pieces cross themselves, too, their volumes still sum to its signed volume, but where
/// sheets overlap, or edges have more than two faces, pieces may have such edges, too
/// (`countSelfIntersections` tells before); where planes or more than four cells meet in one place by design,
/// points may coincide within the 1e-11, and some contact area there may go unseen. Cost: one pass over the
/// parts in reach of each plane; of cells, some passes over the mesh for each.
/// @throws Error if the mesh has no faces, is open or inside out, values are not finite, a normal is 0,
/// cells are equal, or minVolume < 0; Cancelled.
/// Source: Tessendorf, Resolution Independent Volumes, chapter 5.
MeshPieces cutMesh(const Mesh& mesh, const MeshCutOptions& options, const Progress& progress = silent());

}  // namespace nephele
