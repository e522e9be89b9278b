#include "tests/fuzz/harness.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "apps/app.h"
#include "apps/detail/program_run.h"
#include "nephele/levelset/grid/bake.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/marching_cubes.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele::fuzz {
namespace {

namespace fs = std::filesystem;

/// Removed with everything in it when the process ends.
class ScratchFolder {
 public:
  ScratchFolder() {
    const fs::path memory = "/dev/shm";
    path_ = (fs::is_directory(memory) ? memory : fs::temp_directory_path()) /
            fmt::format("nephele-fuzz-{}", ::getpid());
    fs::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::string file(std::string_view name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

std::shared_ptr<BrickGrid> ballBricks(float voxelSize) {
  return bakeGrid(
      sphere({0, 0, 0}, 0.5f),
      {.voxelSize = voxelSize, .box = {{-1, -1, -1}, {1, 1, 1}}, .band = {-3 * voxelSize, 3 * voxelSize}});
}

/// Words in it may be in messages.
std::string_view whole;

}  // namespace

void setInput(std::string_view bytes) {
  whole = bytes;
}

void fail(std::string_view message) {
  std::fprintf(stderr, "FINDING: %.*s\n", int(message.size()), message.data());
  std::abort();
}

void checkMessage(std::string_view message, std::string_view named) {
  // Between quotes stands what the input said.
  std::string own;
  bool isQuoted = false;
  char before = ' ';
  for (const char c : message) {
    if (c == '\'' && (isQuoted || !std::isalnum(std::uint8_t(before)))) isQuoted = !isQuoted;
    if (!isQuoted) own += c;
    before = c;
  }
  for (const char* word : {"std::", "json.exception", "basic_string", "vector::", "_M_", "openvdb", "Imf",
                           "nan MB", "toml::", "stoi", "stof", "map::at", "bad_alloc", "Assertion",
                           "terminate", "not in range", "not in {"})
    if (own.find(word) != own.npos && whole.find(word) == whole.npos)
      fail(fmt::format("words of a library in a message: {}", message));
  if (message.find('\n') != message.npos) fail(fmt::format("more than one line: {}", message));
  if (message.find(named) == message.npos) fail(fmt::format("{} is not named: {}", named, message));
}

std::string& lastError() {
  static std::string message;
  return message;
}

bool runVerb(std::vector<std::string> arguments, std::string_view named) {
  using namespace nephele::apps;
  static const std::vector<Verb> verbs = allVerbs();
  arguments.insert(arguments.end(), {"--quiet", "--threads", "1", "--memory-limit", "256M"});
  std::vector<char*> argv = {const_cast<char*>("nephele")};
  for (std::string& argument : arguments) argv.push_back(argument.data());

  std::ostringstream errors, results;
  std::streambuf* const error = std::cerr.rdbuf(errors.rdbuf());
  std::streambuf* const result = std::cout.rdbuf(results.rdbuf());
  const int exitCode = runProgram(int(argv.size()), argv.data(), verbs);
  std::cerr.rdbuf(error);
  std::cout.rdbuf(result);
  if (stopSignal() != 0) std::_Exit(0);

  std::string message = errors.str();
  if (exitCode == 0) {
    expect(message.empty(), "a message of a verb that succeeded: " + message);
    return true;
  }
  expect(exitCode == 1, fmt::format("exit {}: {}", exitCode, message));
  if (message.ends_with('\n')) message.pop_back();
  // Estimates and what a format of outputs cannot hold are not of the input.
  const bool isOfOutput =
      message.find("this needs ") != message.npos || message.find(" cannot hold") != message.npos;
  checkMessage(message, isOfOutput ? "" : named);
  return false;
}

std::vector<std::string> linesOf(std::string_view text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines.emplace_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return lines;
}

bool runRender(std::vector<std::string> arguments, std::string_view named) {
  static const std::pair<std::string, std::string> least[] = {
      {"--size", "4x3"}, {"--samples", "1"},       {"--octaves", "1"},
      {"--aov", "none"}, {"--sky", "0.2,0.3,0.4"}, {"--light-quality", "draft"}};
  arguments.insert(arguments.begin(), "render");
  arguments.insert(arguments.end(), {"-o", scratchPath("out.exr")});
  for (const auto& [option, value] : least)
    if (std::ranges::find(arguments, option) == arguments.end())
      arguments.insert(arguments.end(), {option, value});
  return runVerb(std::move(arguments), named);
}

std::string scratchPath(std::string_view name) {
  static const ScratchFolder folder;
  return folder.file(name);
}

const std::string& ballLevelSet() {
  static const std::string path = [] {
    std::string file = scratchPath("ball_level_set.vdb");
    writeVdbFile(file, {toVdb(*ballBricks(0.1f), {"surface", VdbGridInfo::Class::levelSet})}, {});
    return file;
  }();
  return path;
}

const std::string& ballFog() {
  static const std::string path = [] {
    std::string file = scratchPath("ball_fog.vdb");
    const auto bricks = bakeGrid(clamp(sphere({0, 0, 0}, 0.5f) * 8.0f, 0.0f, 1.0f),
                                 {.voxelSize = 0.15f, .box = {{-0.6f, -0.6f, -0.6f}, {0.6f, 0.6f, 0.6f}}});
    writeVdbFile(file, {toVdb(*bricks, {"density", VdbGridInfo::Class::fogVolume})}, {});
    return file;
  }();
  return path;
}

const std::string& ballMesh() {
  static const std::string path = [] {
    std::string file = scratchPath("ball.obj");
    Mesh mesh = marchingCubes(*ballBricks(0.2f));
    MeshAttribute uv{"uv", MeshAttribute::Domain::corner, 2, {}};
    for (const std::uint32_t corner : mesh.corners) {
      const Vec3d& p = mesh.positions[corner];
      uv.values.insert(uv.values.end(), {float(p.x), float(p.y)});
    }
    mesh.attributes = {uv};
    writeMesh(file, mesh);
    return file;
  }();
  return path;
}

}  // namespace nephele::fuzz
