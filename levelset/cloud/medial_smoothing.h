#pragma once

#include <vector>

#include "nephele/levelset/grid/brick_samples.h"
#include "nephele/modeling/base/progress.h"

namespace nephele {

struct MedialSmoothingOptions {
  /// Largest difference between neighbouring samples that is not a jump, in units of the samples, > 0.
  float jump = 0.0f;
  /// Voxels by which the marked places grow before they are smoothed; 0 marks but smooths nothing.
  int dilation = 4;
  /// Diffusion steps.
  int steps = 16;
};

struct MedialSmoothing {
  /// Samples that were diffused.
  std::size_t diffused = 0;
  /// Of every pool brick: whether it is to be stored without signs.
  std::vector<bool> signless;
};

/// Smooths a displacement where the medial axis makes it jump.
///
/// `signedDisplacement` holds samples whose absolute value is the displacement. Around every pair of
/// neighbours that differ by more than `jump`, the absolute value is diffused, and the bricks that see those
/// samples, their own or in their borders, are to lose the sign: a change of sign across a jump is no crease,
/// and interpolating it would cut a false one. Samples that are exactly 0 lie outside the band; they neither
/// count as jumps nor conduct. Ranges are up to date afterwards. Each pool brick but brick 0 must stand at
/// one position, and brick 0 be 0; samples that are shared stay as they are. All cores; the same bits at any
/// thread count.
/// @throws Error if jump is not > 0 or a count is negative; Cancelled.
MedialSmoothing smoothMedialJumps(detail::BrickSamples& signedDisplacement,
                                  const MedialSmoothingOptions& options, const Progress& progress = silent());

}  // namespace nephele
