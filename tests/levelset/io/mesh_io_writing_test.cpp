#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <tuple>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/mesh_attributes.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

using test::find;
using test::TemporaryFolder;

Mesh decorated() {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {0.1, 0, 0}, {0, 1.0 / 3, 0}, {0, 0, 1e-7}, {0.5, 0.5, 0.5}};
  mesh.addFace(std::vector<std::uint32_t>{0, 1, 2});
  mesh.addFace(std::vector<std::uint32_t>{0, 2, 4, 3});
  mesh.addFace(std::vector<std::uint32_t>{3, 1, 0});
  mesh.groups = {{"piece_0000", 0, 2}, {"piece_0001", 2, 1}};
  mesh.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, {}});
  for (int c = 0; c < 10; ++c)
    mesh.attributes[0].values.insert(mesh.attributes[0].values.end(), {c * 0.1f, 1 - c * 0.1f});
  mesh.attributes.push_back(
      {"color", MeshAttribute::Domain::vertex, 3, {0, 1, 0.2f, 1, 0, 0, 1, 1, 1, 0, 0, 0, 0.4f, 0.6f, 0.8f}});
  mesh.attributes.push_back({"mass", MeshAttribute::Domain::vertex, 1, {1, 2, 3, 4, 5}});
  return mesh;
}

TEST(MeshIo, WhatCouldNotBeReadIsNotWritten) {
  const TemporaryFolder folder;
  Mesh far = decorated(), open = decorated();
  far.positions[1].y = 1e39;
  open.addFace({});
  const auto errorOf = [&](const std::string& name, const Mesh& mesh) -> std::string {
    const std::string path = folder.file(name);
    try {
      writeMesh(path, mesh);
    } catch (const Error& error) {
      EXPECT_FALSE(std::filesystem::exists(path));
      return std::string(error.what()).substr(path.size());
    }
    EXPECT_NO_THROW(readMesh(path));
    return "";
  };
  // Beyond the largest float, and far below the largest double.
  EXPECT_EQ(errorOf("a.stl", far), ": vertex 1 is at 0.1, 1e+39, 0, which this format cannot hold");
  EXPECT_EQ(errorOf("a.obj", far), "");
  EXPECT_EQ(errorOf("a.ply", far), "");
  far.positions[1].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(errorOf("b.obj", far), ": vertex 1 is at 0.1, nan, 0, which this format cannot hold");
  EXPECT_EQ(errorOf("b.ply", open), ": face 3 has 0 corners; files hold faces of 3 and more");
  EXPECT_EQ(errorOf("c.obj", open), ": face 3 has 0 corners; files hold faces of 3 and more");
  EXPECT_EQ(errorOf("b.stl", open), "");
}

