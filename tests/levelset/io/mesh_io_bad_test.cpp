#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele {
namespace {

using test::sharedData;
using test::TemporaryFolder;

std::string messageFor(const std::string& path) {
  try {
    readMesh(path);
  } catch (const Error& error) {
    return error.what();
  }
  return "no error";
}

// What is expected of the real files is in the README of the shared data.

struct BadFile {
  const char* name;
  const char* what;  // part of the message
};

std::ostream& operator<<(std::ostream& stream, const BadFile& file) {
  return stream << file.name;
}

class BadFiles : public ::testing::TestWithParam<BadFile> {};

TEST_P(BadFiles, AreRefusedInOneLineThatNamesTheFileAndTheFault) {
  const std::string path = sharedData(std::string("malformed/") + GetParam().name);
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const std::string message = messageFor(path);
  EXPECT_TRUE(message.starts_with(path + ": ")) << message;
  EXPECT_NE(message.find(GetParam().what), std::string::npos) << message;
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

INSTANTIATE_TEST_SUITE_P(
    All, BadFiles,
    ::testing::Values(BadFile{"absurd_count.off", "353535235358 vertices, more than its 309 bytes can hold"},
                      BadFile{"bad_faces.obj", "line 28: vertex index 0"},
                      BadFile{"box_infinite.glb", "vertex 0: a coordinate is not finite"},
                      BadFile{"box_needs_draco.glb", "'KHR_draco_mesh_compression'"},
                      BadFile{"empty_0_bytes.obj", "the file is empty"},
                      BadFile{"empty_0_bytes.ply", "the file is empty"},
                      BadFile{"empty_binary.stl", "has no faces"},
                      BadFile{"empty_header_only.ply", "has no faces"},
                      BadFile{"git_lfs_pointer.vdb", "Git LFS pointer"},
                      BadFile{"invalid_face_definition.obj", "line 15: a face needs at least 3 vertices"},
                      BadFile{"list_in_vertex_element_no_faces.ply", "line 15: vertex 1 of 24"},
                      BadFile{"nan_vertices.obj", "line 12: a coordinate is not finite: 'nan'"},
                      BadFile{"points_only_ascii.ply", "has no faces (5 vertices)"},
                      BadFile{"relative_index_out_of_range.obj", "line 1: vertex index -4 is out of range"},
                      BadFile{"truncated_binary.ply", "is cut short"},
                      BadFile{"truncated_binary.stl", "declares 224 triangles but holds 118"},
                      BadFile{"zero_face_index.obj", "line 16: vertex index 0"}),
    [](const auto& file) {
      std::string name = file.param.name;
      for (char& c : name) c = c == '.' ? '_' : c;
      return name;
    });

struct Fault {
  const char* file;
  std::string text;
  const char* what;
};

TEST(MeshIoBad, FaultsAreNamedWithTheirLine) {
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string lists =
      "element face 1\nproperty list uchar int vertex_indices\nproperty list uchar float heat\nend_header\n";
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
  const std::string v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const Fault faults[] = {
      {"a.obj", v + "f 1 2 4\n", "line 4: vertex index 4 is out of range (the file has 3)"},
      // Its negation is no 64-bit integer; the undefined-behaviour sanitizer stopped here.
      {"a.obj", v + "f 1 2 -9223372036854775808\n",
       "line 4: vertex index -9223372036854775808 is out of range (3 so far)"},
      {"a.obj", v + "f 1/1 2/1 3/1\n", "line 4: texture index 1 is out of range"},
      {"a.obj", v + "f 1 2 3x\n", "line 4: a face corner should look like"},
      {"a.obj", v + "f 1 2 99999999999999999999\n", "line 4: a vertex index should be a whole number"},
      {"a.obj", "v 0 0\n" + v + "f 1 2 3\n", "line 1: a coordinate is missing"},
      {"a.obj", "v 0 zero 0\n" + v + "f 1 2 3\n", "line 1: a coordinate should be a number, found 'zero'"},
      {"a.obj", "v 0 1e999 0\n" + v + "f 1 2 3\n", "line 1: a coordinate is not finite: '1e999'"},
      {"a.obj", v + "v 0 0 0 1e60 1 1\nf 1 2 3\n", "line 4: a weight or colour is too large: 1e+60"},
      {"a.obj", v + "vt 0 -1e39\nf 1 2 3\n", "line 4: a texture coordinate is too large: -1e+39"},
      {"a.obj", v, "has no faces (3 vertices)"},
      {"a.ply", "plx\n", "does not start with the line 'ply'"},
      {"a.ply", "ply\nformat ascii 1.0\n", "no 'end_header'"},
      {"a.ply", "ply\nformat utf8 1.0\nend_header\n", "line 2: unknown format 'utf8'"},
      {"a.ply", ply + faces + points + "3 0 1 3\n", "line 13: face 1 of 1: vertex index 3 is out of range"},
      {"a.ply", ply + faces + points + "3 0 1 -1\n", "line 13: face 1 of 1: vertex index -1 is out of range"},
      {"a.ply", ply + faces + points + "2 0 1\n", "line 13: face 1 of 1: a face needs at least 3"},
      {"a.ply", ply + faces + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n",
       "line 11: vertex 2 of 3: coordinate y is not finite"},
      {"a.ply", ply + faces + points, "face 1 of 1: the file ends here"},
      {"a.ply", ply + lists + points + "3 0 1 2 3 1 2\n", "face 1 of 1: the file ends here"},
      {"a.ply", ply + lists + points + "3 0 1 2 255 1 2 3\n", "a list of 255 values is longer than the file"},
      {"a.ply", ply + lists + points + "3 0 1 2 -3 1 2 3\n", "list length -3 makes no sense"},
      {"a.ply", ply + lists + points + "3 0 1 2 3 1 x 3\n", "line 14: face 1 of 1: expected a number"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 99999999\nproperty float x\nend_header\n0\n",
       "is cut short"},
      {"a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n",
       "no property y"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n",
       "line 6: a facet needs"},
      {"a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "cut short"},
      {"a.stl", "solid a\nvertex 0 0 0\n", "line 2: 'vertex' outside"},
      {"a.stl", "nothing", "neither a text STL nor"},
      {"a.off", "OFF\n3 1 0\n" + points + "3 0 1 3\n", "line 6: vertex index 3 is out of range"},
      {"a.off", "OFF\n3 1 0\n" + points, "the file ends after 0 of 1 faces"},
      {"a.off", "OFF BINARY\n", "binary OFF is not supported"},
      {"a.off", "4OFF\n", "'4OFF' is not supported"},
      {"a.gltf", "{\"asset\":{\"version\":\"1.0\"}}", "is glTF version '1.0'"},
      {"a.gltf", "{\"asset\":", "the JSON part is broken"},
      {"a.glb", "glTF\2\0\0\0", "is cut short"},
      {"a.xyz", "1 2 3\n", "unknown mesh format '.xyz'"},
  };
  for (const Fault& fault : faults) {
    const TemporaryFolder folder;
    const std::string path = folder.file(fault.file);
    std::ofstream(path, std::ios::binary) << fault.text;
    const std::string message = messageFor(path);
    EXPECT_TRUE(message.starts_with(path + ": ")) << message;
    EXPECT_NE(message.find(fault.what), std::string::npos) << message << "\nexpected: " << fault.what;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(MeshIoBad, MissingFilesAndFoldersAreNamed) {
  const TemporaryFolder folder;
  EXPECT_NE(messageFor(folder.file("none.obj")).find("none.obj: cannot be read: No such file"),
            std::string::npos);
  EXPECT_NE(messageFor(folder.file("")).find("Is a directory"), std::string::npos);
}

TEST(MeshIoBad, NodesThatFormACycleAreRefused) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("a.gltf")) << R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],
      "nodes":[{"children":[1]},{"children":[0]}]})";
  EXPECT_NE(messageFor(folder.file("a.gltf")).find("node 0 has two parents or is its own ancestor"),
            std::string::npos);
}

