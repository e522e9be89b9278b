#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "nephele/levelset/mesh/exact_distance.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/modeling/base/similarity.h"

namespace nephele {

struct AlignmentOptions {
  /// Chooses the surface points.
  std::uint32_t seed = 0;
  /// Surface points of each shape that the last fit uses.
  int pointCount = 420;
};

struct AlignmentResult {
  Similarity similarity;
  /// Root mean square distance between the aligned surfaces, over points of both, world units.
  double cost = 0;
};

/// Turns, scales and shifts `object` onto `reference`: least squares of the distances of surface points of
/// each shape to the other, softened so that parts that only one of them has do not pull.
///
/// Starts from the moments of both with the 24 rotations of a cube and the pairings of their main axes, goes
/// 8 steps on 120 points each, and refines the best 3. Of equally good ones the smallest turn is kept.
/// Mirror images are not tried. Runs on one thread; deterministic.
/// @throws Error if an option is out of its range; Cancelled.
AlignmentResult alignSimilarity(const ExactDistance& reference, const ExactDistance& object,
                                const AlignmentOptions& options = {}, const Progress& progress = silent());

/// A smooth bend of space: cubic B-splines on 5 x 5 x 5 control points over a box.
struct BendLattice {
  Vec3d low, high;
  /// Displacements, x fastest.
  std::array<Vec3d, 125> control{};

  /// p plus the displacement there; that of the nearest point of the box outside it.
  Vec3d operator()(const Vec3d& p) const;
};

struct LatticeOptions {
  std::uint32_t seed = 0;
  /// Surface points of the object that the fit uses.
  int pointCount = 800;
  /// Weight of the bending energy against the mean squared distance, > 0.
  double smoothness = 1.0;
};

/// Bends the aligned object onto `reference`: least squares of reference(lattice(similarity(x))) over its
/// surface, with the second differences of the control points held small.
/// @throws Error if an option is out of its range; Cancelled.
BendLattice alignLattice(const ExactDistance& reference, const ExactDistance& object,
                         const Similarity& similarity, const LatticeOptions& options = {},
                         const Progress& progress = silent());

}  // namespace nephele
