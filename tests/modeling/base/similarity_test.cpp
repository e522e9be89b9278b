#include "nephele/modeling/base/similarity.h"

#include <gtest/gtest.h>

namespace nephele {
namespace {

void expectNear(const Vec3d& found, const Vec3d& expected) {
  for (int c = 0; c != 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-12);
}

TEST(Similarity, TurnsRightHandedAboutXThenYThenZ) {
  expectNear(Similarity::rotation({90, 0, 0})({0, 1, 0}), {0, 0, 1});
  expectNear(Similarity::rotation({0, 90, 0})({0, 0, 1}), {1, 0, 0});
  expectNear(Similarity::rotation({0, 0, 90})({1, 0, 0}), {0, 1, 0});
  // y goes to z, z to x, and x to y.
  expectNear(Similarity::rotation({90, 90, 90})({0, 1, 0}), {0, 1, 0});
}

TEST(Similarity, ProductsAreDoneOneAfterTheOther) {
  Similarity first = Similarity::rotation({20, -35, 80}), second = Similarity::rotation({-50, 10, 5});
  first.scale = 3;
  first.shift = {1, 2, 3};
  second.scale = 0.25;
  second.shift = {-4, 0, 7};
  const Vec3d p{0.3, -0.7, 2};
  expectNear((second * first)(p), second(first(p)));
}

TEST(Similarity, TakesNormalsAndVelocitiesOfAMeshAlong) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.corners = {0, 1, 2};
  mesh.faceStart = {0, 3};
  const auto all = [](float x, float y, float z) { return std::vector<float>{x, y, z, x, y, z, x, y, z}; };
  mesh.attributes = {{"N", MeshAttribute::Domain::corner, 3, all(0, 0, 1)},
                     {"v", MeshAttribute::Domain::vertex, 3, all(0, 2, 0)},
                     {"color", MeshAttribute::Domain::vertex, 3, all(0.25f, 0.5f, 0.75f)}};
  Similarity by = Similarity::rotation({90, 0, 0});
  by.scale = 10;
  const Mesh result = moved(mesh, by);
  expectNear(result.positions[2], {0, 0, 10});
  EXPECT_NEAR(result.attributes[0].values[1], -1, 1e-6f);
  EXPECT_NEAR(result.attributes[1].values[2], 20, 1e-5f);
  EXPECT_EQ(result.attributes[2].values, mesh.attributes[2].values);
  EXPECT_NEAR(surfaceArea(result), 50, 1e-9);
}

// As tables of vertices have vectors: a column for each component.
TEST(Similarity, TakesVectorsOfThreeAttributesAlong) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.corners = {0, 1, 2};
  mesh.faceStart = {0, 3};
  const auto add = [&](const char* name, float value) {
    mesh.attributes.push_back({name, MeshAttribute::Domain::vertex, 1, {value, value, value}});
  };
  add("nx", 0), add("ny", 0), add("nz", 1);
  add("velocity_x", 0), add("velocity_y", 2), add("velocity_z", 0);
  add("v_0", 0), add("v_1", 1), add("v_2", 0);
  add("vx", 5), add("boxx", 7);
  Similarity by = Similarity::rotation({90, 0, 0});
  by.scale = 10;
  const Mesh result = moved(mesh, by);
  const auto value = [&](std::size_t attribute) { return result.attributes[attribute].values[2]; };
  EXPECT_NEAR(value(1), -1, 1e-6);
  EXPECT_NEAR(value(2), 0, 1e-6);
  EXPECT_NEAR(value(4), 0, 1e-5);
  EXPECT_NEAR(value(5), 20, 1e-5);
  EXPECT_NEAR(value(8), 10, 1e-5);
  // Without y and z it is no vector.
  EXPECT_EQ(value(9), 5);
  EXPECT_EQ(value(10), 7);
}

}  // namespace
}  // namespace nephele
