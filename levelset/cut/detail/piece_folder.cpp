// A folder of files that belong together. pieces.json, put in place last, says which files a cut made, so
// that the next one knows what is its own and what is the user's.
#include "nephele/levelset/cut/detail/piece_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>

#include "nephele/levelset/cut/piece_files.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/text_file.h"

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

/// Keeps other cuts from putting files into the folder as long as it lives.
class FolderLock {
 public:
  explicit FolderLock(const std::string& path)
      : descriptor_(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    // File systems that know no locks are written to without one.
    while (descriptor_ >= 0 && ::flock(descriptor_, LOCK_EX) != 0 && errno == EINTR) {
    }
  }
  ~FolderLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace

PieceFolder::PieceFolder(std::string path) : path_(std::move(path)) {
  require(!path_.empty(), "the name of the folder for pieces is empty");
  requireWholeName(path_);
  std::error_code error;
  fs::path folder = fs::absolute(path_).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  const fs::file_status status = fs::symlink_status(folder, error);
  require(status.type() != fs::file_type::none,
          fmt::format("cannot make the folder {}: {}", path_, error.message()));
  if (fs::exists(status)) {
    require(fs::is_directory(folder, error),
            fmt::format("cannot write pieces to {}: it is no folder", path_));
    if (fs::exists(pathOf(kList), error)) listed_ = filesListed(pathOf(kList));
    return;
  }
  target_ = folder.string();
  makeFolder();
}

void PieceFolder::makeFolder() {
  std::error_code error;
  const fs::path folder(target_), parent = folder.parent_path();
  const auto failed = [&] {
    for (std::size_t k = made_.size(); k-- > 0;) ::rmdir(made_[k].c_str());
    made_.clear();
    return Error(fmt::format("cannot make the folder {}: {}", path_, error.message()));
  };
  std::vector<std::string> missing;
  for (fs::path p = parent; !fs::exists(p, error) && p.has_relative_path(); p = p.parent_path())
    missing.insert(missing.begin(), p.string());
  for (const std::string& name : missing) {
    if (!fs::create_directory(name, error) && error) throw failed();
    made_.push_back(name);
  }
  static std::atomic<unsigned> serial{0};
  for (int attempt = 0; attempt < 1000; ++attempt) {
    staging_ =
        (parent / fmt::format(".{}.{}-{}", folder.filename().string().substr(0, 100), ::getpid(), serial++))
            .string();
    openStaging_ = std::make_unique<OpenOutput>(staging_);
    if (::mkdir(staging_.c_str(), 0777) == 0) return;
    error.assign(errno, std::generic_category());
    openStaging_.reset();
    if (error != std::errc::file_exists) break;
  }
  throw failed();
}

PieceFolder::~PieceFolder() {
  outputs_.clear();
  if (committed_) return;
  if (!staging_.empty()) {
    for (const std::string& name : names_) ::unlink((fs::path(staging_) / name).c_str());
    ::rmdir(staging_.c_str());
  }
  for (std::size_t i = made_.size(); i-- > 0;) ::rmdir(made_[i].c_str());
}

std::string PieceFolder::pathOf(const std::string& name) const {
  return (fs::path(path_) / name).string();
}

void PieceFolder::expect(const std::vector<std::string>& names) {
  names_ = names;
  outputs_.resize(names.size());
  openFiles_.resize(names.size());
  if (staging_.empty()) requireNoneInTheWay();
}

void PieceFolder::requireNoneInTheWay() const {
  const std::set<std::string> listed(listed_.begin(), listed_.end()), wanted(names_.begin(), names_.end());
  for (const auto& entry : fs::directory_iterator(path_)) {
    const std::string name = entry.path().filename().string();
    const std::string extension = entry.path().extension().string();
    const bool isLikePiece = (extension == ".obj" || extension == ".ply") && isPieceName(entry.path().stem());
    require(name == kList || listed.count(name) > 0 || (wanted.count(name) == 0 && !isLikePiece),
            fmt::format("{}: {} is in the way, which no {} there lists; move it away or write to another "
                        "folder",
                        path_, name, kList));
  }
}

std::string PieceFolder::temporary(std::size_t index) {
  if (!staging_.empty()) {
    std::string path = (fs::path(staging_) / names_[index]).string();
    openFiles_[index] = std::make_unique<OpenOutput>(path);
    return path;
  }
  outputs_[index] = std::make_unique<OutputFile>(pathOf(names_[index]));
  return outputs_[index]->temporaryPath();
}

void PieceFolder::commit() {
  std::error_code ignored;
  if (!staging_.empty()) {
    if (std::rename(staging_.c_str(), target_.c_str()) != 0)
      throw Error(fmt::format("cannot make the folder {}: {}", path_,
                              errno == ENOTEMPTY || errno == EEXIST
                                  ? "another run has made it meanwhile"
                                  : std::generic_category().message(errno)));
    committed_ = true;
    return;
  }
  const FolderLock lock(path_);
  if (fs::exists(pathOf(kList), ignored)) listed_ = filesListed(pathOf(kList));
  requireNoneInTheWay();
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

namespace nephele {

bool isListedPiece(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path file = fs::absolute(path), list = file.parent_path() / detail::PieceFolder::kList;
  std::error_code error;
  return fs::exists(list, error) &&
         std::ranges::count(detail::filesListed(list.string()), file.filename().string()) > 0;
}

}  // namespace nephele
