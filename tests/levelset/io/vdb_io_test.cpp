#include "nephele/levelset/io/vdb_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <regex>

#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/shape/shapes.h"
#include "tests/support/full_disk.h"
#include "tests/support/message_of.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

using Class = VdbGridInfo::Class;

VdbGrid ballGrid(double voxelSize) {
  return toVdb(meshToLevelSet(icosphere(1.0, 4), {.voxelSize = voxelSize}), {"surface", Class::levelSet});
}

/// A grid of 3 x 3 x 3 bricks: ramp in the middle brick, the constant `inner` in the one after it along x,
/// `outer` in the others.
BrickGrid smallGrid(float outer, float inner) {
  BrickGrid grid({}, {{-1, -1, -1}, {3, 3, 3}}, outer);
  grid.place({1, 0, 0}, grid.appendConstant(inner));
  const std::int32_t ramp = grid.appendConstant(outer);
  grid.place({0, 0, 0}, ramp);
  float* own = grid.brick(ramp);
  for (int z = 0; z < 8; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 8; ++x)
        own[((z + 1) * 11 + y + 1) * 11 + x + 1] = 0.01f * float(x + 10 * y + 100 * z + 1);
  grid.setRange(ramp, {std::min(outer, 0.01f), std::max(outer, 7.78f)});
  return grid;
}

void expectSameSamples(const BrickGrid& a, const BrickGrid& b) {
  const Vec3i low = min(a.firstBrick(), b.firstBrick()),
              high = max(a.firstBrick() + a.brickCount(), b.firstBrick() + b.brickCount());
  for (int z = low.z * 8 - 2; z < high.z * 8 + 2; ++z)
    for (int y = low.y * 8 - 2; y < high.y * 8 + 2; ++y)
      for (int x = low.x * 8 - 2; x < high.x * 8 + 2; ++x)
        ASSERT_EQ(a.at({x, y, z}), b.at({x, y, z})) << x << " " << y << " " << z;
}

TEST(VdbIo, LevelSetComesBackBitForBitThroughAFile) {
  const TemporaryFolder folder;
  const auto before = toBricks(meshToLevelSet(torusMesh(1.0, 0.4, 64, 32), {.voxelSize = 0.05}));
  EXPECT_GT(before->at({20, 0, 0}), 0.0f);  // In the tube: positive in code.
  writeVdbFile(folder.file("a.vdb"), {toVdb(*before, {"surface", Class::levelSet})}, {});
  const VdbGrid read = readScalarGrid(folder.file("a.vdb"), "surface");
  EXPECT_LT(valueRange(read).min, 0.0f);  // In the file: negative inside.
  EXPECT_FLOAT_EQ(describe(read).background, 0.15f);
  const auto after = toBricks(read);
  EXPECT_EQ(before->background(), after->background());
  expectSameSamples(*before, *after);
}

// Also what is random in files that OpenVDB writes: the identifier behind the first 21 bytes.
TEST(VdbIo, EqualGridsMakeEqualFiles) {
  const TemporaryFolder folder;
  const auto written = [&](const std::string& name, float inner) {
    writeVdbFile(folder.file(name), {toVdb(smallGrid(0, inner), {"density", Class::fogVolume})},
                 {{"creator", "test"}});
    return textOf(folder.file(name));
  };
  const std::string first = written("a.vdb", 0.5f), again = written("b.vdb", 0.5f);
  EXPECT_TRUE(first == again);
  const std::string identifier = first.substr(21, 36), other = written("c.vdb", 0.25f).substr(21, 36);
  EXPECT_TRUE(std::regex_match(identifier, std::regex("[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")))
      << identifier;
  EXPECT_NE(identifier, other);
  // Every byte of it follows from the contents.
  int same = 0;
  for (std::size_t i = 0; i != identifier.size(); ++i) same += identifier[i] == other[i];
  EXPECT_LT(same, 20) << identifier << ' ' << other;
}

