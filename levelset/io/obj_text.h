#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "nephele/modeling/base/mesh.h"

// Text of OBJ files.
namespace nephele::detail {

/// The last line of meshes, by which those that were cut off are known; to readers it is a comment.
inline constexpr std::string_view kObjEnd = "# end\n";

/// Text on its way to a file, in large pieces, or kept where there is no file.
class TextWriter {
 public:
  explicit TextWriter(std::FILE* stream = nullptr) : stream_(stream) {}
  ~TextWriter() { flush(); }
  TextWriter(const TextWriter&) = delete;
  TextWriter& operator=(const TextWriter&) = delete;

  TextWriter& text(std::string_view s) {
    buffer_.append(s);
    if (stream_ && buffer_.size() > kFlushAt) flush();
    return *this;
  }
  /// The shortest decimal form that reads back to the same value, or the same float where it is one.
  TextWriter& number(double value);
  TextWriter& integer(std::uint64_t value);

  const std::string& kept() const { return buffer_; }
  /// What was kept; the writer is empty then.
  std::string take() { return std::exchange(buffer_, {}); }

 private:
  static constexpr std::size_t kFlushAt = 1 << 16;

  void flush();

  std::FILE* stream_;
  std::string buffer_;
};

/// Texture coordinates, each written once per value, so that charts stay connected in other programs.
struct ObjCoordinates {
  /// Per corner, from 1; empty where the mesh has none.
  std::vector<std::uint32_t> index;
  std::uint32_t count = 0;
};

/// Lines `v` and `vt` of a mesh, whose positions are finite.
/// @throws Error if a colour or texture coordinate is not: no reader takes such a number.
ObjCoordinates writeObjPoints(TextWriter& out, const Mesh& mesh, const Vec3d& offset = {});

/// Lines `mtllib` of the files of materials, as seen from the folder of the .obj.
void writeObjLibraries(TextWriter& out, const std::vector<std::string>& files, const std::string& folder);

/// Lines `f`, behind `usemtl` where the material changes, and behind `g` unless groups are not named; for
/// points that are not the first of their file: `vertices` and `coordinates` of them came before.
void writeObjFaces(TextWriter& out, const Mesh& mesh, const ObjCoordinates& uv, bool areGroupsNamed = true,
                   std::uint64_t vertices = 0, std::uint64_t coordinates = 0);

}  // namespace nephele::detail
