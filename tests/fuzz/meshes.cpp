#include <fmt/format.h>

#include <filesystem>

#include "apps/options/descriptions.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/point_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"

namespace nephele::fuzz {
namespace {

/// Beyond so many, a verb would take a second, and other inputs wait.
constexpr std::size_t kMostCorners = 600;

/// What is written is read again as it was, as far as the format can hold it.
void writeAndReadBack(const Mesh& mesh, std::uint64_t hash) {
  const std::string path = scratchPath(hash % 3 == 0 ? "mesh.obj" : hash % 3 == 1 ? "mesh.ply" : "mesh.stl");
  if (!succeeds(path, [&] { writeMesh(path, mesh); })) return;
  // STL holds triangles only, and no file needs to hold faces without area or a surface of nothing.
  Mesh back;
  if (!succeeds(path, [&] { back = readMesh(path); })) {
    expect(path.ends_with(".stl") || triangulated(mesh).faceCount() == 0,
           "a mesh that was written cannot be read: " + lastError());
    return;
  }
  if (path.ends_with(".stl")) {
    expect(back.faceCount() == triangulated(mesh).faceCount(),
           "the triangles of an STL file are not those written");
    return;
  }
  expect(back.positions.size() == mesh.positions.size(), "the vertices of a file are not those written");
  expect(back.corners == mesh.corners && back.faceStart == mesh.faceStart,
         "the faces of a file are not those written");
}

void runVerbs(const Input& input) {
  const std::string &path = input.path, volume = scratchPath("out.vdb"), mesh = scratchPath("out.obj");
  // Wraps take as long as their fineness asks for, however small the mesh; only `levelset` has coarse ones.
  switch (input.hash / 3 % 11) {
    case 0:
      runVerb({"levelset", path, "-o", volume, "--resolution", "8"}, path);
      break;
    case 1:
      runVerb({"levelset", path, "-o", volume, "--resolution", "8", "--repair", "wrap"}, path);
      break;
    case 2: {
      const std::string folder = scratchPath("pieces");
      runVerb({"cut", path, "-o", folder, "--random-planes", "2", "--seed", std::to_string(input.hash % 5),
               "--repair", "off"},
              path);
      std::filesystem::remove_all(folder);
      break;
    }
    case 3:
      runVerb({"mesh", path, "-o", mesh, "--faces", "20"}, path);
      break;
    case 4:
      runVerb({"mesh", path, "-o", mesh, "--smooth", "2", "--subdivide", "1"}, path);
      break;
    case 5:
      runVerb({"cloud", path, "-o", volume, "--resolution", "10", "--layers", "1", "--repair", "off"}, path);
      break;
    case 6:
      runVerb({"wisps", path, "-o", volume, "--guides", "2", "--dots", "200", "--resolution", "8"}, path);
      break;
    case 7:
      runRender({ballFog(), "--object", path, "--checker", "4"}, path);
      break;
    case 8:
      runVerb({"transfer", "--from", ballMesh(), "--to", path, "-o", mesh, "--resolution", "8",
               "--iterations", "1"},
              "");
      break;
    case 9:
      runVerb(
          {"transform", path, "-o", mesh, "--up-axis", "z", "--to-unit", input.hash % 2 == 0 ? "mm" : "ft",
           "--scale", input.hash % 5 == 0 ? "1e9" : "0.5", "--rotate", "10,20,30", "--place", "ground"},
          path);
      break;
    default:
      runVerb({"transfer", "--from", path, "--to", ballMesh(), "-o", mesh, "--method", "closest"}, "");
  }
}

}  // namespace

bool useMesh(const Input& input) {
  succeeds(input.path, [&] { requireValid(readPoints(input.path)); });
  Mesh mesh;
  if (!succeeds(input.path, [&] { mesh = readMesh(input.path); })) return false;
  requireValid(mesh);
  diagnose(mesh);
  if (mesh.corners.size() > kMostCorners) return true;
  succeeds(input.path, [&] { apps::describeFile(input.path); });
  writeAndReadBack(mesh, input.hash);
  runVerbs(input);
  return true;
}

}  // namespace nephele::fuzz
