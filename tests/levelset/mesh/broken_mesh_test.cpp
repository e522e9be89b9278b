// Every family of functions that take a mesh refuses one that is not valid, in words. A mesh whose corners
// are out of range was read out of bounds before.
#include <gtest/gtest.h>

#include <functional>

#include "nephele/levelset/cloud/attribute_field.h"
#include "nephele/levelset/cloud/cloud.h"
#include "nephele/levelset/cut/cut.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/mesh/exact_distance.h"
#include "nephele/levelset/mesh/mass_properties.h"
#include "nephele/levelset/mesh/mesh_distance.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/levelset/mesh/nearest_on_mesh.h"
#include "nephele/levelset/warp/mesh_warp.h"
#include "nephele/levelset/warp/surface_relaxation.h"
#include "nephele/levelset/warp/transfer_attributes.h"
#include "nephele/levelset/warp/transfer_quality.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/run_program.h"
#include "tests/support/test_meshes.h"

namespace nephele {
namespace {

struct Entry {
  const char* name;
  std::function<void(const Mesh&)> call;
};

std::ostream& operator<<(std::ostream& stream, const Entry& entry) {
  return stream << entry.name;
}

const Mesh& whole() {
  static const Mesh mesh = test::icosphere(1.0, 1);
  return mesh;
}

class BrokenMesh : public ::testing::TestWithParam<Entry> {};

TEST_P(BrokenMesh, IsRefusedInWords) {
  Mesh outOfRange = whole();
  outOfRange.corners[7] = 1234567890;
  Mesh ofOtherSize = whole();
  ofOtherSize.attributes = {{"heat", MeshAttribute::Domain::vertex, 1, {1, 2, 3}}};
  for (const auto& [mesh, words] :
       {std::pair{outOfRange, "corner 7 is at position 1234567890, but there are 42 positions"},
        std::pair{ofOtherSize, "attribute 'heat' has 3 values for 42 positions, 1 each"}}) {
    try {
      GetParam().call(mesh);
      FAIL() << "no error";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, BrokenMesh,
    ::testing::Values(
        Entry{"diagnose", [](const Mesh& m) { diagnose(m); }},
        Entry{"countSelfIntersections", [](const Mesh& m) { countSelfIntersections(m); }},
        Entry{"solidVolume", [](const Mesh& m) { solidVolume(m); }},
        Entry{"repairMesh", [](const Mesh& m) { repairMesh(m); }},
        Entry{"massProperties", [](const Mesh& m) { massProperties(m); }},
        Entry{"exactDistance", [](const Mesh& m) { exactDistance(m); }},
        Entry{"closestPoint", [](const Mesh& m) { closestPoint(m); }},
        Entry{"meshDistance",
              [](const Mesh& m) {
                meshDistance(m, {.voxelSize = 0.1, .exteriorBand = 0.3, .interiorBand = 0.3});
              }},
        Entry{"meshToLevelSet", [](const Mesh& m) { meshToLevelSet(m, {.voxelSize = 0.1}); }},
        Entry{"estimateLevelSetBytes", [](const Mesh& m) { estimateLevelSetBytes(m, {.voxelSize = 0.1}); }},
        Entry{"writeMesh",
              [](const Mesh& m) {
                const test::TemporaryFolder folder;
                writeMesh(folder.file("mesh.ply"), m);
              }},
        Entry{"makeCloud", [](const Mesh& m) { makeCloud(m, {.layers = {{}}, .voxelSize = 0.1f}); }},
        Entry{"estimatedCloudBytes",
              [](const Mesh& m) { estimatedCloudBytes(m, {.layers = {}, .voxelSize = 0.1f}); }},
        Entry{"attributeField", [](const Mesh& m) { attributeField(m, "heat"); }},
        Entry{"facingField",
              [](const Mesh& m) {
                facingField(m, {0, 1, 0});
              }},
        Entry{"cutIntoMeshes",
              [](const Mesh& m) {
                cutIntoMeshes(m, {.planes = {{{}, {1, 0, 0}}}});
              }},
        Entry{"cutIntoMeshes_solid", [](const Mesh& m) { cutIntoMeshes(whole(), {.solids = {m}}); }},
        Entry{"warpMesh", [](const Mesh& m) { warpMesh(m, whole()); }},
        Entry{"warpMesh_object", [](const Mesh& m) { warpMesh(whole(), m); }},
        Entry{"transferAttributes", [](const Mesh& m) { transferAttributes(m, whole(), whole().positions); }},
        Entry{"transferQuality", [](const Mesh& m) { transferQuality(m, whole(), whole().positions); }},
        Entry{"SurfaceRelaxation", [](const Mesh& m) { SurfaceRelaxation(ExactDistance(whole()), m); }}),
    [](const auto& entry) { return std::string(entry.param.name); });

}  // namespace
}  // namespace nephele
