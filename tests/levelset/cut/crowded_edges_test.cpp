#include "nephele/levelset/cut/detail/solids/crowded_edges.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/mesh_topology.h"

namespace nephele::test {
namespace {

/// A tetrahedron in two groups; its attributes are linear in space.
Mesh tetrahedron() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}};
  MeshAttribute height{"height", MeshAttribute::Domain::vertex, 1, {}},
      uv{"uv", MeshAttribute::Domain::corner, 2, {}};
  for (const auto& face : {std::array{0u, 2u, 1u}, {0u, 1u, 3u}, {0u, 3u, 2u}, {1u, 2u, 3u}}) {
    mesh.addFace(face);
    for (const std::uint32_t v : face) {
      uv.values.push_back(float(mesh.positions[v].x));
      uv.values.push_back(float(mesh.positions[v].y));
    }
  }
  for (const Vec3d& p : mesh.positions) height.values.push_back(float(p.z));
  mesh.attributes = {height, uv};
  mesh.groups = {{"low", 0, 2}, {"high", 2, 2}};
  return mesh;
}

TEST(CrowdedEdges, SplitEdgesLeaveTheSurfaceItsAttributesAndItsGroups) {
  Mesh mesh = tetrahedron();
  // 0 to 1 and 1 to 2, both of them edges of the first face, and 3 to 2 of the high group.
  detail::splitEdges(mesh, std::vector<detail::CornerPair>{{2, 3}, {1, 9}, {7, 10}});
  EXPECT_EQ(mesh.positions.size(), 7u);
  ASSERT_EQ(mesh.faceCount(), 10u);
  EXPECT_TRUE(topologyOf(mesh).isClosedManifold()) << topologyOf(mesh);
  EXPECT_NEAR(signedVolume(mesh), 64.0 / 6, 1e-12);
  EXPECT_NEAR(surfaceArea(mesh), surfaceArea(tetrahedron()), 1e-12);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    EXPECT_EQ(double(mesh.attributes[0].values[v]), mesh.positions[v].z);
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
    const Vec3d& p = mesh.positions[mesh.corners[c]];
    EXPECT_EQ(
        Vec3d(double(mesh.attributes[1].values[2 * c]), double(mesh.attributes[1].values[2 * c + 1]), p.z),
        p);
  }
  EXPECT_EQ(mesh.groups[0].firstFace, 0u);
  EXPECT_EQ(mesh.groups[0].faceCount, 5u);
  EXPECT_EQ(mesh.groups[1].firstFace, 5u);
  EXPECT_EQ(mesh.groups[1].faceCount, 5u);
}

TEST(CrowdedEdges, ATriangleMayBeSplitOnAllSides) {
  Mesh mesh = tetrahedron();
  detail::splitEdges(mesh, std::vector<detail::CornerPair>{{2, 3}, {1, 9}, {0, 8}});
  EXPECT_EQ(mesh.faceCount(), 10u);
  EXPECT_TRUE(topologyOf(mesh).isClosedManifold()) << topologyOf(mesh);
  EXPECT_NEAR(signedVolume(mesh), 64.0 / 6, 1e-12);
}

}  // namespace
}  // namespace nephele::test
