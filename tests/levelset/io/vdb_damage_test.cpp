// Files that say what cannot be: the layout is that of OpenVDB 10's readers (RootNode.h, InternalNode.h,
// Compression.h).
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_to_level_set.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

using Class = VdbGridInfo::Class;

class VdbDamage : public testing::Test {
 protected:
  VdbDamage() {
    const VdbGrid ball =
        toVdb(meshToLevelSet(icosphere(1.0, 4), {.voxelSize = 0.1}), {"surface", Class::levelSet});
    writeVdbFile(folder_.file("whole.vdb"), {ball}, {});
    whole_ = textOf(folder_.file("whole.vdb"));
  }

  /// What reading such a file says, or that it says nothing.
  std::string errorOf(const std::string& bytes) {
    std::ofstream(folder_.file("damaged.vdb"), std::ios::binary) << bytes;
    try {
      describe(readScalarGrid(folder_.file("damaged.vdb")));
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }

  template <class T>
  static std::string with(std::string bytes, std::size_t place, T value) {
    std::memcpy(bytes.data() + place, &value, sizeof(value));
    return bytes;
  }

  template <class T>
  T at(std::size_t place) const {
    T value;
    std::memcpy(&value, whole_.data() + place, sizeof(value));
    return value;
  }

  /// Where the tree begins: after the name of the transform and its five vectors of doubles.
  std::size_t tree() const {
    return whole_.find("UniformScaleMap") + std::strlen("UniformScaleMap") + 5 * 3 * 8;
  }
  /// The first of the root's children: after the count of buffers, the background and the counts of tiles and
  /// children.
  std::size_t firstChild() const {
    return tree() + 4 + 4 + 4 + 4 + at<std::uint32_t>(tree() + 8) * (12 + 4 + 1);
  }
  /// The block of values of the first child: after its origin, its two masks and what tells of inactive
  /// values.
  std::size_t firstBlock() const {
    constexpr std::size_t kMask = 4096;
    constexpr std::size_t kInactive[] = {0, 0, 4, kMask, kMask + 4, kMask + 8, 0};
    const std::size_t kind = firstChild() + 12 + 2 * kMask;
    return kind + 1 + kInactive[std::size_t(at<std::int8_t>(kind))];
  }

  TemporaryFolder folder_;
  std::string whole_;
};

TEST_F(VdbDamage, AnyBytesAreAnErrorOrOtherValuesButNothingWorse) {
  int refused = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    std::mt19937 random(seed);
    std::string damaged = whole_;
    // Half of them where names and lengths stand, half where nodes do.
    const std::size_t begin = seed % 2 ? tree() : 4;
    for (int k = 0; k < 3; ++k) damaged[begin + random() % (seed % 2 ? 12000 : tree())] = char(random());
    const std::string message = errorOf(damaged);
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    refused += message != "no error";
  }
  EXPECT_GT(refused, 150);
}

TEST_F(VdbDamage, TextsThatTheFileCannotHoldAreRefused) {
  // The first text after the magic number, versions and identifier is the name of a metadatum.
  const std::size_t creator = whole_.find("Tree_float_5_4_3") - 4;
  EXPECT_NE(errorOf(with(whole_, creator, 0xfffffff0u)).find("damaged: a text of 4294967280 bytes"),
            std::string::npos);
  const std::size_t metadata = whole_.find("class") - 4;
  EXPECT_NE(errorOf(with(whole_, metadata, 0x7fffffffu)).find("damaged: a text of 2147483647 bytes"),
            std::string::npos);
}

// A file may be as long as it says, and still hold nothing but a text. What follows is a hole of the file.
TEST_F(VdbDamage, TextsOfHundredsOfMegabytesAreRefused) {
  const std::string path = folder_.file("long.vdb");
  constexpr std::uint32_t kSize = 300u << 20;
  const std::size_t name = whole_.find("class") - 4;
  // The value of `class`: after its name and its type, "string".
  for (const std::size_t place : {name, whole_.find("class") + 5 + 4 + 6}) {
    std::ofstream(path, std::ios::binary) << with(whole_, place, kSize);
    std::filesystem::resize_file(path, kSize + whole_.size());
    EXPECT_THROW(
        try { readVdbFile(path); } catch (const Error& error) {
          EXPECT_NE(std::string(error.what()).find("a text of 314572800 bytes, where 67108864 are the most"),
                    std::string::npos)
              << error.what();
          throw;
        },
        Error);
  }
}

TEST_F(VdbDamage, MetadataOfTheWrongSizeIsRefused) {
  const std::size_t value = whole_.find("file_voxel_count") + std::strlen("file_voxel_count") + 4 + 5;
  ASSERT_EQ(at<std::uint32_t>(value), 8u);
  EXPECT_NE(
      errorOf(with(whole_, value, 12u)).find("metadata 'file_voxel_count' of type int64 has 12 bytes, not 8"),
      std::string::npos);
}

