// NanoVDB files made by NanoVDB's own builder, whole and damaged.
#define NANOVDB_USE_ZIP
#define NANOVDB_USE_BLOSC
#include <gtest/gtest.h>
#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>

#include <random>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

using nanovdb::io::Codec;

/// A ball of 40 voxels across, in several nodes.
nanovdb::GridHandle<> ball() {
  nanovdb::GridBuilder<float> builder(0.0f, nanovdb::GridClass::FogVolume);
  auto values = builder.getAccessor();
  for (int z = -20; z < 20; ++z)
    for (int y = -20; y < 20; ++y)
      for (int x = -20; x < 20; ++x)
        if (x * x + y * y + z * z < 400) values.setValue({x, y, z}, 1.0f + 0.01f * float(x));
  return builder.getHandle<>(0.1, {0.0, 0.0, 0.0}, "density");
}

class NanoVdb : public testing::Test {
 protected:
  std::string bytesOf(const nanovdb::GridHandle<>& grid, Codec codec) {
    nanovdb::io::writeGrid(folder_.file("whole.nvdb"), grid, codec);
    return textOf(folder_.file("whole.nvdb"));
  }
  std::string errorOf(const std::string& bytes) {
    std::ofstream(folder_.file("a.nvdb"), std::ios::binary) << bytes;
    try {
      describe(readScalarGrid(folder_.file("a.nvdb")));
    } catch (const Error& e) {
      return e.what();
    }
    return "no error";
  }

  TemporaryFolder folder_;
};

TEST_F(NanoVdb, IsTheSameInEveryCompression) {
  const auto grid = ball();
  for (const Codec codec : {Codec::NONE, Codec::ZIP, Codec::BLOSC}) {
    nanovdb::io::writeGrid(folder_.file("a.nvdb"), grid, codec);
    const auto bricks = toBricks(readScalarGrid(folder_.file("a.nvdb"), "density"));
    for (const Vec3i v : {Vec3i{0, 0, 0}, Vec3i{-19, 0, 0}, Vec3i{7, -8, 9}, Vec3i{25, 0, 0}}) {
      const bool inside = v.x * v.x + v.y * v.y + v.z * v.z < 400;
      EXPECT_EQ(bricks->at(v), inside ? 1.0f + 0.01f * float(v.x) : 0.0f);
    }
  }
}

TEST_F(NanoVdb, ValuesThatAreNotFiniteAreCounted) {
  nanovdb::GridBuilder<float> builder(0.0f, nanovdb::GridClass::FogVolume);
  auto values = builder.getAccessor();
  values.setValue({0, 0, 0}, 1.0f);
  values.setValue({1, 0, 0}, 3.0f);
  values.setValue({2, 0, 0}, std::numeric_limits<float>::quiet_NaN());
  values.setValue({3, 0, 0}, -std::numeric_limits<float>::infinity());
  nanovdb::io::writeGrid(folder_.file("a.nvdb"), builder.getHandle<>(0.1, {0.0, 0.0, 0.0}, "density"),
                         Codec::NONE);
  const VdbGrid grid = readScalarGrid(folder_.file("a.nvdb"));
  EXPECT_EQ(describe(grid).activeVoxels, 4u);
  const VdbValueRange range = valueRange(grid);
  EXPECT_EQ(range.notFinite, 2u);
  EXPECT_EQ(range.min, 1.0f);
  EXPECT_EQ(range.max, 3.0f);
}

TEST_F(NanoVdb, AByteThatChangedInACompressedGridIsNoticed) {
  // zlib closes with a checksum of its own. The grid is the last thing in the file.
  const std::string whole = bytesOf(ball(), Codec::ZIP);
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    std::string damaged = whole;
    damaged[whole.size() - 1 - random() % 1000] ^= char(1 + random() % 255);
    EXPECT_NE(errorOf(damaged).find("grid 'density': damaged"), std::string::npos) << seed;
  }
}

TEST_F(NanoVdb, AWrongChecksumIsNoticed) {
  const auto grid = ball();
  auto* data = reinterpret_cast<nanovdb::GridData*>(
      grid.grid<float>() ? const_cast<std::uint8_t*>(grid.data()) : nullptr);
  ASSERT_NE(data, nullptr);
  data->mVoxelSize[0] = 0.2;
  EXPECT_NE(errorOf(bytesOf(grid, Codec::NONE)).find("damaged: its checksum is wrong"), std::string::npos);
}

TEST_F(NanoVdb, AnyBytesAreAnErrorOrOtherValuesButNothingWorse) {
  for (const Codec codec : {Codec::NONE, Codec::BLOSC}) {
    const std::string whole = bytesOf(ball(), codec);
    int refused = 0;
    for (unsigned seed = 0; seed < 150; ++seed) {
      std::mt19937 random(seed);
      std::string damaged = whole;
      for (int k = 0; k < 3; ++k)
        damaged[random() % std::min<std::size_t>(whole.size(), seed % 2 ? 2000 : 500000)] = char(random());
      const std::string message = errorOf(damaged);
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
      refused += message != "no error";
    }
    EXPECT_GT(refused, 70);
  }
}

TEST_F(NanoVdb, NodesWithTwoParentsAreRefused) {
  const auto grid = ball();
  auto* tree = const_cast<nanovdb::FloatTree*>(&grid.grid<float>()->tree());
  ASSERT_GT(tree->nodeCount(1), 0u);
  auto* lower = tree->getFirstNode<1>();
  std::uint32_t first = 0;
  while (!lower->childMask().isOn(first)) ++first;
  std::uint32_t second = first + 1;
  while (!lower->childMask().isOn(second)) ++second;
  lower->data()->mTable[second].child = lower->data()->mTable[first].child;
  EXPECT_NE(errorOf(bytesOf(grid, Codec::NONE)).find("damaged: a node is not where its parent says"),
            std::string::npos);
}

TEST_F(NanoVdb, TypesThatDoNotExistAreRefused) {
  std::string whole = bytesOf(ball(), Codec::NONE);
  const std::uint32_t type = 0x3f3f3f3f;
  // In the table of contents, and in the grid itself.
  std::string inTable = whole;
  std::memcpy(inTable.data() + sizeof(nanovdb::io::Header) + offsetof(nanovdb::io::MetaData, gridType), &type,
              sizeof(type));
  EXPECT_NE(errorOf(inTable).find("type 1061109567"), std::string::npos);
  const std::size_t grid = whole.size() - ball().size();
  std::memcpy(whole.data() + grid + offsetof(nanovdb::GridData, mGridType), &type, sizeof(type));
  EXPECT_NE(errorOf(whole).find("type 1061109567"), std::string::npos);
}

}  // namespace
}  // namespace nephele::test