TEST(VdbIo, BricksHoldTheirNeighboursBorderSamples) {
  // Every stored sample of every brick equals the grid's sample at its voxel.
  const auto grid = toBricks(meshToLevelSet(icosphere(1.0, 3), {.voxelSize = 0.08}));
  for (int bz = 0; bz < grid->brickCount().z; ++bz)
    for (int by = 0; by < grid->brickCount().y; ++by)
      for (int bx = 0; bx < grid->brickCount().x; ++bx) {
        const Vec3i b = grid->firstBrick() + Vec3i{bx, by, bz};
        const float* samples = grid->brick(grid->poolIndex(b));
        for (int z = 0; z < 11; ++z)
          for (int y = 0; y < 11; ++y)
            for (int x = 0; x < 11; ++x)
              ASSERT_EQ(samples[(z * 11 + y) * 11 + x],
                        grid->at({b.x * 8 + x - 1, b.y * 8 + y - 1, b.z * 8 + z - 1}));
      }
}

TEST(VdbIo, FogKeepsItsValuesAndItsConstantBricksAreTiles) {
  const TemporaryFolder folder;
  const BrickGrid bricks = smallGrid(0.0f, 2.5f);
  writeVdbFile(folder.file("fog.vdb"), {toVdb(bricks, {"density", Class::fogVolume})}, {});
  const VdbGrid read = readScalarGrid(folder.file("fog.vdb"));
  const VdbGridInfo info = describe(read);
  EXPECT_EQ(info.name, "density");
  EXPECT_EQ(info.gridClass, Class::fogVolume);
  EXPECT_EQ(info.background, 0.0f);
  EXPECT_EQ(info.activeVoxels, 1024u);  // 8^3 of the ramp, 8^3 of the tile.
  EXPECT_FLOAT_EQ(valueRange(read).max, 7.78f);
  expectSameSamples(bricks, *toBricks(read));
}

TEST(VdbIo, FogIsNeverNegativeInFiles) {
  BrickGrid bricks = smallGrid(0.0f, 1.0f);
  bricks.brick(2)[12 * 11 + 1] = -3.0f;
  const VdbGrid fog = toVdb(bricks, {"density", Class::fogVolume});
  EXPECT_GT(valueRange(fog).min, 0.0f);
  EXPECT_EQ(describe(fog).activeVoxels, 1023u);
}

TEST(VdbIo, LevelSetInteriorIsAnInactiveTileOfTheOtherSign) {
  const VdbGrid grid = ballGrid(0.02);
  const auto bricks = toBricks(grid);
  EXPECT_FLOAT_EQ(bricks->at({0, 0, 0}), 0.06f);
  EXPECT_FLOAT_EQ(bricks->at({100, 0, 0}), -0.06f);
  const VdbGrid again = toVdb(*bricks, {"surface", Class::levelSet});
  EXPECT_EQ(describe(again).activeVoxels, describe(grid).activeVoxels);
  EXPECT_LT(valueRange(again).max, 0.06f);
}

TEST(VdbIo, TransformsComeBack) {
  const TemporaryFolder folder;
  BrickGrid bricks = smallGrid(0.0f, 1.0f);
  for (const Mat3f& linear : {Mat3f::scaling(0.25f), Mat3f::rotation({1, 2, 3}, 0.7f) * Mat3f::scaling(0.5f),
                              Mat3f{{0.5f, 0.1f, 0.0f, 0.0f, 0.25f, 0.0f, -0.1f, 0.0f, 1.0f}}}) {
    bricks.setLattice(Lattice::of({linear, {3, -4, 5}}));
    writeVdbFile(folder.file("t.vdb"), {toVdb(bricks, {"density", Class::fogVolume})}, {});
    const VdbGrid read = readScalarGrid(folder.file("t.vdb"));
    const auto back = toBricks(read);
    for (int i = 0; i < 9; ++i)
      EXPECT_NEAR(back->indexToWorld().linear.m[std::size_t(i)], linear.m[std::size_t(i)], 1e-6f);
    EXPECT_NEAR(length(back->indexToWorld().translation - Vec3f(3, -4, 5)), 0.0f, 1e-6f);
    EXPECT_NEAR(back->voxelSize(), std::cbrt(determinant(linear)), 1e-6f);
    EXPECT_EQ(describe(read).uniform, linear == Mat3f::scaling(0.25f));
    const Vec3f p(1.5f, 2.5f, -3.5f);
    EXPECT_NEAR(length(back->worldToIndex()(back->indexToWorld()(p)) - p), 0.0f, 1e-5f);
  }
}

