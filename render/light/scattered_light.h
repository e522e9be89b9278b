#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "nephele/levelset/grid/large_buffer.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/render/light/phase_expansion.h"
#include "nephele/render/light/scattered_source.h"
#include "nephele/render/light/viewpoint.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

namespace detail {
class CellRows;
struct ScatteringLattice;
}  // namespace detail

/// How a volume scatters light of one colour.
struct Scattering {
  float extinction = 1.0f;
  float albedo = 1.0f;
  /// See legendreMoments; those that are missing count as 0.
  std::vector<float> phase{1.0f};
};

/// Light in a volume by discrete ordinates, as moments over all directions, on a coarse lattice.
///
/// The transport equation is solved in a medium without forward peak (SmoothScattering), whose cells are
/// thinned where they would be nearly opaque, by a density that no voxel exceeds: what is thinned away counts
/// as light that goes on as before, for the beam and for what becomes of it alike, so that no light is lost.
class ScatteredLight {
 public:
  struct Options {
    /// Nodes along the longest side, about: within a third of it, where there are as many voxels.
    int longestSide = 84;
    /// Of the directions: 4, 6 or 8, see levelSymmetric. Moments are kept up to a degree of 2, 3 or 5, where
    /// the phase function has so many.
    int order = 6;
    /// Sweeps over the finest lattice, at most; they end where one changes less of all light than
    /// `tolerance`, and leaves about as much to change.
    int sweeps = 16;
    float tolerance = 2e-3f;

    /// The degree for a phase function with these moments: where those above it are below 0.1, at most that
    /// of the directions.
    int degree(const std::vector<float>& phase) const;
    /// These, with cells three quarters as wide where they would be so deep that thinning them shows, and
    /// with all directions where light keeps its way: through thin cells, scattered forward.
    Options suitedTo(const RenderVolume& volume, const Scattering& scattering) const;
  };

  /// From where ScatteredSource::sky is asked for radiance.
  static std::vector<Vec3f> skyDirections(const RenderVolume& volume, const Options& options);

  /// Cost: some 4 sweeps, each directions * nodes. @throws Error if an option is not useful or `scattering`
  /// is outside its range.
  ScatteredLight(const RenderVolume& volume, const Scattering& scattering, const ScatteredSource& source,
                 const Options& options, const Progress& progress = silent());
  ScatteredLight(const RenderVolume& volume, const Scattering& scattering, const ScatteredSource& source,
                 const Progress& progress = silent())
      : ScatteredLight(volume, scattering, source, Options{}, progress) {}

  /// From world space to this lattice, whose nodes are the integers from 0 on: the same for all of a volume.
  const Affine& worldToLattice() const { return worldToLattice_; }
  Vec3i size() const { return size_; }
  /// Mean over all directions of the light that was scattered, and of the sky's that was not: of every node
  /// that density is near. First axis fastest.
  std::vector<float> mean() const;
  /// The same at a world-space point, clamped to the lattice. Slow; for tests.
  float meanAt(const Vec3f& world) const;

  /// What every node sends towards a viewpoint, per optical depth of the medium itself, of all light but the
  /// beam (ForwardLight has what becomes of that) and what glows. Cost: a march of some ten steps per node,
  /// on all cores; little more of several lights than of one.
  std::vector<float> towards(const Viewpoint& viewpoint) const;
  static std::vector<std::vector<float>> towards(std::span<const ScatteredLight* const> lights,
                                                 const Viewpoint& viewpoint);

  /// Over the finest lattice, and an estimate of the relative error that they left.
  int sweeps() const { return sweeps_; }
  float residual() const { return residual_; }

  /// Cells are never thinned so far that density 1 has less extinction than this.
  static float leastExtinction(const RenderVolume& volume, const Options& options);

  /// So many are made at the same time where there are more than one.
  static constexpr std::size_t kMadeTogether = 2;

  /// Bytes held while it is made, and afterwards.
  struct Bytes {
    double working = 0, kept = 0;
  };
  static Bytes estimateBytes(const RenderVolume& volume, const Options& options);

 private:
  struct Sender;
  void addBeam(detail::UnsetVector<float>& moments, const detail::ScatteringLattice& lattice,
               const detail::CellRows& rows, float wider) const;
  Vec3f wayOfBeam(const Vec3f& node) const;
  bool hasWay() const { return towards_ || place_; }
  void sharpen(std::vector<float>& values) const;
  void growShares(const std::vector<float>& density);

  Affine worldToLattice_;
  Vec3i size_{1, 1, 1};
  // The solver's extinction over the medium's, of all nodes, and what it was before cells were thinned; its
  // albedo, the optical depth of a cell of density 1, and the moments of its phase function.
  std::vector<float> share_;
  float smoothShare_ = 1, albedo_ = 1, depthPerDensity_ = 0;
  std::vector<float> phase_{1.0f};
  // As in ScatteredSource, in the lattice.
  std::optional<Vec3f> towards_, place_;
  // Moments of the light around the volume.
  std::vector<float> sky_;
  // Nodes near density, and the moments of the light at each of them, beam and all.
  std::shared_ptr<const detail::CellRows> rows_;
  detail::UnsetVector<float> moments_;
  // The beam alone and the thinned density, at all nodes, and its centre, see ScatteringLattice.
  std::vector<float> beam_, density_;
  std::vector<Vec3f> centre_;
  int sweeps_ = 0;
  float residual_ = 0;
};

}  // namespace nephele
