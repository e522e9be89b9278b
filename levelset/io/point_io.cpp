#include "nephele/levelset/io/point_io.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <optional>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

bool isBetween(char c) {
  return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r';
}

/// The first three numbers of a line, or nothing.
std::optional<Vec3d> pointOf(std::string_view line) {
  Vec3d p;
  const char *at = line.data(), *end = at + line.size();
  for (int axis = 0; axis < 3; ++axis) {
    while (at != end && isBetween(*at)) ++at;
    if (at != end && *at == '+') ++at;
    const auto [last, error] = std::from_chars(at, end, p[axis]);
    if (error != std::errc() || !std::isfinite(p[axis]) || (last != end && !isBetween(*last)))
      return std::nullopt;
    at = last;
  }
  return p;
}

Mesh readTable(const detail::MeshFile& file) {
  Mesh mesh;
  std::string_view rest = file.bytes;
  bool isFirst = true;
  for (std::size_t line = 1; !rest.empty(); ++line) {
    const std::size_t end = rest.find('\n');
    std::string_view text = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    while (!text.empty() && isBetween(text.front())) text.remove_prefix(1);
    if (text.empty() || text.front() == '#') continue;
    if (const auto p = pointOf(text))
      mesh.positions.push_back(*p);
    else if (!isFirst)
      file.failAtLine(line, fmt::format("should be three numbers, found {}", detail::excerpt(text)));
    isFirst = false;
  }
  return mesh;
}

}  // namespace

Mesh readPoints(const std::string& path) {
  if (const auto* held = MemoryFile::contentOf<std::shared_ptr<const Mesh>>(path)) {
    require(!(*held)->positions.empty(), path + ": has no points");
    return **held;
  }
  const std::string content = detail::readWholeFile(path);
  const detail::MeshFile file{path, content};
  const auto endsIn = [&](std::string_view extension) { return path.ends_with(extension); };
  Mesh mesh;
  if (content.starts_with("ply\n") || content.starts_with("ply\r"))
    mesh = detail::readPly(file);
  else if (endsIn(".obj") || endsIn(".OBJ"))
    mesh = detail::readObj(file);
  else if (endsIn(".txt") || endsIn(".csv") || endsIn(".xyz"))
    mesh = readTable(file);
  else
    return readMesh(path);
  if (mesh.positions.empty()) file.fail("has no points");
  return mesh;
}

}  // namespace nephele
