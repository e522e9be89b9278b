#include "nephele/levelset/mesh/decimation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/mesh_topology.h"
#include "tests/support/surface_distance.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

using test::surfaceDistance;
using test::Topology;
using test::topologyOf;

// A ball crumpled by noise, `resolution` voxels across 2 units.
Mesh crumpledBall(int resolution) {
  const float h = 2.0f / float(resolution);
  const ScalarField field = sphere({}, 0.7f) + perlin({.frequency = 5}) * ScalarField(0.12f);
  return marchingCubes(*bakeGrid(
      field,
      {.voxelSize = h, .box = {{-1, -1, -1}, {1, 1, 1}}, .band = {-3 * h, 3 * h}, .background = -3 * h}));
}

// A torus of quads cut open along two circles, so that its chart is the unit square.
Mesh torusWithChart(int around, int along) {
  Mesh mesh = test::torusMesh(1.0, 0.4, around, along);
  MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}};
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < along; ++j)
      for (const auto& [di, dj] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}) {
        uv.values.push_back(float(i + di) / float(around));
        uv.values.push_back(float(j + dj) / float(along));
      }
  mesh.attributes.push_back(std::move(uv));
  return mesh;
}

// A square of side 1 in the plane z = 0, `count` x `count` quads in two triangles each.
Mesh sheet(int count) {
  Mesh mesh;
  const auto at = [&](int i, int j) { return std::uint32_t(i * (count + 1) + j); };
  for (int i = 0; i <= count; ++i)
    for (int j = 0; j <= count; ++j) mesh.positions.emplace_back(double(i) / count, double(j) / count, 0.0);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      mesh.addFace(std::array{at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.addFace(std::array{at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

// Twice the area of a face in its texture coordinates, positive where it is not turned over.
double chartArea(const std::vector<float>& uv, std::size_t face) {
  const auto at = [&](std::size_t k, std::size_t axis) { return double(uv[2 * (3 * face + k) + axis]); };
  return (at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(1, 1) - at(0, 1)) * (at(2, 0) - at(0, 0));
}

std::string messageOf(const Mesh& mesh, const DecimationOptions& options) {
  try {
    decimate(mesh, options);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

TEST(Decimation, CrumpledBallStaysClosedManifoldOutwardAndWithinAVoxel) {
  const Mesh ball = crumpledBall(40);
  const Topology before = topologyOf(ball);
  const std::size_t faces = ball.faceCount() / 10;
  const DecimatedMesh result = decimate(ball, {.faces = faces});
  EXPECT_LE(result.mesh.faceCount(), faces);
  EXPECT_GE(result.mesh.faceCount(), faces - 1);
  const Topology after = topologyOf(result.mesh);
  EXPECT_TRUE(after.isClosedManifold()) << after;
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.eulerCharacteristic, before.eulerCharacteristic);
  EXPECT_NEAR(signedVolume(result.mesh) / signedVolume(ball), 1, 0.03);
  const double voxel = 2.0 / 40, distance = surfaceDistance(result.mesh, ball, 0.25 * voxel);
  EXPECT_LT(distance, voxel);
  EXPECT_LT(distance, 1.25 * result.error);
  EXPECT_GT(distance, 0.8 * result.error);
}

TEST(Decimation, SurfaceStaysWithinTheLargestError) {
  // A surface that is rough from triangle to triangle may be off by a third more between the points measured.
  const std::pair<Mesh, double> surfaces[] = {
      {crumpledBall(32), 1.33}, {test::torusMesh(1.0, 0.4, 60, 30), 1}, {test::icosphere(1.0, 4), 1}};
  for (const auto& [mesh, factor] : surfaces)
    for (const double error : {0.01, 0.05}) {
      const DecimatedMesh result = decimate(mesh, {.maxError = error});
      EXPECT_LT(result.mesh.faceCount(), mesh.faceCount());
      EXPECT_LE(result.error, error);
      EXPECT_LE(surfaceDistance(result.mesh, mesh, 0.02), factor * error);
      EXPECT_TRUE(topologyOf(result.mesh).isClosedManifold());
    }
}

TEST(Decimation, FlatPlacesGoWhole) {
  // A box has twelve triangles at least, however finely it is split.
  Mesh box = test::boxMesh({0, 0, 0}, {1, 2, 3});
  for (int level = 0; level < 4; ++level) {
    Mesh split;
    split.positions = box.positions;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, added] = middles.try_emplace(std::minmax(a, b), std::uint32_t(split.positions.size()));
      if (added) split.positions.push_back((split.positions[a] + split.positions[b]) * 0.5);
      return at->second;
    };
    for (std::size_t f = 0; f < box.faceCount(); ++f) {
      const auto face = box.face(f);
      const std::uint32_t a = face[0], b = face[1], c = face[2];
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const auto& t : {std::array{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}}) split.addFace(t);
    }
    box = split;
  }
  ASSERT_EQ(box.faceCount(), 3072u);
  const DecimatedMesh result = decimate(box, {.maxError = 1e-6});
  EXPECT_EQ(result.mesh.faceCount(), 12u);
  EXPECT_NEAR(signedVolume(result.mesh), 6, 1e-12);
}

TEST(Decimation, SeamsAndChartsOfTextureCoordinatesStay) {
  const Mesh torus = torusWithChart(96, 48);
  const DecimatedMesh result = decimate(torus, {.faces = 900});
  EXPECT_LE(result.mesh.faceCount(), 900u);
  EXPECT_TRUE(topologyOf(result.mesh).isClosedManifold());
  ASSERT_EQ(result.mesh.attributes.size(), 1u);
  const std::vector<float>& uv = result.mesh.attributes[0].values;
  // The chart is the unit square as before, no triangle turned over.
  double area = 0;
  for (std::size_t f = 0; f < result.mesh.faceCount(); ++f) {
    EXPECT_GT(chartArea(uv, f), 0);
    area += chartArea(uv, f) / 2;
  }
  EXPECT_NEAR(area, 1, 1e-6);
  // Every corner is one of the mesh's.
  std::set<std::array<double, 5>> corners;
  const auto cornerOf = [](const Mesh& mesh, std::size_t c) {
    const Vec3d& p = mesh.positions[mesh.corners[c]];
    const std::vector<float>& values = mesh.attributes[0].values;
    return std::array<double, 5>{p.x, p.y, p.z, double(values[2 * c]), double(values[2 * c + 1])};
  };
  for (std::size_t c = 0; c < torus.corners.size(); ++c) corners.insert(cornerOf(torus, c));
  for (std::size_t c = 0; c < result.mesh.corners.size(); ++c)
    EXPECT_TRUE(corners.contains(cornerOf(result.mesh, c)));
}

TEST(Decimation, GroupsKeepTheirBordersAndVertexAttributesTheirVertices) {
  Mesh square = sheet(32);
  // Quads come in columns of x; the first half is `left`. Groups are runs of faces.
  square.groups = {{"left", 0, 1024}, {"right", 1024, 1024}};
  MeshAttribute x{"x", MeshAttribute::Domain::vertex, 1, {}};
  for (const Vec3d& p : square.positions) x.values.push_back(float(p.x));
  square.attributes.push_back(x);
  const Mesh result = decimate(square, {.maxError = 1e-6}).mesh;
  // Two rectangles that share the two points of the line between them: the corners of the square, which
  // nothing holds but that the surface must not move, and the ends of the line.
  ASSERT_EQ(result.groups.size(), 2u);
  EXPECT_EQ(result.faceCount(), 4u);
  EXPECT_NEAR(surfaceArea(result), 1, 1e-12);
  for (const MeshGroup& group : result.groups) {
    double area = 0;
    for (std::uint32_t f = group.firstFace; f < group.firstFace + group.faceCount; ++f) {
      const auto face = result.face(f);
      const Vec3d& a = result.positions[face[0]];
      area += length(cross(result.positions[face[1]] - a, result.positions[face[2]] - a)) / 2;
    }
    EXPECT_NEAR(area, 0.5, 1e-12) << group.name;
  }
  for (std::size_t v = 0; v < result.positions.size(); ++v)
    EXPECT_EQ(double(result.attributes[0].values[v]), result.positions[v].x);
}

TEST(Decimation, BordersOfAnOpenMeshStay) {
  const Mesh result = decimate(sheet(40), {.faces = 2}).mesh;
  EXPECT_EQ(result.faceCount(), 2u);
  EXPECT_NEAR(surfaceArea(result), 1, 1e-12);
}

TEST(Decimation, FarFromTheOriginAsBesideIt) {
  const Mesh torus = test::torusMesh(1.0, 0.4, 64, 32);
  Mesh far = torus;
  // Shifts by powers of two lose no digits of coordinates that are multiples of 2^-20.
  Mesh near = torus;
  for (std::size_t v = 0; v < torus.positions.size(); ++v) {
    for (int k = 0; k < 3; ++k) near.positions[v][k] = std::round(torus.positions[v][k] * 1048576) / 1048576;
    far.positions[v] = near.positions[v] + Vec3d(1048576, -524288, 2097152);
  }
  const Mesh a = decimate(near, {.faces = 500}).mesh, b = decimate(far, {.faces = 500}).mesh;
  EXPECT_EQ(a.corners, b.corners);
}

TEST(Decimation, MeshWithFewerFacesIsReturnedAsItIs) {
  Mesh quads;
  quads.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  quads.addFace(std::array<std::uint32_t, 4>{0, 1, 2, 3});
  const DecimatedMesh result = decimate(quads, {.faces = 2});
  EXPECT_EQ(result.mesh.faceCount(), 1u);
  EXPECT_EQ(result.error, 0);
}

TEST(Decimation, WhatHalfEdgesCannotHoldIsRefusedInWords) {
  // Three triangles on one edge.
  Mesh fan = test::boxMesh({0, 0, 0}, {1, 1, 1});
  fan.positions.emplace_back(2, 2, 2);
  fan.addFace(std::array<std::uint32_t, 3>{0, 2, 8});
  EXPECT_NE(messageOf(fan, {.faces = 4}).find("1 edge with more than two faces"), std::string::npos)
      << messageOf(fan, {.faces = 4});
  // Two boxes that touch in a corner.
  const Mesh touching =
      test::joined(test::boxMesh({0, 0, 0}, {1, 1, 1}), test::boxMesh({1, 1, 1}, {2, 2, 2}));
  EXPECT_NE(messageOf(touching, {.faces = 8}).find("1 vertex where several fans of faces meet"),
            std::string::npos)
      << messageOf(touching, {.faces = 8});
  Mesh turned = test::boxMesh({0, 0, 0}, {1, 1, 1});
  std::swap(turned.corners[0], turned.corners[1]);
  EXPECT_NE(messageOf(turned, {.faces = 8}).find("3 edges between faces of opposite orientation"),
            std::string::npos)
      << messageOf(turned, {.faces = 8});
}

TEST(Decimation, OptionsOutOfRangeAreNamed) {
  const Mesh box = test::boxMesh({0, 0, 0}, {1, 1, 1});
  EXPECT_NE(messageOf(box, {}).find("must be given"), std::string::npos);
  EXPECT_NE(messageOf(box, {.faces = 0}).find("at least 1, got 0"), std::string::npos);
  EXPECT_NE(messageOf(box, {.maxError = 0.0}).find("> 0, got 0"), std::string::npos);
  Mesh broken = box;
  broken.positions[3].y = std::nan("");
  EXPECT_NE(messageOf(broken, {.faces = 4}).find("not finite"), std::string::npos);
}

}  // namespace
}  // namespace nephele