TEST_F(VdbDamage, MetadataOfOpenVdbsOwnOfAnotherTypeIsRefused) {
  const std::size_t type = whole_.find("is_saved_as_half_float") + std::strlen("is_saved_as_half_float") + 4;
  ASSERT_EQ(whole_.substr(type, 4), "bool");
  EXPECT_NE(errorOf(with(whole_, type, '@')).find("metadata 'is_saved_as_half_float' is of type '@ool'"),
            std::string::npos);
}

TEST_F(VdbDamage, BlocksThatAreNotAsLongAsTheirNodeAreRefused) {
  const std::size_t block = firstBlock();
  const auto length = at<std::int64_t>(block);
  ASSERT_GT(length, 0) << "a compressed block";
  ASSERT_EQ(at<std::uint32_t>(block + 8 + 12), std::uint32_t(length)) << "of Blosc";
  EXPECT_NE(errorOf(with(whole_, block, std::int64_t(-65536))).find("damaged: a block of -65536 bytes"),
            std::string::npos);
  EXPECT_NE(errorOf(with(whole_, block, std::int64_t(1) << 40)).find("damaged: a block of"),
            std::string::npos);
  EXPECT_NE(
      errorOf(with(whole_, block, std::numeric_limits<std::int64_t>::min())).find("damaged: a block of"),
      std::string::npos);
  EXPECT_NE(errorOf(with(whole_, block + 8 + 12, std::uint32_t(length) + 16))
                .find("damaged: a compressed block claims"),
            std::string::npos);
  EXPECT_NE(errorOf(with(whole_, block + 8 + 4, 0xffffffffu)).find("damaged: a compressed block claims"),
            std::string::npos);
}

TEST_F(VdbDamage, TreesOfSeveralBuffersAreRefused) {
  EXPECT_NE(errorOf(with(whole_, tree(), 2)).find("damaged: a tree of 2 buffers"), std::string::npos);
}

TEST(VdbInstances, HaveTheValuesOfTheGridWhoseTreeTheyShare) {
  const std::string path = sharedData("attack/hand_vdb_instance.vdb");
  NEPHELE_REQUIRE_SHARED_DATA(path);
  const VdbGridInfo copy = describe(readScalarGrid(path, "copy"));
  EXPECT_EQ(copy.name, "copy");
  EXPECT_GT(copy.activeVoxels, 0u);
  std::uint64_t parents = 0;
  for (const VdbGrid& grid : readVdbFile(path)) parents += describe(grid).activeVoxels == copy.activeVoxels;
  EXPECT_EQ(parents, 2u);
}

// Points are described by what the file says of them; nothing here reads their values, so nothing can write
// them.
TEST_F(VdbDamage, GridsOfPointsAreDescribedButNotWritten) {
  const std::string type = "Tree_float_5_4_3", points = "Tree_ptdataidx32_5_4_3";
  const std::size_t name = whole_.find(type);
  ASSERT_NE(name, std::string::npos);
  // Behind the type stand the name of a parent, which is empty, and three places in the file, which all move.
  std::string bytes = with(whole_, name - 4, std::uint32_t(points.size()));
  const std::size_t longer = points.size() - type.size();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t place = name + type.size() + 4 + 8 * i;
    bytes = with(bytes, place, at<std::uint64_t>(place) + longer);
  }
  bytes.replace(name, type.size(), points);
  std::ofstream(folder_.file("points.vdb"), std::ios::binary) << bytes;

  const std::vector<VdbGrid> grids = readVdbFile(folder_.file("points.vdb"));
  ASSERT_EQ(grids.size(), 1u);
  EXPECT_EQ(describe(grids[0]).type, "ptdataidx32");
  EXPECT_EQ(describe(grids[0]).activeVoxels,
            describe(readScalarGrid(folder_.file("whole.vdb"))).activeVoxels);
  const std::string copy = folder_.file("copy.vdb");
  EXPECT_THROW(
      try { writeVdbFile(copy, grids, {}); } catch (const Error& e) {
        EXPECT_EQ(std::string(e.what()), copy + ": the grid 'surface' of ptdataidx32 cannot be written");
        throw;
      },
      Error);
  EXPECT_FALSE(std::filesystem::exists(copy));
}

TEST_F(VdbDamage, NodesThatOverlapAreRefused) {
  EXPECT_NE(errorOf(with(whole_, firstChild(), 1)).find("damaged: a node begins at voxel 1,"),
            std::string::npos);
  // A value where the first child of the node is.
  const std::size_t children = firstChild() + 12;
  std::size_t byte = 0;
  while (whole_[children + byte] == 0) ++byte;
  EXPECT_NE(
      errorOf(with(whole_, children + 4096 + byte, char(0xff))).find("damaged: a value is where a node is"),
      std::string::npos);
}

}  // namespace
}  // namespace nephele::test
