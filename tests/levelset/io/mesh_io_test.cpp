#include "nephele/levelset/io/mesh_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <fstream>

#include "nephele/levelset/mesh/mesh_repair.h"
#include "tests/support/known_meshes.h"
#include "tests/support/mesh_attributes.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

using namespace std::string_literals;

namespace nephele {
namespace {

using test::find;
using test::KnownMesh;
using test::ownData;
using test::sharedData;
using test::TemporaryFolder;

Mesh readText(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  std::ofstream(folder.file(name), std::ios::binary) << text;
  return readMesh(folder.file(name));
}

std::string little(const std::vector<float>& values) {
  return {reinterpret_cast<const char*>(values.data()), 4 * values.size()};
}

std::string bigEndianFloats(const std::vector<float>& values) {
  std::string bytes;
  for (const float value : values) {
    char raw[4];
    std::memcpy(raw, &value, 4);
    bytes.append({raw[3], raw[2], raw[1], raw[0]});
  }
  return bytes;
}

class KnownMeshes : public ::testing::TestWithParam<KnownMesh> {};

TEST_P(KnownMeshes, AreReadAndDiagnosedAsTheManifestSays) {
  const KnownMesh& known = GetParam();
  NEPHELE_REQUIRE_SHARED_DATA(sharedData(known.name));
  const Mesh mesh = readMesh(sharedData(known.name));
  const MeshDiagnosis is = diagnose(mesh);
  EXPECT_EQ(is.vertices, std::size_t(known.vertices));
  EXPECT_EQ(is.faces, std::size_t(known.faces));
  EXPECT_EQ(is.triangles, std::size_t(known.triangles));
  EXPECT_EQ(is.eulerCharacteristic, known.euler);
  EXPECT_EQ(is.components, std::size_t(known.components));
  EXPECT_EQ(is.boundaryEdges, std::size_t(known.boundaryEdges));
  EXPECT_EQ(is.boundaryLoops, std::size_t(known.boundaryLoops));
  EXPECT_EQ(is.nonManifoldEdges, std::size_t(known.nonManifoldEdges));
  EXPECT_EQ(is.nonManifoldVertices, std::size_t(known.nonManifoldVertices));
  EXPECT_EQ(is.misorientedEdges, std::size_t(known.misorientedEdges));
  EXPECT_EQ(is.duplicateFaces, std::size_t(known.duplicateFaces));
  EXPECT_EQ(is.degenerateFaces, std::size_t(known.zeroAreaTriangles));
  EXPECT_EQ(find(mesh, "uv") != nullptr, known.hasUv);
  // The manifest has 9 digits, and was summed about the origin: rounding grows with the distance from there.
  const double reach = std::max(length(Vec3d(is.box.min)), length(Vec3d(is.box.max)));
  const double tolerance = 1e-7 * std::abs(known.volume) + 1e-16 * reach * reach * reach;
  if (is.closed()) {
    EXPECT_NEAR(is.volume, known.volume, tolerance);
  }
  const bool good = !std::string_view(known.name).starts_with("defective/");
  if (good) {
    EXPECT_TRUE(is.problems().empty()) << is.problems().front();
  }
}

std::string testName(const ::testing::TestParamInfo<KnownMesh>& info) {
  std::string name = info.param.name;
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(All, KnownMeshes, ::testing::ValuesIn(test::kKnownMeshes), testName);

TEST(MeshIo, SpotHasItsTextureCoordinates) {
  const std::string path = sharedData("meshes/spot_uv.obj");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Mesh mesh = readMesh(path);
  const MeshAttribute* uv = find(mesh, "uv");
  ASSERT_NE(uv, nullptr);
  EXPECT_EQ(uv->domain, MeshAttribute::Domain::corner);
  ASSERT_EQ(uv->values.size(), 2 * mesh.corners.size());
  // Box of the coordinates, from the data's README: [-0.0522, 0.989] x [0.111, 1].
  float low[2] = {9, 9}, high[2] = {-9, -9};
  for (std::size_t i = 0; i < uv->values.size(); ++i) {
    low[i % 2] = std::min(low[i % 2], uv->values[i]);
    high[i % 2] = std::max(high[i % 2], uv->values[i]);
  }
  EXPECT_NEAR(low[0], -0.0522, 5e-5);
  EXPECT_NEAR(high[0], 0.989, 5e-4);
  EXPECT_NEAR(low[1], 0.111, 5e-4);
  EXPECT_NEAR(high[1], 1, 5e-3);  // three digits are given, so 1.00 here
}

TEST(MeshIo, DuckHasItsNodeTransformAndSize) {
  const std::string path = sharedData("meshes/duck.glb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const Box box = boundingBox(readMesh(path));
  // From the data's README.
  EXPECT_NEAR(box.min.x, -0.693, 5e-4);
  EXPECT_NEAR(box.min.y, 0.09929, 5e-6);
  EXPECT_NEAR(box.max.y, 1.64, 5e-3);
  EXPECT_NEAR(box.max.z, 0.5393, 5e-5);
}

TEST(MeshIo, SecondTextureSetOfAGlbIsThereToo) {
  const std::string path = sharedData("meshes/multi_uv_box.glb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  EXPECT_NE(find(readMesh(path), "uv1"), nullptr);
}

TEST(MeshIo, UnusualButValidFilesAreRead) {
  const std::pair<const char*, std::size_t> files[] = {
      {"malformed/header_delimiters.ply", 8},  // README: usable faces
      {"malformed/starts_with_newline_data.ply", 6},
      {"malformed/fuzz_seed.glb", 12},
      {"malformed/long_face_line.obj", 6}};
  for (const auto& [name, faces] : files) {
    NEPHELE_REQUIRE_SHARED_DATA(sharedData(name));
    EXPECT_EQ(readMesh(sharedData(name)).faceCount(), faces) << name;
  }
}

TEST(MeshIo, ObjTakesEveryFormOfACorner) {
  const Mesh mesh =
      readText("a.obj",
               "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0.25\nvt 0 1\nvn 0 0 1\n"
               "f 1 2 3\nf 1/1 2/2 3/3\nf 1//1 2//1 3//1\nf 1/1/1 2/2/1 3/3/1\nf -3/-3/-1 -2/-2 -1\n");
  ASSERT_EQ(mesh.faceCount(), 5u);
  for (std::size_t f = 0; f < 5; ++f)
    EXPECT_TRUE(std::ranges::equal(mesh.face(f), std::vector<unsigned>{0, 1, 2}));
  const MeshAttribute* uv = find(mesh, "uv");
  ASSERT_NE(uv, nullptr);
  const std::vector<float> none{0, 0, 0, 0, 0, 0}, all{0, 0, 1, 0.25, 0, 1}, twoOfThree{0, 0, 1, 0.25, 0, 0};
  for (const auto& [f, expected] : {std::pair{0, none}, {1, all}, {2, none}, {3, all}, {4, twoOfThree}})
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), uv->values.begin() + 6 * f)) << "face " << f;
}

TEST(MeshIo, ObjJoinsContinuedLinesAndKnowsAllLineEnds) {
  const Mesh mesh =
      readText("a.obj", "# x\r\nv 0 0 \\\r\n0\rv +1 0 0 # corner\nv 0 1e0 0\nf 1 \\\n 2 \\\n 3");
  ASSERT_EQ(mesh.faceCount(), 1u);
  EXPECT_EQ(mesh.positions[1], Vec3d(1, 0, 0));
}

TEST(MeshIo, ObjVertexColoursAndGroupsAreKept) {
  const Mesh mesh = readText(
      "a.obj", "v 0 0 0 1 0.5 0\nv 1 0 0\nv 0 1 0 0 0 1\ng left part\nf 1 2 3\nf 3 2 1\no right\nf 1 2 3\n");
  const MeshAttribute* color = find(mesh, "color");
  ASSERT_NE(color, nullptr);
  EXPECT_EQ(color->values, (std::vector<float>{1, 0.5, 0, 1, 1, 1, 0, 0, 1}));
  ASSERT_EQ(mesh.groups.size(), 2u);
  EXPECT_EQ(mesh.groups[0].name, "left part");
  EXPECT_EQ(mesh.groups[0].faceCount, 2u);
  EXPECT_EQ(mesh.groups[1].name, "right");
  EXPECT_EQ(mesh.groups[1].firstFace, 2u);
}

TEST(MeshIo, ObjReadsTinyAndHugeNumbers) {
  const Mesh mesh = readText("a.obj", "v 1e-400 2e-310 1e300\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(mesh.positions[0].x, 0);
  EXPECT_EQ(mesh.positions[0].z, 1e300);
}

constexpr const char* kTriangleElements =
    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

TEST(MeshIo, PlyReadsBothByteOrders) {
  const std::vector<float> positions{0, 0, 0, 1.5, 0, 0, 0, 2.5, 0};
  const std::string head = "ply\nformat binary_";
  const Mesh a = readText("a.ply", head + "little_endian 1.0\n" + kTriangleElements + little(positions) +
                                       std::string("\3\0\0\0\0\1\0\0\0\2\0\0\0", 13));
  const Mesh b =
      readText("a.ply", head + "big_endian 1.0\n" + kTriangleElements + bigEndianFloats(positions) +
                            std::string("\3\0\0\0\0\0\0\0\1\0\0\0\2", 13));
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.corners, b.corners);
  EXPECT_EQ(a.positions[2], Vec3d(0, 2.5, 0));
}

TEST(MeshIo, PlyPassesOverElementsAndListsItDoesNotKnow) {
  const Mesh mesh = readText(
      "a.ply",
      "ply\nformat ascii 1.0\ncomment c\nelement camera 1\nproperty list int double pose\n"
      "element vertex 3\nproperty double x\nproperty list uchar short odd\nproperty float y\n"
      "property float z\nelement face 1\nproperty uchar flag\n"
      "property list uint ushort vertex_index\nend_header\n2 1.5 2.5\n0 1 7 0 0\n1 0 0 0\n0 2 8 9 1 0\n"
      "4 3 0 1 2\n");
  EXPECT_EQ(mesh.positions[2], Vec3d(0, 1, 0));
  EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(MeshIo, PlyPropertiesBecomeAttributes) {
  const Mesh mesh = readText(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float s\n"
      "property float t\nproperty float mass\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n"
      "0 0 0 255 0 51 0.1 0.2 5\n1 0 0 0 0 0 0.3 0.4 6\n0 1 0 0 255 0 0.5 0.6 7\n3 2 0 1\n");
  EXPECT_EQ(find(mesh, "color")->values, (std::vector<float>{1, 0, 0.2f, 0, 0, 0, 0, 1, 0}));
  EXPECT_EQ(find(mesh, "mass")->values, (std::vector<float>{5, 6, 7}));
  const MeshAttribute* uv = find(mesh, "uv");
  ASSERT_NE(uv, nullptr);
  EXPECT_EQ(uv->domain, MeshAttribute::Domain::corner);
  EXPECT_EQ(uv->values, (std::vector<float>{0.5f, 0.6f, 0.1f, 0.2f, 0.3f, 0.4f}));
}

TEST(MeshIo, PlyStripsAlternateAndRestart) {
  const Mesh mesh = readText(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 2 0\n9 0 1 2 3 -1 2 3 3 4\n");
  EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 3}));
}

TEST(MeshIo, TextPlyHasAttributesOfCornersToo) {
  const Mesh mesh = readText(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face 2\nproperty list uchar float heat\nproperty list uchar int vertex_indices\n"
      "property list uchar double color\nproperty list uchar float texcoord\n"
      "property list int int neighbours\nend_header\n"
      "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n"
      "3 1 2 3 3 0 1 2 9 0 0 0 .5 .5 .5 1 1 1 6 0 0 1 0 0 1 3 7 8 9\n"
      "3 4 5 6 3 2 1 0 9 1 0 0 0 1 0 0 0 1 6 1 1 0 1 1 0 3 7 8 9\n");
  EXPECT_EQ(mesh.attributes.size(), 4u) << "lists of whole numbers are none";
  EXPECT_EQ(find(mesh, "heat")->values, (std::vector<float>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(find(mesh, "uv")->width, 2);
  EXPECT_EQ(find(mesh, "color")->domain, MeshAttribute::Domain::vertex) << "they have the name";
  EXPECT_EQ(find(mesh, "color_corner")->values,
            (std::vector<float>{0, 0, 0, .5f, .5f, .5f, 1, 1, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1}));
}

TEST(MeshIo, PlyListsThatDoNotBelongToCornersArePassedOver) {
  const auto readWith = [](const char* header, const char* first, const char* second) {
    return readText("a.ply", std::string("ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n"
                                         "property float y\nproperty float z\nelement face 2\n"
                                         "property list uchar int vertex_indices\nproperty ") +
                                 header + "\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 " + first +
                                 "\n4 0 1 3 2 " + second + "\n");
  };
  EXPECT_EQ(readWith("list uchar float a", "3 1 2 3", "4 1 2 3 4").attributes.size(), 1u);
  // Not the same number for each corner; missing at a face; no multiple of the corners.
  EXPECT_TRUE(readWith("list uchar float a", "3 1 2 3", "8 1 2 3 4 5 6 7 8").attributes.empty());
  EXPECT_TRUE(readWith("list uchar float a", "0", "4 1 2 3 4").attributes.empty());
  EXPECT_TRUE(readWith("list uchar float a", "3 1 2 3", "0").attributes.empty());
  EXPECT_TRUE(readWith("list uchar float a", "2 1 2", "2 1 2").attributes.empty());
  EXPECT_TRUE(readWith("list uchar float a", "0", "0").attributes.empty());
}

std::string binaryStl(const std::string& header, const std::vector<float>& facets) {
  std::string bytes = header + std::string(80 - header.size(), ' ');
  const auto count = std::uint32_t(facets.size() / 12);
  bytes.append(reinterpret_cast<const char*>(&count), 4);
  for (std::size_t f = 0; f < count; ++f)
    bytes +=
        little({facets.begin() + long(12 * f), facets.begin() + long(12 * f + 12)}) + std::string(2, '\0');
  return bytes;
}

TEST(MeshIo, BinaryStlMayBeginWithTheWordSolid) {
  const Mesh mesh =
      readText("a.stl", binaryStl("solid made elsewhere", {0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0,  //
                                                           0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, -0.0f}));
  EXPECT_EQ(mesh.faceCount(), 2u);
  EXPECT_EQ(mesh.positions.size(), 4u) << "equal positions are shared";
}

TEST(MeshIo, TextStlKeepsItsSolidsAsGroups) {
  const std::string facet =
      "facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n endloop\nendfacet\n";
  const Mesh mesh = readText(
      "a.stl", "solid one\n" + facet + "endsolid one\nsolid two words\n" + facet + facet + "endsolid\n");
  ASSERT_EQ(mesh.groups.size(), 2u);
  EXPECT_EQ(mesh.groups[1].name, "two words");
  EXPECT_EQ(mesh.groups[1].faceCount, 2u);
}

TEST(MeshIo, OffKnowsColoursNormalsCommentsAndCountsBehindTheWord) {
  const Mesh mesh =
      readText("a.off",
               "# made by hand\nCNOFF 3 1 0 # counts\n0 0 0  0 0 1  255 0 0\n\n1 0 0  0 0 1  0 51 0\n"
               "0 1 0  0 0 1  0 0 0\n3 0 1 2  9 9 9\n");
  EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 1, 2}));
  EXPECT_EQ(find(mesh, "color")->values, (std::vector<float>{1, 0, 0, 0, 0.2f, 0, 0, 0, 0}));
}