// `nan` and `inf` are no numbers of text formats; a binary .ply has them, and our reader takes them.
TEST(MeshIo, ColoursAndTextureCoordinatesThatAreNotFiniteAreNotWrittenAsText) {
  const TemporaryFolder folder;
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  Mesh uv = decorated(), color = decorated(), mass = decorated();
  uv.attributes[0].values[2 * 5 + 1] = nan;
  color.attributes[1].values[3 * 4] = -inf;
  mass.attributes[2].values[1] = nan;
  const std::string path = folder.file("a.obj");
  const auto errorOf = [&](const Mesh& mesh) -> std::string {
    try {
      writeMesh(path, mesh);
    } catch (const Error& error) {
      EXPECT_FALSE(std::filesystem::exists(path));
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(errorOf(uv),
            path + ": a texture coordinate of corner 5 is not a number, which an .obj cannot hold");
  EXPECT_EQ(errorOf(color), path + ": the colour of vertex 4 is infinite, which an .obj cannot hold");
  EXPECT_EQ(errorOf(mass), "") << "an .obj has no such attribute";
  EXPECT_NO_THROW(readMesh(path));

  writeMesh(folder.file("a.ply"), uv);
  EXPECT_TRUE(std::isnan(find(readMesh(folder.file("a.ply")), "uv")->values[2 * 5 + 1]));
  writeMesh(folder.file("b.ply"), mass);
  EXPECT_TRUE(std::isnan(find(readMesh(folder.file("b.ply")), "mass")->values[1]));
  writeMesh(folder.file("c.ply"), color);
  EXPECT_EQ(find(readMesh(folder.file("c.ply")), "color")->values[3 * 4], -inf);
  writeMesh(folder.file("a.stl"), uv);
  EXPECT_NO_THROW(readMesh(folder.file("a.stl")));
}

TEST(MeshIo, ObjRoundTripKeepsEverythingItCanHold) {
  const TemporaryFolder folder;
  const Mesh mesh = decorated();
  writeMesh(folder.file("a.obj"), mesh);
  const Mesh back = readMesh(folder.file("a.obj"));
  EXPECT_EQ(back.positions, mesh.positions);
  EXPECT_EQ(back.corners, mesh.corners);
  EXPECT_EQ(back.faceStart, mesh.faceStart);
  EXPECT_EQ(find(back, "uv")->values, mesh.attributes[0].values);
  EXPECT_EQ(find(back, "color")->values, mesh.attributes[1].values);
  ASSERT_EQ(back.groups.size(), 2u);
  EXPECT_EQ(back.groups[1].name, "piece_0001");
  EXPECT_EQ(back.groups[1].firstFace, 2u);
}

// A statement `usemtl` holds until the next.
TEST(MeshIo, ObjNamesMaterialsAndTheirFilesAsSeenFromItsFolder) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.file("made/here"));
  Mesh mesh = decorated();
  mesh.groups = {{"lid", 0, 1, "red"}, {"side", 1, 1, "dark blue"}, {"back", 2, 1, ""}};
  mesh.materialFiles = {folder.file("made/a b.mtl"), folder.file("c.mtl"), "nowhere/d.mtl"};
  const std::string path = folder.file("made/here/a.obj");
  writeMesh(path, mesh);
  const std::string text = test::textOf(path);
  EXPECT_TRUE(text.starts_with("mtllib ../a b.mtl\nmtllib ../../c.mtl\nmtllib ../")) << text;
  const Mesh back = readMesh(path);
  ASSERT_EQ(back.groups.size(), 3u);
  for (int g = 0; g < 3; ++g) {
    EXPECT_EQ(back.groups[g].name, mesh.groups[g].name);
    EXPECT_EQ(back.groups[g].material, mesh.groups[g].material);
    EXPECT_EQ(back.groups[g].firstFace, mesh.groups[g].firstFace);
  }
  ASSERT_EQ(back.materialFiles.size(), 3u);
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(std::filesystem::path(back.materialFiles[i]).lexically_normal(),
              std::filesystem::absolute(mesh.materialFiles[i]));
}

TEST(MeshIo, PlyRoundTripKeepsPolygonsAttributesAndDigits) {
  const TemporaryFolder folder;
  const Mesh mesh = decorated();
  writeMesh(folder.file("a.ply"), mesh);
  const Mesh back = readMesh(folder.file("a.ply"));
  EXPECT_EQ(back.positions, mesh.positions) << "positions that no float holds are written as doubles";
  EXPECT_EQ(back.corners, mesh.corners);
  EXPECT_EQ(back.faceStart, mesh.faceStart);
  EXPECT_EQ(find(back, "uv")->values, mesh.attributes[0].values);
  EXPECT_EQ(find(back, "color")->values, mesh.attributes[1].values) << "multiples of 1/255 survive";
  EXPECT_EQ(find(back, "mass")->values, mesh.attributes[2].values);
}

TEST(MeshIo, PlyHasColoursAsBytesWhereBytesHoldThem) {
  const TemporaryFolder folder;
  Mesh bytes = decorated(), floats = decorated();
  for (std::size_t i = 0; i < 15; ++i) bytes.attributes[1].values[i] = float(17 * i) / 255;
  floats.attributes[1].values = {0.5f, 2.5f, -1, 0.1f, 1e-9f, 1e9f, 0, 0, 0, 1, 1, 1, 0.3f, 0.7f, 1.0001f};
  for (const auto& [mesh, type] : {std::pair{&bytes, "uchar"}, {&floats, "float"}}) {
    writeMesh(folder.file("a.ply"), *mesh);
    EXPECT_NE(test::textOf(folder.file("a.ply")).find(std::string("property ") + type + " red\n"),
              std::string::npos);
    EXPECT_EQ(find(readMesh(folder.file("a.ply")), "color")->values, mesh->attributes[1].values) << type;
  }
}

// Corner c has 10 c, 10 c + 1, ... per attribute, which no two corners share.
Mesh withCornerAttributes() {
  Mesh mesh = decorated();
  for (const auto& [name, width] :
       {std::pair{"uv1", 2}, std::pair{"color_corner", 3}, std::pair{"heat", 1}, std::pair{"flow", 5}}) {
    MeshAttribute attribute{name, MeshAttribute::Domain::corner, width, {}};
    for (std::size_t c = 0; c < mesh.corners.size(); ++c)
      for (int k = 0; k < width; ++k) attribute.values.push_back(float(10 * c) + float(k) + 0.1f);
    mesh.attributes.push_back(std::move(attribute));
  }
  return mesh;
}

