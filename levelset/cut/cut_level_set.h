#pragma once

#include <optional>
#include <vector>

#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/grid/brick_grid.h"

namespace nephele {

/// Triangles of the surface where `level` is 0, with each cell of the lattice cut into six tetrahedra and
/// linear values in these: what `cutLevelSet` calls the whole. Some three times as many triangles as
/// `marchingCubes`, and a surface that needs no tables.
///
/// A closed manifold facing outwards, whatever the samples; samples of 0, or below 1/4096 of a voxel,
/// count as outside. Vertices lie on edges of tetrahedra and keep away from the ends; but where the surface
/// is simple about a sample of 0, it passes through it. The same mesh at any number of threads.
/// @throws Error if the background is inside, a sample near the surface is NaN, or there are too many
/// triangles; Cancelled.
Mesh marchingTetrahedra(const BrickGrid& level, const Progress& progress = silent());

struct LevelSetCutOptions {
  /// Flat blades.
  std::vector<BladePlane> planes{};
  /// Points whose Voronoi cells part the level set, too. Empty: none.
  std::vector<Vec3f> cells{};
  /// Width of the cut, world units, >= 0: half of it goes from each side of every knife.
  float kerf = 0.0f;
  /// Rough blades; their `spacing` is that of the level set.
  std::vector<RoughBlade> rough{};
  /// Any other fields: a shape, the distance to a mesh, another level set.
  std::vector<Knife> knives{};
  /// Pieces with less volume are left out, world units cubed, >= 0. Default: one voxel.
  std::optional<double> minVolume{};
};

/// Cuts a level set exactly into closed meshes, by linear cells: every cell of its lattice is six tetrahedra,
/// in each of which the level set and all knives are linear between their values at the corners.
///
/// So rims are sharp, both sides of a cut have the same triangles, and the volumes of the pieces sum to that
/// of `marchingTetrahedra`. Pieces are as `MeshPiece` says, codes in the order planes, rough blades, knives;
/// `uv` of a knife that is no plane is the place on the axis plane that the face looks at most.
///
/// Planes and cells, which are linear everywhere, cut whole triangles, and their faces are as large as can
/// be; other knives have the triangles of the lattice. Their vertices lie on the blade within a thousandth of
/// a voxel; beside rims and other knives, where they are those of linear cells, they are off a blade of
/// radius r by at most 3 / 8 voxel^2 / r. Decisions are exact (`TetrahedronFacets` in the sources): knives
/// may meet anywhere, in samples, or coincide with the surface, and any level set does. Equal fields, or
/// equal rough blades, cut once. The order of the knives changes nothing but the order of the signs in the
/// codes: pieces come in the same order, with the same bits. The same result at any number of threads. Cost:
/// as `cutMesh` for planes and cells; for other knives the cells inside the level set that they pass.
/// @throws Error if the level set has no surface or its background is inside, values are not finite, a
/// normal is 0, cells are equal, minVolume or kerf < 0, or there are more than 16 000 knives; as `roughKnife`
/// for rough blades; Cancelled.
/// Source: Tessendorf, Resolution Independent Volumes, chapter 5.
MeshPieces cutLevelSet(const BrickGrid& level, const LevelSetCutOptions& options,
                       const Progress& progress = silent());
/// The same for a level set of which `whole` is the mesh by `marchingTetrahedra`.
MeshPieces cutLevelSet(const BrickGrid& level, const Mesh& whole, const LevelSetCutOptions& options,
                       const Progress& progress = silent());

}  // namespace nephele
