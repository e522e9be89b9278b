// Names of files that shells, terminals, formats and farms stumble over.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

std::string quoted(const std::string& argument) {
  std::string result = "'";
  for (const char c : argument) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

const std::string kNames[] = {"a b  c",       "line\nbreak", "it's \"quoted\"", "50% %s %d",   "#1",
                              "$F4 `x` $(y)", "caf\xe9",     "\xff\xfe",        "\u96f2",      "a\x1b[31mb",
                              "*?",           "{}{0}",       "a,b:c=d;e&f",     "back\\slash", "a\rb",
                              "..a"};

TEST(Names, AreKeptByInputsOutputsAndStatistics) {
  const TemporaryFolder folder;
  for (const std::string& name : kNames) {
    const auto file = [&](const std::string& rest) { return quoted(folder.file(name + rest)); };
    std::filesystem::copy_file(ownData("data/sphere_uv.obj"), folder.file(name + ".obj"));
    for (const std::string& arguments :
         {"levelset " + file(".obj") + " --resolution 12 -o " + file(".vdb") + " --progress alf",
          "mesh " + file(".vdb") + " -o " + file(".ply"),
          "cut " + file(".ply") + " --plane 0,0,0,0,1,0 -o " + file(".pieces"),
          "info " + file(".obj") + " " + file(".vdb") + " " + file(".ply")}) {
      const ProgramResult result = runProgram(arguments + " --stats " + file(".json"));
      EXPECT_EQ(result.exitCode, 0) << result.errors;
      EXPECT_NO_THROW(nlohmann::json::parse(textOf(folder.file(name + ".json")))) << arguments;
      for (const std::string& text : {result.output, result.errors})
        EXPECT_EQ(std::count_if(text.begin(), text.end(), [](char c) { return c == '\r' || c == '\x1b'; }), 0)
            << arguments;
    }
    EXPECT_TRUE(std::filesystem::exists(folder.file(name + ".pieces/pieces.json"))) << name;
    const ProgramResult missing = runProgram("info " + file(".none.obj"));
    EXPECT_EQ(std::count(missing.errors.begin(), missing.errors.end(), '\n'), 1) << missing.errors;
  }
}

TEST(Names, MayBeginWithADashBehindTwoDashes) {
  const TemporaryFolder folder;
  std::filesystem::copy_file(ownData("data/sphere_uv.obj"), folder.file("-v.obj"));
  std::filesystem::copy_file(ownData("data/sphere_uv.obj"), folder.file("--quiet"));
  const std::string there = "cd " + quoted(folder.file("")) + " &&";
  const ProgramResult converted = runProgram("levelset --resolution 12 -o -v.vdb -- -v.obj", there);
  EXPECT_EQ(converted.exitCode, 0) << converted.errors;
  EXPECT_TRUE(std::filesystem::exists(folder.file("-v.vdb")));
  const ProgramResult described = runProgram("info -- -v.obj -v.vdb --quiet", there);
  EXPECT_EQ(described.exitCode, 1) << "a file without extension is no mesh";
  EXPECT_NE(described.output.find("-v.obj:\n"), std::string::npos) << described.output;
  EXPECT_NE(described.errors.find("--quiet"), std::string::npos) << described.errors;
}

TEST(Names, ThatAreTooLongAreToldByTheSystemsReason) {
  const TemporaryFolder folder;
  const std::string longName(300, 'n');
  for (const std::string& arguments :
       {"info " + longName + ".exr", "info " + longName + ".obj", "info x.obj --stats " + longName,
        "cut " + ownData("data/sphere_uv.obj") + " --plane 0,0,0,0,1,0 -o " + folder.file(longName)}) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 1) << arguments;
    EXPECT_NE(result.errors.find("File name too long"), std::string::npos) << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test