TEST(MeshIo, PlyRoundTripKeepsEveryAttributeOfCorners) {
  const TemporaryFolder folder;
  const Mesh mesh = withCornerAttributes();
  writeMesh(folder.file("a.ply"), mesh);
  const Mesh back = readMesh(folder.file("a.ply"));
  EXPECT_EQ(back.attributes.size(), mesh.attributes.size());
  for (const MeshAttribute& a : mesh.attributes) {
    const MeshAttribute* b = find(back, a.name);
    ASSERT_NE(b, nullptr) << a.name;
    EXPECT_EQ(b->domain, a.domain) << a.name;
    EXPECT_EQ(b->width, a.width) << a.name;
    EXPECT_EQ(b->values, a.values) << a.name;
  }
}

TEST(MeshIo, PlyHasNoTwoPropertiesOfOneName) {
  const TemporaryFolder folder;
  Mesh mesh = decorated();
  const std::size_t vertices = mesh.positions.size();
  for (const char* name : {"a b", "a_b", "x", "red", "a b"})
    mesh.attributes.push_back({name, MeshAttribute::Domain::vertex, 1,
                               std::vector<float>(vertices, float(mesh.attributes.size()))});
  writeMesh(folder.file("a.ply"), mesh);
  const Mesh back = readMesh(folder.file("a.ply"));
  EXPECT_EQ(back.positions, mesh.positions);
  EXPECT_EQ(find(back, "color")->values, mesh.attributes[1].values);
  std::size_t k = mesh.attributes.size() - 5;
  for (const char* name : {"a_b", "a_b_2", "x_2", "red_2", "a_b_3"}) {
    const MeshAttribute* attribute = find(back, name);
    ASSERT_NE(attribute, nullptr) << name;
    EXPECT_EQ(attribute->values, mesh.attributes[k++].values) << name;
  }
}

TEST(MeshIo, PlyKeepsNamesThatWouldMeanSomethingElse) {
  const TemporaryFolder folder;
  Mesh mesh = decorated();
  std::erase_if(mesh.attributes, [](const MeshAttribute& a) { return a.name == "uv" || a.name == "color"; });
  const auto add = [&](const char* name) {
    mesh.attributes.push_back({name, MeshAttribute::Domain::vertex, 1,
                               std::vector<float>(mesh.positions.size(), float(mesh.attributes.size()))});
  };
  const std::size_t first = mesh.attributes.size();
  for (const char* name : {"s", "t", "x", "x_2", "red", "green", "blue", "alpha"}) add(name);
  writeMesh(folder.file("a.ply"), mesh);
  const Mesh back = readMesh(folder.file("a.ply"));
  EXPECT_EQ(find(back, "uv"), nullptr);
  EXPECT_EQ(find(back, "color"), nullptr);
  std::size_t k = first;
  for (const char* name : {"s_2", "t_2", "x_3", "x_2", "red_2", "green_2", "blue_2", "alpha"}) {
    const MeshAttribute* attribute = find(back, name);
    ASSERT_NE(attribute, nullptr) << name;
    EXPECT_EQ(attribute->values, mesh.attributes[k++].values) << name;
  }
}

TEST(MeshIo, ObjEndsGroupsWhereTheyEnd) {
  const TemporaryFolder folder;
  Mesh mesh = test::octahedron();
  mesh.groups = {{"a", 0, 2, "stone"}, {"b", 5, 1, ""}};
  writeMesh(folder.file("a.obj"), mesh);
  const std::vector<MeshGroup> groups = readMesh(folder.file("a.obj")).groups;
  ASSERT_EQ(groups.size(), 4u);
  const std::tuple<const char*, std::uint32_t, std::uint32_t, const char*> expected[] = {
      {"a", 0, 2, "stone"}, {"default", 2, 3, ""}, {"b", 5, 1, ""}, {"default", 6, 2, ""}};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(std::tie(groups[i].name, groups[i].firstFace, groups[i].faceCount, groups[i].material),
              expected[i])
        << i;
}

TEST(MeshIo, ObjKeepsFacesAfterNamesThatEndInBackslashes) {
  const TemporaryFolder folder;
  Mesh mesh = decorated();
  mesh.groups[0].name = "\\";
  mesh.groups[1].name = "stone\\";
  writeMesh(folder.file("a.obj"), mesh);
  EXPECT_EQ(test::textOf(folder.file("a.obj")).find("\\\n"), std::string::npos)
      << "which joins two lines, for any reader";
  const Mesh back = readMesh(folder.file("a.obj"));
  EXPECT_EQ(back.corners, mesh.corners);
  ASSERT_EQ(back.groups.size(), 2u);
  EXPECT_EQ(back.groups[0].name, "\\");
  EXPECT_EQ(back.groups[1].name, "stone\\");
}

