#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"
#include "tests/support/density.h"
#include "tests/support/run_program.h"

namespace nephele::test {

/// Volumes to be turned, and a folder for the frames.
class TurntableVerb : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    data_ = new TemporaryFolder;
    write("ball.vdb", *ball(1.0f, 0.1f));
    // Long in z, with a thick end: from no two sides alike.
    write("club.vdb", *densityGrid(voxels(0.1f), {-6, -6, -12}, {6, 6, 16}, [](const Vec3f& p) {
            const float rod = 0.25f - std::hypot(p.x, p.y), end = 0.5f - length(p - Vec3f{0.1f, 0, 1.0f});
            return std::clamp(0.5f + 10 * std::max(std::min(rod, 1.1f + p.z), end), 0.0f, 1.0f);
          }));
  }
  static void TearDownTestSuite() { delete data_; }
  static void write(const std::string& name, const BrickGrid& grid) {
    writeVdbFile(data_->file(name), {toVdb(grid, {"density", VdbGridInfo::Class::fogVolume})}, {});
  }

  static std::string volume(const std::string& name) { return fmt::format("'{}'", data_->file(name)); }
  // The arguments of a turntable into the test's own folder.
  std::string call(const std::string& options, const std::string& name = "club.vdb", int samples = 1) const {
    return fmt::format("turntable {} -o '{}' --size 64x36 --samples {} {}", volume(name),
                       folder.file("f.####.exr"), samples, options);
  }
  std::string frame(int number) const { return folder.file(fmt::format("f.{:04d}.exr", number)); }
  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder.file("")))
      names.insert(entry.path().filename());
    return names;
  }
  nlohmann::json statistics() const { return nlohmann::json::parse(textOf(folder.file("s.json"))); }
  static bool isWhole(const std::string& path) {
    try {
      return readImage(path).width > 0;
    } catch (const Error&) {
      return false;
    }
  }
  // Mean of the green channel.
  static double brightness(const std::string& path) {
    double sum = 0;
    const Image image = readImage(path);
    for (const float value : image.channel("G").values) sum += value;
    return sum / double(image.channel("G").values.size());
  }

  TemporaryFolder folder;
  static inline TemporaryFolder* data_ = nullptr;
};

}  // namespace nephele::test
