#pragma once

#include "nephele/modeling/base/math.h"
#include "nephele/render/light/detail/cell_rows.h"
#include "nephele/render/light/detail/harmonics.h"

namespace nephele::detail {

/// A vector of cells of a row, side by side along the first axis, and what they send to an eye.
struct SendingCells {
  /// Of the first cell, in the lattice, as all places and ways are.
  Vec3f node{};
  /// Where the eye is, or the way of all rays from it.
  Vec3f eye{};
  bool isEyeAPlace = false;
  /// What scattered light of every degree counts for.
  int degree = 0;
  const float* weights = nullptr;
  /// Moments of the light, see CellRows::momentsAt, and of these what is the beam's in every cell.
  const float* moments = nullptr;
  const float* beam = nullptr;
  /// Harmonics of the beam's way, all but the first 0 where it has none, unless it comes from a place.
  const float* beamWay = nullptr;
  const Vec3f* beamPlace = nullptr;

  /// The light that is sent, without what the beam sends, and that.
  alignas(32) float own[CellRows::kVector] = {};
  alignas(32) float ofBeam[CellRows::kVector] = {};
};

/// Sets `own` and `ofBeam`.
void send(SendingCells& cells);

}  // namespace nephele::detail
