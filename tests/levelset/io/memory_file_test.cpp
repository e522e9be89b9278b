#include "nephele/levelset/io/memory_file.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

TEST(MemoryFile, StandsForAMeshThatIsRead) {
  const auto mesh = std::make_shared<const Mesh>(icosphere(1, 1));
  const MemoryFile file("ball", ".ply", mesh);
  EXPECT_TRUE(isMeshFile(file.path()));
  EXPECT_EQ(readMesh(file.path()).positions, mesh->positions);
  EXPECT_THROW(readVdbFile(file.path()), Error);
}

TEST(MemoryFile, KeepsWhatIsWrittenAndMakesNoFile) {
  const Mesh mesh = icosphere(1, 1);
  MemoryFile file("ball", ".ply");
  writeMesh(file.path(), mesh);
  EXPECT_FALSE(std::filesystem::exists(file.path()));
  EXPECT_EQ(readMesh(file.path()).corners, mesh.corners);

  const auto grid =
      bakeGrid(sphere({0, 0, 0}, 1), {.voxelSize = 0.2f, .box = {{-1.5f, -1.5f, -1.5f}, {1.5f, 1.5f, 1.5f}}});
  MemoryFile volume("fog", ".vdb");
  writeVdbFile(volume.path(), {toVdb(*grid, {.name = "density"})}, {{"creator", "test"}});
  const VdbGrid read = readScalarGrid(volume.path(), "density");
  EXPECT_EQ(metadataOf(read, "creator"), "test");
  EXPECT_EQ(toBricks(read)->at({1, 2, 3}), grid->at({1, 2, 3}));
  EXPECT_THROW(readScalarGrid(volume.path(), "v"), Error);
}

TEST(MemoryFile, AsksForContentsOnlyWhereTheyArePut) {
  int asked = 0;
  const auto make = [&] { return ++asked; };
  EXPECT_FALSE(MemoryFile::put("ball.ply", make));
  EXPECT_EQ(asked, 0);
  const MemoryFile file("ball", ".ply");
  EXPECT_TRUE(MemoryFile::put(file.path(), make));
  EXPECT_EQ(*MemoryFile::contentOf<int>(file.path()), 1);
}

TEST(MemoryFile, HasAPathOfItsOwnAsLongAsItLives) {
  std::string path;
  {
    const MemoryFile a("ball", ".ply"), b("ball", ".ply");
    EXPECT_NE(a.path(), b.path());
    path = a.path();
    EXPECT_EQ(MemoryFile::find(path), &a);
    EXPECT_TRUE(isStream(path));
    EXPECT_THROW(readMesh(path), Error);
  }
  EXPECT_EQ(MemoryFile::find(path), nullptr);
  EXPECT_THROW(readMesh(path), Error);
}

}  // namespace
}  // namespace nephele::test
