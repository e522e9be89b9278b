#pragma once

#include <any>
#include <string>
#include <string_view>

namespace nephele {

/// A path under which an object of this process is found in place of a file, as long as this lives: readers
/// of meshes and volumes take what it holds, writers of meshes, volumes and pictures leave there what they
/// would have written. Nothing is encoded and no file is made. For programs that call with objects what is
/// made for files.
class MemoryFile {
 public:
  /// `name` begins the path and messages about it; `extension` ends it and says what it stands for: ".ply".
  /// The path is like no other that lives.
  MemoryFile(std::string_view name, std::string_view extension, std::any content = {});
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& path() const { return path_; }
  /// What was put or written here.
  std::any& content() { return content_; }
  const std::any& content() const { return content_; }

  /// The one that has this path, or null where the path is that of a file. Thread-safe; the content is not.
  static MemoryFile* find(const std::string& path);
  /// What the one of this path holds, or null if the path is that of a file. @throws Error naming the path if
  /// it holds something else.
  template <class T>
  static const T* contentOf(const std::string& path) {
    const MemoryFile* file = find(path);
    if (!file) return nullptr;
    const T* content = std::any_cast<T>(&file->content_);
    if (!content) refuse(path);
    return content;
  }
  /// Puts what make() returns there, if the path is one of these, and says whether it is.
  template <class Make>
  static bool put(const std::string& path, Make&& make) {
    MemoryFile* file = find(path);
    if (file) file->content_ = make();
    return file != nullptr;
  }

 private:
  [[noreturn]] static void refuse(const std::string& path);

  std::string path_;
  std::any content_;
};

}  // namespace nephele
