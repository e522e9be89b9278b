#include <gtest/gtest.h>

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
  EXPECT_EQ(completed("nephele cloud --noise-s", 2, "cloud"), "--noise-speed\n");
}

}  // namespace
}  // namespace nephele::test
