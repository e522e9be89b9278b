#include "nephele/levelset/mesh/mass_properties.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

TEST(MassProperties, OfABoxAreThoseOfTheTextbook) {
  const MassProperties mass = massProperties(boxMesh({1, 2, 3}, {3, 5, 7}));
  // Sides 2, 3, 4: V = 24, I = V (b^2 + c^2) / 12.
  EXPECT_NEAR(mass.volume, 24, 1e-12);
  EXPECT_NEAR(mass.area, 52, 1e-12);
  EXPECT_NEAR(length(mass.centroid - Vec3d(2, 3.5, 5)), 0, 1e-12);
  EXPECT_NEAR(mass.inertia[0], 24 * (9 + 16) / 12.0, 1e-11);
  EXPECT_NEAR(mass.inertia[4], 24 * (4 + 16) / 12.0, 1e-11);
  EXPECT_NEAR(mass.inertia[8], 24 * (4 + 9) / 12.0, 1e-11);
  for (const std::size_t k : {1, 2, 3, 5, 6, 7}) EXPECT_NEAR(mass.inertia[k], 0, 1e-11);
}

TEST(MassProperties, OfACornerTetrahedronHaveItsProductsOfInertia) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const auto& face : {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}})
    mesh.addFace(face);
  const MassProperties mass = massProperties(mesh);
  // Integrals over the simplex: x^2 -> 1/60, x y -> 1/120; shifted to the centroid (1/4, 1/4, 1/4).
  EXPECT_NEAR(mass.volume, 1 / 6.0, 1e-15);
  EXPECT_NEAR(length(mass.centroid - Vec3d(0.25, 0.25, 0.25)), 0, 1e-15);
  EXPECT_NEAR(mass.inertia[0], 2 / 60.0 - 2 / 96.0, 1e-15);
  EXPECT_NEAR(mass.inertia[1], -(1 / 120.0 - 1 / 96.0), 1e-15);
}

}  // namespace
}  // namespace nephele::test
