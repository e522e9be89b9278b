#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace nephele::apps {

/// A 64 bit FNV-1a hash of what something is made of.
class ContentHash {
 public:
  void add(std::string_view bytes);
  /// A file by what it holds, wherever it is.
  void addFile(const std::string& path);
  template <class T>
  void addNumbers(std::span<const T> numbers) {
    add({reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()});
  }
  /// 16 digits.
  std::string text() const;

 private:
  std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// Size and time of the last change of a file; "" where there is none.
std::string fileStamp(const std::string& path);

/// What may be the name of a file in `text`: all of it, what stands within quotes, and what begins behind an
/// equals sign or a colon, or ends before a colon; longer ones come first. What a script writes is not there.
std::vector<std::string> namesIn(std::string_view text);

/// Hashes of what files hold, each read once while its stamp stays the same.
class FileHashes {
 public:
  /// Scripts (.felt), recipes (.toml) and .gltf count with the files that they name, seen from here or from
  /// their own folder.
  std::string of(const std::string& path);

 private:
  struct Known {
    std::string stamp, hash;
    std::vector<std::string> names;
  };
  const Known& knownOf(const std::string& path);

  std::map<std::string, Known> known_;
};

}  // namespace nephele::apps
