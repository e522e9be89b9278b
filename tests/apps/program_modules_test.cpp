// OpenVDB, and what serves pages, are loaded only where they are needed. Expected: what the dynamic linker
// says of the program, and what a program does whose modules are where an installation has them, or nowhere.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

namespace fs = std::filesystem;

const fs::path kModules = fs::path(programPath()).parent_path(), kModule = kModules / "nephele-openvdb.so";

class ProgramModules : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kModule)) GTEST_SKIP() << "the program is linked with all libraries";
  }

  // The result of a copy of the program in a folder.
  static ProgramResult run(const std::string& program, const std::string& arguments) {
    if (!fs::exists(program)) fs::copy_file(programPath(), program);
    return runProgram(arguments, "run() { shift; '" + program + "' \"$@\"; }; run");
  }

  TemporaryFolder folder_;
  const std::string mesh_ = ownData("data/sphere_uv.obj"), levels_ = folder_.file("levels.vdb");
};

TEST_F(ProgramModules, AreNotLoadedAtTheStart) {
  const ProgramResult libraries = runProgram("", "LD_TRACE_LOADED_OBJECTS=1");
  EXPECT_NE(libraries.output.find("libtbb"), std::string::npos) << libraries.output;
  for (const char* library : {"openvdb", "httplib", "libssl"})
    EXPECT_EQ(libraries.output.find(library), std::string::npos) << libraries.output;
}

TEST_F(ProgramModules, AreNeededForVolumesAndPagesAlone) {
  const std::string alone = folder_.file("nephele");
  EXPECT_EQ(run(alone, "--version").exitCode, 0);
  EXPECT_EQ(run(alone, "info '" + mesh_ + "'").exitCode, 0);
  const ProgramResult failed = run(alone, "levelset '" + mesh_ + "' --resolution 16 -o '" + levels_ + "'");
  EXPECT_EQ(failed.exitCode, 1);
  EXPECT_NE(failed.errors.find("the part of the program that knows VDB cannot be loaded, install it again"),
            std::string::npos)
      << failed.errors;
  EXPECT_NE(failed.errors.find("nephele-openvdb.so"), std::string::npos) << failed.errors;
  const ProgramResult served = run(alone, "look --no-browser");
  EXPECT_EQ(served.exitCode, 1);
  EXPECT_NE(served.errors.find(
                "the part of the program that knows how to serve pages cannot be loaded, install it again"),
            std::string::npos)
      << served.errors;
  EXPECT_EQ(folder_.entryCount(), 1u);
}

TEST_F(ProgramModules, AreFoundBesideTheProgramAndThroughLinksToIt) {
  fs::create_directories(folder_.file("bin"));
  fs::copy_file(kModule, folder_.file("bin/nephele-openvdb.so"));
  const std::string there = folder_.file("bin/nephele");
  EXPECT_EQ(run(there, "levelset '" + mesh_ + "' --resolution 16 -o '" + levels_ + "'").exitCode, 0);
  fs::create_symlink(there, folder_.file("link"));
  EXPECT_EQ(run(folder_.file("link"), "info '" + levels_ + "'").exitCode, 0);
}

TEST_F(ProgramModules, OfAnotherVersionAreRefused) {
  const auto refused = [&](const std::string& name, const std::string& arguments) {
    std::string module = textOf((kModules / (name + ".so")).string());
    const std::size_t version = module.find(name + " ");
    EXPECT_NE(version, std::string::npos);
    module[version + name.size() + 1] = '9';
    std::ofstream(folder_.file(name + ".so"), std::ios::binary) << module;
    const ProgramResult failed = run(folder_.file("nephele"), arguments);
    EXPECT_EQ(failed.exitCode, 1);
    return failed.errors;
  };
  const std::string levels =
      refused("nephele-openvdb", "levelset '" + mesh_ + "' --resolution 16 -o '" + levels_ + "'");
  EXPECT_NE(levels.find("the part of the program that knows VDB is another version's, install it again"),
            std::string::npos)
      << levels;
  const std::string page = refused("nephele-look", "look --no-browser");
  EXPECT_NE(
      page.find(
          "the part of the program that knows how to serve pages is another version's, install it again"),
      std::string::npos)
      << page;
}

}  // namespace
}  // namespace nephele::test