TEST(MeshIo, OffHasTextureCoordinatesBehindColoursOfThreeValuesOrFour) {
  // The order of Geomview's manual (OOGL, OFF): normals, colours, texture coordinates.
  for (const std::string opacity : {"", " 0.25"}) {
    const Mesh mesh =
        readText("a.off", "STCNOFF 3 1 0\n0 0 0 0 0 1 1 0.5 0" + opacity + " 0.75 0.125\n1 0 0 0 0 1 0 1 0" +
                              opacity + " 2 3\n0 1 0 0 0 1 0 0 1" + opacity + " 4 5\n3 2 0 1\n");
    EXPECT_EQ(find(mesh, "uv")->values, (std::vector<float>{4, 5, 0.75f, 0.125f, 2, 3}));
    EXPECT_EQ(find(mesh, "color")->values,
              opacity.empty() ? (std::vector<float>{1, 0.5f, 0, 0, 1, 0, 0, 0, 1})
                              : (std::vector<float>{1, 0.5f, 0, 0.25f, 0, 1, 0, 0.25f, 0, 0, 1, 0.25f}));
  }
}

TEST(MeshIo, TextMayBeginWithAMarkOfByteOrder) {
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  for (const auto& [name, text] : {std::pair{"a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"s},
                                   {"a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"s},
                                   {"a.stl", "solid a\n" + facet + "endsolid a\n"}})
    EXPECT_EQ(readText(name, "\xef\xbb\xbf" + text).positions,
              (std::vector<Vec3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}))
        << name;
}

