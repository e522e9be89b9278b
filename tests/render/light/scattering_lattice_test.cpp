// Cells of density: how much they hold and where, and how light finds its way through deep ones.
#include "nephele/render/light/detail/scattering_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "nephele/render/light/detail/beam_samples.h"
#include "nephele/render/light/detail/transport_solver.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using detail::LatticePlacement;
using detail::ScatteringLattice;

// Density that grows along x by `slope` per voxel from 1 on, within 40 voxels.
RenderVolume wedge(float slope) {
  return RenderVolume(test::densityGrid(test::voxels(1), {0, 0, 0}, {39, 39, 39},
                                        [=](const Vec3f& p) { return 1 + slope * p.x; }));
}

ScatteringLattice sampled(const RenderVolume& volume, int longestSide, float most = INFINITY) {
  const LatticePlacement place(volume, longestSide);
  ScatteringLattice lattice = place.lattice();
  detail::sampleDensity(volume, place, most, lattice);
  return lattice;
}

TEST(ScatteringLattice, KnowsWhereTheDensityOfCellsIs) {
  // A linear density of mean m in a cell has its centre at slope width / m times the mean square of what
  // samples are from its middle, which is 1/16 for two and 2/27 for three.
  const RenderVolume volume(wedge(0.1f));
  for (const int side : {12, 24}) {
    const ScatteringLattice lattice = sampled(volume, side);
    const float square = lattice.voxels == 8 || lattice.voxels == 2 ? 2.0f / 27 : 1.0f / 16;
    const int before = -BrickGrid::kBrick * LatticePlacement(volume, side).firstBrick.x;
    const int middle = int(float(before + 20) / lattice.voxels);
    int inside = 0;
    for (int x = 0; x != lattice.size.x; ++x) {
      const std::size_t i = lattice.index(x, middle, middle);
      const float first = float(x) * lattice.voxels - 0.5f - float(before);
      if (first < 0 || first + lattice.voxels > 39) continue;
      EXPECT_NEAR(lattice.centre[i].x, 0.1f * lattice.voxels * square / lattice.density[i], 1e-4f) << x;
      EXPECT_NEAR(lattice.centre[i].y, 0, 1e-5f) << x;
      EXPECT_NEAR(lattice.centre[i].z, 0, 1e-5f) << x;
      ++inside;
    }
    EXPECT_GT(inside, 2);
  }
}

TEST(ScatteringLattice, KeepsTheCentreOfMassWhenCellsAreJoined) {
  const RenderVolume volume(test::ball(1.0f, 0.05f));
  const ScatteringLattice fine = sampled(volume, 40), coarse = detail::halved(fine);
  const auto moment = [](const ScatteringLattice& lattice, int axis) {
    double sum = 0;
    for (int z = 0; z != lattice.size.z; ++z)
      for (int y = 0; y != lattice.size.y; ++y)
        for (int x = 0; x != lattice.size.x; ++x) {
          const std::size_t i = lattice.index(x, y, z);
          const float at = float(Vec3i{x, y, z}[axis]) + 0.5f + lattice.centre[i][axis];
          sum += double(lattice.density[i] * at) * std::pow(double(lattice.voxels), 4);
        }
    return sum;
  };
  for (int axis = 0; axis != 3; ++axis)
    EXPECT_NEAR(moment(coarse, axis) / moment(fine, axis), 1, 1e-5) << axis;
}

TEST(ScatteringLattice, CountsDensityAboveTheMostAsThat) {
  const RenderVolume volume(wedge(0.1f));
  const ScatteringLattice whole = sampled(volume, 24), capped = sampled(volume, 24, 2.0f);
  ASSERT_EQ(whole.density.size(), capped.density.size());
  for (std::size_t i = 0; i != whole.density.size(); ++i) {
    EXPECT_LE(capped.density[i], std::min(whole.density[i], 2.0f) + 1e-6f) << i;
    EXPECT_EQ(whole.density[i] > 0, capped.density[i] > 0) << i;
  }
}

TEST(TransportSolver, ConvergesInFewSweepsWhereCellsAreDeep) {
  // A cube of 44 cells without much absorption, of the depth that cells have at most, about. A plain
  // iteration would need thousands. What a hundred sweeps would change is about the tolerance.
  for (const float extinction : {0.3f, 1.0f, 2.0f}) {
    const auto solved = [&](int sweeps, float tolerance) {
      ScatteringLattice lattice({48, 48, 48}, 1);
      for (int z = 2; z != 46; ++z)
        for (int y = 2; y != 46; ++y)
          for (int x = 2; x != 46; ++x) {
            const std::size_t i = lattice.index(x, y, z);
            lattice.density[i] = 1;
            lattice.beam[i] = std::exp(-0.5f * float(45 - z) * extinction);
          }
      detail::TransportSolver::Medium medium;
      medium.extinction = extinction;
      medium.phase = {0.9999f};
      medium.ordinates = detail::levelSymmetric(6);
      medium.inflow.assign(medium.ordinates.size(), 0.0f);
      detail::TransportSolver solver(std::move(lattice), std::move(medium));
      const auto addBeam = [](const ScatteringLattice& level, const detail::CellRows& rows,
                              detail::Moments& light) {
        const std::vector<float> beam = rows.kept(level.beam);
        for (std::size_t i = 0; i != beam.size(); ++i) light[detail::CellRows::momentsAt(i, 1)] += beam[i];
      };
      detail::Moments light = solver.solve({0.0f}, addBeam, {sweeps, tolerance}, silent());
      return std::pair{std::move(light), solver.sweeps()};
    };
    const auto [light, sweeps] = solved(20, 2e-3f);
    const auto [limit, most] = solved(100, 1e-6f);
    EXPECT_LE(sweeps, 12) << extinction;
    double off = 0, whole = 0;
    for (std::size_t i = 0; i != light.size(); ++i)
      off += std::fabs(double(light[i]) - double(limit[i])), whole += double(limit[i]);
    EXPECT_LT(off, 3 * 2e-3 * whole) << extinction;
  }
}

}  // namespace
}  // namespace nephele
