#pragma once

#include "nephele/modeling/base/math.h"
#include "nephele/render/scene/phase.h"

namespace nephele {

/// What a density does to light. Extinction coefficient at x: extinction * density(x), per world unit.
struct Medium {
  float extinction = 1.0f;
  /// Share of the light met that is scattered and not absorbed, per colour, in [0, 1].
  Vec3f albedo{0.99f, 0.99f, 0.99f};
  Phase phase = Phase::henyeyGreenstein(0.3f);
  /// Multiplies the extinction, per colour, >= 0: what is left of white light behind a volume is brighter
  /// where it is smaller.
  Vec3f extinctionColour{1, 1, 1};

  /// @throws Error if a number is outside its range.
  void check() const;
};

/// Multiple scattering: what the marcher takes for it.
struct Octaves {
  /// 1: single scattering. More: all of it; so many terms stand for light that has been scattered forward
  /// several times on its way (ForwardLight), and the rest comes from a coarse lattice (ScatteredLight).
  int count = 4;
  /// Of the directions in which the rest is solved for: 4, 6 or 8, that is 24, 48 or 80 of them.
  int order = 6;
  /// Cells of that lattice along its longest side, about, from 8 on; 0: 72, 84 or 160, as the order is.
  int cells = 0;
  int longestSide() const { return cells > 0 ? cells : order == 4 ? 72 : order == 6 ? 84 : 160; }

  bool operator==(const Octaves&) const = default;
};

}  // namespace nephele
