// Every verb that writes, on a disk that is full. A limit on the size of files stands in for it: both make a
// write end short, and the limit's signal must not end the program.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

struct Call {
  const char* name;
  /// IN stands for the folder of inputs, OUT for that of outputs.
  const char* arguments;
  std::vector<std::string> outputs;
};

const Call kCalls[] = {
    {"Levelset", "levelset IN/ball.obj -o OUT/a.vdb --resolution 24", {"a.vdb"}},
    {"Cloud",
     "cloud IN/ball.obj -o OUT/a.vdb --resolution 24 --layers 1 --surface OUT/b.vdb --shape-mesh OUT/c.ply",
     {"a.vdb", "b.vdb", "c.ply"}},
    {"Mesh", "mesh IN/ball.vdb -o OUT/a.obj", {"a.obj"}},
    {"Cut", "cut IN/ball.obj -o OUT/pieces --random-planes 2 --preview OUT/a.png --size 64x48", {"a.png"}},
    {"Transfer",
     "transfer --from IN/ball.obj --to IN/ball.obj -o OUT/a.obj --method closest --align none "
     "--preview OUT/b.png --size 64x48",
     {"a.obj", "b.png"}},
    {"Render",
     "render IN/cloud.vdb -o OUT/a.exr --deep OUT/b.exr --preview OUT/c.png --size 64x48 --octaves 1",
     {"a.exr", "b.exr", "c.png"}},
    {"Turntable",
     "turntable IN/cloud.vdb -o OUT/a.#.exr --frames 1-2 --contact-sheet OUT/c.png --size 64x48 --octaves 1",
     {"a.1.exr", "a.2.exr", "c.png"}},
    {"Advect",
     "advect IN/cloud.vdb -o OUT/a.vdb --map OUT/b.vdb --velocity curl:amplitude=1%,frequency=2x",
     {"a.vdb", "b.vdb"}},
    {"Wisps", "wisps -o OUT/a.vdb --resolution 24 --dots 200 --points OUT/b.ply", {"a.vdb", "b.ply"}},
    {"Statistics", "info IN/ball.obj --stats OUT/a.json", {"a.json"}},
};

class FullDiskVerbs : public ::testing::TestWithParam<Call> {};

TEST_P(FullDiskVerbs, EndInOneLineAndLeaveTheEarlierFiles) {
  const TemporaryFolder in;
  std::filesystem::copy_file(ownData("data/sphere_uv.obj"), in.file("ball.obj"));
  ASSERT_EQ(runProgram("levelset " + in.file("ball.obj") + " -o " + in.file("ball.vdb") + " --resolution 24")
                .exitCode,
            0);
  ASSERT_EQ(runProgram("cloud " + in.file("ball.obj") + " -o " + in.file("cloud.vdb") +
                       " --resolution 24 --layers 1 --frequency 2x")
                .exitCode,
            0);
  // Blocks of 512 bytes: the message, which goes to a file, needs one.
  for (const int blocks : {1, 6}) {
    if (blocks > 1 && std::string(GetParam().name) == "Statistics") continue;  // there are less
    const TemporaryFolder out;
    for (const std::string& name : GetParam().outputs) std::ofstream(out.file(name)) << "earlier";
    std::string arguments = GetParam().arguments;
    for (const auto& [word, folder] : {std::pair{std::string("IN/"), &in}, {"OUT/", &out}})
      for (std::size_t at; (at = arguments.find(word)) != std::string::npos;)
        arguments.replace(at, word.size(), folder->file(""));
    const ProgramResult result =
        runProgram(arguments + " --quiet", "ulimit -f " + std::to_string(blocks) + ";");
    EXPECT_EQ(result.exitCode, 1) << blocks << ": " << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_NE(result.errors.find("error: "), std::string::npos) << result.errors;
    EXPECT_TRUE(result.errors.find("too large") != std::string::npos ||
                result.errors.find("the disk may be full") != std::string::npos)
        << result.errors;
    for (const std::string& name : GetParam().outputs) {
      const std::string text = textOf(out.file(name));
      // What came first may be there, whole; the limit is below the size of most.
      EXPECT_TRUE(text == "earlier" || (text.size() <= std::size_t(512 * blocks) && blocks > 1)) << name;
    }
    EXPECT_EQ(out.entryCount(), GetParam().outputs.size()) << "a temporary file, or half of a folder";
  }
}

INSTANTIATE_TEST_SUITE_P(All, FullDiskVerbs, ::testing::ValuesIn(kCalls),
                         [](const auto& call) { return std::string(call.param.name); });

}  // namespace
}  // namespace nephele::test
