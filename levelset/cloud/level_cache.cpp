// Levels of clouds in files.
//
// A file says which levels it holds and what all their values come to together, so that neither a foreign nor
// a damaged one is taken for them.
#include "nephele/levelset/cloud/level_cache.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char *kPrefix = "cloud_layers_", *kExtension = ".vdb";
constexpr const char *kLevels = "surface", *kEstimates = "estimate", *kLabel = "nephele:cloud_levels";

std::uint64_t mixed(std::uint64_t h) {
  h ^= h >> 32;
  h *= 0x9e3779b97f4a7c15u;
  return h ^ h >> 29;
}

std::uint64_t digestOf(const float* values, std::size_t count) {
  std::uint64_t h = 1;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint32_t bits;
    // -0 is 0.
    const float value = values[i] + 0.0f;
    std::memcpy(&bits, &value, sizeof bits);
    h = mixed(h + bits);
  }
  return h;
}

/// The same whether a brick of one value is kept as such or not, in any order.
std::uint64_t digestOf(const VoxelGrid<float>& grid) {
  std::vector<std::uint64_t> constants;
  for (const float value : grid.constants()) {
    std::array<float, kBrickSamples> all;
    all.fill(value);
    constants.push_back(digestOf(all.data(), all.size()));
  }
  std::uint64_t sum = 0;
  grid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    const std::uint64_t content =
        entry < 0 ? constants[std::size_t(-1 - entry)] : digestOf(grid.samples(entry), kBrickSamples);
    if (content == constants.front()) return;
    const auto part = [](int i) { return std::uint64_t(std::uint32_t(i)); };
    sum += mixed(mixed(mixed(content + part(brick.x)) + part(brick.y)) + part(brick.z));
  });
  return sum;
}

std::string digestOf(const VoxelGrid<float>& surface, const VoxelGrid<float>& estimates) {
  return fmt::format("{:016x}{:016x}", digestOf(surface), digestOf(estimates));
}

/// What a file takes is given back to nobody.
VoxelGrid<float> copyOf(const VoxelGrid<float>& grid) {
  VoxelGrid<float> copy("levels", grid.voxelSize(), grid.background());
  grid.forEachBrick([&](const Vec3i& brick, std::int32_t entry) {
    if (entry < 0)
      copy.setConstant(brick, grid.constants()[std::size_t(-1 - entry)]);
    else
      std::copy_n(grid.samples(entry), kBrickSamples, copy.add(brick));
  });
  return copy;
}

json labelOf(const std::string& key, const CloudLevels& levels, const VoxelGrid<float>& surface) {
  json layers = json::array();
  for (const CumuloLayerReport& r : levels.layers)
    layers.push_back(
        {r.amplitude, r.frequency, r.voxelSize, r.activeVoxels, r.unconvergedFraction, r.meanDisplacement});
  const Box& b = levels.box;
  return {{"key", key},
          {"digest", digestOf(surface, levels.estimates)},
          {"voxel_size", levels.levels.voxelSize()},
          {"half_width", levels.halfWidth},
          {"estimate_error", levels.estimateError},
          {"box", {b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z}},
          {"layers", layers}};
}

CloudLevels levelsFrom(const std::string& path, const std::string& key) {
  const std::vector<VdbGrid> grids = readVdbFile(path);
  const auto named = [&](const char* name) {
    return std::find_if(grids.begin(), grids.end(),
                        [&](const VdbGrid& grid) { return labelOf(grid).name == name; });
  };
  const auto surface = named(kLevels), estimate = named(kEstimates);
  require(surface != grids.end(), "it has no levels");
  const json label = json::parse(metadataOf(*surface, kLabel).value_or("{}"));
  require(label.value("key", "") == key, "it holds something else");
  const float halfWidth = label.at("half_width");
  VoxelGrid<float> voxels = toVoxels(*toBricks(*surface));
  VoxelGrid<float> estimates =
      estimate != grids.end() ? toVoxels(*toBricks(*estimate))
                              : VoxelGrid<float>("estimates", label.at("voxel_size").get<double>(), 0.0f);
  require(digestOf(voxels, estimates) == label.at("digest").get<std::string>(), "it is damaged");
  CloudLevels levels{NarrowBand(std::move(voxels), -halfWidth, halfWidth), std::move(estimates)};
  levels.halfWidth = halfWidth;
  levels.estimateError = label.at("estimate_error");
  const auto box = label.at("box").get<std::array<float, 6>>();
  levels.box = {{box[0], box[1], box[2]}, {box[3], box[4], box[5]}};
  for (const json& r : label.at("layers"))
    levels.layers.push_back({.amplitude = r.at(0),
                             .frequency = r.at(1),
                             .voxelSize = r.at(2),
                             .activeVoxels = r.at(3),
                             .unconvergedFraction = r.at(4),
                             .meanDisplacement = r.at(5)});
  return levels;
}