TEST(VdbIo, GridsFarFromTheOriginKeepTheirPlaceOrAreRefused) {
  // Beside 1e5, floats are 2^-7 apart: a voxel of 1 keeps its place, one of 0.01 would move by as much as
  // 2^-8, which is 0.39 of it. At 100, where floats are 2^-17 apart, it may stay.
  const TemporaryFolder folder;
  BrickGrid bricks = smallGrid(0.0f, 1.0f);
  const auto readAt = [&](float voxel, float x) {
    bricks.setLattice(Lattice::of({Mat3f::scaling(voxel), {x, 0, 0}}));
    writeVdbFile(folder.file("far.vdb"), {toVdb(bricks, {"density", Class::fogVolume})}, {});
    return toBricks(readScalarGrid(folder.file("far.vdb")));
  };
  EXPECT_EQ(readAt(1.0f, 1e5f)->indexToWorld()(Vec3f{3, 0, 0}).x, 100003.0f);
  EXPECT_NEAR(readAt(0.01f, 100.0f)->indexToWorld()(Vec3f{3, 0, 0}).x, 100.03f, 1e-5f);
  const std::string message = messageOf([&] { readAt(0.01f, 1e5f); });
  for (const char* part : {"'density'", "100000", "0.01"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(VdbIo, MetadataIsWrittenToEveryGrid) {
  const TemporaryFolder folder;
  const BrickGrid bricks = smallGrid(0.0f, 1.0f);
  writeVdbFile(
      folder.file("m.vdb"),
      {toVdb(bricks, {"density", Class::fogVolume}), toVdb(bricks, {"heat", Class::fogVolume, true})},
      {{"creator", "nephele"}, {"seed", "7"}});
  for (const VdbGrid& grid : readVdbFile(folder.file("m.vdb"))) {
    const VdbGridInfo info = describe(grid);
    EXPECT_EQ(info.metadata.at("creator"), "nephele");
    EXPECT_EQ(info.metadata.at("seed"), "7");
    EXPECT_EQ(info.metadata.at("class"), "fog volume");
    EXPECT_EQ(info.halfFloat, info.name == "heat");
  }
  EXPECT_THROW(writeVdbFile(folder.file("m.vdb"), {toVdb(bricks, {"a"}), toVdb(bricks, {"a"})}, {}), Error);
}

TEST(VdbIo, HalfFloatsRoundToElevenBits) {
  const TemporaryFolder folder;
  const BrickGrid bricks = smallGrid(0.0f, 1.0f);
  writeVdbFile(folder.file("h.vdb"), {toVdb(bricks, {"density", Class::fogVolume, true})}, {});
  const auto back = toBricks(readScalarGrid(folder.file("h.vdb")));
  EXPECT_NE(back->at({3, 4, 5}), bricks.at({3, 4, 5}));
  EXPECT_NEAR(back->at({3, 4, 5}), bricks.at({3, 4, 5}), bricks.at({3, 4, 5}) / 2048);
}

// IEEE half floats end at 65504 and are 2^-24 apart near zero.
TEST(VdbIo, RefusesValuesAndVoxelsThatFilesDoNotHold) {
  const TemporaryFolder folder;
  const std::string path = folder.file("h.vdb");
  const auto fog = [](float value, bool half) {
    return toVdb(smallGrid(0.0f, value), {"density", Class::fogVolume, half});
  };
  const float most = valueRange(fog(1.0f, false)).max;
  writeVdbFile(path, {fog(65504 / most * 0.999f, true)}, {});
  writeVdbFile(path, {fog(1e6f, false)}, {});
  const std::string tooLarge = messageOf([&] { writeVdbFile(path, {fog(1e6f, true)}, {}); });
  EXPECT_NE(tooLarge.find("h.vdb: the grid 'density' has values up to"), std::string::npos) << tooLarge;

  const auto voxels = [](float value) {
    VoxelGrid<Vec3f> grid("v", 1.0, Vec3f{});
    std::fill_n(grid.add({0, 0, 0}), kBrickSamples, Vec3f{0, value, 0});
    return toVdb(std::move(grid), {"v", Class::unknown, true});
  };
  writeVdbFile(path, {voxels(-65504)}, {});
  EXPECT_NE(messageOf([&] { writeVdbFile(path, {voxels(-1e5f)}, {}); }), "");

  const auto ball = [](float voxelSize, bool half) {
    return toVdb(
        *bakeGrid(sphere({0, 0, 0}, 4 * voxelSize), {.voxelSize = voxelSize,
                                                     .box = {{-8 * voxelSize, -8 * voxelSize, -8 * voxelSize},
                                                             {8 * voxelSize, 8 * voxelSize, 8 * voxelSize}},
                                                     .band = {-3 * voxelSize, 3 * voxelSize}}),
        {"surface", Class::levelSet, half});
  };
  writeVdbFile(path, {ball(1e-4f, true)}, {});
  writeVdbFile(path, {ball(1e-6f, false)}, {});
  writeVdbFile(path, {ball(2e-12f, false)}, {});
  const std::string tiny = messageOf([&] { writeVdbFile(path, {ball(5e-13f, false)}, {}); });
  EXPECT_NE(tiny.find("voxels of 5e-13, and files hold ones from 1e-12"), std::string::npos) << tiny;
  const std::string tooSmall = messageOf([&] { writeVdbFile(path, {ball(1e-6f, true)}, {}); });
  EXPECT_NE(tooSmall.find("distances up to"), std::string::npos) << tooSmall;
}

TEST(VdbIo, RefusesToMakeWhatFilesMustNotHold) {
  EXPECT_NE(messageOf([] {
              toVdb(smallGrid(1.0f, 2.0f), {"density", Class::fogVolume});
            }).find("background"),
            std::string::npos);
  EXPECT_NE(messageOf([] {
              toVdb(smallGrid(1.0f, 2.0f), {"surface", Class::levelSet});
            }).find("background"),
            std::string::npos);
  BrickGrid bad = smallGrid(0.0f, 1.0f);
  bad.brick(2)[12 * 11 + 3] = NAN;
  EXPECT_EQ(messageOf([&] {
              toVdb(bad, {"smoke\n2", Class::fogVolume});
            }),
            "grid 'smoke\\n2' holds values that are not finite");
}

TEST(VdbIo, RefusesMetadataWithoutAName) {
  const TemporaryFolder folder;
  const VdbGridLabel label{"density", Class::fogVolume, false, {{"", "1"}}};
  EXPECT_EQ(messageOf([&] { toVdb(smallGrid(0.0f, 1.0f), label); }), "grid 'density': metadata needs names");
  const std::string path = folder.file("a.vdb");
  const VdbGrid grid = toVdb(smallGrid(0.0f, 1.0f), {"density", Class::fogVolume});
  EXPECT_EQ(messageOf([&] { writeVdbFile(path, {grid}, {{"", "1"}}); }), path + ": metadata needs names");
  EXPECT_FALSE(std::filesystem::exists(path));
}

// As many bytes as a reader takes, docs/limits.md has the number, are written and read.
TEST(VdbIo, RefusesToWriteTextsThatAreTooLongToBeRead) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.vdb");
  const std::string most(std::size_t{64} << 20, 'x'), tooLong = most + 'x';
  const auto write = [&](const std::string& name, const std::string& key, const std::string& value) {
    return messageOf([&] {
      writeVdbFile(path, {toVdb(smallGrid(0.0f, 1.0f), {name, Class::fogVolume})}, {{key, value}});
    });
  };
  const std::string shown = "'" + std::string(77, 'x') + "...'",
                    size = "has 67108865 bytes, where 67108864 are the most";
  EXPECT_EQ(write("a\n", "note\n", tooLong), path + ": grid 'a\\n': its metadata 'note\\n' " + size);
  EXPECT_EQ(write("a", tooLong, "1"), path + ": grid 'a': a name in its metadata, " + shown + ", " + size);
  EXPECT_EQ(write(tooLong, "note", "1"), path + ": grid " + shown + ": its name " + size);
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_EQ(write("a", "note", most), "no error");
  EXPECT_EQ(readVdbFile(path).size(), 1u);
}

TEST(VdbIo, RefusesTwoGridsOfOneNameInOneLine) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.vdb");
  const VdbGrid grid = toVdb(smallGrid(0.0f, 1.0f), {"smoke\n2", Class::fogVolume});
  EXPECT_EQ(messageOf([&] {
              writeVdbFile(path, {grid, grid}, {});
            }),
            path + ": two grids are called 'smoke\\n2'");
  EXPECT_EQ(messageOf([&] { requireWritable({grid, grid}); }), "two grids are called 'smoke\\n2'");
  EXPECT_FALSE(std::filesystem::exists(path));
}

struct KnownVolume {
  const char* file;
  const char* grid;
  const char* type;
  Class gridClass;
  std::uint64_t active;
  Vec3i size;
  float voxel, low, high;
};

TEST(VdbIo, ReadsVolumesMadeElsewhere) {
  // Counts as the test data's README measured them with other tools.
  const KnownVolume known[] = {
      {"bifrost_torus_fog.vdb",
       "voxel_fog_density",
       "float",
       Class::fogVolume,
       2450,
       {22, 9, 22},
       0.4032f,
       0.0268698f,
       100},
      {"blender_fluid_5_grids.vdb",
       "density",
       "float",
       Class::fogVolume,
       26912,
       {29, 29, 32},
       0.4209f,
       0,
       0.972656f},
      {"cube_levelset.vdb",
       "ls_cube",
       "float",
       Class::levelSet,
       1452218,
       {225, 225, 225},
       0.05f,
       -0.0999756f,
       0.141479f},
      {"dragon_small_fog.vdb",
       "density",
       "float",
       Class::fogVolume,
       19660,
       {70, 49, 31},
       0.1f,
       2.89331e-05f,
       1},
      {"half_spot_multi_grid.vdb",
       "distanceField",
       "float",
       Class::levelSet,
       684983,
       {130, 130, 41},
       0.08467f,
       -1.23f,
       0.507629f},
      {"smoke_double_fog.vdb", "density", "float", Class::fogVolume, 524288, {128, 64, 64}, 1, 0, 1},
      {"smoke_fog.vdb",
       "density",
       "float",
       Class::fogVolume,
       1049275,
       {111, 222, 112},
       0.4762f,
       1.00136e-05f,
       5.71484f},
      {"teapot_cloud.nvdb", "density", "float", Class::fogVolume, 1963736, {267, 134, 178}, 0.00767f, 0, 1},
      {"tiles_no_class.vdb", "temperature", "float", Class::unknown, 1000000, {100, 100, 100}, 1, 1, 1},
      {"wdas_cloud_sixteenth_fog.vdb",
       "density",
       "float",
       Class::fogVolume,
       415642,
       {126, 86, 154},
       3.333f,
       0,
       1},
  };
  for (const KnownVolume& k : known) {
    SCOPED_TRACE(k.file);
    const std::string path = sharedData(std::string("volumes/") + k.file);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const VdbGrid grid = readScalarGrid(path);
    const VdbGridInfo info = describe(grid);
    const VdbValueRange values = valueRange(grid);
    EXPECT_EQ(info.name, k.grid);
    EXPECT_EQ(info.type, k.type);
    EXPECT_EQ(info.gridClass, k.gridClass);
    EXPECT_EQ(info.activeVoxels, k.active);
    EXPECT_EQ(info.indexMax - info.indexMin + Vec3i(1, 1, 1), k.size);
    EXPECT_NEAR(info.voxelSize.x, k.voxel, 1e-4f * k.voxel + 5e-6f);
    const bool rangeIsKnown = std::string(k.file) != "teapot_cloud.nvdb";
    if (rangeIsKnown) {
      EXPECT_NEAR(values.min, k.low, 1e-5f);
      EXPECT_NEAR(values.max, k.high, 1e-4f);
    }
    // Bricks hold the same extremes: the sign turned for level sets.
    const auto bricks = toBricks(grid);
    const float sign = k.gridClass == Class::levelSet ? -1.0f : 1.0f;
    EXPECT_EQ(bricks->background(), sign * info.background);
    Interval range = Interval::of(bricks->background());
    for (const Interval& r : bricks->ranges()) range = range.hull(r);
    EXPECT_TRUE(range.contains(sign * values.min) && range.contains(sign * values.max));
  }
}

TEST(VdbIo, DescribesGridsThatHoldNoNumbers) {
  for (const auto& [file, grid, type, active] : {std::tuple{"sphere_colour_vec3.vdb", "Cd", "vec3s", 9047u},
                                                 {"sphere_points.vdb", "points", "ptdataidx32", 1178u},
                                                 {"velocity_vec3_tiles.vdb", "vel", "vec3s", 1000000u}}) {
    const std::string path = sharedData(std::string("volumes/") + file);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const VdbGridInfo info = describe(readVdbFile(path).at(0));
    EXPECT_EQ(info.name, grid);
    EXPECT_EQ(info.type, type);
    EXPECT_EQ(info.activeVoxels, active);
    const std::string message = messageOf([&] { readScalarGrid(path); });
    EXPECT_NE(message.find(path), std::string::npos) << message;
    EXPECT_NE(message.find(grid), std::string::npos) << message;
    EXPECT_NE(message.find(type), std::string::npos) << message;
  }
}

TEST(VdbIo, MissingNameListsTheGridsThatAreThere) {
  const std::string path = sharedData("volumes/blender_fluid_5_grids.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  EXPECT_EQ(readVdbFile(path).size(), 5u);
  EXPECT_EQ(describe(readScalarGrid(path, "flame")).name, "flame");
  const std::string message = messageOf([&] { readScalarGrid(path, "densty"); });
  for (const char* part : {"densty", "density", "flame", "shadow", "temperature", "velocity"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_NE(messageOf([&] { readScalarGrid(path, "velocity"); }).find("vec3s"), std::string::npos);
}

TEST(VdbIo, AnEmptyGridReadsAsBackground) {
  const std::string path = sharedData("volumes/empty_grid.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const VdbGrid grid = readScalarGrid(path);
  EXPECT_EQ(describe(grid).activeVoxels, 0u);
  const auto bricks = toBricks(grid);
  EXPECT_EQ(bricks->at({1, 2, 3}), 0.0f);
  EXPECT_EQ(bricks->table().size(), 0u);
}

TEST(VdbIo, BadFilesNameThemselvesAndWhatIsWrong) {
  for (const auto& [file, part] : {std::pair{"git_lfs_pointer.vdb", "Git LFS pointer"},
                                   {"truncated.vdb", "cut short"},
                                   {"truncated_reads_silently.vdb", "cut short"},
                                   {"old_version_0_28.nvdb", "0.0.28"}}) {
    const std::string path = sharedData(std::string("malformed/") + file);
    NEPHELE_REQUIRE_SHARED_DATA(path);
    const std::string message = messageOf([&] { readVdbFile(path); });
    EXPECT_EQ(message.find(path), 0u) << message;
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(VdbIo, FilesCutAnywhereAreRefused) {
  const TemporaryFolder folder;
  writeVdbFile(folder.file("whole.vdb"), {ballGrid(0.1)}, {});
  const std::string whole = textOf(folder.file("whole.vdb"));
  for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 97) {
    std::ofstream(folder.file("cut.vdb"), std::ios::binary) << whole.substr(0, length);
    EXPECT_THROW(readVdbFile(folder.file("cut.vdb")), Error) << length << " of " << whole.size();
  }
  EXPECT_THROW(readVdbFile(folder.file("missing.vdb")), Error);
  EXPECT_THROW(readVdbFile(folder.file("")), Error);
}

TEST(VdbIo, NanoVdbFilesCutAnywhereAreRefused) {
  const std::string path = sharedData("volumes/teapot_cloud.nvdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const TemporaryFolder folder;
  const std::string whole = textOf(path);
  for (const double share : {0.0, 1e-5, 5e-5, 1.3e-4, 2e-4, 0.3, 0.999}) {
    std::ofstream(folder.file("cut.nvdb"), std::ios::binary)
        << whole.substr(0, std::size_t(share * double(whole.size())));
    EXPECT_THROW(readVdbFile(folder.file("cut.nvdb")), Error) << share;
  }
}

TEST(VdbIo, AFullDiskLeavesAnErrorAndNoFile) {
  const TemporaryFolder folder;
  const VdbGrid grid = ballGrid(0.03);
  std::string message;
  {
    const FullDisk full(20000);
    message = messageOf([&] { writeVdbFile(folder.file("full.vdb"), {grid}, {}); });
  }
  EXPECT_NE(message.find("full.vdb"), std::string::npos) << message;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(VdbIo, AnUnwritableTargetIsNamed) {
  const VdbGrid grid = toVdb(smallGrid(0.0f, 1.0f), {"density", Class::fogVolume});
  const std::string message = messageOf([&] { writeVdbFile("/no/such/folder/a.vdb", {grid}, {}); });
  EXPECT_NE(message.find("/no/such/folder"), std::string::npos) << message;
}

}  // namespace
}  // namespace nephele::test
