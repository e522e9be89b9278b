#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace nephele::test {

/// A folder of the running test's own, removed with it.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::string file(const std::string& name) const { return (path_ / name).string(); }
  std::size_t entryCount() const;

 private:
  std::filesystem::path path_;
};

std::string textOf(const std::string& path);

struct ProgramResult {
  int exitCode = -1;  ///< 128 + signal where a signal ended it.
  std::string output;
  std::string errors;
};

/// Path of the program that is tested.
std::string programPath();

/// Runs `nephele <arguments>` through the shell and returns what it said. `before` goes in front of the
/// command line ("ulimit -f 8;"). The standard input is the file `input`.
ProgramResult runProgram(const std::string& arguments, const std::string& before = {},
                         const std::string& input = "/dev/null");

/// A file of the checkout, e.g. "data/sphere_uv.obj".
std::string ownData(const std::string& name);

}  // namespace nephele::test
