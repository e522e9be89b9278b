#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "nephele/levelset/mesh/mass_properties.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/shape/knives.h"

namespace nephele {

/// A plane with hills as a triangulated height field: the hills of `roughKnife`, read on the plane at the
/// points of a lattice. Its sides at half a kerf are raised by that times the secant of the slope.
struct RoughBlade {
  BladePlane plane;
  RoughnessOptions roughness{};
  /// Between the points of the lattice, world units. 0: an eighth of the shortest wave of the roughness, but
  /// no finer than the size of the solid / 400.
  float spacing = 0.0f;
};

struct MeshCutOptions {
  /// Flat blades.
  std::vector<BladePlane> planes{};
  /// Points whose Voronoi cells part the solid, too. Empty: none.
  std::vector<Vec3f> cells{};
  /// Width of the cut, world units, >= 0: half of it goes from each side of every knife.
  float kerf = 0.0f;
  /// Rough blades.
  std::vector<RoughBlade> rough{};
  /// Closed meshes as knives: their inside is the positive side. With a kerf their faces move along their
  /// normals.
  std::vector<Mesh> solids{};
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
  /// from both sides: on the plane, also of a rough blade; of a solid on the axis plane that the face looks
  /// at most; on outer faces of a source without `uv` it is 0, as are other corner attributes inside.
  Mesh mesh;
  /// The sides of the planes, then of the rough blades, then of the solids, each in their order: true where
  /// (x - point) . normal > 0, above the hills, inside.
  PieceCode code;
  /// Which of the cells, if there are any.
  std::optional<std::uint32_t> cell;
  MassProperties mass;
  Vec3d boxMin{}, boxMax{};
  /// In the order of their indices; none across a kerf.
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
/// Rough blades and solids are brought together with the mesh at once: which faces meet and in what order is
/// decided exactly, then points are rounded. Each part is then split by each cell's bisectors, those of
/// points near enough to reach it, and by each plane that passes through it, so that cost follows the pieces
/// that there are. Cut points depend on the edge and the knife alone: both sides of a cut have the same
/// points, bit for bit, and the same triangles. Points closer to a plane than 1e-11 of the solid's size count
/// as on it, and are not moved; a face in a knife goes with the solid below it, and is no cut. A knife that
/// misses the solid leaves it as it is. With a kerf there may be no pieces at all.
///
/// Order of the knives: the same pieces in another order, up to rounding. The same result at any number of
/// threads. Limits: a mesh that crosses itself is cut by planes and cells as it is: its pieces cross
/// themselves, too, their volumes still sum to its signed volume, but where sheets overlap, or edges have
/// more than two faces, pieces may have such edges, too (`countSelfIntersections` tells before). So may a
/// piece that touches itself along an edge. Where planes or more than four cells meet in one place by design,
/// points may coincide within the 1e-11, and some contact area there may go unseen. Cost: one pass over the
/// parts in reach of each plane; of cells, some passes over the mesh for each; of rough blades and solids, n
/// log n in all triangles, and some 20 microseconds for each pair of them that meet.
/// @throws Error if the mesh or a solid has no faces, is open or inside out, values are not finite, a normal
/// is 0, cells are equal, minVolume, kerf or a spacing < 0, a spacing is too fine for the solid, the sides of
/// a solid's kerf cross themselves, or the mesh or a solid crosses itself where another surface passes;
/// Cancelled. As `roughKnife` for rough blades.
/// Source: Tessendorf, Resolution Independent Volumes, chapter 5.
MeshPieces cutMesh(const Mesh& mesh, const MeshCutOptions& options, const Progress& progress = silent());

}  // namespace nephele
