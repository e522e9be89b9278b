#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace nephele::test {

/// A folder of the running test's own, removed with it.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("nephele-test-" + std::to_string(getpid()) + "-" + std::to_string(count++));
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::size_t entryCount() const {
    return std::size_t(
        std::distance(std::filesystem::directory_iterator(path_), std::filesystem::directory_iterator()));
  }

 private:
  std::filesystem::path path_;
};

inline std::string textOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

struct ProgramResult {
  int exitCode = -1;  ///< 128 + signal where a signal ended it.
  std::string output;
  std::string errors;
};

/// Runs `nephele <arguments>` through the shell and returns what it said. `before` goes in front of the
/// command line
/// ("ulimit -f 8;").
inline ProgramResult runProgram(const std::string& arguments, const std::string& before = {}) {
  const TemporaryFolder folder;
  const std::string command = before + " '" + NEPHELE_PROGRAM + "' " + arguments + " >'" +
                              folder.file("out") + "' 2>'" + folder.file("err") + "' </dev/null";
  const int status = std::system(command.c_str());
  ProgramResult result;
  result.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  result.output = textOf(folder.file("out"));
  result.errors = textOf(folder.file("err"));
  return result;
}

/// A file of the checkout, e.g. "data/sphere_uv.obj".
inline std::string ownData(const std::string& name) {
  return (std::filesystem::path(NEPHELE_SOURCE_DIR) / name).string();
}

}  // namespace nephele::test
