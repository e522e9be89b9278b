#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "nephele/levelset/io/vdb_io.h"
#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

const std::string kMesh = ownData("data/sphere_uv.obj");

TEST(Program, PrintsItsVersionAndVerbs) {
  EXPECT_EQ(runProgram("--version").exitCode, 0);
  const ProgramResult help = runProgram("--help");
  EXPECT_EQ(help.exitCode, 0);
  for (const char* verb : {"levelset", "cloud", "mesh", "render", "info", "felt"})
    EXPECT_NE(help.output.find(verb), std::string::npos) << verb;
}

TEST(Program, HelpOfEveryVerbShowsAnExample) {
  for (const std::string verb : {"levelset", "cloud", "mesh", "render", "info", "felt"}) {
    const ProgramResult help = runProgram(verb + " --help-all");
    EXPECT_EQ(help.exitCode, 0) << verb;
    EXPECT_NE(help.output.find("Example:\n  nephele " + verb), std::string::npos) << help.output;
    EXPECT_NE(help.output.find("--stats"), std::string::npos) << verb;
  }
}

int optionsShown(const std::string& help) {
  int count = 0;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) count += line.starts_with("  -");
  return count;
}

TEST(Program, HelpShowsTheOptionsOfAFirstDayAndLeadsToAll) {
  for (const std::string verb : {"levelset", "cloud", "advect", "wisps", "mesh", "cut", "transfer", "render",
                                 "turntable", "info", "felt"}) {
    const ProgramResult help = runProgram(verb + " --help"), all = runProgram(verb + " --help-all");
    EXPECT_EQ(help.exitCode, 0) << verb;
    // Fifteen or so, three of help, and --frames and --wedge.
    EXPECT_LE(optionsShown(help.output), 20) << verb;
    EXPECT_EQ(runProgram("help " + verb).output, help.output) << verb;
    EXPECT_NE(help.output.find("'nephele " + verb + " --help-all' shows all"), std::string::npos) << verb;
    EXPECT_NE(help.output.find("Example:\n  nephele " + verb), std::string::npos) << verb;
    EXPECT_GT(optionsShown(all.output), optionsShown(help.output)) << verb;
  }
  const ProgramResult wrong = runProgram("help clod");
  EXPECT_EQ(wrong.exitCode, 2);
  EXPECT_NE(wrong.errors.find("did you mean 'cloud'"), std::string::npos) << wrong.errors;
}

TEST(Program, OldNamesOfOptionsWorkWithOneNote) {
  const TemporaryFolder folder;
  const std::string cut = "cut " + kMesh + " --random-planes 2 -o " + folder.file("out") + " ";
  const ProgramResult before = runProgram(cut + "--through-centre");
  EXPECT_EQ(before.exitCode, 0) << before.errors;
  EXPECT_EQ(before.errors,
            "nephele cut: --through-centre is called --through-center now; the old name still works\n");
  EXPECT_EQ(runProgram(cut + "--through-center").errors, "");
  // In configuration files, too; and they are not shown.
  std::ofstream(folder.file("old.toml")) << "through-centre = true\n";
  EXPECT_EQ(runProgram(cut + "--config " + folder.file("old.toml")).exitCode, 0);
  EXPECT_EQ(runProgram("cut --help-all").output.find("centre"), std::string::npos);
  EXPECT_EQ(runProgram("render --help-all").output.find("-colour"), std::string::npos);
  EXPECT_EQ(runProgram("render --help-all").output.find("--spp"), std::string::npos);
}

TEST(Program, TakesVectorsThatBeginWithAMinus) {
  const TemporaryFolder folder;
  const std::string volume = folder.file("a.vdb");
  ASSERT_EQ(runProgram("cloud " + kMesh + " --layers 1 --resolution 12 -o " + volume).exitCode, 0);
  // Half a voxel along -x moves the density there.
  const ProgramResult moved =
      runProgram("advect " + volume + " --velocity -20,0,0 --dt 0.1 -o " + folder.file("b.vdb"));
  EXPECT_EQ(moved.exitCode, 0) << moved.errors;
  const VdbGridInfo from = describe(readVdbFile(volume)[0]),
                    to = describe(readVdbFile(folder.file("b.vdb"))[0]);
  const double voxels = 20 * 0.1 / double(from.voxelSize.x);
  EXPECT_NEAR(double(to.indexMin.x - from.indexMin.x), -voxels, 2);
  EXPECT_NEAR(double(to.indexMax.x - from.indexMax.x), -voxels, 2);
}

TEST(Program, WithoutAVerbIsAUsageError) {
  EXPECT_EQ(runProgram("").exitCode, 2);
}

