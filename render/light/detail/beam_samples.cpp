// Samples of the density and of a beam, averaged over the cells of a lattice.
//
// A beam is sampled at points: averaged along the line of a sample, as if the density were the same there, it
// would be by some per cent too bright where density begins.
#include "nephele/render/light/detail/beam_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <span>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/exp_of_minus.h"

namespace nephele::detail {

namespace {

// Samples along a cell, none of them at a voxel, where they would see none of what is between. Where cells
// are wide a sample between eight voxels stands for these.
int samplesAlong(const LatticePlacement& place) {
  return place.cellsPerBrick == 1 || place.cellsPerBrick == 4 ? 3 : 2;
}

// Voxels from one sample to the next.
float spacingOf(const LatticePlacement& place) {
  return place.voxelsPerSampledCell() / float(samplesAlong(place));
}

// Samples of a brick: of its node 0, and how many there are in a row.
struct DecodedBrick {
  static constexpr int kMost =
      (CodedBricks::kWidth + 1) * (CodedBricks::kWidth + 1) * (CodedBricks::kWidth + 1);

  const float* first;
  int width;
};

// The nodes 0 to 8 of a brick, and those before them, which its neighbours hold, where they are needed.
DecodedBrick decoded(const RenderVolume& volume, const Vec3i& brick, bool needsBefore, float* nodes) {
  const BrickGrid& grid = volume.density();
  if (!needsBefore) {
    volume.coded().decode(grid.tableIndex(brick), nodes);
    return {nodes, CodedBricks::kWidth};
  }
  constexpr int kWidth = CodedBricks::kWidth + 1;
  float* out = nodes;
  for (int z = -1; z != CodedBricks::kWidth; ++z)
    for (int y = -1; y != CodedBricks::kWidth; ++y)
      for (int x = -1; x != CodedBricks::kWidth; ++x) {
        const Vec3i side{x < 0, y < 0, z < 0}, place = brick - side;
        *out++ = grid.covers(place)
                     ? volume.coded().at(grid.tableIndex(place), Vec3i{x, y, z} + side * BrickGrid::kBrick)
                     : 0.0f;
      }
  return {nodes + (kWidth + 1) * kWidth + 1, kWidth};
}

// A row of samples along x.
struct SampleRow {
  static constexpr int kMost = 2 * BrickGrid::kBrick;

  // Sums of the cells along it, `kinds` for each, which has so many samples. In double, so that they do not
  // depend on the order: mirrored light has the same bits.
  double* sums;
  int kinds, perCell;
  // The first sample in voxels; the others follow at the samples' spacing.
  Vec3f voxel;
  // From the middle of their cell, in cells: all along x, and the row.
  const float* inCell;
  float y, z;
  std::span<const float> density;

