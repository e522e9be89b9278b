#include "nephele/render/volume/finer_density.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/light/light_volume.h"
#include "nephele/render/volume/render_volume.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

using detail::finerDensity;
using test::densityGrid;
using test::voxels;

// Bumps of a few voxels, with a sheared map.
std::shared_ptr<BrickGrid> bumps() {
  Affine map = voxels(0.1f);
  map.linear(0, 1) = 0.03f;
  map.translation = {0.4f, -0.2f, 1};
  return densityGrid(map, {-11, -5, -9}, {12, 14, 9}, [](const Vec3f& p) {
    return std::fmax(0.0f, std::sin(11 * p.x) + std::sin(9 * p.y + 1) * std::cos(12 * p.z));
  });
}

// Points within the cells of the voxels of `bumps`.
Vec3f pointOf(const BrickGrid& grid, int i) {
  const Vec3f t{std::sin(i * 1.3f), std::sin(i * 2.1f + 1), std::cos(i * 0.7f)};
  return grid.indexToWorld()({0.5f + 11.9f * t.x, 4.5f + 9.9f * t.y, 9.4f * t.z});
}

TEST(FinerDensity, HasTheSameValuesEverywhere) {
  const auto grid = bumps();
  const ScalarField coarse = gridField(grid);
  for (const int factor : {1, 2, 4, 8}) {
    const auto finer = finerDensity(*grid, factor);
    EXPECT_FLOAT_EQ(finer->voxelSize(), grid->voxelSize() / float(factor));
    const ScalarField fine = gridField(finer);
    // Single precision: values up to 2, places up to a hundred voxels.
    for (int i = 0; i != 2000; ++i) {
      const Vec3f p = pointOf(*grid, i);
      EXPECT_NEAR(fine(p), coarse(p), 2e-4f) << factor << " " << i;
    }
  }
}

TEST(FinerDensity, KeepsSharedBricksAndEmptiness) {
  // Three bricks in a row: one constant twice, and nothing.
  auto grid = std::make_shared<BrickGrid>(Lattice{}, BrickBox{{}, {3, 1, 1}});
  grid->appendConstant(0.5f);
  grid->setTable({1, 0, 1});
  const auto fine = finerDensity(*grid, 2);
  EXPECT_EQ(fine->poolSize(), 2u);
  ASSERT_EQ(fine->table().size(), 24u);
  for (std::size_t i = 0; i != 24; ++i) EXPECT_EQ(fine->table()[i], i % 6 / 2 == 1 ? 0 : 1) << i;
  EXPECT_EQ(fine->ranges()[1], Interval::of(0.5f));
}

TEST(FinerDensity, MakesShadowsMoreExact) {
  const auto grid = bumps();
  const ScalarField density = gridField(grid);
  const Vec3f towards = normalize(Vec3f{0.4f, 0.8f, 0.3f});
  const auto error = [&](int factor) {
    const LightVolume light(RenderVolume(finerDensity(*grid, factor)), towards);
    double sum = 0;
    for (int i = 0; i != 300; ++i) {
      const Vec3f p = pointOf(*grid, i);
      // The midpoint rule in steps of a hundredth of a voxel.
      double exact = 0;
      constexpr double step = 1e-3;
      for (double s = 0.5 * step; s < 3; s += step) exact += step * double(density(p + towards * float(s)));
      sum += std::pow(light.columnDensity(p) - exact, 2);
    }
    return std::sqrt(sum / 300);
  };
  // The error of linear interpolation between nodes falls with the square of their distance.
  EXPECT_LT(error(2), 0.4 * error(1));
}

TEST(FinerDensity, RefusesOtherFactors) {
  for (const int factor : {0, 3, -2, 16}) EXPECT_THROW(finerDensity(*bumps(), factor), Error);
}

}  // namespace
}  // namespace nephele
