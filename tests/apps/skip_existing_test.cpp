// What --skip-existing keeps and what it makes again, through the program.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/view_config.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

class SkipExisting : public testing::Test {
 protected:
  void SetUp() override { writeBall("ball.vdb", 1); }
  void writeBall(const std::string& name, float value) const {
    writeVdbFile(folder.file(name),
                 {toVdb(*ball(1, 0.1f, value), {"density", VdbGridInfo::Class::fogVolume})}, {});
  }
  // A letter for each call, s where it was skipped and m where it was made.
  std::string letters(const std::string& arguments, const std::string& before = {}) const {
    const ProgramResult result =
        runProgram(arguments + " --skip-existing --stats '" + folder.file("s.json") + "'", before);
    EXPECT_EQ(result.exitCode, 0) << arguments << '\n' << result.errors;
    if (result.exitCode != 0) return result.errors;
    const auto stats = nlohmann::json::parse(textOf(folder.file("s.json")));
    std::string text;
    for (const auto& call : stats[stats.contains("wedge") ? "wedge" : "frames"])
      text += call["skipped"] == true ? 's' : 'm';
    return text;
  }
  // Made by the first call, kept by the second, and made again by the third, after `change`.
  template <class Change>
  void expectFollows(const std::string& arguments, const Change& change) const {
    EXPECT_EQ(letters(arguments), "mm") << arguments;
    EXPECT_EQ(letters(arguments), "ss") << arguments;
    change();
    EXPECT_EQ(letters(arguments), "mm") << arguments;
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder.file(name)) << text;
  }

  TemporaryFolder folder;
};

TEST_F(SkipExisting, FollowsMasks) {
  const std::string mask = folder.file("mask.vdb"),
                    cloud = "cloud " + ownData("data/sphere_uv.obj") +
                            " --resolution 24 --layers 1 --noise-time 0 --frames 1-2 -o '" +
                            folder.file("c.##.vdb") + "' ";
  write("recipe.toml", "[[layer]]\namplitude = \"mask:" + mask + ":1%,3%\"\n");
  for (const std::string& options :
       {"--density 'mask:" + mask + ":0.1,1'", "--density '=mask(\"" + mask + "\")'",
        "--recipe '" + folder.file("recipe.toml") + "'"}) {
    writeBall("mask.vdb", 1);
    expectFollows(cloud + options, [&] { writeBall("mask.vdb", 0.5f); });
  }
}

TEST_F(SkipExisting, FollowsWhatScriptsImportAndRead) {
  writeBall("read.vdb", 1);
  write("inner.felt", "param float half = 0.5;\n");
  write("script.felt", "import \"inner.felt\";\nscalarfield density = half * readfield(\"" +
                           folder.file("read.vdb") + "\");\n");
  const std::string render = "render '" + folder.file("script.felt") + "' -o '" + folder.file("r.##.exr") +
                             "' --frames 1-2 --size 16x12 --samples 1";
  expectFollows(render, [&] { write("inner.felt", "param float half = 0.25;\n"); });
  EXPECT_EQ(letters(render), "ss");
  writeBall("read.vdb", 0.5f);
  EXPECT_EQ(letters(render), "mm");
}

TEST_F(SkipExisting, FollowsBuffersOfGltf) {
  const float points[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  const auto writeBuffer = [&](float scale) {
    std::ofstream file(folder.file("x.bin"), std::ios::binary);
    for (const float point : points) {
      const float value = scale * point;
      file.write(reinterpret_cast<const char*>(&value), sizeof value);
    }
  };
  writeBuffer(1);
  write("x.gltf", R"({"asset":{"version":"2.0"},"buffers":[{"uri":"x.bin","byteLength":36}],
    "bufferViews":[{"buffer":0,"byteLength":36}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}],"scenes":[{"nodes":[0]}]})");
  expectFollows("render '" + folder.file("ball.vdb") + "' --object '" + folder.file("x.gltf") + "' -o '" +
                    folder.file("r.##.exr") + "' --frames 1-2 --size 16x12 --samples 1",
                [&] { writeBuffer(2); });
}

