#include "nephele/levelset/io/point_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/levelset/io/memory_file.h"
#include "nephele/levelset/io/mesh_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele {
namespace {

/// What stands between commas or semicolons, if only nothing, or else between blanks; without quotes.
std::vector<std::string_view> columnsOf(std::string_view line) {
  std::vector<std::string_view> columns;
  std::size_t at = 0;
  const auto passBlanks = [&] { at = std::min(line.find_first_not_of(" \t", at), line.size()); };
  for (passBlanks(); at < line.size(); passBlanks()) {
    const bool isQuoted = line[at] == '"';
    const std::size_t begin = isQuoted ? at + 1 : at;
    const std::size_t end = std::min(line.find_first_of(isQuoted ? "\"" : " \t,;", begin), line.size());
    columns.push_back(line.substr(begin, end - begin));
    at = isQuoted && end < line.size() ? end + 1 : end;
    passBlanks();
    if (at < line.size() && (line[at] == ',' || line[at] == ';')) ++at;
  }
  return columns;
}

std::optional<double> numberOf(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || last != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// The columns that hold x, y and z.
using Axes = std::array<std::size_t, 3>;

std::optional<Vec3d> pointOf(const std::vector<std::string_view>& columns, const Axes& axes) {
  Vec3d p;
  for (int k = 0; k < 3; ++k) {
    const std::size_t column = axes[std::size_t(k)];
    const auto value = column < columns.size() ? numberOf(columns[column]) : std::nullopt;
    if (!value) return std::nullopt;
    p[k] = *value;
  }
  return p;
}

/// The columns that titles name as other programs do (x, P.x, pos_x, Points:0), or the first three.
Axes axesOf(const std::vector<std::string_view>& titles) {
  Axes axes{0, 1, 2};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string letter(1, "xyz"[k]), digit(1, "012"[k]);
    const auto isOfAxis = [&](std::string_view title) {
      std::string name;
      for (const unsigned char c : title)
        if (std::isalnum(c)) name += char(std::tolower(c));
      return name == letter ||
             std::ranges::any_of(
                 std::array<std::string, 5>{"p", "pos", "position", "point", "points"},
                 [&](const std::string& of) { return name == of + letter || name == of + digit; });
    };
    const auto found = std::ranges::find_if(titles, isOfAxis);
    if (found == titles.end()) return {0, 1, 2};
    axes[k] = std::size_t(found - titles.begin());
  }
  return axes;
}

Mesh readTable(const detail::MeshFile& file) {
  Mesh mesh;
  std::string_view rest = withoutByteOrderMark(file.bytes);
  Axes axes{0, 1, 2};
  bool isFirst = true;
  for (std::size_t line = 1; !rest.empty(); ++line) {
    const std::size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
    const std::string_view text = rest.substr(0, end);
    rest.remove_prefix(end);
    rest.remove_prefix(rest.starts_with("\r\n") ? 2 : std::min<std::size_t>(rest.size(), 1));
    const std::vector<std::string_view> columns = columnsOf(text);
    if (columns.empty() || columns[0].starts_with('#')) continue;
    if (const auto p = pointOf(columns, axes))
      mesh.positions.push_back(*p);
    else if (isFirst && !numberOf(columns[0]))
      axes = axesOf(columns);
    else
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
