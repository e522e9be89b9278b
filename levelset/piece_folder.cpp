// A folder of files that belong together. pieces.json, put in place last, says which files a cut made, so
// that the next one knows what is its own and what is the user's.
#include "levelset/piece_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "levelset/piece_files.h"
#include "modeling/error.h"

namespace nephele::detail {
namespace {

namespace fs = std::filesystem;

// The files that a list names, if it is one of ours. Names with folders in them are not.
std::vector<std::string> filesListed(const std::string& path) {
  std::ifstream stream(path);
  const auto list = nlohmann::json::parse(stream, nullptr, false);
  require(list.is_object() && list.value("creator", "") == "nephele" && list.contains("files") &&
              list["files"].is_array(),
          fmt::format("{}: was not written by a cut; move it away or write to another folder", path));
  std::vector<std::string> files;
  for (const auto& file : list["files"])
    if (file.is_string()) {
      const fs::path name = file.get<std::string>();
      if (name.has_filename() && name == name.filename() && name != "." && name != "..")
        files.push_back(name.string());
    }
  return files;
}

}  // namespace

PieceFolder::PieceFolder(std::string path) : path_(std::move(path)) {
  require(!path_.empty(), "the name of the folder for pieces is empty");
  std::error_code error;
  fs::path folder = fs::absolute(path_).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  if (fs::exists(folder, error)) {
    require(fs::is_directory(folder, error),
            fmt::format("cannot write pieces to {}: it is no folder", path_));
    if (fs::exists(pathOf(kList), error)) listed_ = filesListed(pathOf(kList));
    return;
  }
  for (fs::path p = folder; !fs::exists(p, error) && p.has_relative_path(); p = p.parent_path())
    made_.insert(made_.begin(), p.string());
  for (std::size_t i = 0; i < made_.size(); ++i)
    if (!fs::create_directory(made_[i], error) && error) {
      for (std::size_t k = i; k-- > 0;) fs::remove(made_[k]);
      throw Error(fmt::format("cannot make the folder {}: {}", path_, error.message()));
    }
}

PieceFolder::~PieceFolder() {
  outputs_.clear();
  std::error_code ignored;
  if (!committed_)
    for (std::size_t i = made_.size(); i-- > 0;) fs::remove(made_[i], ignored);
}

std::string PieceFolder::pathOf(const std::string& name) const {
  return (fs::path(path_) / name).string();
}

void PieceFolder::expect(const std::vector<std::string>& names) {
  const std::set<std::string> listed(listed_.begin(), listed_.end()), wanted(names.begin(), names.end());
  for (const auto& entry : fs::directory_iterator(path_)) {
    const std::string name = entry.path().filename().string();
    const std::string extension = entry.path().extension().string();
    const bool isLikePiece = (extension == ".obj" || extension == ".ply") && isPieceName(entry.path().stem());
    require(name == kList || listed.count(name) > 0 || (wanted.count(name) == 0 && !isLikePiece),
            fmt::format("{}: {} is in the way, which no {} there lists; move it away or write to another "
                        "folder",
                        path_, name, kList));
  }
  names_ = names;
  outputs_.resize(names.size());
}

const std::string& PieceFolder::temporary(std::size_t index) {
  outputs_[index] = std::make_unique<OutputFile>(pathOf(names_[index]));
  return outputs_[index]->temporaryPath();
}

void PieceFolder::commit() {
  std::error_code ignored;
  // While its files go, the old list still names them, so that what is missing is missed. (Some file systems
  // wait for the disk where a file is replaced, not where one is new.)
  for (const std::string& file : listed_)
    if (file != kList) fs::remove(pathOf(file), ignored);
  std::vector<OutputFile*> all;
  for (const auto& output : outputs_)
    if (output) all.push_back(output.get());
  commitTogether(all);
  committed_ = true;
}

}  // namespace nephele::detail
