#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "nephele/levelset/cut/knives.h"
#include "nephele/levelset/cut/piece_level_set.h"
#include "nephele/levelset/mesh/mass_properties.h"

/// Cutting meshes and level sets into pieces. Source: Tessendorf, Resolution Independent Volumes, chapter 5.
namespace nephele {

struct CutOptions {
  /// Width of the cut, world units, >= 0: half of it goes from each side of every knife.
  float kerf = 0.0f;
  /// Pieces with less volume are left out and counted, world units cubed, >= 0. Default: splinters of meshes,
  /// less than a voxel of level sets. Of meshes those below 1e-12 of the whole always are.
  std::optional<double> minVolume{};
};

/// A piece is a splinter if it has less than these shares of the median piece and of what was cut. Measured
/// on 35 cuts of five models by planes, cells and rough blades: up to 14 % of the pieces of planes, up to 4 %
/// of those of cells, and never more than 6e-6 of the volume together.
inline constexpr double kSplinterOfMedian = 1e-3, kSplinterOfWhole = 1e-6;

/// Where two pieces touch.
struct PieceContact {
  /// Index of the other piece.
  std::uint32_t piece = 0;
  double area = 0.0;
};

/// A connected part of what was cut.
struct Piece {
  /// Of cuts of parts only, see cut_parts.h: what it is called, and the piece that it was cut from, if any.
  std::string name{}, parent{};
  /// Closed. Faces of a mesh that no knife crosses are the polygons that they were, all others triangles; a
  /// piece that touches itself along an edge has triangles only. Empty where a field was cut into level sets.
  ///
  /// Outer faces come first, by the groups of the source; what the knives made is the last group, `inside`.
  /// Of meshes, corner attributes are those of the source, on cut faces read at the place of the corner in
  /// its source triangle, so that seams stay. Vertex attributes likewise; vertices on inner faces alone have
  /// the mean of the source. `uv` is there always: on inner faces it is the place on the knife in world
  /// units, the same from both sides: on the plane, also of a rough blade; of others on the axis plane that
  /// the face looks at most; on outer faces of a source without `uv` it is 0, as are other corner attributes
  /// inside.
  Mesh mesh{};
  /// Of cuts into level sets: min(shape, +-knives - kerf / 2, distance to the cell's sides) within the band
  /// of its surface, the band's ends beyond. Other pieces of the same code are outside of it. Where the piece
  /// is thinner than a voxel, it may show several shells.
  std::optional<PieceLevelSet> level{};
  PieceCode code{};
  /// Which of the cells, if there are any.
  std::optional<std::uint32_t> cell{};
  /// Of the mesh, and whether each of its edges has a face on either side.
  MassProperties mass{};
  Vec3d boxMin{}, boxMax{};
  bool closed = false;
  /// In the order of their indices; none across a kerf.
  std::vector<PieceContact> neighbours{};
};

struct Pieces {
  std::vector<Piece> pieces;
  /// Of what was cut, and of the pieces; 0 where a field was cut into level sets.
  double volumeOriginal = 0.0, volumeSum = 0.0;
  /// Combinations of sides and cells that hold pieces, of the many that could.
  std::size_t codes = 0;
  /// Parts below the least volume, and the volume that went with them.
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
/// misses the solid leaves it as it is. With a kerf there may be no pieces at all. Pieces come by cell, then
/// by code with the negative side first, then by the order of the source's faces.
///
/// Order of the knives: the same pieces in another order, up to rounding. The same result at any number of
/// threads. Limits: a mesh that crosses itself is cut by planes and cells as it is: its pieces cross
/// themselves, too, their volumes still sum to its signed volume, but where sheets overlap, or edges have
/// more than two faces, pieces may have such edges, too (`countSelfIntersections` tells before). So may a
/// piece that touches itself along an edge. Where planes or more than four cells meet in one place by design,
/// points may coincide within the 1e-11, and some contact area there may go unseen. Cost: one pass over the
/// parts in reach of each plane; of cells, some passes over the mesh for each; of rough blades and solids, n
/// log n in all triangles, and some 20 microseconds for each pair of them that meet.
/// The sides of a solid's kerf are its faces moved out and in. Where that folds them over, as in creases and
/// of triangles that are small for the kerf, they are surfaces of the solid's distance, from samples 256 to
/// the longest side of the mesh, or 2048 to that of the solid; where the solid is thinner than the kerf, it
/// has no inner side.
/// @throws Error if the mesh or a solid has no faces, is open or inside out, values are not finite, a normal
/// is 0, cells are equal, minVolume, kerf or a spacing < 0, a spacing is too fine for the solid, the mesh or
/// a solid crosses itself where another surface passes, or there are fields among the knives; Cancelled. As
/// `roughKnife` for rough blades.
Pieces cutIntoMeshes(const Mesh& mesh, const Knives& knives, const CutOptions& options = {},
                     const Progress& progress = silent());

/// Cuts a level set exactly into closed meshes, by linear cells: every cell of its lattice is six tetrahedra,
/// in each of which the level set and all knives are linear between their values at the corners.
///
/// So rims are sharp, both sides of a cut have the same triangles, and the volumes of the pieces sum to that
/// of `marchingTetrahedra`. Planes and cells, which are linear everywhere, cut whole triangles, and their
/// faces are as large as can be; other knives have the triangles of the lattice. Their vertices lie on the
/// blade within a thousandth of a voxel; beside rims and other knives, where they are those of linear cells,
/// they are off a blade of radius r by at most 3 / 8 voxel^2 / r. Decisions are exact (`TetrahedronFacets` in
/// the sources): knives may meet anywhere, in samples, or coincide with the surface, and any level set does.
/// Equal fields, or equal rough blades, cut once. The order of the knives changes nothing but the order of
/// the signs in the codes: pieces come in the same order, with the same bits. The same result at any number
/// of threads. Cost: as for meshes for planes and cells; for other knives the cells inside the level set that
/// they pass.
/// @throws Error if the level set has no surface or its background is inside, values are not finite, a normal
/// is 0, cells are equal, minVolume or kerf < 0, or there are more than 16 000 knives; as `roughKnife` for
/// rough blades, `solidKnife` for solids; Cancelled.
Pieces cutIntoMeshes(const BrickGrid& level, const Knives& knives, const CutOptions& options = {},
                     const Progress& progress = silent());

/// Where the samples of pieces as level sets stand.
struct PieceLattice {
  /// Edge of a voxel, world units, > 0. Voxels stand at integer multiples of it.
  float voxelSize = 0.0f;
  /// A box around the surface of the shape, world units.
  Box box{};
  /// How far from their surface the pieces hold values, voxels, 2 to 7.
  float bandVoxels = 3.0f;
};

/// Cuts a shape into pieces, as level sets.
///
/// `shape` is positive inside and a distance within the band; beyond it may be any number of the right sign.
/// One walk finds the side of every knife for every voxel inside; only combinations that occur are ever
/// looked at, so cost follows what is there: bricks that no blade passes are settled by ranges, and pieces
/// are written where their surfaces are. Voxels on a blade, or within half a kerf of it, belong to no piece.
/// Pieces come in the order of their first voxels by z, y, x. The result is the same bit for bit at any
/// thread count and for any order of the knives; the bits of the codes follow the knives.
///
/// Where two surfaces meet at an angle the grid bevels the rim, by some (voxelSize)^2 / 4 across.
/// @throws Error for options outside their range, equal cells, a box too large for its voxels; as for
/// `asFields`; Cancelled.
Pieces cutIntoLevelSets(const ScalarField& shape, const PieceLattice& lattice, const Knives& knives,
                        const CutOptions& options = {}, const Progress& progress = silent());

}  // namespace nephele
