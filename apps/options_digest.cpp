#include "apps/options_digest.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/app.h"
#include "apps/options/outputs.h"
#include "apps/options/picture/view_options.h"
#include "nephele/levelset/cut/piece_files.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/obj_text.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/image_file.h"

namespace nephele::apps {
namespace {

/// How the program runs. What --config and --look set counts as if it were typed.
constexpr std::string_view kHow[]{"config",       "look",           "skip-existing", "threads",
                                  "memory-limit", "display-server", "quiet",         "verbose",
                                  "progress",     "overwrite",      "help"};

std::string extensionOf(const std::string& path) {
  return CLI::detail::to_lower(std::filesystem::path(path).extension().string());
}

std::string digestOfPicture(const std::string& path) {
  std::string digest;
  const detail::ImageReader reader{[&](const detail::ImageHeader& header) {
                                     for (const auto& [name, value] : header.attributes)
                                       if (name == kPartDigest) digest = value;
                                   },
                                   [](int, const float*) {},
                                   [](std::span<const unsigned>, std::span<const std::vector<float>>) {}};
  extensionOf(path) == ".png" ? detail::readPngFile(path, reader) : detail::readExrFile(path, reader);
  return digest;
}

std::string digestOfVolume(const std::string& path) {
  const std::vector<VdbGrid> grids = readVdbFile(path);
  return grids.empty() ? "" : metadataOf(grids.front(), kPartDigest).value_or("");
}

/// That its list of pieces has.
std::string digestOfPieces(const std::string& folder) {
  static_cast<void>(readPieces(folder));
  std::ifstream list(std::filesystem::path(folder) / "pieces.json");
  const nlohmann::json found = nlohmann::json::parse(list, nullptr, false);
  require(found.is_object(), folder + ": has no list of pieces");
  for (const nlohmann::json& file : found.value("files", nlohmann::json::array()))
    require(
        file.is_string() && std::filesystem::exists(std::filesystem::path(folder) / file.get<std::string>()),
        fmt::format("{}: has no {}", folder, file.dump()));
  return found.value(kPartDigest, "");
}

/// What ends early between two lines can be read, too.
void requireWholeMesh(const std::string& path) {
  static_cast<void>(readMesh(path));
  if (extensionOf(path) != ".obj") return;
  std::ifstream file(path, std::ios::binary);
  std::string end(detail::kObjEnd.size(), ' ');
  file.seekg(-std::streamoff(end.size()), std::ios::end);
  file.read(end.data(), std::streamsize(end.size()));
  require(end == detail::kObjEnd, path + ": has no last line");
}

}  // namespace

std::string optionsDigest(const CLI::App& app, std::span<const std::string_view> others,
                          const std::string& more, FileHashes& files) {
  ContentHash hash;
  hash.add(NEPHELE_VERSION);
  hash.add(app.get_name());
  hash.add(more);
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = option->get_single_name();
    if (option->count() == 0 || isOutput(*option) || std::ranges::count(others, name) > 0 ||
        std::ranges::count(kHow, name) > 0)
      continue;
    hash.add(name);
    for (const std::string& value : option->results()) {
      std::error_code ignored;
      const std::size_t equals = value.find('=');
      const std::string rest = equals == std::string::npos ? value : value.substr(equals + 1);
      const bool isFile = std::filesystem::is_regular_file(rest, ignored);
      hash.add(isFile ? value.substr(0, value.size() - rest.size()) : value);
      for (const std::string& file : isFile ? std::vector{rest} : namesIn(value))
        if (std::filesystem::is_regular_file(file, ignored)) hash.add(files.of(file));
    }
  }
  if (app.get_option_no_throw("--ocio-config") && std::ranges::count(others, "view-transform") == 0)
    hash.add(
        ViewOptions{.name = givenValue(app, "--view-transform"), .config = givenValue(app, "--ocio-config")}
            .identity());
  return hash.text();
}

std::string outputDigest(const std::string& path) {
  if (std::filesystem::is_directory(path)) return digestOfPieces(path);
  if (isVolumeFile(path)) return digestOfVolume(path);
  if (!isMeshFile(path)) return digestOfPicture(path);
  requireWholeMesh(path);
  return "";
}

std::string outputDefect(const std::string& path, const std::string& digest) {
  try {
    const std::string found = outputDigest(path);
    return found == digest || isMeshFile(path) ? "" : kOtherDigest;
  } catch (const Error& error) {
    return fmt::format("is not whole ({})", error.what());
  }
}

}  // namespace nephele::apps
