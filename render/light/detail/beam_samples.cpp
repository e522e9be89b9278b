// Samples of the density and of a beam, averaged over the cells of a lattice.
//
// A beam is not sampled at points but averaged along the line of each sample: in the first voxel of a dense
// cloud a point would be nearly in the light or nearly in the dark.
#include "nephele/render/light/detail/beam_samples.h"

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/light/exp_of_minus.h"

namespace nephele::detail {

namespace {

// Voxels from one sample to the next: two samples per voxel where a cell is hardly more than one; otherwise
// every other voxel, where a sample between voxels is the mean of eight.
float spacingOf(int factor) {
  return factor <= 2 ? 0.5f : 2.0f;
}

// Mean of what is left of a beam along a sample of optical depth `depth`, whose middle it sees through
// `before`.
float meanTransmittance(float before, float depth) {
  if (depth < 0.01f) return expOfMinus(before);
  const float up = std::min(0.5f * depth, before), down = 0.5f * depth;
  return (expOfMinus(before - up) - expOfMinus(std::min(before + down, 80.0f))) / (up + down);
}

// Calls visit(cell, voxel, rho) for samples between the voxels, as many in every cell.
template <class Visit>
void forEachSample(const RenderVolume& volume, const LatticePlacement& place,
                   const ScatteringLattice& lattice, Visit&& visit) {
  const BrickGrid& grid = volume.density();
  const std::vector<Vec3i>& occupied = volume.occupiedBricks();
  const float spacing = spacingOf(place.factor);
  const int across = int(float(BrickGrid::kBrick) / spacing), perBrick = BrickGrid::kBrick / place.factor;
  parallelFor(occupied.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i != end; ++i) {
      const Vec3i origin = (occupied[i] - place.firstBrick) * perBrick;
      const float* values = grid.brick(grid.poolIndex(occupied[i]));
      const auto split = [&](int n, int& low, float& share) {
        const float at = (float(n) + 0.5f) * spacing - 0.5f;
        low = int(std::floor(at));
        share = at - float(low);
        return at;
      };
      for (int z = 0; z < across; ++z)
        for (int y = 0; y < across; ++y)
          for (int x = 0; x < across; ++x) {
            int lx, ly, lz;
            float fx, fy, fz;
            const Vec3f p{split(x, lx, fx), split(y, ly, fy), split(z, lz, fz)};
            const auto row = [&](int j, int k) {
              const float* at = values + sampleOffset(lx, ly + j, lz + k);
              const float a = std::max(at[0], 0.0f);
              return a + fx * (std::max(at[1], 0.0f) - a);
            };
            const auto plane = [&](int k) { return row(0, k) + fy * (row(1, k) - row(0, k)); };
            const float rho = plane(0) + fz * (plane(1) - plane(0));
            if (!(rho > 0)) continue;
            visit(lattice.index(origin.x + x * perBrick / across, origin.y + y * perBrick / across,
                                origin.z + z * perBrick / across),
                  Vec3f(occupied[i] * BrickGrid::kBrick) + p, rho);
          }
    }
  });
}

float samplesPerCell(const LatticePlacement& place) {
  const float across = float(place.factor) / spacingOf(place.factor);
  return across * across * across;
}

}  // namespace

LatticePlacement::LatticePlacement(const RenderVolume& volume, int longestSide) {
  const Box box = volume.indexBounds();
  firstBrick = Vec3i(box.min * (1.0f / BrickGrid::kBrick)) - Vec3i{1, 1, 1};
  bricks = Vec3i(box.size() * (1.0f / BrickGrid::kBrick)) + Vec3i{2, 2, 2};
  const int longest = std::max({bricks.x, bricks.y, bricks.z}) * BrickGrid::kBrick;
  while (factor < BrickGrid::kBrick && longest / factor > longestSide) factor *= 2;
}

ScatteringLattice LatticePlacement::lattice() const {
  return {bricks * (BrickGrid::kBrick / factor), factor};
}

void sampleDensity(const RenderVolume& volume, const LatticePlacement& place, ScatteringLattice& lattice) {
  forEachSample(volume, place, lattice,
                [&](std::size_t cell, const Vec3f&, float rho) { lattice.density[cell] += rho; });
  const float samples = samplesPerCell(place);
  for (float& value : lattice.density) value /= samples;
}

void sampleBeam(const RenderVolume& volume, const LatticePlacement& place, const ScatteredSource& source,
                float extinction, ScatteringLattice& lattice) {
  if (!source.column && !source.glow) return;
  const BrickGrid& grid = volume.density();
  const float perDensity = extinction * source.shadow * grid.voxelSize() * spacingOf(place.factor);
  forEachSample(volume, place, lattice, [&](std::size_t cell, const Vec3f& voxel, float rho) {
    const Vec3f world = grid.indexToWorld()(voxel);
    if (source.glow) {
      lattice.beam[cell] += rho * source.glow(world);
      return;
    }
    const float before = std::clamp(extinction * source.shadow * source.column(world), 0.0f, 80.0f);
    lattice.beam[cell] += rho * source.irradiance(world) / (4 * kPi) *
                          meanTransmittance(before, std::min(perDensity * rho, 80.0f));
  });
  const float samples = samplesPerCell(place);
  for (std::size_t i = 0; i != lattice.beam.size(); ++i)
    if (lattice.density[i] > 0) lattice.beam[i] /= samples * lattice.density[i];
}

}  // namespace nephele::detail
