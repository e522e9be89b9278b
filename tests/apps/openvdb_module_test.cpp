// OpenVDB is loaded only where it is needed. Expected: what the dynamic linker says of the program, and what
// a program does whose module is where an installation has it, or nowhere.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

const fs::path kModule = fs::path(programPath()).parent_path() / "nephele-openvdb.so";

class OpenVdbModule : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kModule)) GTEST_SKIP() << "the program is linked with OpenVDB";
  }

  // The result of a copy of the program in a folder.
  static ProgramResult run(const std::string& program, const std::string& arguments) {
    if (!fs::exists(program)) fs::copy_file(programPath(), program);
    return runProgram(arguments, "run() { shift; '" + program + "' \"$@\"; }; run");
  }

  TemporaryFolder folder_;
  const std::string mesh_ = ownData("data/sphere_uv.obj"), levels_ = folder_.file("levels.vdb");
};

TEST_F(OpenVdbModule, IsNotLoadedAtTheStart) {
  const ProgramResult libraries = runProgram("", "LD_TRACE_LOADED_OBJECTS=1");
  EXPECT_NE(libraries.output.find("libtbb"), std::string::npos) << libraries.output;
  EXPECT_EQ(libraries.output.find("openvdb"), std::string::npos) << libraries.output;
}

TEST_F(OpenVdbModule, IsNeededForVolumesAlone) {
  const std::string alone = folder_.file("nephele");
  EXPECT_EQ(run(alone, "--version").exitCode, 0);
  EXPECT_EQ(run(alone, "info '" + mesh_ + "'").exitCode, 0);
  const ProgramResult failed = run(alone, "levelset '" + mesh_ + "' --resolution 16 -o '" + levels_ + "'");
  EXPECT_EQ(failed.exitCode, 1);
  EXPECT_NE(failed.errors.find("the part of the program that knows VDB cannot be loaded, install it again"),
            std::string::npos)
      << failed.errors;
  EXPECT_NE(failed.errors.find("nephele-openvdb.so"), std::string::npos) << failed.errors;
  EXPECT_EQ(folder_.entryCount(), 1u);
}

TEST_F(OpenVdbModule, IsFoundBesideTheProgramAndThroughLinksToIt) {
  fs::create_directories(folder_.file("bin"));
  fs::copy_file(kModule, folder_.file("bin/nephele-openvdb.so"));
  const std::string there = folder_.file("bin/nephele");
  EXPECT_EQ(run(there, "levelset '" + mesh_ + "' --resolution 16 -o '" + levels_ + "'").exitCode, 0);
  fs::create_symlink(there, folder_.file("link"));
  EXPECT_EQ(run(folder_.file("link"), "info '" + levels_ + "'").exitCode, 0);
}

TEST_F(OpenVdbModule, OfAnotherVersionIsRefused) {
  const std::string stamp = "nephele-openvdb ";
  std::string module = textOf(kModule.string());
  const std::size_t version = module.find(stamp);
  ASSERT_NE(version, std::string::npos);
  module[version + stamp.size()] = '9';
  std::ofstream(folder_.file("nephele-openvdb.so"), std::ios::binary) << module;
  const ProgramResult failed =
      run(folder_.file("nephele"), "levelset '" + mesh_ + "' --resolution 16 -o '" + levels_ + "'");
  EXPECT_EQ(failed.exitCode, 1);
  EXPECT_NE(
      failed.errors.find("the part of the program that knows VDB is another version's, install it again"),
      std::string::npos)
      << failed.errors;
}

}  // namespace
}  // namespace nephele::test
