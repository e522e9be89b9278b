#include "apps/file_hashes.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace nephele::apps {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> namesInFile(const std::string& path) {
  const std::string extension = fs::path(path).extension().string();
  if (extension != ".felt" && extension != ".toml" && extension != ".gltf") return {};
  std::ifstream file(path, std::ios::binary);
  return namesIn(std::string(std::istreambuf_iterator<char>(file), {}));
}

}  // namespace

void ContentHash::add(std::string_view bytes) {
  for (const char byte : bytes) value_ = (value_ ^ std::uint8_t(byte)) * 0x100000001b3u;
  // So that "ab", "c" and "a", "bc" differ.
  value_ = (value_ ^ bytes.size()) * 0x100000001b3u;
}

void ContentHash::addFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> block(std::size_t(1) << 20);
  while (file.read(block.data(), std::streamsize(block.size())) || file.gcount() > 0)
    add({block.data(), std::size_t(file.gcount())});
}

std::string ContentHash::text() const {
  return fmt::format("{:016x}", value_);
}

std::string fileStamp(const std::string& path) {
  struct stat status;
  if (stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return "";
  return fmt::format("{}.{:09}.{}.{}", status.st_mtim.tv_sec, status.st_mtim.tv_nsec, status.st_size,
                     status.st_ino);
}

std::vector<std::string> namesIn(std::string_view text) {
  constexpr std::size_t kLongest = 4096, kMostParts = 16;
  std::vector<std::string> names;
  bool isWritten = false;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find_first_of("\"'\\\n", begin), text.size());
    const std::string_view part = text.substr(begin, end - begin);
    begin = end + 1;
    const bool isOutput = std::exchange(isWritten, part.ends_with("write("));
    if (part.empty() || part.size() > kLongest || isOutput) continue;
    std::vector<std::size_t> starts{0}, ends{part.size()};
    for (std::size_t i = 0; i != part.size(); ++i) {
      if (part[i] == ':' || part[i] == '=') starts.push_back(i + 1);
      if (part[i] == ':') ends.insert(ends.begin() + 1, i);
    }
    if (starts.size() > kMostParts) continue;
    for (const std::size_t from : starts)
      for (const std::size_t to : ends)
        if (from < to) names.emplace_back(part.substr(from, to - from));
  }
  return names;
}

std::string FileHashes::of(const std::string& path) {
  ContentHash hash;
  std::vector<std::string> files{path};
  for (std::size_t i = 0; i != files.size(); ++i) {
    const Known& known = knownOf(files[i]);
    const fs::path folder = fs::path(files[i]).parent_path();
    hash.add(known.hash);
    for (const std::string& name : known.names)
      for (const std::string& file : {name, (folder / name).string()}) {
        std::error_code ignored;
        if (fs::is_regular_file(file, ignored) && std::ranges::count(files, file) == 0) files.push_back(file);
      }
  }
  return hash.text();
}

const FileHashes::Known& FileHashes::knownOf(const std::string& path) {
  Known& known = known_[path];
  if (std::string stamp = fileStamp(path); known.hash.empty() || known.stamp != stamp) {
    ContentHash hash;
    hash.addFile(path);
    known = {std::move(stamp), hash.text(), namesInFile(path)};
  }
  return known;
}

}  // namespace nephele::apps
