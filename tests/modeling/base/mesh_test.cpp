#include "nephele/modeling/base/mesh.h"

#include <gtest/gtest.h>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

// Unit cube from (0, 0, 0), quads, counter-clockwise from outside.
Mesh cube() {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) mesh.positions.emplace_back(i & 1, i >> 1 & 1, i >> 2 & 1);
  const std::uint32_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& quad : quads) mesh.addFace(quad);
  return mesh;
}

TEST(Mesh, ValidityIsRequiredOfFacesCornersAttributesAndGroups) {
  EXPECT_NO_THROW(requireValid(Mesh{}));
  EXPECT_NO_THROW(requireValid(cube()));
  const auto messageFor = [](void (*spoil)(Mesh&)) -> std::string {
    Mesh mesh = cube();
    spoil(mesh);
    try {
      requireValid(mesh);
    } catch (const Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(messageFor([](Mesh& m) { m.faceStart.clear(); }), "mesh: the first face must start at corner 0");
  EXPECT_EQ(messageFor([](Mesh& m) { m.faceStart[2] = 3; }), "mesh: face 1 ends before it starts");
  EXPECT_EQ(messageFor([](Mesh& m) { m.corners.pop_back(); }),
            "mesh: the faces have 24 corners, but there are 23");
  EXPECT_EQ(messageFor([](Mesh& m) { m.corners[5] = 8; }),
            "mesh: corner 5 is at position 8, but there are 8 positions");
  EXPECT_EQ(messageFor([](Mesh& m) {
              m.attributes = {{"uv", MeshAttribute::Domain::corner, 2, {}}};
            }),
            "mesh: attribute 'uv' has 0 values for 24 corners, 2 each");
  EXPECT_EQ(messageFor([](Mesh& m) {
              m.attributes = {{"u\nv", MeshAttribute::Domain::corner, 2, {}}};
            }),
            "mesh: attribute 'u\\nv' has 0 values for 24 corners, 2 each");
  EXPECT_EQ(messageFor([](Mesh& m) {
              m.groups = {{"all", 4, 3}};
            }),
            "mesh: group 'all' ends behind face 7, but there are 6 faces");
}

TEST(Mesh, UnitCubeHasVolumeOneAndAreaSix) {
  EXPECT_DOUBLE_EQ(signedVolume(cube()), 1);
  EXPECT_DOUBLE_EQ(surfaceArea(cube()), 6);
}

TEST(Mesh, VolumeKeepsItsDigitsFarFromTheOrigin) {
  Mesh far = cube();
  for (Vec3d& p : far.positions) p = p * 1.0 + Vec3d(1e6, 2e6, -3e6);
  EXPECT_NEAR(signedVolume(far), 1, 1e-9);  // summed about the origin it is off by 1e-3
}

TEST(Mesh, VolumeOfAMeshTurnedInsideOutIsNegative) {
  Mesh inward;
  inward.positions = cube().positions;
  const Mesh outward = cube();
  for (std::size_t f = 0; f < outward.faceCount(); ++f) {
    const auto face = outward.face(f);
    inward.addFace(std::vector<std::uint32_t>(face.rbegin(), face.rend()));
  }
  EXPECT_DOUBLE_EQ(signedVolume(inward), -1);
}

TEST(Mesh, BoxHoldsOnlyPositionsThatFacesUse) {
  Mesh mesh = cube();
  mesh.positions.emplace_back(100, 100, 100);
  EXPECT_EQ(boundingBox(mesh), (Box{{0, 0, 0}, {1, 1, 1}}));
  EXPECT_TRUE(boundingBox(Mesh{}).isEmpty());
}

TEST(Mesh, TriangulationFansPolygonsAndCarriesAttributesAndGroups) {
  Mesh mesh;
  for (int i = 0; i < 5; ++i) mesh.positions.emplace_back(i, i * i, 0);
  mesh.addFace(std::vector<std::uint32_t>{0, 1, 2, 3, 4});
  mesh.addFace(std::vector<std::uint32_t>{4, 1, 0});
  mesh.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, {}});
  for (int c = 0; c < 8; ++c)
    mesh.attributes[0].values.insert(mesh.attributes[0].values.end(), {float(c), float(-c)});
  mesh.attributes.push_back({"mass", MeshAttribute::Domain::vertex, 1, {5, 6, 7, 8, 9}});
  mesh.groups = {{"pentagon", 0, 1}, {"triangle", 1, 1}};

  const Mesh fans = triangulated(mesh);
  ASSERT_EQ(fans.faceCount(), 4u);
  EXPECT_EQ(fans.corners, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3, 0, 3, 4, 4, 1, 0}));
  EXPECT_EQ(fans.attributes[0].values, (std::vector<float>{0, 0, 1, -1, 2, -2, 0, 0,  2, -2, 3, -3,
                                                           0, 0, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7}));
  EXPECT_EQ(fans.attributes[1].values, mesh.attributes[1].values);
  ASSERT_EQ(fans.groups.size(), 2u);
  EXPECT_EQ(fans.groups[0].faceCount, 3u);
  EXPECT_EQ(fans.groups[1].firstFace, 3u);
  EXPECT_EQ(fans.groups[1].faceCount, 1u);
}

TEST(Mesh, TriangulationDoesNotMistakeMixedFacesForTriangles) {
  Mesh mesh;  // 2 + 4 corners: as many as two triangles have
  for (int i = 0; i < 4; ++i) mesh.positions.emplace_back(i, i * i, 0);
  mesh.addFace(std::vector<std::uint32_t>{0, 1});
  mesh.addFace(std::vector<std::uint32_t>{0, 1, 2, 3});
  EXPECT_EQ(triangulated(mesh).corners, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 3}));
}

TEST(Mesh, EqualPositionsAreFoundWhateverTheSignOfZero) {
  const std::vector<Vec3d> positions{{0, 1, 2}, {-0.0, 1, 2}, {1, 0, 2}, {0, 1, 2 + 1e-15}, {1, 0, 2}};
  EXPECT_EQ(firstEqualPosition(positions), (std::vector<std::uint32_t>{0, 0, 2, 3, 2}));
}

}  // namespace
}  // namespace nephele
