// Reading and writing of meshes: files into memory, choice of the format, and what the formats share.
//
// A file is read whole, then parsed in place with std::from_chars. The content decides where it has a
// signature (ply, glTF), the extension where not. Every format ends in the same checks, so no reader can hand
// out a mesh without faces.
#include "nephele/levelset/io/mesh_io.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <system_error>

#include "nephele/levelset/io/detail/file_extension.h"
#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele {
namespace detail {
namespace {

bool isBlank(char c) {
  return c == ' ' || c == '\t' || c == '\v' || c == '\f';
}
bool isLineEnd(char c) {
  return c == '\n' || c == '\r';
}

}  // namespace

void MeshFile::fail(const std::string& what) const {
  throw Error(fmt::format("{}: {}", path, what));
}

void MeshFile::failAtLine(std::size_t line, const std::string& what) const {
  throw Error(fmt::format("{}: line {}: {}", path, line, what));
}

void MeshFile::requireRoom(std::uint64_t count, std::uint64_t bytesEach, const char* items) const {
  if (count > bytes.size() / std::max<std::uint64_t>(bytesEach, 1))
    fail(fmt::format("declares {} {}, more than its {} bytes can hold", count, items, bytes.size()));
  if (count > 0x7FFFFFFFu) fail(fmt::format("declares {} {}, more than 2147483647", count, items));
}

std::string readWholeFile(const std::string& path) {
  const auto failed = [&](int error) {
    return Error(fmt::format("{}: cannot be read: {}", path, std::generic_category().message(error)));
  };
  requireWholeName(path);
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw failed(errno);
  const std::unique_ptr<const int, void (*)(const int*)> closer(&descriptor,
                                                                [](const int* d) { ::close(*d); });

  struct stat status {};
  if (::fstat(descriptor, &status) != 0) throw failed(errno);
  if (S_ISDIR(status.st_mode)) throw failed(EISDIR);
  // Devices need not end, as pipes do.
  require(!S_ISCHR(status.st_mode) && !S_ISBLK(status.st_mode), path + ": is a device, not a file");
  std::string content;
  content.resize(static_cast<std::size_t>(std::max<off_t>(status.st_size, 0)) + 1);
  std::size_t size = 0;
  while (true) {
    // Pipes have no size: grow while there is more.
    if (size == content.size()) content.resize(2 * size);
    const ssize_t got = ::read(descriptor, content.data() + size, content.size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw failed(errno);
    if (got == 0) break;
    size += static_cast<std::size_t>(got);
  }
  content.resize(size);
  return content;
}

TextScanner::TextScanner(const MeshFile& file, bool continuation)
    : file_(file),
      cursor_(withoutByteOrderMark(file.bytes).data()),
      end_(file.bytes.data() + file.bytes.size()),
      continuation_(continuation) {}

void TextScanner::skipBlanks() {
  while (cursor_ != end_) {
    if (isBlank(*cursor_)) {
      ++cursor_;
    } else if (*cursor_ == '\\' && continuation_ && end_ - cursor_ > 1 && isLineEnd(cursor_[1])) {
      ++cursor_;
      nextLine();
    } else {
      return;
    }
  }
}

bool TextScanner::atLineEnd() {
  skipBlanks();
  return cursor_ == end_ || isLineEnd(*cursor_) || *cursor_ == '#';
}

void TextScanner::nextLine() {
  while (cursor_ != end_ && !isLineEnd(*cursor_)) ++cursor_;
  if (cursor_ == end_) return;
  if (*cursor_ == '\r' && end_ - cursor_ > 1 && cursor_[1] == '\n') ++cursor_;
  ++cursor_;
  ++line_;
}

std::string_view TextScanner::word() {
  if (atLineEnd()) return {};
  const char* first = cursor_;
  while (cursor_ != end_ && !isBlank(*cursor_) && !isLineEnd(*cursor_)) ++cursor_;
  return {first, static_cast<std::size_t>(cursor_ - first)};
}

std::string_view TextScanner::rest() {
  skipBlanks();
  const char* first = cursor_;
  while (cursor_ != end_ && !isLineEnd(*cursor_)) ++cursor_;
  const char* last = cursor_;
  while (last != first && isBlank(last[-1])) --last;
  return {first, static_cast<std::size_t>(last - first)};
}

double TextScanner::number(const char* what) {
  if (atLineEnd()) fail(fmt::format("{} is missing", what));
  const char* first = cursor_;
  if (*first == '+' && end_ - first > 1 && first[1] != '-') ++first;
  double value = 0;
  auto [last, error] = std::from_chars(first, end_, value);
  // Too large or too small for from_chars to say which: strtod gives infinity or zero.
  if (error == std::errc::result_out_of_range) value = std::strtod(std::string(first, last).c_str(), nullptr);
  if (error == std::errc::invalid_argument ||
      (last != end_ && !isBlank(*last) && !isLineEnd(*last) && *last != '\\'))
    fail(fmt::format("{} should be a number, found {}", what, excerpt(word())));
  if (!std::isfinite(value)) fail(fmt::format("{} is not finite: {}", what, excerpt(word())));
  cursor_ = last;
  return value;
}

float TextScanner::single(const char* what) {
  const double value = number(what);
  // The largest float written as nine digits is a little above it.
  constexpr double kRoundsToInfinity = 0x1.ffffffp127;
  if (std::fabs(value) >= kRoundsToInfinity) fail(fmt::format("{} is too large: {:g}", what, value));
  return float(value);
}

std::int64_t TextScanner::integer(const char* what) {
  if (atLineEnd()) fail(fmt::format("{} is missing", what));
  std::int64_t value = 0;
  const auto [last, error] = std::from_chars(cursor_, end_, value);
  if (error != std::errc{}) fail(fmt::format("{} should be a whole number, found {}", what, excerpt(word())));
  cursor_ = last;
  return value;
}

std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 48;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest)) result += c >= ' ' && c <= '~' ? c : '?';
  return result + (text.size() > kLongest ? "...'" : "'");
}

