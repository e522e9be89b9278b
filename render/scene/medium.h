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
///
/// With a count of 1, single scattering. With more: a share g of every scattering, g the mean cosine of the
/// phase function, counts as light that goes on, and the rest as scattered evenly. The evenly scattered light
/// comes from a coarse lattice (see ScatteredLight). The light that goes on, bent but little, is a sum of
/// octaves: octave n is the sun seen through extinction * (1 - albedo g^(count - n)), octave 0 through all of
/// it, less what the octave before sees, and is scattered to the eye by the phase function itself for n = 0
/// and by Henyey-Greenstein's with g^(n + bend) for the others.
///
/// The numbers were fitted to path traced pictures of three clouds (tests/bench/fit_scattering.cpp measures
/// and fits): optical depths of 150 and 38 across, albedo 0.9 to 1, in a sun from the front, the side or the
/// back and a tenth as much sky. Left over, up to a mean cosine of 0.3: means within 5 %; regions of 32x32
/// pixels of 640x480 3 to 7 % in the root mean square, 3 % of them above 15 %, the worst 28 %, where a cloud
/// is lit from behind. At a mean cosine of 0.85: means within 11 %, regions 7 to 16 %, the worst 53 %.
struct Octaves {
  int count = 3;
  /// On the evenly scattered light of suns: what the lattice's cells lose near a lit surface.
  float gain = 1.07f;
  float bend = 2.0f;
  /// How far along the ray that light is read, in its free paths times g: light that flows outwards is
  /// brighter towards the eye than its mean over directions, by what that mean gains along this way. 1
  /// follows from diffusion.
  float lookAhead = 1.0f;

  bool operator==(const Octaves&) const = default;
};

}  // namespace nephele
