#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nephele/render/light/detail/cell_rows.h"
#include "nephele/render/light/detail/harmonics.h"

namespace nephele::detail {

/// What carries light through a slice of a lattice in four directions that differ in signs alone.
struct SliceWork {
  /// Cells of a row, and rows; one row after `rowStride` of CellRows.
  int width = 0, rowBegin = 0, rowEnd = 0;
  const CellRows::Row* rows = nullptr;
  std::size_t rowStride = 1;
  /// Of all cells, and the optical depth per density of the way through one.
  const float* density = nullptr;
  float depthPerDensity = 0;
  /// Slopes of the first moment along the row, from row to row and from slice to slice, per cell.
  const float* slopes[3] = {};
  /// Moments of the light that is scattered, and of the sum, see CellRows::momentsAt.
  const float* moments = nullptr;
  float* sums = nullptr;
  std::size_t momentCount = 1;
  /// What a moment counts for in the first direction, and that for the moment. Sorted by the signs in the
  /// other directions: alike in all, odd along the row, odd from row to row, odd in both; each kind ends at
  /// `ends`.
  struct Part {
    std::size_t offset;
    float source, sum;
  };
  std::array<Part, kMostMoments> parts{};
  std::array<int, 4> ends{};
  /// Every other one differs from the first in its sign along the row, the last two from row to row.
  struct Way {
    /// Mixed along rows: the slice before, at the first of four rows that light comes in from, and this one.
    const float* before;
    float* here;
    /// A row before it is mixed, behind kRim cells of what comes in from outside.
    float* row;
    /// The first of four cells along a row that are mixed, from the one that they are mixed for.
    int first;
    std::array<float, 4> along, across;
    /// Of the way through a cell, times the phase function's first moment.
    float slopes[3];
  } ways[4];
  std::size_t planeStride = 0;

  /// Cells around a row, and rows around a slice, through which light comes in.
  static constexpr int kRim = 2;
};

void carrySlice(const SliceWork& work);

/// Copies vectors of cells side by side to the ones across them, or adds them to these. Null ones are zero,
/// and not written.
void turnSquare(const float* const (&from)[CellRows::kVector], float* const (&to)[CellRows::kVector],
                bool adds);

/// Carries light through one lattice in all directions.
class LightSweep {
 public:
  /// `rows`: the cells whose moments are wanted, all with density among them. `density`: theirs.
  /// `extinction`: per density and cell. `phase`: moments of the phase function times albedo, up to a degree.
  /// `inflow`: what comes in along each of the ordinates. All must outlive it but `phase`.
  LightSweep(const CellRows& rows, const std::vector<float>& density, float extinction,
             const std::vector<float>& phase, const std::vector<Ordinate>& ordinates,
             const std::vector<float>& inflow);

  /// Moments of the light in every cell that is kept, given those of the light that is scattered, see
  /// CellRows::momentsAt. Nothing comes in unless `hasInflow`.
  void sweep(const Moments& moments, Moments& result, bool hasInflow = true);

 private:
  // The lattice as it lies, or turned so that x is the slowest axis.
  struct Layout {
    const CellRows* rows;
    const std::vector<float>* density;
    std::vector<float> slopes[3];
  };
  // Four directions along an axis, and the length of a cell on their way.
  struct Group {
    int axis;
    bool rises;
    float length;
    std::array<std::size_t, 4> ordinates;
  };

  void findSlopes(const Moments& moments);
  struct Wave;
  Wave wave(const Group& group, const Moments& moments, Moments& sums, bool hasInflow) const;
  void carry(int axis, bool rises, const Moments& moments, Moments& sums, bool hasInflow) const;

  float extinction_;
  const std::vector<Ordinate>& ordinates_;
  const std::vector<float>& inflow_;
  std::size_t momentCount_;
  float scattered_;
  std::vector<Group> groups_;
  CellRows turnedRows_;
  std::vector<float> turnedDensity_;
  Layout plain_, turned_;
  std::vector<std::array<float, kMostMoments>> sources_, sums_;
  // Moments and sums of the directions along x, and in small lattices the sums of those along y.
  Moments turnedMoments_, turnedSums_, sidewaysSums_;
};

}  // namespace nephele::detail