void CornerUvs::addTo(Mesh& mesh) {
  if (values_.empty()) return;
  values_.resize(2 * mesh.corners.size(), 0.0f);
  mesh.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, std::move(values_)});
}

}  // namespace detail

namespace {

/// What a reader of the file would refuse is not written.
void requireWritable(const Mesh& mesh, bool asTrianglesOfFloats) {
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3d& p = mesh.positions[v];
    if (asTrianglesOfFloats ? !isFinite(Vec3f(p)) : !isFinite(p))
      throw Error(
          fmt::format("vertex {} is at {:g}, {:g}, {:g}, which this format cannot hold", v, p.x, p.y, p.z));
  }
  if (asTrianglesOfFloats) return;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f)
    if (mesh.face(f).size() < 3)
      throw Error(
          fmt::format("face {} has {} corners; files hold faces of 3 and more", f, mesh.face(f).size()));
}

Mesh parse(const detail::MeshFile& file) {
  const std::string extension = detail::lowerExtension(file.path);
  if (file.bytes.empty()) file.fail("the file is empty");
  if (file.bytes.starts_with("version https://git-lfs"))
    file.fail("is a Git LFS pointer, not the mesh itself; fetch it with 'git lfs pull'");
  if (file.bytes.starts_with("glTF") || extension == ".glb" || extension == ".gltf")
    return detail::readGltf(file);
  if (file.bytes.starts_with("ply\n") || file.bytes.starts_with("ply\r") || extension == ".ply")
    return detail::readPly(file);
  if (extension == ".obj") return detail::readObj(file);
  if (extension == ".stl") return detail::readStl(file);
  if (extension == ".off") return detail::readOff(file);
  file.fail(
      fmt::format("unknown mesh format '{}'; known are .obj, .ply, .stl, .off, .gltf and .glb", extension));
}

}  // namespace

bool isMeshFile(const std::string& path) {
  constexpr const char* kExtensions[] = {".obj", ".ply", ".stl", ".off", ".gltf", ".glb"};
  return std::ranges::find(kExtensions, detail::lowerExtension(path)) != std::end(kExtensions);
}

Mesh readMesh(const std::string& path) {
  if (const auto* held = MemoryFile::contentOf<std::shared_ptr<const Mesh>>(path)) {
    require((*held)->faceCount() > 0,
            fmt::format("{}: has no faces ({} vertices)", path, (*held)->positions.size()));
    return **held;
  }
  const std::string content = detail::readWholeFile(path);
  const detail::MeshFile file{path, content};
  Mesh mesh;
  try {
    mesh = parse(file);
  } catch (const std::bad_alloc&) {
    file.fail("not enough memory to read it");
  }
  if (mesh.faceCount() == 0) file.fail(fmt::format("has no faces ({} vertices)", mesh.positions.size()));
  return mesh;
}

void writeMesh(const std::string& path, const Mesh& mesh) {
  namingFile(path, [&] { requireWritable(requireValid(mesh), detail::lowerExtension(path) == ".stl"); });
  const std::string extension = detail::lowerExtension(path);
  const bool isObj = extension == ".obj", isPly = extension == ".ply";
  require(isObj || isPly || extension == ".stl",
          fmt::format("cannot write {}: unknown mesh format '{}'; .obj, .ply and .stl can be written", path,
                      extension));

  if (MemoryFile::put(path, [&] { return std::make_shared<const Mesh>(mesh); })) return;
  OutputFile output(path);
  OutputStream stream(output);
  namingFile(path, [&] {
    if (isObj)
      detail::writeObj(stream.file(), mesh, std::filesystem::path(path).parent_path().string());
    else
      (isPly ? detail::writePly : detail::writeStl)(stream.file(), mesh);
  });
  stream.close();
  output.commit();
}

}  // namespace nephele
