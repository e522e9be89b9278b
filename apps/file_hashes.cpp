#include "apps/file_hashes.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <fstream>
#include <vector>

namespace nephele::apps {

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

const std::string& FileHashes::of(const std::string& path) {
  Known& known = known_[path];
  if (std::string stamp = fileStamp(path); known.hash.empty() || known.stamp != stamp) {
    ContentHash hash;
    hash.addFile(path);
    known = {std::move(stamp), hash.text()};
  }
  return known.hash;
}

}  // namespace nephele::apps
