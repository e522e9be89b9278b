#pragma once

#include <memory>
#include <vector>

#include "nephele/levelset/grid/brick_grid.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/shape/knives.h"

namespace nephele {

/// A plane with hills: the height field of `roughKnife`. Meshes are cut by its triangles: the hills are read
/// at the points of a lattice on the plane.
struct RoughBlade {
  BladePlane plane;
  RoughnessOptions roughness{};
  /// Between the points of the lattice, world units. 0: an eighth of the shortest wave of the roughness, but
  /// no finer than the size of the solid / 400. Level sets have a lattice of their own instead.
  float spacing = 0.0f;
};

/// All knives of a cut. `PieceCode` has the sides of planes, rough blades, solids and fields, in this order.
struct Knives {
  /// Flat blades: the positive side is the one that the normal points to.
  std::vector<BladePlane> planes{};
  /// Points whose Voronoi cells part what is cut, too. Empty: none.
  std::vector<Vec3f> cells{};
  /// Roughens the walls between cells, of meshes only and without a kerf; amplitude 0: they are flat. Cells
  /// that touch share one rough wall, triangle by triangle.
  RoughnessOptions cellRoughness{};
  /// Rough blades: the positive side is above the hills.
  std::vector<RoughBlade> rough{};
  /// Closed meshes: the positive side is inside.
  std::vector<Mesh> solids{};
  /// Any other fields: a shape, another level set. They cut level sets only.
  std::vector<Knife> fields{};

  /// How many signs a code has.
  std::size_t signs() const { return planes.size() + rough.size() + solids.size() + fields.size(); }
};

/// The inside of a closed mesh as a knife for level sets of that voxel size: its signed distance as far as a
/// cut of that width needs it. @throws Error as `meshDistance`.
Knife solidKnife(const Mesh& solid, double voxelSize, float kerf, const Progress& progress = silent());

/// Samples of a field in a box and around it, whose inside is a knife for meshes: `marchingCubes` of them
/// gives a closed mesh at 0, and the sides of a kerf at -kerf / 2 and kerf / 2 where the field is a distance.
/// The walls that close it stand outside of the box. @throws Error as `bakeGrid`; Cancelled.
std::shared_ptr<BrickGrid> sampledBlade(const ScalarField& field, const Box& box, double voxelSize,
                                        float kerf, const Progress& progress = silent());

/// All but the cells as fields for a level set of that voxel size, in the order of the signs. Of equal solids
/// there is one field. @throws Error as `flatKnife`, `roughKnife` and `solidKnife`; Cancelled.
std::vector<Knife> asFields(const Knives& knives, double voxelSize, float kerf,
                            const Progress& progress = silent());

}  // namespace nephele
