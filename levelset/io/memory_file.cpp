#include "nephele/levelset/io/memory_file.h"

#include <fmt/format.h>

#include <map>
#include <mutex>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

struct Table {
  std::mutex mutex;
  std::map<std::string, MemoryFile*, std::less<>> files;
  std::size_t made = 0;
};

// Never destroyed: files may live as long as the process.
Table& table() {
  static Table& all = *new Table;
  return all;
}

}  // namespace

MemoryFile::MemoryFile(std::string_view name, std::string_view extension, std::any content)
    : content_(std::move(content)) {
  Table& all = table();
  const std::lock_guard lock(all.mutex);
  path_ = fmt::format("{}<{}>{}", name, ++all.made, extension);
  all.files.emplace(path_, this);
}

MemoryFile::~MemoryFile() {
  Table& all = table();
  const std::lock_guard lock(all.mutex);
  all.files.erase(path_);
}

MemoryFile* MemoryFile::find(const std::string& path) {
  Table& all = table();
  const std::lock_guard lock(all.mutex);
  const auto found = all.files.find(path);
  return found == all.files.end() ? nullptr : found->second;
}

void MemoryFile::refuse(const std::string& path) {
  throw Error(path + ": holds something else than what is to be read here");
}

}  // namespace nephele
