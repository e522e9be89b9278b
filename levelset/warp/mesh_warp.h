#pragma once

#include <cstdint>
#include <vector>

#include "nephele/levelset/warp/alignment.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/cloud/nacelle.h"
#include "nephele/modeling/field/field.h"

namespace nephele {

/// nacelle: solves object(x) = reference(X(x)). closest: the reference's nearest point, without alignment or
/// relaxation.
enum class WarpMethod { nacelle, closest };

/// What is done to the object before: nothing; turned, scaled and shifted; and then bent.
enum class Alignment { none, similarity, lattice };

/// fast: the warp field as it is. balanced: relaxed where it folds over or stretches, for a few rounds. best:
/// for many, from several starts until there is hardly any fold. Of all maps tried, the best that is no worse
/// than closest points in flips, collapsed triangles, stretch and coverage (transfer_quality.h) is kept, if
/// possible one without triangles that span the reference (surface_relaxation.h); if none is, one that has
/// fewer bad triangles of both kinds and no less coverage.
enum class WarpQuality { fast, balanced, best };

struct MeshWarpOptions {
  WarpMethod method = WarpMethod::nacelle;
  Alignment align = Alignment::similarity;
  WarpQuality quality = WarpQuality::balanced;
  /// 1 or 2 as NacelleOptions::order; 0: 1, since both shapes are distances.
  int order = 0;
  /// Iterations at most, 1 to 20.
  int steps = 3;
  /// The unit of residuals and tolerances, and the voxel of grids, world units of the reference. 0: its
  /// longest side / 256.
  double voxelSize = 0;
  /// Distances from grids instead of exact ones: `map` evaluates some ten times faster.
  bool gridded = false;
  /// Chooses the surface points that alignment uses.
  std::uint32_t seed = 0;
};

/// A map from an object to a reference.
struct MeshWarp {
  /// For every position of the object its image on the surface of the reference. Always finite.
  std::vector<Vec3d> images;
  /// The warp field x -> X(x) in all of space, before relaxation.
  VectorField map = Vec3f{};
  /// The level sets that it connects, object(x) = reference(map(x)): the object's distance is in the units of
  /// the reference, that is, times the alignment's scale. Positive inside.
  ScalarField object = 0.0f, reference = 0.0f;
  /// Residuals at the object's positions, after alignment and after each step; in voxels.
  std::vector<WarpResidual> iterations;
  /// Share of the object's positions that took the reference's nearest point: 1 for `closest`.
  double unconvergedFraction = 0;
  /// What the object was turned, scaled and shifted by.
  Similarity alignment;
  /// Root mean square distance of the aligned object from the reference, in voxels.
  double alignmentCost = 0;
  /// The images were relaxed, and the relaxed ones are better than those of the warp field.
  bool isRelaxed = false;
};

/// Maps every position of `object` to the surface of `reference`; both must be triangulated.
///
/// A mesh that is not closed has no inside: its level set is minus the distance to it, so that only its
/// surface and the outside are mapped. A mesh that is inside out counts as turned right.
/// Uses all cores; the same result at any thread count.
/// @throws Error if a mesh has no faces, is not triangulated or has positions that are not finite, or an
/// option is out of its range; Cancelled.
MeshWarp warpMesh(const Mesh& reference, const Mesh& object, const MeshWarpOptions& options = {},
                  const Progress& progress = silent());

/// Bytes that `warpMesh` holds at most, beside the reference and grids.
double estimateWarpBytes(const Mesh& object, const MeshWarpOptions& options);

}  // namespace nephele