TEST(MeshIo, GltfAppliesNodesFlipsVAndTurnsMirroredFaces) {
  // One triangle (0,0,0) (1,0,0) (0,1,0) with coordinates (0,0) (1,0) (0,0.25) in a base64 buffer, under a
  // parent that moves by (10, 0, 0) and a child that scales by (-2, 1, 1). The buffer was made with Python's
  // base64.
  const Mesh mesh = readText(
      "a.gltf",
      R"({"asset":{"version":"2.0"},"nodes":[{"translation":[10,0,0],"children":[1]},{"scale":[-2,1,1],"mesh":0}],
          "meshes":[{"name":"t","primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":1}}]}],
          "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
                       {"bufferView":0,"byteOffset":36,"componentType":5126,"count":3,"type":"VEC2"}],
          "bufferViews":[{"buffer":0,"byteLength":60}],"buffers":[{"byteLength":60,"uri":"data:application/octet-stream;base64,)"
      "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA+"
      R"("}]})");
  EXPECT_EQ(mesh.positions, (std::vector<Vec3d>{{10, 0, 0}, {8, 0, 0}, {10, 1, 0}}));
  EXPECT_EQ(mesh.corners, (std::vector<std::uint32_t>{0, 2, 1}));
  EXPECT_EQ(find(mesh, "uv")->values, (std::vector<float>{0, 1, 0, 0.75, 1, 1}));
  ASSERT_EQ(mesh.groups.size(), 1u);
  EXPECT_EQ(mesh.groups[0].name, "t");
}