// A file from anywhere must not choose what is read of this machine.
TEST(MeshIoBad, BuffersOfGltfLieBesideIt) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.file("scene"));
  std::ofstream(folder.file("outside.bin")) << "0123456789";
  const std::string path = folder.file("scene/a.gltf");
  for (const std::string uri : {"/dev/zero", "../outside.bin", "x/../../outside.bin", "%2e%2e/outside.bin",
                                "%2fetc%2fpasswd", "file:///etc/passwd", "."}) {
    std::ofstream(path) << R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":4,"uri":")" << uri
                        << "\"}]}";
    EXPECT_NE(messageFor(path).find("a buffer is at '" + uri + "'"), std::string::npos) << messageFor(path);
  }
}

// 300 bytes for each million of vertices, all of them zero.
TEST(MeshIoBad, GltfThatRepeatsItsDataWithoutEndIsRefused) {
  const TemporaryFolder folder;
  std::string primitives;
  for (int i = 0; i != 300; ++i)
    primitives += std::string(i > 0 ? "," : "") + R"({"attributes":{"POSITION":0},"mode":5})";
  std::ofstream(folder.file("a.gltf"))
      << R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[)"
      << "{\"primitives\":[" << primitives << R"(]}],"accessors":[{"componentType":5126,"count":1000000,)"
      << R"("type":"VEC3"}]})";
  EXPECT_NE(messageFor(folder.file("a.gltf")).find("out of proportion"), std::string::npos)
      << messageFor(folder.file("a.gltf"));
}