TEST(Program, UnknownVerbIsAUsageErrorWithASuggestion) {
  const ProgramResult result = runProgram("levelst x.obj");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.errors.find("did you mean 'levelset'"), std::string::npos) << result.errors;
}

TEST(Program, UnknownOptionIsAUsageErrorWithASuggestion) {
  const ProgramResult result = runProgram("levelset in.obj -o out.vdb --resolutoin 12");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.errors.find("--resolution"), std::string::npos) << result.errors;
}

TEST(Program, WrongValueNamesOptionValueAndRange) {
  const ProgramResult result = runProgram("cloud in.obj -o out.vdb --layers 17");
  EXPECT_EQ(result.exitCode, 2);
  EXPECT_NE(result.errors.find("--layers"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("'17'"), std::string::npos) << result.errors;
  EXPECT_NE(result.errors.find("from 0 to 16"), std::string::npos) << result.errors;
}

TEST(Program, ValuesAreRefusedInOneForm) {
  const std::pair<const char*, const char*> cases[] = {
      {"render --exposure 21", "--exposure: got '21', allowed: a number from -20 to 20"},
      {"render --exposure nan", "--exposure: got 'nan', allowed: a number from -20 to 20"},
      {"render --sky-intensity x", "--sky-intensity: got 'x', allowed: a number from 0 to 1e+06"},
      {"render --shadow-tolerance 1", "--shadow-tolerance: got '1', allowed: a number from 1e-06 to 0.5"},
      {"render --sky-rotation 1e6", "--sky-rotation: got '1e6', allowed: a number from -36000 to 36000"},
      {"render --integrator x", "--integrator: got 'x', allowed: one of march|path"},
      {"render --aov Z,x", "--aov: got 'x', allowed: one of Z|"},
      {"look --show x", "--show: got 'x', allowed: one of cloud|surface|"},
      {"info --progress x", "--progress: got 'x', allowed: one of auto|alf"},
      {"cloud a.obj -o a.vdb --layers 1 --layers 2", "--layers: is given 2 times, allowed: once"},
      {"render a.vdb -o a.exr --aerial-perspective --samples 1 --samples 2",
       "--samples: is given 2 times, allowed: once"}};
  for (const auto& [line, said] : cases) {
    const ProgramResult result = runProgram(line);
    EXPECT_EQ(result.exitCode, 2) << line;
    EXPECT_NE(result.errors.find(said), std::string::npos) << line << ": " << result.errors;
  }
}

TEST(Program, MissingInputNamesTheFile) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("levelset " + folder.file("none.obj") + " -o " + folder.file("out.vdb"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("none.obj"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Program, MissingOutputFolderNamesThePath) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("levelset " + kMesh + " --resolution 16 -o " + folder.file("none/out.vdb"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("none"), std::string::npos) << result.errors;
}

TEST(Program, UnwritableTargetIsRefused) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkdir(folder.file("out.vdb").c_str(), 0777), 0);
  const ProgramResult result =
      runProgram("levelset " + kMesh + " --resolution 16 -o " + folder.file("out.vdb"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_EQ(folder.entryCount(), 1u) << "no temporary file may stay";
}

// A file size limit stands in for a full disk: both make a write end short.
TEST(Program, FullDiskLeavesNoPartialFile) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("levelset " + kMesh + " --resolution 96 -o " + folder.file("out.vdb"), "ulimit -f 8;");
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("out.vdb"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Program, InterruptLeavesNoPartialFileAndSaysSo) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram(
      "cloud " + kMesh + " --resolution 1200 --layers 4 --memory-limit 16G -o " + folder.file("out.vdb"),
      "timeout --signal=INT --preserve-status 1");
  EXPECT_EQ(result.exitCode, 130) << result.errors;
  EXPECT_NE(result.errors.find("stopped"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(Program, SaysSoWhereTheSystemHasNoMoreMemory) {
  const TemporaryFolder folder;
  for (const std::string verb : {"levelset", "cloud"}) {
    const ProgramResult result =
        runProgram(verb + " " + kMesh + " --resolution 3000 --memory-limit 64G -o " + folder.file("out.vdb"),
                   "ulimit -v 600000;");
    EXPECT_EQ(result.exitCode, 1) << verb;
    EXPECT_NE(result.errors.find("out of memory; lower --memory-limit or the resolution"), std::string::npos)
        << result.errors;
    EXPECT_EQ(folder.entryCount(), 0u);
  }
}
#endif

TEST(Program, RefusesWorkOverTheMemoryLimitBeforeDoingIt) {
  const TemporaryFolder folder;
  for (const std::string verb : {"levelset", "cloud"}) {
    const ProgramResult result =
        runProgram(verb + " " + kMesh + " --resolution 100000 -o " + folder.file("out.vdb"));
    EXPECT_EQ(result.exitCode, 1) << verb;
    EXPECT_NE(result.errors.find("GB"), std::string::npos) << result.errors;
    EXPECT_NE(result.errors.find("--resolution"), std::string::npos) << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Program, ConfigFileSetsOptionsAndTheCommandLineWins) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("options.toml")) << "resolution = 24\nhalf-width = 5\n";
  const std::string common = "levelset " + kMesh + " -o " + folder.file("out.vdb") + " --stats " +
                             folder.file("stats.json") + " --config " + folder.file("options.toml");
  ASSERT_EQ(runProgram(common).exitCode, 0);
  const double coarse = nlohmann::json::parse(textOf(folder.file("stats.json")))["grid"]["voxel_size"];
  ASSERT_EQ(runProgram(common + " --resolution 48").exitCode, 0);
  const double fine = nlohmann::json::parse(textOf(folder.file("stats.json")))["grid"]["voxel_size"];
  EXPECT_NEAR(coarse / fine, 2.0, 1e-6) << "48 voxels along a side are twice as small as 24";
  // What excludes an option of the file takes its place as well.
  ASSERT_EQ(runProgram(common + " --voxel-size 0.125").exitCode, 0);
  EXPECT_EQ(nlohmann::json::parse(textOf(folder.file("stats.json")))["grid"]["voxel_size"], 0.125);
  std::ofstream(folder.file("options.toml")) << "resolution = 24\nvoxel-size = 0.1\n";
  EXPECT_EQ(runProgram(common).exitCode, 2);
}

TEST(Program, FilesSayWhatWasTypedAndWhatAConfigFileGave) {
  const TemporaryFolder folder;
  const std::string config = folder.file("options.toml"), out = folder.file("out.vdb");
  std::ofstream(config) << "resolution = 24\nhalf-width = 5\n";
  const std::string typed = "levelset " + kMesh + " --half-width 4 --config " + config + " -o " + out;
  ASSERT_EQ(runProgram(typed).exitCode, 0);
  const auto metadata = describe(readVdbFile(out)[0]).metadata;
  EXPECT_EQ(metadata.at("command_line"), "nephele " + typed);
  // What was typed wins, and is not among them.
  EXPECT_EQ(metadata.at("config_options"), "--resolution=24");
  ASSERT_EQ(runProgram("levelset " + kMesh + " --resolution 24 -o " + out).exitCode, 0);
  EXPECT_FALSE(describe(readVdbFile(out)[0]).metadata.contains("config_options"));
}

// /dev/full takes every write and says that the disk is full.
TEST(Program, WhatCannotBePrintedFailsNoJobButAnAnswerThatCannotBePrintedDoes) {
  const TemporaryFolder folder;
  const std::string convert =
      programPath() + " levelset " + kMesh + " --resolution 16 --verbose -o " + folder.file("out.vdb");
  EXPECT_EQ(WEXITSTATUS(std::system((convert + " 2>/dev/full >/dev/null").c_str())), 0);
  EXPECT_EQ(WEXITSTATUS(std::system((convert + " 2>&- >/dev/null").c_str())), 0);
  EXPECT_EQ(WEXITSTATUS(std::system((programPath() + " info " + kMesh + " >/dev/full 2>/dev/null").c_str())),
            1);
  EXPECT_EQ(WEXITSTATUS(std::system((programPath() + " info " + kMesh + " >&- 2>/dev/null").c_str())), 1);
}

TEST(Program, ConfigFilesThatAreNoneAreRefused) {
  const TemporaryFolder folder;
  std::string dotted = "a";
  for (int i = 0; i != 100000; ++i) dotted += ".a";
  std::ofstream(folder.file("dotted.toml")) << "# fine.....\n'a.b' = 1\n" << dotted << " = 1\n";
  const std::string convert = "levelset " + kMesh + " -o " + folder.file("out.vdb") + " --config ";
  const ProgramResult nested = runProgram(convert + folder.file("dotted.toml"));
  EXPECT_EQ(nested.exitCode, 2);
  EXPECT_NE(nested.errors.find("dotted.toml:3:64: error: a key nests more than 32 deep"), std::string::npos)
      << nested.errors;
  const ProgramResult notAFile = runProgram(convert + folder.file("."));
  EXPECT_EQ(notAFile.exitCode, 2);
  EXPECT_NE(notAFile.errors.find("is a folder"), std::string::npos) << notAFile.errors;
  std::ofstream(folder.file("zero.toml")) << "output = \"a.vdb\\u0000b.vdb\"\n";
  const ProgramResult zero = runProgram("levelset " + kMesh + " --config " + folder.file("zero.toml"));
  EXPECT_EQ(zero.exitCode, 2);
  EXPECT_NE(zero.errors.find("zero.toml:1:10: error: a text may not have a byte of zero"), std::string::npos)
      << zero.errors;
  std::ofstream(folder.file("recipe.toml")) << "[[layer]]\namplitude = \"a.vdb\\u0000b.vdb\"\n";
  const ProgramResult recipe = runProgram("cloud " + kMesh + " -o " + folder.file("out.vdb") + " --recipe " +
                                          folder.file("recipe.toml"));
  EXPECT_NE(recipe.errors.find("recipe.toml:2:13: error: a text may not have a byte of zero"),
            std::string::npos)
      << recipe.errors;
}

TEST(Program, MeshesBeyondTheRangeOfTheirNumbersAreRefusedByName) {
  const TemporaryFolder folder;
  const auto tetrahedron = [&](const std::string& name, const std::string& side) {
    std::ofstream(folder.file(name)) << "v 0 0 0\nv " << side << " 0 0\nv 0 " << side << " 0\nv 0 0 " << side
                                     << "\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    return folder.file(name);
  };
  const std::string out = " -o " + folder.file("out.vdb"), far = tetrahedron("far.obj", "1e39"),
                    tiny = tetrahedron("tiny.obj", "1e-20"), small = tetrahedron("small.obj", "1e-8");
  for (const auto& [arguments, part] :
       {std::pair{"levelset " + far + " --repair wrap" + out, "far.obj: mesh repair: the mesh is too large"},
        {"levelset " + tiny + out, "tiny.obj: mesh repair: the mesh is too small: its longest side is 1e-20"},
        {"cloud " + tiny + out, "tiny.obj: mesh repair: the mesh is too small"},
        {"cut " + tiny + " --random-planes 1 -o " + folder.file("p"),
         "tiny.obj: mesh repair: the mesh is too small"},
        {"wisps " + tiny + " --dots 100" + out, "tiny.obj: dots: voxels may be from 1e-12 to 1e+12 wide"}}) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 1) << arguments;
    EXPECT_NE(result.errors.find(part), std::string::npos) << arguments << "\n" << result.errors;
  }
  EXPECT_EQ(runProgram("levelset " + small + " --resolution 32" + out).exitCode, 0);
}

TEST(Program, NamesInAnyEncodingAreWrittenAndStatisticsStayJson) {
  const TemporaryFolder folder;
  const std::string name = "caf\xe9 %s\n.vdb";
  const ProgramResult result = runProgram("levelset " + kMesh + " --resolution 16 -o '" + folder.file(name) +
                                          "' --stats " + folder.file("stats.json"));
  EXPECT_EQ(result.exitCode, 0) << result.errors;
  EXPECT_TRUE(std::filesystem::exists(folder.file(name)));
  EXPECT_NE(result.output.find("%s\\n.vdb"), std::string::npos) << "one line: " << result.output;
  const nlohmann::json stats = nlohmann::json::parse(textOf(folder.file("stats.json")));
  // U+FFFD stands where a byte is no letter.
  EXPECT_NE(stats["command"].get<std::string>().find("caf\xef\xbf\xbd %s"), std::string::npos);
}

TEST(Program, OutputsThatMeetAreRefusedBeforeTheWork) {
  const TemporaryFolder folder;
  const std::string mesh = folder.file("ball.obj"), volume = folder.file("a.vdb");
  std::filesystem::copy_file(kMesh, mesh);
  std::filesystem::create_directory_symlink(".", folder.file("here"));
  const std::string same = folder.file("here/../a.vdb");
  const std::size_t before = folder.entryCount();
  for (const auto& [arguments, option] :
       {std::pair{"levelset " + mesh + " -o " + volume + " --stats " + volume, "--stats"},
        {"levelset " + mesh + " -o " + volume + " --stats " + folder.file("here/a.vdb"), "--stats"},
        {"levelset " + mesh + " -o " + volume + " --stats " + mesh, "--stats"},
        {"cloud " + mesh + " -o " + volume + " --surface " + volume, "--surface"},
        {"cloud " + mesh + " -o " + volume + " --shape-mesh " + mesh, "--shape-mesh"},
        {"render x.vdb -o " + folder.file("a.exr") + " --deep " + folder.file("./a.exr"), "--deep"},
        {"cut " + mesh + " -o " + folder.file("a") + " --voronoi 2 --stats " + folder.file("a/"),
         "--stats"}}) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments << "\n" << result.errors;
    EXPECT_NE(result.errors.find(option), std::string::npos) << result.errors;
    EXPECT_NE(result.errors.find("another file"), std::string::npos) << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), before);
  EXPECT_EQ(runProgram("mesh " + mesh + " -o " + mesh).exitCode, 0) << "work in place";
  EXPECT_EQ(runProgram("levelset " + mesh + " --resolution 16 -o " + volume + " --stats /dev/null").exitCode,
            0);
}

