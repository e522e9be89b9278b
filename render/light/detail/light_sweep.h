#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/light/detail/scattering_lattice.h"

namespace nephele::detail {

/// What carries light through a slice of a lattice in four directions that differ in signs alone.
struct SliceWork {
  /// Cells of a row, and rows.
  int width = 0, rowBegin = 0, rowEnd = 0;
  std::size_t rowStride = 0;
  /// Of the first row: share that a cell takes of what comes in, and what it holds on average of that.
  const float *taken = nullptr, *mean = nullptr;
  /// The same of what the cell's own light grows by on the way through it.
  const float *takenSlope = nullptr, *meanSlope = nullptr;
  /// Slopes of the first moment along the row, from row to row and from slice to slice, per cell.
  const float* slopes[3] = {};
  /// Moments of the light that is scattered, and of the sum; one moment after `momentStride` floats.
  const float* moments = nullptr;
  float* sums = nullptr;
  std::size_t momentStride = 0;
  int momentCount = 1;
  /// Cells of every row that hold something or are asked for, whole vectors.
  const std::array<std::uint16_t, 2>* active = nullptr;
  std::size_t activeStride = 1;
  struct Way {
    /// The slice before at the first of four cells that light comes in from, and this slice.
    const float* before;
    float* here;
    float shares[4];
    /// Of the way through a cell, times the phase function's first moment.
    float slopes[3];
  } ways[4];
  std::size_t planeStride = 0;
  /// Per moment and direction.
  float source[kMostMoments][4], sum[kMostMoments][4];
};

void carrySlice(const SliceWork& work);

/// Carries light through one lattice in all directions.
class LightSweep {
 public:
  /// `extinction`: per density and cell. `phase`: moments of the phase function times albedo, up to a degree.
  /// `inflow`: what comes in along each of the ordinates. `needed`: cells whose moments are wanted beside
  /// those with density. All must outlive it but `needed` and `phase`.
  LightSweep(const ScatteringLattice& lattice, float extinction, const std::vector<float>& phase,
             const std::vector<Ordinate>& ordinates, const std::vector<float>& inflow,
             const std::vector<std::uint8_t>& needed);

  /// Moments of the light in every cell that is needed, given those of the light that is scattered; moment m
  /// of cell i is at m * cells + i. Nothing comes in unless `hasInflow`.
  void sweep(const std::vector<float>& moments, std::vector<float>& result, bool hasInflow = true);

 private:
  // The lattice as it lies, or turned so that x is the slowest axis.
  struct Layout {
    Vec3i size;
    std::vector<std::vector<float>> taken, mean, takenSlope, meanSlope;
    std::vector<float> slopes[3];
    // Of rows along the first axis.
    std::vector<std::array<std::uint16_t, 2>> active;
  };
  // Four directions: a cell's path, how far light moves sideways per slice, and their ordinates.
  struct Group {
    int axis;
    bool rises;
    std::size_t length;
    std::array<std::size_t, 4> ordinates;
  };

  void addLayout(const std::vector<float>& density, const std::vector<std::uint8_t>& needed,
                 const Vec3i& size, Layout& layout) const;
  void findSlopes(const std::vector<float>& moments);
  void carry(const Group& group, const std::vector<float>& moments, std::vector<float>& sums,
             bool hasInflow) const;

  const ScatteringLattice& lattice_;
  float extinction_;
  const std::vector<Ordinate>& ordinates_;
  const std::vector<float>& inflow_;
  std::size_t momentCount_;
  float scattered_;
  std::vector<float> lengths_;
  std::vector<Group> groups_;
  Layout plain_, turned_;
  std::vector<std::array<float, kMostMoments>> sources_, sums_;
  // Sums of the directions along x and y, added to those along z in a fixed order.
  std::vector<float> turnedMoments_, turnedSums_, sidewaysSums_;
};

}  // namespace nephele::detail