TEST(MeshIoBad, DevicesAreRefused) {
  const TemporaryFolder folder;
  std::filesystem::create_symlink("/dev/zero", folder.file("a.obj"));
  EXPECT_NE(messageFor(folder.file("a.obj")).find("is a device"), std::string::npos);
}

TEST(MeshIoBad, UnknownOutputFormatIsRefused) {
  Mesh mesh;
  EXPECT_THROW(writeMesh("/tmp/a.xyz", mesh), Error);
}

// Flips, overwrites, cuts and repeats bytes; the reader must return a mesh that can be diagnosed or throw
// Error.
void mutate(const std::string& name, const std::string& original) {
  const TemporaryFolder folder;
  const std::string path = folder.file(name);
  std::mt19937 random(20240607);
  const auto below = [&](std::size_t n) { return std::size_t(random() % n); };
  std::size_t refused = 0;
  for (int round = 0; round < 300; ++round) {
    std::string text = original;
    for (std::size_t i = 0, count = 1 + below(4); i < count; ++i) {
      const std::size_t at = below(text.size());
      switch (below(5)) {
        case 0:
          text[at] = char(text[at] ^ (1 << below(8)));
          break;
        case 1:
          text[at] = char(below(256));
          break;
        case 2:
          text[at] = "0123456789-+.e \n"[below(16)];
          break;
        case 3:
          text.resize(std::max<std::size_t>(at, 1));
          break;
        default:
          text.insert(at, text.substr(below(text.size()), 1 + below(16)));
          break;
      }
    }
    std::ofstream(path, std::ios::binary) << text;
    try {
      const Mesh mesh = readMesh(path);
      ASSERT_GT(mesh.faceCount(), 0u);
      ASSERT_EQ(mesh.faceStart.back(), mesh.corners.size());
      for (const std::uint32_t v : mesh.corners) ASSERT_LT(v, mesh.positions.size());
      for (const MeshAttribute& a : mesh.attributes) {
        const bool corner = a.domain == MeshAttribute::Domain::corner;
        ASSERT_EQ(a.values.size(),
                  (corner ? mesh.corners.size() : mesh.positions.size()) * std::size_t(a.width));
      }
      diagnose(mesh);
    } catch (const Error& error) {
      ++refused;
      ASSERT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(refused, 30u) << "the mutations should break something";
}

class Mutations : public ::testing::TestWithParam<const char*> {};

TEST_P(Mutations, EndInAMeshOrAnError) {
  const std::string path = sharedData(GetParam());
  NEPHELE_REQUIRE_SHARED_DATA(path);
  mutate(std::filesystem::path(path).filename().string(), test::textOf(path));
}

INSTANTIATE_TEST_SUITE_P(Formats, Mutations,
                         ::testing::Values("meshes/cube_uv.obj", "meshes/negative_indices_uv.obj",
                                           "meshes/cube_quads_ascii.ply",
                                           "meshes/cube_binary_crlf_header.ply",
                                           "malformed/header_delimiters.ply", "meshes/box_ascii.stl",
                                           "meshes/box_binary.stl", "meshes/box_textured.glb"),
                         [](const auto& file) {
                           std::string name = std::filesystem::path(file.param).filename().string();
                           for (char& c : name) c = c == '.' ? '_' : c;
                           return name;
                         });

TEST(MeshIoBad, MutatedOffEndsInAMeshOrAnError) {
  mutate("a.off",
         "COFF\n4 4 6\n0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 9 9 9\n3 0 2 1\n3 0 1 3\n3 1 2 "
         "3\n3 2 0 3\n");
}

TEST(MeshIoBad, MutatedAttributesOfCornersEndInAMeshOrAnError) {
  const TemporaryFolder folder;
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (const auto& f : {std::array<std::uint32_t, 3>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}})
    mesh.addFace(f);
  for (const auto& [name, width] : {std::pair{"uv", 2}, std::pair{"uv1", 2}, std::pair{"color", 4}}) {
    mesh.attributes.push_back({name, MeshAttribute::Domain::corner, width, {}});
    for (int i = 0; i < 12 * width; ++i) mesh.attributes.back().values.push_back(float(i) / 48);
  }
  writeMesh(folder.file("a.ply"), mesh);
  mutate("a.ply", test::textOf(folder.file("a.ply")));
}

}  // namespace
}  // namespace nephele
