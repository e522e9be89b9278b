// A picture for the screen as the only output, through the program.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/support/test_meshes.h"

namespace nephele::test {
namespace {

class PreviewAlone : public testing::Test {
 protected:
  /// Writes the file `name` into an empty folder, all that is then there, and with the other outputs the
  /// same.
  void expectSame(const std::string& name, const std::string& call, const std::string& others) {
    const TemporaryFolder alone, all;
    const ProgramResult one = runProgram(call + alone.file(name));
    ASSERT_EQ(one.exitCode, 0) << one.errors;
    EXPECT_NE(one.output.find(alone.file(name)), std::string::npos) << one.output;
    EXPECT_EQ(namesIn(alone), std::set<std::string>{name});
    std::string rest = others;
    for (std::size_t at = 0; (at = rest.find("@", at)) != std::string::npos;)
      rest.replace(at, 1, all.file(""));
    const ProgramResult other = runProgram(call + all.file(name) + rest);
    ASSERT_EQ(other.exitCode, 0) << other.errors;
    EXPECT_GT(namesIn(all).size(), 1u);
    const Image a = readImage(alone.file(name)), b = readImage(all.file(name));
    ASSERT_EQ(a.width, b.width);
    for (const char* c : {"R", "G", "B"}) EXPECT_EQ(a.channel(c).values, b.channel(c).values) << c;
  }
  void expectRefused(const std::string& call, const std::string& names) {
    const ProgramResult result = runProgram(call);
    EXPECT_EQ(result.exitCode, 2) << call;
    EXPECT_NE(result.errors.find("one of " + names + " is required"), std::string::npos) << result.errors;
  }
  static std::set<std::string> namesIn(const TemporaryFolder& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.file("")))
      names.insert(entry.path().filename());
    return names;
  }
  std::string fog() const {
    writeVdbFile(folder_.file("fog.vdb"),
                 {toVdb(*ball(1.0f, 0.1f), {"density", VdbGridInfo::Class::fogVolume})}, {});
    return folder_.file("fog.vdb");
  }
  std::string box() const {
    writeMesh(folder_.file("box.obj"), boxMesh({-1, -1, -1}, {1, 1, 1}));
    return folder_.file("box.obj");
  }

  TemporaryFolder folder_;
};

TEST_F(PreviewAlone, OfADensityAndOfAMesh) {
  expectSame("p.png", "render " + fog() + " --size 32x24 --preview ", " -o @a.exr");
  expectSame("p.png", "render " + box() + " --size 32x24 --preview ", " -o @a.exr");
  expectRefused("render " + fog(), "--output, --preview, --deep");
}

TEST_F(PreviewAlone, OrTheDeepPictureAlone) {
  const TemporaryFolder alone;
  ASSERT_EQ(runProgram("render " + fog() + " --size 8x6 --deep " + alone.file("d.exr")).exitCode, 0);
  EXPECT_EQ(namesIn(alone), std::set<std::string>{"d.exr"});
  const ProgramResult shape = runProgram("render " + box() + " --size 8x6 --deep " + alone.file("e.exr"));
  EXPECT_EQ(shape.exitCode, 2);
  EXPECT_NE(shape.errors.find("--deep"), std::string::npos) << shape.errors;
}

// The movie and the sheet are of pixels as files would hold them.
TEST_F(PreviewAlone, OfATurn) {
  const std::string call = "turntable " + fog() + " --size 32x24 --samples 1 --frames 1-3 ";
  expectSame("s.png", call + "--contact-sheet ", " -o @f.####.exr");
  expectSame("s.png", call + "--threads 1 --contact-sheet ", " -o @f.####.exr");
  const TemporaryFolder previews;
  ASSERT_EQ(runProgram(call + "--preview " + previews.file("p.####.png")).exitCode, 0);
  EXPECT_EQ(namesIn(previews), (std::set<std::string>{"p.0001.png", "p.0002.png", "p.0003.png"}));
  expectRefused(call, "--output, --preview, --movie, --contact-sheet, --deep");
  const ProgramResult skipping =
      runProgram(call + "--skip-existing --contact-sheet " + previews.file("s.png"));
  EXPECT_EQ(skipping.exitCode, 2);
  EXPECT_NE(skipping.errors.find("--output"), std::string::npos) << skipping.errors;
}

TEST_F(PreviewAlone, OfATurnAsAMovie) {
  if (std::system("command -v ffmpeg >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "the package ffmpeg is not installed";
  const TemporaryFolder alone, all;
  const std::string call = "turntable " + fog() + " --size 32x24 --samples 1 --frames 1-3 --movie ";
  ASSERT_EQ(runProgram(call + alone.file("m.mp4")).exitCode, 0);
  EXPECT_EQ(namesIn(alone), std::set<std::string>{"m.mp4"});
  ASSERT_EQ(runProgram(call + all.file("m.mp4") + " -o " + all.file("f.####.exr")).exitCode, 0);
  EXPECT_EQ(textOf(alone.file("m.mp4")), textOf(all.file("m.mp4")));
}

TEST_F(PreviewAlone, OfPieces) {
  const std::string call = "cut " + box() + " --plane 0,0,0,0,1,0 --size 32x24 --preview ";
  expectSame("p.png", call, " -o @out");
  expectRefused("cut " + box() + " --plane 0,0,0,0,1,0", "--output, --preview");
  const ProgramResult levels = runProgram(call + folder_.file("p.png") + " --vdb");
  EXPECT_EQ(levels.exitCode, 2);
  EXPECT_NE(levels.errors.find("--output"), std::string::npos) << levels.errors;
}

TEST_F(PreviewAlone, OfATransfer) {
  const std::string call = "transfer --from " + ownData("data/sphere_uv.obj") + " --to " + box() +
                           " --method closest --quality fast ";
  expectSame("p.png", call + "--size 32x16 --preview ", " -o @a.obj");
  const TemporaryFolder alone;
  ASSERT_EQ(runProgram(call + "--resolution 16 --warp " + alone.file("w.vdb")).exitCode, 0);
  EXPECT_EQ(namesIn(alone), std::set<std::string>{"w.vdb"});
  expectRefused(call, "--output, --preview, --bake-texture, --warp, --warped-mesh");
}

TEST_F(PreviewAlone, OfAMeshThatIsMade) {
  expectSame("p.png", "mesh " + box() + " --subdivide 2 --size 32x24 --preview ", " -o @a.obj");
  expectRefused("mesh " + box(), "--output, --preview");
}

}  // namespace
}  // namespace nephele::test
