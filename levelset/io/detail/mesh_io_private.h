#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>

#include "nephele/modeling/base/mesh.h"

// What the mesh readers share. Not for other folders.
namespace nephele::detail {

/// A file in memory. Readers look at the bytes only; the path is for messages.
struct MeshFile {
  std::string path;
  std::string_view bytes;

  /// @throws Error "<path>: <what>"
  [[noreturn]] void fail(const std::string& what) const;
  /// @throws Error "<path>: line <line>: <what>"
  [[noreturn]] void failAtLine(std::size_t line, const std::string& what) const;
  /// Refuses a declared count (vertices, faces) that `bytesEach` bytes per item cannot hold, before
  /// allocating.
  void requireRoom(std::uint64_t count, std::uint64_t bytesEach, const char* items) const;
};

/// Whole content of a file. @throws Error naming the path if it cannot be read.
std::string readWholeFile(const std::string& path);

Mesh readObj(const MeshFile& file);
Mesh readPly(const MeshFile& file);
Mesh readStl(const MeshFile& file);
Mesh readOff(const MeshFile& file);
/// glTF 2, text or binary; external buffers are looked for beside the file.
Mesh readGltf(const MeshFile& file);

/// `folder` is where the file will be: files of materials are named as seen from there.
void writeObj(std::FILE* stream, const Mesh& mesh, const std::string& folder);
void writePly(std::FILE* stream, const Mesh& mesh);
void writeStl(std::FILE* stream, const Mesh& mesh);

/// Walks through a text file line by line, number by number. All reads stay on the current line.
class TextScanner {
 public:
  /// `continuation`: a backslash before the end of a line joins it with the next.
  TextScanner(const MeshFile& file, bool continuation);

  std::size_t line() const { return line_; }
  bool atEnd() const { return cursor_ == end_; }
  /// Skips blanks; true at the end of the line or at a comment ('#').
  bool atLineEnd();
  /// Goes behind the end of the line: LF, CR LF or CR.
  void nextLine();
  /// The next run of characters that are not blank; empty at the end of the line.
  std::string_view word();
  /// The rest of the line without surrounding blanks.
  std::string_view rest();
  /// A finite number. @throws Error with the line if there is none; `what` names it ("a coordinate").
  double number(const char* what);
  /// One that single precision can hold.
  float single(const char* what);
  std::int64_t integer(const char* what);
  /// Takes `character` if it comes next.
  bool take(char character) {
    if (cursor_ == end_ || *cursor_ != character) return false;
    ++cursor_;
    return true;
  }
  bool atBlankOrLineEnd() const {
    return cursor_ == end_ || static_cast<unsigned char>(*cursor_) <= ' ' || *cursor_ == '\\' ||
           *cursor_ == '#';
  }
  /// True if a digit or sign comes next.
  bool atInteger() const {
    return cursor_ != end_ && ((*cursor_ >= '0' && *cursor_ <= '9') || *cursor_ == '-');
  }
  [[noreturn]] void fail(const std::string& what) const { file_.failAtLine(line_, what); }

 private:
  void skipBlanks();

  const MeshFile& file_;
  const char* cursor_;
  const char* end_;
  std::size_t line_ = 1;
  bool continuation_;
};

/// `text` cut to a few printable characters, for messages.
std::string excerpt(std::string_view text);

/// Corner attribute "uv", built while corners arrive; corners without coordinates are (0, 0).
/// Nothing is stored until the first corner has one.
class CornerUvs {
 public:
  void set(std::size_t corner, float u, float v) {
    if (values_.size() < 2 * corner) values_.resize(2 * corner, 0.0f);
    values_.push_back(u);
    values_.push_back(v);
  }
  void addTo(Mesh& mesh);

 private:
  std::vector<float> values_;
};

}  // namespace nephele::detail
