#pragma once

#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>

namespace nephele {

/// The file that writing to `path` is about: where a symbolic link leads, or `path` itself.
std::string outputTarget(const std::string& path);

/// Whether `path` is something that bytes go into and that must not be replaced: a device, a pipe, a socket;
/// or a MemoryFile.
bool isStream(const std::string& path);

/// An output that appears whole or not at all: written under a temporary name in the target's folder, then
/// renamed. Symbolic links stay and what they lead to is written; streams get the bytes on commit.
///
/// The destructor removes the temporary unless `commit` was called. `discardAllOutputs` removes those of a
/// process that is being killed.
class OutputFile {
 public:
  /// @throws Error naming the path if its folder is missing or not writable, or if it is a folder.
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Where to write; has the same extension as the target.
  const std::string& temporaryPath() const { return temporary_; }

  const std::string& path() const { return path_; }

  /// Renames the temporary to the target. @throws Error naming the path.
  void commit();

  /// Removes the target again, if it is a file.
  void withdraw() noexcept;

 private:
  std::string path_;
  std::string target_;
  bool isStream_;
  std::string temporary_;
  void* entry_ = nullptr;  // where discardAllOutputs finds the temporary
  bool committed_ = false;
};

/// What is written of an output, with every fault of the disk told: also those that show only when the last
/// bytes leave the buffer.
class OutputStream {
 public:
  /// Opens the temporary of `output`, which must outlive this. @throws Error naming the path.
  explicit OutputStream(const OutputFile& output);
  ~OutputStream();
  OutputStream(const OutputStream&) = delete;
  OutputStream& operator=(const OutputStream&) = delete;

  /// For those who write through C's library; they need not look for errors.
  std::FILE* file() const { return file_; }

  /// @throws Error naming the path and the reason; Cancelled, see CancelScope.
  void write(std::string_view bytes);
  std::uint64_t position();
  void seek(std::uint64_t position);

  /// @throws Error naming the path and the reason if anything was not written; Cancelled, see CancelScope.
  void close();

  /// Throws what `close` would, where writing has failed already.
  void requireWritten() const;

 private:
  [[noreturn]] void fail() const;

  const OutputFile& output_;
  std::FILE* file_;
  int error_ = 0;  // of the first call that failed
};

/// Commits all, in this order: files that mean something only together. Where one cannot be renamed, those
/// renamed before it are removed. @throws Error naming the path.
void commitTogether(std::span<OutputFile* const> outputs);

/// Unlinks every temporary that is open now, and removes those that are folders. Safe to call from a signal
/// handler.
void discardAllOutputs() noexcept;

namespace detail {

/// A file or folder that `discardAllOutputs` removes as long as this lives: nothing else is done to it.
class OpenOutput {
 public:
  explicit OpenOutput(const std::string& path);
  ~OpenOutput();
  OpenOutput(const OpenOutput&) = delete;
  OpenOutput& operator=(const OpenOutput&) = delete;

 private:
  void* entry_;
};

}  // namespace detail

}  // namespace nephele