TEST(MeshIo, GltfVertexColoursBecomeColor) {
  // The triangle (0,0,0) (1,0,0) (0,1,0) with normalised bytes (255,0,51,255) (0,0,0,0) (0,255,0,102); the
  // buffer was made with Python's base64.
  const Mesh mesh = readText("a.gltf",
                             R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],
          "meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":1}}]}],
          "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
                       {"bufferView":0,"byteOffset":36,"componentType":5121,"normalized":true,"count":3,"type":"VEC4"}],
          "bufferViews":[{"buffer":0,"byteLength":48}],"buffers":[{"byteLength":48,"uri":"data:application/octet-stream;base64,)"
                             "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA/wAz/wAAAAAA/wBm"
                             R"("}]})");
  ASSERT_NE(find(mesh, "color"), nullptr);
  EXPECT_EQ(find(mesh, "color")->width, 4);
  EXPECT_EQ(find(mesh, "color")->values, (std::vector<float>{1, 0, 0.2f, 1, 0, 0, 0, 0, 0, 1, 0, 0.4f}));
}

TEST(MeshIo, PaintedMeshOfThisProjectHasItsAttributes) {
  // Painted by data/paint_mesh.py with "amplitude = ramp(h, 0.1, 0.6)" and others; ramp is 3 t^2 - 2 t^3.
  const Mesh mesh = readMesh(ownData("data/cloud_base_painted.ply"));
  const MeshAttribute* amplitude = find(mesh, "amplitude");
  ASSERT_NE(amplitude, nullptr);
  ASSERT_NE(find(mesh, "billow"), nullptr);
  ASSERT_NE(find(mesh, "color"), nullptr);
  const Box box = boundingBox(mesh);
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const double h = (mesh.positions[v].y - double(box.min.y)) / double(box.size().y);
    const double t = std::clamp((h - 0.1) / 0.5, 0.0, 1.0);
    ASSERT_NEAR(amplitude->values[v], t * t * (3 - 2 * t), 1e-5);
  }
}

}  // namespace
}  // namespace nephele