TEST(MeshIo, PlyHasColoursOfCornersAsMeshLabHasThem) {
  // As VCGlib's importer and exporter do: a list "color" of three floats per corner; opacity beside it.
  const TemporaryFolder folder;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const auto& f : {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 1, 3}}) mesh.addFace(f);
  for (const int width : {3, 4}) {
    MeshAttribute color{"color", MeshAttribute::Domain::corner, width, {}};
    for (int i = 0; i < 6 * width; ++i) color.values.push_back(float(i) / 24);
    mesh.attributes = {color};
    writeMesh(folder.file("a.ply"), mesh);
    const std::string text = test::textOf(folder.file("a.ply"));
    EXPECT_NE(text.find("property list uchar float color\n"), std::string::npos);
    EXPECT_EQ(text.find("property list uchar float alpha\n") != std::string::npos, width == 4);
    const Mesh back = readMesh(folder.file("a.ply"));
    ASSERT_EQ(back.attributes.size(), 1u);
    EXPECT_EQ(back.attributes[0].name, "color");
    EXPECT_EQ(back.attributes[0].width, width);
    EXPECT_EQ(back.attributes[0].values, color.values);
  }
}

TEST(MeshIo, PlyPutsTextureCoordinatesOnVerticesWhereTheyAgree) {
  const TemporaryFolder folder;
  Mesh mesh = decorated();
  for (std::size_t c = 0; c < mesh.corners.size(); ++c)
    for (std::size_t k = 0; k < 2; ++k) mesh.attributes[0].values[2 * c + k] = float(mesh.corners[c] + k);
  writeMesh(folder.file("a.ply"), mesh);
  EXPECT_NE(test::textOf(folder.file("a.ply")).find("property float s\nproperty float t\n"),
            std::string::npos);
  EXPECT_EQ(find(readMesh(folder.file("a.ply")), "uv")->values, mesh.attributes[0].values);
}

TEST(MeshIo, PlyHoldsPolygonsOfMoreThan255Corners) {
  const TemporaryFolder folder;
  Mesh mesh;
  std::vector<std::uint32_t> loop;
  for (std::uint32_t i = 0; i < 300; ++i) {
    mesh.positions.emplace_back(std::cos(i * 0.02), std::sin(i * 0.02), 0);
    loop.push_back(i);
  }
  mesh.addFace(loop);
  MeshAttribute weight{"weight", MeshAttribute::Domain::corner, 1, std::vector<float>(300)};
  for (std::size_t c = 0; c < 300; ++c) weight.values[c] = float(c);
  mesh.attributes.push_back(weight);
  writeMesh(folder.file("a.ply"), mesh);
  const Mesh back = readMesh(folder.file("a.ply"));
  EXPECT_EQ(back.corners, mesh.corners);
  ASSERT_EQ(back.attributes.size(), 1u);
  EXPECT_EQ(back.attributes[0].values, weight.values);
}

TEST(MeshIo, StlRoundTripIsTheTriangulationInFloats) {
  const TemporaryFolder folder;
  const Mesh mesh = decorated();
  writeMesh(folder.file("a.stl"), mesh);
  const Mesh back = readMesh(folder.file("a.stl"));
  EXPECT_EQ(back.faceCount(), 4u);
  EXPECT_EQ(back.positions.size(), mesh.positions.size());
  EXPECT_NEAR(surfaceArea(back), surfaceArea(mesh), 1e-7);
}

TEST(MeshIo, WritingFloatsAsTextAndBackGivesTheSameFloats) {
  const TemporaryFolder folder;
  Mesh mesh;
  mesh.positions = {{double(0.1f), double(1.0f / 3), double(1e-30f)}, {1, 0, 0}, {0, 1, 0}};
  mesh.addFace(std::vector<std::uint32_t>{0, 1, 2});
  writeMesh(folder.file("a.obj"), mesh);
  EXPECT_EQ(Vec3f(readMesh(folder.file("a.obj")).positions[0]), Vec3f(0.1f, 1.0f / 3, 1e-30f));
  // In nine digits the largest float is a number above it.
  constexpr float kMost = std::numeric_limits<float>::max(),
                  kLeast = std::numeric_limits<float>::denorm_min();
  mesh.attributes = {{"uv", MeshAttribute::Domain::corner, 2, {kMost, -kMost, kLeast, 0.1f, 0, 1}}};
  writeMesh(folder.file("b.obj"), mesh);
  EXPECT_EQ(test::attributeOf(readMesh(folder.file("b.obj")), "uv").values, mesh.attributes[0].values);
}

}  // namespace
}  // namespace nephele
