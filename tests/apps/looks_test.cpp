#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace nephele::test {
namespace {

std::string optionsOf(const std::string& volume) {
  return metadataOf(readVdbFile(volume)[0], "config_options").value_or("");
}

TEST(Looks, GrowAndShowTheirClouds) {
  const std::filesystem::path folder =
      std::filesystem::path(ownData("data/sphere_uv.obj")).parent_path() / "looks";
  int count = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder)) {
    const std::string look = file.path().stem().string();
    const TemporaryFolder made;
    const std::string volume = made.file("a.vdb"),
                      verb = look == "wisps" ? "wisps --dots 20000" : "cloud --layers 1";
    const ProgramResult grown =
        runProgram(verb + " --look " + look + " --resolution 24 --quiet -o " + volume);
    ASSERT_EQ(grown.exitCode, 0) << look << ": " << grown.errors;
    const ProgramResult shown =
        runProgram("render " + volume + " --look " + look + " --size 24x16 --quiet -o " + made.file("a.exr") +
                   " --preview " + made.file("a.png"));
    EXPECT_EQ(shown.exitCode, 0) << look << ": " << shown.errors;
    // The file itself says the same.
    const ProgramResult asFile = runProgram(verb + " --config " + file.path().string() +
                                            " --resolution 24 --quiet -o " + made.file("b.vdb"));
    EXPECT_EQ(asFile.exitCode, 0) << look << ": " << asFile.errors;
    EXPECT_EQ(optionsOf(made.file("b.vdb")).size(), optionsOf(volume).size()) << look;
    ++count;
  }
  EXPECT_EQ(count, 10);
}

TEST(Looks, GiveWayToWhatIsTyped) {
  const TemporaryFolder folder;
  const std::string out = folder.file("a.vdb"),
                    usual = "cloud --layers 1 --look congestus --resolution 24 --quiet -o " + out + " ";
  ASSERT_EQ(runProgram(usual).exitCode, 0);
  EXPECT_NE(optionsOf(out).find("--species=congestus"), std::string::npos);
  EXPECT_EQ(optionsOf(out).find("--resolution"), std::string::npos);
  // On a shape of one's own there is no species, and so no seed for one.
  ASSERT_EQ(runProgram(usual + ownData("data/sphere_uv.obj")).exitCode, 0);
  EXPECT_EQ(optionsOf(out).find("species"), std::string::npos);
  EXPECT_NE(optionsOf(out).find("--billow"), std::string::npos);
  std::ofstream(folder.file("own.toml")) << "[cloud]\nbillow = 0.25\n[render]\nfov = 20\n";
  ASSERT_EQ(runProgram(usual + "--config " + folder.file("own.toml")).exitCode, 0);
  EXPECT_NE(optionsOf(out).find("--billow=0.25"), std::string::npos);
}

TEST(Looks, AreRefusedWhereThereIsNone) {
  const TemporaryFolder folder;
  const struct {
    std::string arguments, message;
  } cases[] = {{"cloud --look stormy -o " + folder.file("a.vdb"), "did you mean 'storm'?"},
               {"info --look storm a.vdb", "'storm' says nothing of info"}};
  for (const auto& c : cases) {
    const ProgramResult result = runProgram(c.arguments);
    EXPECT_EQ(result.exitCode, 2) << c.arguments;
    EXPECT_NE(result.errors.find(c.message), std::string::npos) << result.errors;
  }
}

}  // namespace
}  // namespace nephele::test
