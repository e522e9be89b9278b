#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <regex>

#include "tests/support/run_program.h"

namespace nephele::test {
namespace {

// Every long option that --help-all prints.
std::vector<std::string> optionsOf(const std::string& verb) {
  const std::string help = runProgram(verb + " --help-all").output;
  std::vector<std::string> options;
  const std::regex option("\n  (?:-[a-z],)?(--[a-z-]+)");
  for (auto it = std::sregex_iterator(help.begin(), help.end(), option); it != std::sregex_iterator(); ++it)
    options.push_back((*it)[1]);
  return options;
}

std::string escaped(const std::string& text) {
  return std::regex_replace(text, std::regex("-"), "\\-");
}

TEST(Manual, HasEveryOptionOfEveryVerb) {
  const std::string overview = runProgram("--help").output;
  const std::string bash = runProgram("help --completion bash").output;
  const std::string zsh = runProgram("help --completion zsh").output;
  const std::string fish = runProgram("help --completion fish").output;
  for (const std::string verb : {"cloud", "render", "cut", "transfer", "felt"}) {
    const ProgramResult page = runProgram("help --man " + verb);
    ASSERT_EQ(page.exitCode, 0);
    EXPECT_TRUE(page.output.starts_with(".TH nephele\\-" + verb));
    const std::vector<std::string> options = optionsOf(verb);
    EXPECT_GT(options.size(), 10u) << verb;
    for (const std::string& option : options) {
      if (option != "--help" && option != "--help-all") {
        EXPECT_NE(page.output.find(escaped(option)), std::string::npos) << verb << option;
        EXPECT_NE(zsh.find(option), std::string::npos) << option;
        EXPECT_NE(fish.find("-l " + option.substr(2)), std::string::npos) << option;
      }
      EXPECT_NE(bash.find(option), std::string::npos) << option;
    }
  }
  EXPECT_NE(runProgram("help --man").output.find("nephele\\-levelset"), std::string::npos);
}

TEST(Manual, RefusesWhatThereIsNot) {
  const ProgramResult shell = runProgram("help --completion csh");
  EXPECT_EQ(shell.exitCode, 2);
  EXPECT_NE(shell.errors.find("bash, zsh and fish, not for 'csh'"), std::string::npos);
  EXPECT_EQ(runProgram("help --man nothing").exitCode, 2);
}

TEST(Manual, CompletesInBash) {
  const TemporaryFolder folder;
  const std::string script = folder.file("nephele.bash");
  std::ofstream(script) << runProgram("help --completion bash").output;
  const auto completed = [&](const std::string& words, int at, const std::string& before) {
    const std::string command = "bash -c 'source " + script + "; COMP_WORDS=(" + words +
                                "); COMP_CWORD=" + std::to_string(at) +
                                "; _nephele nephele \"${COMP_WORDS[$COMP_CWORD]}\" " + before +
                                "; echo ${COMPREPLY[@]} >" + folder.file("out") + "' &&";
    runProgram("--version", command);
    return textOf(folder.file("out"));
  };
  EXPECT_EQ(completed("nephele tr", 1, "nephele"), "transfer transform\n");
  EXPECT_EQ(completed("nephele cloud --noise per", 3, "--noise"), "perlin\n");
  EXPECT_EQ(completed("nephele render --integrator p", 3, "--integrator"), "path\n");
  EXPECT_EQ(completed("nephele cloud --noise-s", 2, "cloud"), "--noise-speed\n");
  EXPECT_EQ(completed("nephele felt ch", 2, "felt"), "check\n");
}

TEST(Manual, CompletesInFish) {
  if (std::system("fish --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "there is no fish";
  const TemporaryFolder folder;
  const std::string script = folder.file("nephele.fish"), out = folder.file("out");
  std::ofstream(script) << runProgram("help --completion fish").output;
  const auto completed = [&](const std::string& line) {
    const std::string command = "HOME=" + folder.file("home") + " fish --no-config -c 'source " + script +
                                "; complete -C \"" + line + "\" | cut -f1' >" + out + " 2>&1 </dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << line;
    return textOf(out);
  };
  EXPECT_EQ(completed("nephele tr"), "transfer\ntransform\n");
  EXPECT_EQ(completed("nephele cloud --noise per"), "perlin\n");
  EXPECT_EQ(completed("nephele render --integrator p"), "path\n");
  EXPECT_EQ(completed("nephele cloud --noise-s"), "--noise-speed\n");
  EXPECT_EQ(completed("nephele felt ch"), "check\n");
  EXPECT_EQ(completed("nephele help tur"), "turntable\n");
}

// What zsh offers stands on the line that it shows once a tabulator was pressed.
TEST(Manual, CompletesInZsh) {
  if (std::system("zsh --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "there is no zsh";
  const TemporaryFolder folder;
  const std::string script = folder.file("try.zsh"), out = folder.file("out");
  std::ofstream(folder.file("_nephele")) << runProgram("help --completion zsh").output;
  std::ofstream(script) << "zmodload zsh/zpty\nzpty z zsh -f -i\n"
                           "zpty -w z 'PS1=; fpath=("
                        << folder.file("")
                        << " $fpath); autoload -U compinit; compinit -u -D; echo rea''dy'\n"
                        << "zpty -r z text '*ready*'\n"
                           "zpty -w -n z $1$'\\t'\nzpty -r z text \"*$2*\" && print found\n";
  const auto completes = [&](const std::string& line, const std::string& to) {
    const std::string command =
        "timeout 60 zsh -f " + script + " '" + line + "' '" + to + "' >" + out + " 2>&1 </dev/null";
    return std::system(command.c_str()) == 0 && textOf(out) == "found\n";
  };
  EXPECT_TRUE(completes("nephele turn", "turntable"));
  EXPECT_TRUE(completes("nephele cloud --noise wor", "worley"));
  EXPECT_TRUE(completes("nephele cloud --noise-s", "--noise-speed"));
  EXPECT_TRUE(completes("nephele felt form", "format"));
  EXPECT_TRUE(completes("nephele help turn", "turntable"));
}

}  // namespace
}  // namespace nephele::test
