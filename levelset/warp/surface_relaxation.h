#pragma once

#include <memory>
#include <span>
#include <vector>

#include "nephele/levelset/mesh/exact_distance.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

struct RelaxationOptions {
  /// Rounds of plain smoothing first. They open folds, and shrink what does not wrap around the reference.
  int smoothingRounds = 4;
  /// Newton steps at most. The barrier is lowered over the first half of them.
  int rounds = 16;
  /// Weight of keeping areas against keeping angles, > 0.
  double areaWeight = 0.5;
  /// Energy (1 + areaWeight for an isometry) beyond which a triangle counts less and less: in the first
  /// three quarters of the rounds, and in the last one. Low limits give up more triangles for the rest, > 0.
  double limit = 30, lastLimit = 5;
  /// From this share of the rounds on triangles resist spanning the reference, 0 to 1. Until then they may
  /// tear, which finds places where they cover it.
  double resistsFrom = 0.5;
  /// How strongly, >= 0.
  double tearWeight = 10;
};

/// How many of the object's triangles are torn: once the object has the reference's area, the image of a side
/// is longer than 4.5 times the side, and than 12 times the side held within 0.15 and 0.3 times the
/// reference's longest side.
/// @throws Error if the counts differ or `object` has other faces than triangles.
std::size_t countTears(const ExactDistance& reference, const Mesh& object, std::span<const Vec3d> images);

/// Maps of one object to one reference, relaxed: keeps what does not depend on the images.
class SurfaceRelaxation {
 public:
  /// `object` is the object laid on the reference (its positions are where the alignment puts them; its size
  /// does not matter). Both must outlive this. @throws Error if `object` has other faces than triangles;
  /// Cancelled.
  SurfaceRelaxation(const ExactDistance& reference, const Mesh& object, const Progress& progress = silent());
  ~SurfaceRelaxation();

  /// Moves the images of the object's positions along the surface of the reference so that triangles keep
  /// their shape.
  ///
  /// Lowers, over the object's triangles, the sum of
  ///   area * limit * log(1 + f / limit),   f = (|J|^2 / 2 + areaWeight (det^2 + 1) / 2) / chi(det),
  ///   chi = (det + sqrt(eps^2 + det^2)) / 2,
  /// J the map of a triangle in the tangent plane of the reference: angles and areas, each least where the
  /// map is an isometry, over a barrier against fold-over that is lowered (eps) as the rounds go on. Sides
  /// whose images span more than a fifth of the reference (and three times themselves) resist on top.
  /// Coincident positions stay together. Returns points of the reference. Cost: about 0.2 s per round for
  /// 60 000 triangles on one core. The same at any thread count.
  /// @throws Error if an option is out of its range or the counts differ; Cancelled.
  std::vector<Vec3d> relaxed(std::span<const Vec3d> images, const RelaxationOptions& options = {},
                             const Progress& progress = silent());

  /// Relaxes only what is around torn triangles (see countTears), with sides that resist more, and then what
  /// is around those that are turned over or have collapsed, in wider and wider patches as long as some are
  /// left. A patch stays as it was unless it gets fewer of these and no more torn ones. Cost: that of the
  /// patches.
  /// @throws Error if the counts differ; Cancelled.
  std::vector<Vec3d> mended(std::span<const Vec3d> images, const Progress& progress = silent());

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// SurfaceRelaxation::relaxed, once.
std::vector<Vec3d> relaxImages(const ExactDistance& reference, const Mesh& object,
                               std::span<const Vec3d> images, const RelaxationOptions& options = {},
                               const Progress& progress = silent());

}  // namespace nephele