// The matrix of the view Half, by the environment and by a table of one dimension.
TEST_F(SkipExisting, FollowsViewsOfConfigurations) {
  if (runProgram("render a.vdb -o a.exr --ocio-config none.ocio").errors.find("built without it") !=
      std::string::npos)
    GTEST_SKIP() << "no OpenColorIO";
  const std::string config = folder.file("config.ocio");
  const auto writeTable = [&](const std::string& last) {
    write("no_such_table.spi1d",
          "Version 1\nFrom 0.0 1.0\nLength 2\nComponents 1\n{\n    0.0\n    " + last + "\n}\n");
  };
  const std::string picture = "'" + folder.file("ball.vdb") + "' --size 16x12 --samples 1 --frames 1-2 -o '" +
                              folder.file("r.##.exr") + "' --preview '" + folder.file("r.##.png") +
                              "' --view-transform ";
  writeViewConfig(config);
  writeTable("1.0");
  const std::string half = "render " + picture + "Half", table = "render " + picture + "Broken",
                    other = folder.file("other.ocio");
  std::string text = textOf(config);
  text.replace(text.find("0.5"), 3, "0.6");
  write("other.ocio", text);
  EXPECT_EQ(letters(half, "OCIO=" + config), "mm");
  EXPECT_EQ(letters(half, "OCIO=" + config), "ss");
  EXPECT_EQ(letters(half, "OCIO=" + other), "mm");
  EXPECT_EQ(letters(table, "OCIO=" + config), "mm");
  EXPECT_EQ(letters(table, "OCIO=" + config), "ss");
  writeTable("0.5");
  EXPECT_EQ(letters(table, "OCIO=" + config), "mm");
  // Those of turntable are made again from the frames.
  const std::string turn = "turntable " + picture + "Half";
  const auto preview = [&](const std::string& of) {
    letters(turn, "OCIO=" + of);
    return textOf(folder.file("r.01.png"));
  };
  EXPECT_NE(preview(config), preview(other));
}

TEST_F(SkipExisting, MakesMeshesAgainThatWereCutOffBetweenLines) {
  const std::string mesh =
      "mesh '" + folder.file("ball.vdb") + "' -o '" + folder.file("m.vdb.obj") + "' --wedge faces=100,200";
  EXPECT_EQ(letters(mesh), "mm");
  EXPECT_EQ(letters(mesh), "ss");
  const std::string path = folder.file("m.vdb.faces_100.obj"), text = textOf(path);
  fs::resize_file(path, text.rfind("f "));
  EXPECT_EQ(letters(mesh), "ms");
  EXPECT_EQ(textOf(path), text);
}

TEST_F(SkipExisting, KeepsPieces) {
  // The slash is that of completed names.
  const std::string cut = "cut " + ownData("data/sphere_uv.obj") + " -o '" + folder.file("pieces/") +
                          "' --wedge random-planes=1,2";
  EXPECT_EQ(letters(cut), "mm");
  EXPECT_EQ(letters(cut), "ss");
  const fs::path one = folder.file("pieces.random-planes_1"), two = folder.file("pieces.random-planes_2");
  fs::remove(one / "pieces.obj");
  fs::resize_file(two / "piece_0001.obj", 100);
  EXPECT_EQ(letters(cut), "mm");
  EXPECT_EQ(letters(cut + " --kerf 1%"), "mm");
}

TEST_F(SkipExisting, KeepsShadowsOfNamedLights) {
  const std::string render = "render '" + folder.file("ball.vdb") + "' -o '" + folder.file("r.##.exr") +
                             "' --frames 1-2 --size 16x12 --samples 1 --sun key=90,38 --shadows deep "
                             "--write-deep-shadow 'key=" +
                             folder.file("s.##.exr") + "'";
  EXPECT_EQ(letters(render), "mm");
  EXPECT_EQ(letters(render), "ss");
}

}  // namespace
}  // namespace nephele::test
