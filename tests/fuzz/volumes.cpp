#include <fmt/format.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <filesystem>

#include "nephele/levelset/grid/grid_field.h"
#include "nephele/levelset/io/detail/openvdb_grid.h"
#include "nephele/levelset/io/vdb_io.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"

namespace nephele::fuzz {
namespace {

/// A tile stands for many voxels in a few bytes; grids of more are looked at but not turned into bricks.
constexpr std::uint64_t kMostVoxels = 1 << 18;

void sample(const ScalarField& field, const Box& box) {
  const Vec3f middle = box.isEmpty() ? Vec3f{} : box.center();
  for (const Vec3f& point : {middle, Vec3f{}, Vec3f{1e30f, -1e30f, 0}, box.min, box.max}) field(point);
  field.range(box);
}

/// Around all leaves and tiles that are not background, as far as bricks are made of them.
template <class Grid>
openvdb::CoordBBox boxOf(const openvdb::GridBase& base) {
  openvdb::CoordBBox box;
  if (!base.isType<Grid>()) return box;
  const auto& grid = static_cast<const Grid&>(base);
  for (auto leaf = grid.tree().cbeginLeaf(); leaf; ++leaf) box.expand(leaf->getNodeBoundingBox());
  auto tile = grid.tree().cbeginValueAll();
  tile.setMaxDepth(tile.getLeafDepth() - 1);
  for (; tile; ++tile)
    if (*tile != grid.background()) {
      openvdb::CoordBBox part;
      tile.getBoundingBox(part);
      box.expand(part);
    }
  return box;
}

/// Verbs walk through the bricks of the box between voxels, however few they are.
bool isSmall(const VdbGrid& grid) {
  constexpr double kMostBricks = 1 << 16;
  const openvdb::GridBase& base = *grid.impl().grid;
  openvdb::CoordBBox box = base.evalActiveVoxelBoundingBox();
  for (const openvdb::CoordBBox& part : {boxOf<openvdb::FloatGrid>(base), boxOf<openvdb::DoubleGrid>(base)})
    if (!part.empty()) box.expand(part);
  if (box.empty()) return true;
  double bricks = 1;
  for (int axis = 0; axis < 3; ++axis) bricks *= (double(box.max()[axis]) - box.min()[axis]) / kBrickSide + 2;
  return base.memUsage() < (1 << 24) && bricks <= kMostBricks;
}

void useGrid(const VdbGrid& grid) {
  const VdbGridInfo info = describe(grid);
  expect(info.indexMin.x <= info.indexMax.x || info.activeVoxels == 0, "active voxels without a box");
  if (info.activeVoxels > kMostVoxels || !isSmall(grid)) return;
  if (valuesOf(grid) == VdbValues::scalar)
    succeeds("", [&] { sample(gridField(toBricks(grid)), contentBox(grid)); });
  if (valuesOf(grid) == VdbValues::vector) {
    succeeds("", [&] {
      for (const VdbGrid& component : vectorComponents(grid)) toBricks(component);
    });
    succeeds("", [&] { toVectorVoxels(grid); });
  }
}

/// What is written is read again as it was.
void writeAndReadBack(const std::vector<VdbGrid>& grids) {
  const std::string path = scratchPath("again.vdb");
  std::filesystem::remove(path);
  if (!succeeds(path, [&] { writeVdbFile(path, grids, {{"creator", "fuzz"}}); })) return;
  std::vector<VdbGrid> back;
  expect(succeeds(path, [&] { back = readVdbFile(path); }),
         "a volume that was written cannot be read: " + lastError());
  expect(back.size() == grids.size(), "a volume that was written has another number of grids");
  for (std::size_t i = 0; i < grids.size(); ++i) {
    const VdbGridInfo before = describe(grids[i]), after = describe(back[i]);
    const std::uint64_t notFinite = valueRange(grids[i]).notFinite,
                        notFiniteAfter = valueRange(back[i]).notFinite;
    expect(
        before.type == after.type && before.activeVoxels == after.activeVoxels &&
            notFinite == notFiniteAfter && before.indexMin.x == after.indexMin.x &&
            before.indexMax.z == after.indexMax.z,
        fmt::format(
            "grid {} of {} is read as another than was written: {} of {} active voxels, {} of {} not finite",
            i, before.type, after.activeVoxels, before.activeVoxels, notFiniteAfter, notFinite));
  }
}

void runVerbs(const Input& input) {
  const std::string &path = input.path, volume = scratchPath("out.vdb"), mesh = scratchPath("out.obj");
  switch (input.hash % 11) {
    case 0:
      runVerb({"mesh", path, "-o", mesh}, path);
      break;
    case 1:
      runVerb({"mesh", path, "-o", mesh, "--adaptivity", "0.5"}, path);
      break;
    case 2:
      runRender({path}, path);
      break;
    case 3:
      runRender({ballFog(), path, "--integrator", "path"}, path);
      break;
    case 4:
      if (input.hash / 10 % 2 == 0)
        runVerb({"cloud", path, "-o", volume, "--resolution", "10", "--layers", "1"}, path);
      else
        runVerb({"levelset", ballLevelSet(), path, "-o", volume, "--voxel-size", "0.1"}, path);
      break;
    case 5:
      runVerb({"advect", path, "-o", volume, "--velocity", "curl:amplitude=2%"}, path);
      break;
    case 6:
      runVerb({"advect", ballFog(), "-o", volume, "--velocity", path}, path);
      break;
    case 7: {
      const std::string folder = scratchPath("pieces");
      runVerb({"cut", path, "-o", folder, "--random-planes", "1"}, path);
      std::filesystem::remove_all(folder);
      break;
    }
    case 8:
      runRender({ballFog(), "--object", path}, path);
      break;
    case 9:
      runVerb({"transform", path, "-o", volume, "--to-up-axis", "z", "--unit",
               input.hash / 11 % 2 == 0 ? "mm" : "ft", "--scale", input.hash / 11 % 5 == 0 ? "1e9" : "0.5",
               "--rotate", "10,20,30", "--place", "centre"},
              path);
      break;
    default:
      runVerb({"cloud", ballMesh(), "-o", volume, "--resolution", "10", "--layers", "1", "--billow",
               "mask:" + path + ":0.1,1"},
              "");
  }
}

}  // namespace

bool useVolume(const Input& input) {
  succeeds(input.path, [&] { readVdbHeaders(input.path); });
  runVerb({"info", input.path}, input.path);
  std::vector<VdbGrid> grids;
  if (!succeeds(input.path, [&] { grids = readVdbFile(input.path); })) return false;
  for (const VdbGrid& grid : grids) useGrid(grid);
  if (!std::ranges::all_of(grids, isSmall)) return true;
  writeAndReadBack(grids);
  runVerbs(input);
  return true;
}

}  // namespace nephele::fuzz
