#pragma once

#include <vector>

#include "modeling/progress.h"
#include "render/medium.h"
#include "render/render_volume.h"

namespace nephele {

/// How much of an equally bright sky reaches every point of a volume, scattered on the way included.
///
/// Holds, on a coarse lattice,  min(1, sum over octaves n of weight_n mean over directions of exp(-extinction
/// c / 2^n)), c the density between the point and the sky: a soft ambient occlusion. At most 1, what a medium
/// that absorbs nothing would see under such a sky.
class AmbientVolume {
 public:
  /// Cost: one sweep per direction over at most `longestSide`^3 nodes.
  AmbientVolume(const RenderVolume& volume, const Medium& medium, const Octaves& octaves,
                const Progress& progress = silent(), int directions = 24, int longestSide = 128);

  /// From world space to this lattice, whose nodes are the integers from 0 on.
  const Affine& worldToLattice() const { return worldToLattice_; }
  Vec3i size() const { return size_; }
  /// First axis fastest.
  const std::vector<float>& values() const { return values_; }

  /// The value at a world-space point, clamped to the lattice. Slow; for tests.
  float visibility(const Vec3f& world) const;

  static double estimateBytes(const RenderVolume& volume, int longestSide = 128);

 private:
  Affine worldToLattice_;
  Vec3i size_;
  std::vector<float> values_;
};

}  // namespace nephele