bool isOurs(const std::string& name) {
  constexpr std::size_t kDigits = 16;
  const std::string prefix = kPrefix, extension = kExtension;
  return name.size() == prefix.size() + kDigits + extension.size() && name.starts_with(prefix) &&
         name.ends_with(extension) &&
         name.find_first_not_of("0123456789abcdef", prefix.size()) == prefix.size() + kDigits;
}

}  // namespace

std::string LevelCache::pathOf(const std::string& key) const {
  return (fs::path(options_.folder) / (kPrefix + key + kExtension)).string();
}

std::optional<CloudLevels> LevelCache::read(const std::string& key, const Progress& progress) const {
  const std::string path = pathOf(key);
  std::error_code error;
  if (!fs::exists(path, error)) return std::nullopt;
  progress.begin("cache");
  const auto tell = [&](const char* what) {
    progress.note(fmt::format("{}: cannot be used, so that layers are made again: {}", path, what));
  };
  try {
    CloudLevels levels = levelsFrom(path, key);
    fs::last_write_time(path, fs::file_time_type::clock::now(), error);
    return levels;
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& failure) {
    tell(failure.what());
  } catch (const json::exception&) {
    tell("it says of itself what cannot be");
  }
  return std::nullopt;
}

bool LevelCache::write(const std::string& key, const CloudLevels& levels, const Progress& progress) const {
  progress.begin("cache");
  const std::string path = pathOf(key);
  try {
    std::error_code error;
    fs::create_directories(options_.folder, error);
    require(!error, fmt::format("the folder {} cannot be made: {}", options_.folder, error.message()));
    VoxelGrid<float> surface = levels.levels.voxels();
    const std::string label = labelOf(key, levels, surface).dump();
    std::vector<VdbGrid> grids{
        toVdb(std::move(surface),
              {.name = kLevels, .gridClass = VdbGridInfo::Class::levelSet, .metadata = {{kLabel, label}}})};
    if (levels.estimates.sampledBricks() > 0)
      grids.push_back(toVdb(copyOf(levels.estimates), {.name = kEstimates}));
    writeVdbFile(path, grids, {{"creator", "nephele"}});
    forgetOldest(path, progress);
    return fs::exists(path, error);
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& failure) {
    progress.note(fmt::format("the layers are not kept: {}", failure.what()));
  }
  return false;
}

void LevelCache::forgetOldest(const std::string& kept, const Progress& progress) const {
  struct File {
    fs::file_time_type time;
    fs::path path;
    double bytes;
  };
  std::vector<File> files;
  double all = 0;
  std::error_code error;
  for (fs::directory_iterator i(options_.folder, error), end; !error && i != end; i.increment(error)) {
    const std::string name = i->path().filename().string();
    std::error_code gone;
    // Of processes that were killed.
    if (name.starts_with(std::string(".") + kPrefix) &&
        fs::file_time_type::clock::now() - i->last_write_time(gone) > std::chrono::hours(24))
      fs::remove(i->path(), gone);
    if (!isOurs(name)) continue;
    const File file{i->last_write_time(gone), i->path(), double(i->file_size(gone))};
    if (gone) continue;
    files.push_back(file);
    all += file.bytes;
  }
  // What was just written goes last.
  const auto isKept = [&](const File& file) { return file.path == fs::path(kept); };
  std::sort(files.begin(), files.end(), [&](const File& a, const File& b) {
    return isKept(a) != isKept(b) ? isKept(b) : a.time != b.time ? a.time < b.time : a.path < b.path;
  });
  for (const File& file : files) {
    if (all <= options_.mostBytes) return;
    std::error_code gone;
    fs::remove(file.path, gone);
    all -= file.bytes;
    if (isKept(file))
      progress.note(
          fmt::format("the layers are not kept: {:.3g} GB are more than the cache may hold, {:.3g} GB",
                      file.bytes / 1e9, options_.mostBytes / 1e9));
  }
}

}  // namespace nephele