TEST(Program, AnyOutputIsTriedBeforeTheWork) {
  const TemporaryFolder folder;
  const ProgramResult result = runProgram("levelset " + kMesh + " --resolution 16 -o " +
                                          folder.file("a.vdb") + " --stats " + folder.file("none/s.json"));
  EXPECT_EQ(result.exitCode, 1);
  EXPECT_NE(result.errors.find("none does not exist"), std::string::npos) << result.errors;
  EXPECT_EQ(folder.entryCount(), 0u) << "nothing was made before the fault was found";
}

TEST(Program, NamesOfFilesAreNotEmpty) {
  const TemporaryFolder folder;
  const std::string out = " -o " + folder.file("a.vdb");
  for (const auto& [arguments, option] :
       {std::pair{"levelset " + kMesh + out + " --stats ''", "--stats"},
        {"levelset ''" + out, "input"},
        {"cut " + kMesh + " -o " + folder.file("a") + " --knife ''", "--knife"},
        {"cloud " + kMesh + out + " --cache ''", "--cache"},
        {"render x.vdb -o " + folder.file("a.exr") + " --holdout ''", "--holdout"}}) {
    const ProgramResult result = runProgram(arguments);
    EXPECT_EQ(result.exitCode, 2) << arguments << "\n" << result.errors;
    EXPECT_NE(result.errors.find(std::string(option) + ": got '', allowed: the name of a file"),
              std::string::npos)
        << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Program, WorkBeyondTheMemoryIsRefusedWhateverAsksForIt) {
  const TemporaryFolder folder;
  const std::string out = folder.file("out"), limit = " --memory-limit 2G";
  for (const auto& [arguments, remedy] :
       {std::pair{"levelset " + kMesh + " -o " + out + ".vdb --resolution 16 --half-width 1000",
                  "--half-width"},
        {"cut " + kMesh + " -o " + out + " --voronoi 2 --size 65536x65536 --preview " + out + ".png",
         "--size"},
        {"cut " + kMesh + " -o " + out + " --random-planes 300", "fewer knives"},
        {"transfer --from " + kMesh + " --to " + kMesh + " -o " + out + ".obj --size 65536x65536 --preview " +
             out + ".png",
         "--size"},
        {"cloud " + kMesh + " -o " + out + ".vdb --resolution 16 --frequency 1e-10", "higher frequency"}}) {
    const ProgramResult result = runProgram(arguments + (remedy[0] == 'h' ? "" : limit));
    EXPECT_EQ(result.exitCode, 1) << arguments << "\n" << result.errors;
    EXPECT_NE(result.errors.find(remedy), std::string::npos) << result.errors;
  }
  EXPECT_EQ(folder.entryCount(), 0u);
}

TEST(Program, StatisticsHoldTheCommonFields) {
  const TemporaryFolder folder;
  ASSERT_EQ(runProgram("levelset " + kMesh + " --resolution 32 -o " + folder.file("out.vdb") + " --stats " +
                       folder.file("stats.json"))
                .exitCode,
            0);
  const nlohmann::json stats = nlohmann::json::parse(textOf(folder.file("stats.json")));
  EXPECT_NE(stats["command"].get<std::string>().find("--resolution 32"), std::string::npos);
  EXPECT_GT(stats["seconds"].get<double>(), 0);
  EXPECT_GT(stats["peak_memory_bytes"].get<double>(), 1e6);
  ASSERT_FALSE(stats["stages"].empty());
  for (const auto& stage : stats["stages"]) {
    EXPECT_FALSE(stage["name"].get<std::string>().empty());
    EXPECT_GE(stage["seconds"].get<double>(), 0);
  }
}

TEST(Program, QuietPrintsNothingOnSuccess) {
  const TemporaryFolder folder;
  const ProgramResult result =
      runProgram("levelset " + kMesh + " --resolution 32 --quiet -o " + folder.file("out.vdb"));
  EXPECT_EQ(result.exitCode, 0);
  EXPECT_EQ(result.output + result.errors, "");
}

}  // namespace
}  // namespace nephele::test
