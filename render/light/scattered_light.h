#pragma once

#include <functional>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// How a volume scatters light of one colour.
struct Scattering {
  float extinction = 1.0f;
  float albedo = 1.0f;
  /// Of the phase function; below 0 counts as 0.
  float meanCosine = 0.0f;

  /// Share g of what is scattered goes on as before: extinction * (1 - albedo g) and albedo (1 - g) / (1 -
  /// albedo g) scatter alike in all directions and transport as much light.
  Scattering isotropic() const;
};

/// Where light comes from: a beam through the volume, or the sky around it.
struct ScatteredSource {
  /// Irradiance of the beam at a world-space point without the volume, and the density on its way there.
  std::function<float(const Vec3f&)> irradiance, column;
  /// Multiplies the extinction on that way.
  float shadow = 1.0f;
  /// Radiance of the sky in each of some unit directions, which stand for equal shares of the sphere.
  std::function<std::vector<float>(const std::vector<Vec3f>&)> sky;

  /// A light of irradiance 1 everywhere, whose column densities are `sun`.
  static ScatteredSource of(const LightVolume& sun);
  /// A sky of radiance 1.
  static ScatteredSource evenSky();
};

/// Light that has been scattered, mean over all directions, on a coarse lattice.
///
/// Solves  J(x) = mean over directions of the light that arrives at x of  albedo (J + beam)  all over the
/// volume, for the isotropic equivalent of a Scattering; beam = irradiance * exp(-extinction c) / (4 pi), c
/// the density between a point and the light. So J is the mean radiance of scattered light for a beam, or of
/// all light for a sky, then at most the sky's largest.
class ScatteredLight {
 public:
  struct Options {
    /// Nodes along the longest side, at most.
    int longestSide = 128;
    int directions = 24;
    /// Sweeps over the finest lattice, at most; they end where one changes J by less than `tolerance`.
    int sweeps = 16;
    float tolerance = 1.5e-3f;
  };

  /// Light of a sun whose column densities are `sun`, or of a sky of radiance 1 if that is null.
  /// Cost: some 8 sweeps, each directions * nodes. @throws Error if an option is too small to be useful or
  /// `scattering` is outside its range.
  ScatteredLight(const RenderVolume& volume, const Scattering& scattering, const LightVolume* sun,
                 const Progress& progress = silent());
  ScatteredLight(const RenderVolume& volume, const Scattering& scattering, const LightVolume* sun,
                 const Options& options, const Progress& progress = silent());
  ScatteredLight(const RenderVolume& volume, const Scattering& scattering, const ScatteredSource& source,
                 const Options& options, const Progress& progress = silent());

  /// From world space to this lattice, whose nodes are the integers from 0 on: the same for all of a volume.
  const Affine& worldToLattice() const { return worldToLattice_; }
  Vec3i size() const { return size_; }
  /// First axis fastest.
  const std::vector<float>& values() const { return values_; }
  /// Multiplies all values.
  void scale(float factor);
  /// J at a world-space point, clamped to the lattice. Slow; for tests.
  float at(const Vec3f& world) const;

  /// Bytes held while it is made, and afterwards.
  struct Bytes {
    double working = 0, kept = 0;
  };
  static Bytes estimateBytes(const RenderVolume& volume, int longestSide = 128);

 private:
  Affine worldToLattice_;
  Vec3i size_{1, 1, 1};
  std::vector<float> values_;
};

}  // namespace nephele