  double* sumsOf(std::size_t sample) const {
    return sums + sample / std::size_t(perCell) * std::size_t(kinds);
  }
};

// Calls set(cell, means) with means over the samples between the voxels of every cell, as many in each, of
// what add(row) adds of so many kinds where any is above 0: of bricks that wants(brick). Voxels above `most`
// count as that.
template <int kKinds, class Wants, class Add, class Set>
void forMeans(const RenderVolume& volume, const LatticePlacement& place, float most,
              const ScatteringLattice& lattice, Wants&& wants, Add&& add, Set&& set) {
  const BrickGrid& grid = volume.density();
  const std::vector<Vec3i>& occupied = volume.occupiedBricks();
  const float spacing = spacingOf(place);
  const int perBrick = place.cellsPerBrick, perCell = samplesAlong(place), across = perBrick * perCell;
  int low[SampleRow::kMost];
  float at[SampleRow::kMost], share[SampleRow::kMost], inCell[SampleRow::kMost];
  for (int n = 0; n != across; ++n) {
    at[n] = (float(n) + 0.5f) * spacing - 0.5f;
    low[n] = int(std::floor(at[n]));
    share[n] = at[n] - float(low[n]);
    inCell[n] = (float(n % perCell) + 0.5f) / float(perCell) - 0.5f;
  }
  const double each = 1 / std::pow(double(perCell), 3);
  parallelFor(occupied.size(), 32, [&](std::size_t begin, std::size_t end) {
    float density[SampleRow::kMost], nodes[DecodedBrick::kMost];
    double sums[kKinds * BrickGrid::kBrick * BrickGrid::kBrick * BrickGrid::kBrick];
    for (std::size_t i = begin; i != end; ++i) {
      if (!wants(occupied[i])) continue;
      const Vec3i origin = (occupied[i] - place.firstBrick) * perBrick;
      const std::int32_t pool = grid.poolIndex(occupied[i]);
      const Interval& range = grid.ranges()[std::size_t(pool)];
      DecodedBrick brick{grid.brick(pool) + sampleOffset(0, 0, 0), BrickGrid::kWidth};
      if (!volume.hasSamples() && !range.isPoint()) brick = decoded(volume, occupied[i], low[0] < 0, nodes);
      std::fill_n(density, across, std::min(range.max, most));
      std::fill_n(sums, kKinds * perBrick * perBrick * perBrick, 0.0);
      for (int z = 0; z != across; ++z)
        for (int y = 0; y != across; ++y) {
          float densest = range.max;
          if (!range.isPoint()) {
            const float* rows[4];
            for (int n = 0; n != 4; ++n)
              rows[n] = brick.first + ((low[z] + n / 2) * brick.width + low[y] + n % 2) * brick.width;
            densest = 0;
            const auto mix = [](float a, float b, float ofB) { return (1 - ofB) * a + ofB * b; };
            for (int x = 0; x != across; ++x) {
              const auto along = [&](const float* row) {
                return mix(std::clamp(row[low[x]], 0.0f, most), std::clamp(row[low[x] + 1], 0.0f, most),
                           share[x]);
              };
              density[x] = mix(mix(along(rows[0]), along(rows[1]), share[y]),
                               mix(along(rows[2]), along(rows[3]), share[y]), share[z]);
              densest = std::max(densest, density[x]);
            }
          }
          if (!(densest > 0)) continue;
          add(SampleRow{sums + kKinds * ((z / perCell) * perBrick + y / perCell) * perBrick, kKinds, perCell,
                        Vec3f(occupied[i] * BrickGrid::kBrick) + Vec3f{at[0], at[y], at[z]}, inCell,
                        inCell[y], inCell[z], std::span<const float>(density, std::size_t(across))});
        }
      double* sum = sums;
      for (int z = 0; z != perBrick; ++z)
        for (int y = 0; y != perBrick; ++y)
          for (int x = 0; x != perBrick; ++x, sum += kKinds) {
            for (int kind = 0; kind != kKinds; ++kind) sum[kind] *= each;
            set(lattice.index(origin.x + x, origin.y + y, origin.z + z), sum);
          }
    }
  });
}

}  // namespace

LatticePlacement::LatticePlacement(const RenderVolume& volume, int longestSide) {
  const Box box = volume.indexBounds();
  firstBrick = Vec3i(box.min * (1.0f / BrickGrid::kBrick)) - Vec3i{1, 1, 1};
  bricks = Vec3i(box.size() * (1.0f / BrickGrid::kBrick)) + Vec3i{2, 2, 2};
  const int longest = std::max({bricks.x, bricks.y, bricks.z});
  cellsPerBrick = std::clamp((2 * longestSide + longest) / (2 * longest), 1, BrickGrid::kBrick);
  for (int cells = longest * cellsPerBrick; 2 * cells > 3 * longestSide; cells = (cells + 1) / 2) ++halvings;
}

ScatteringLattice LatticePlacement::lattice() const {
  return {bricks * cellsPerBrick, voxelsPerSampledCell()};
}

double LatticePlacement::sampledCells() const {
  return double(bricks.x) * bricks.y * bricks.z * std::pow(cellsPerBrick, 3);
}

double LatticePlacement::sampledCellsNear(const RenderVolume& volume, int reach) const {
  ScatteringLattice occupied(bricks, float(BrickGrid::kBrick));
  for (const Vec3i& brick : volume.occupiedBricks()) {
    const Vec3i at = brick - firstBrick;
    occupied.density[occupied.index(at.x, at.y, at.z)] = 1;
  }
  const std::vector<std::uint8_t> near = surroundings(occupied, (reach + cellsPerBrick - 1) / cellsPerBrick);
  double sum = 0;
  for (auto row = near.begin(); row != near.end(); row += occupied.size.x) {
    const auto end = row + occupied.size.x, first = std::find(row, end, 1);
    if (first == end) continue;
    const auto last = std::find(std::make_reverse_iterator(end), std::make_reverse_iterator(row), 1).base();
    // Rows begin and end with whole vectors.
    sum += double((last - first) * cellsPerBrick + 2 * CellRows::kVector);
  }
  return sum * cellsPerBrick * cellsPerBrick;
}

void sampleDensity(const RenderVolume& volume, const LatticePlacement& place, float most,
                   ScatteringLattice& lattice) {
  forMeans<4>(
      volume, place, most, lattice, [](const Vec3i&) { return true; },
      [](const SampleRow& row) {
        for (std::size_t n = 0; n != row.density.size(); ++n) {
          double* sums = row.sumsOf(n);
          const double density = double(row.density[n]);
          sums[0] += density;
          sums[1] += density * double(row.inCell[n]);
          sums[2] += density * double(row.y);
          sums[3] += density * double(row.z);
        }
      },
      [&](std::size_t cell, const double* means) {
        lattice.density[cell] = float(means[0]);
        const double per = means[0] > 0 ? 1 / means[0] : 0;
        lattice.centre[cell] = {float(per * means[1]), float(per * means[2]), float(per * means[3])};
      });
}

void sampleBeam(const RenderVolume& volume, const LatticePlacement& place, const ScatteredSource& source,
                float extinction, float most, ScatteringLattice& lattice) {
  if (!source.columns && !source.glow) return;
  const BrickGrid& grid = volume.density();
  const float spacing = spacingOf(place), behind = extinction * source.shadow;
  if (source.glow) most = INFINITY;
  const auto isLit = [&](const Vec3i& brick) {
    if (!source.leastColumn) return true;
    std::array<Vec3f, 8> corners;
    // Of its voxels, which reach half a voxel beyond its nodes.
    for (int corner = 0; corner != 8; ++corner)
      corners[std::size_t(corner)] = grid.indexToWorld()(
          Vec3f((brick + Vec3i{corner & 1, corner >> 1 & 1, corner >> 2}) * BrickGrid::kBrick) -
          Vec3f{0.5f, 0.5f, 0.5f});
    return behind * source.leastColumn(corners) < kDarkDepth;
  };
  const auto add = [&](const SampleRow& row) {
    const std::size_t count = row.density.size();
    Vec3f world[SampleRow::kMost];
    for (std::size_t n = 0; n != count; ++n)
      world[n] = grid.indexToWorld()(row.voxel + Vec3f{float(n) * spacing, 0, 0});
    float columns[SampleRow::kMost];
    if (source.columns) source.columns({world, count}, {columns, count});
    for (std::size_t n = 0; n != count; ++n) {
      if (!(row.density[n] > 0)) continue;
      double& beam = *row.sumsOf(n);
      if (source.glow) {
        beam += double(row.density[n] * source.glow(world[n]));
        continue;
      }
      const float left = expOfMinus(std::clamp(behind * columns[n], 0.0f, 80.0f));
      beam += double(row.density[n] * source.irradiance(world[n]) / (4 * kPi) * left);
    }
  };
  forMeans<1>(volume, place, most, lattice, isLit, add,
              [&](std::size_t cell, const double* means) { lattice.beam[cell] = float(*means); });
  for (std::size_t i = 0; i != lattice.beam.size(); ++i)
    if (lattice.density[i] > 0) lattice.beam[i] /= lattice.density[i];
}

}  // namespace nephele::detail
