#include "tests/support/run_program.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/support/test_data.h"

namespace nephele::test {

TemporaryFolder::TemporaryFolder() {
  static int count = 0;
  path_ = std::filesystem::temp_directory_path() /
          ("nephele-test-" + std::to_string(getpid()) + "-" + std::to_string(count++));
  std::filesystem::remove_all(path_);
  std::filesystem::create_directories(path_);
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::size_t TemporaryFolder::entryCount() const {
  return std::size_t(
      std::distance(std::filesystem::directory_iterator(path_), std::filesystem::directory_iterator()));
}

std::string textOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string programPath() {
  return NEPHELE_PROGRAM;
}

ProgramResult runProgram(const std::string& arguments, const std::string& before, const std::string& input) {
  const TemporaryFolder folder;
  const std::string command = before + " '" + programPath() + "' " + arguments + " >'" + folder.file("out") +
                              "' 2>'" + folder.file("err") + "' <'" + input + "'";
  const int status = std::system(command.c_str());
  ProgramResult result;
  result.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.output = textOf(folder.file("out"));
  result.errors = textOf(folder.file("err"));
  return result;
}

std::string ownData(const std::string& name) {
  return (std::filesystem::path(NEPHELE_SOURCE_DIR) / name).string();
}

std::string sharedData(const std::string& name) {
  return (std::filesystem::path(NEPHELE_SOURCE_DIR).parent_path() / "shared/data" / name).string();
}

}  // namespace nephele::test
