#include "nephele/levelset/io/point_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <limits>
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

/// Also one that is not finite, or beyond what doubles hold.
bool isNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [last, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error != std::errc::invalid_argument && last == text.data() + text.size();
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

/// A title as names of attributes are: "v.x" is "vx".
std::string nameOf(std::string_view title) {
  std::string name;
  for (const unsigned char c : title)
    if (std::isalnum(c)) name += char(std::tolower(c));
  return name;
}

/// The columns that titles name as other programs do (x, P.x, pos_x, Points:0), if there are all three.
std::optional<Axes> axesOf(const std::vector<std::string_view>& titles) {
  Axes axes{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string letter(1, "xyz"[k]), digit(1, "012"[k]);
    const auto isOfAxis = [&](std::string_view title) {
      const std::string name = nameOf(title);
      return name == letter ||
             std::ranges::any_of(
                 std::array<std::string, 5>{"p", "pos", "position", "point", "points"},
                 [&](const std::string& of) { return name == of + letter || name == of + digit; });
    };
    const auto found = std::ranges::find_if(titles, isOfAxis);
    if (found == titles.end()) return std::nullopt;
    axes[k] = std::size_t(found - titles.begin());
  }
  return axes;
}

/// The columns beside x, y and z, as attributes of one number each. One that holds words is left out; what is
/// missing among numbers is NaN, which whoever needs that number refuses.
class OtherColumns {
 public:
  OtherColumns(const std::vector<std::string_view>& titles, const Axes& axes) {
    for (std::size_t column = 0; column < titles.size(); ++column)
      if (std::ranges::find(axes, column) == axes.end() && !nameOf(titles[column]).empty())
        columns_.push_back({column, {nameOf(titles[column]), MeshAttribute::Domain::vertex, 1, {}}});
  }

  void add(const std::vector<std::string_view>& row) {
    std::erase_if(columns_, [&](Column& column) {
      const std::string_view cell = column.place < row.size() ? row[column.place] : std::string_view();
      const auto value = numberOf(cell);
      column.attribute.values.push_back(float(value.value_or(std::numeric_limits<double>::quiet_NaN())));
      return !value && !cell.empty() && !isNumber(cell);
    });
  }

  /// Colours of three columns are one attribute, as those of other files are.
  std::vector<MeshAttribute> attributes() && {
    std::erase_if(columns_, [](const Column& column) {
      return std::ranges::all_of(column.attribute.values, [](float value) { return std::isnan(value); });
    });
    const std::array<std::string, 3> colours[] = {
        {"red", "green", "blue"}, {"r", "g", "b"}, {"cdr", "cdg", "cdb"}, {"colorr", "colorg", "colorb"}};
    std::vector<MeshAttribute> result;
    for (const auto& names : colours) {
      std::array<const MeshAttribute*, 3> parts{};
      for (std::size_t k = 0; k < 3; ++k)
        for (const Column& column : columns_)
          if (column.attribute.name == names[k]) parts[k] = &column.attribute;
      if (std::ranges::find(parts, nullptr) != parts.end()) continue;
      MeshAttribute color{"color", MeshAttribute::Domain::vertex, 3, {}};
      for (std::size_t i = 0; i < parts[0]->values.size(); ++i)
        for (const MeshAttribute* part : parts) color.values.push_back(part->values[i]);
      result.push_back(std::move(color));
      std::erase_if(columns_, [&](const Column& column) {
        return std::ranges::find(names, column.attribute.name) != names.end();
      });
      break;
    }
    for (Column& column : columns_)
      if (std::ranges::none_of(result, [&](const auto& a) { return a.name == column.attribute.name; }))
        result.push_back(std::move(column.attribute));
    return result;
  }

 private:
  struct Column {
    std::size_t place;
    MeshAttribute attribute;
  };
  std::vector<Column> columns_;
};

Mesh readTable(const detail::MeshFile& file) {
  Mesh mesh;
  std::string_view rest = withoutByteOrderMark(file.bytes);
  Axes axes{0, 1, 2};
  OtherColumns others({}, axes);
  bool isFirst = true;
  for (std::size_t line = 1; !rest.empty(); ++line) {
    const std::size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
    const std::string_view text = rest.substr(0, end);
    rest.remove_prefix(end);
    rest.remove_prefix(rest.starts_with("\r\n") ? 2 : std::min<std::size_t>(rest.size(), 1));
    const std::vector<std::string_view> columns = columnsOf(text);
    if (columns.empty() || columns[0].starts_with('#')) continue;
    if (const auto p = pointOf(columns, axes)) {
      mesh.positions.push_back(*p);
      others.add(columns);
    } else if (isFirst && std::ranges::none_of(columns, isNumber)) {
      if (const auto titled = axesOf(columns)) {
        axes = *titled;
        others = OtherColumns(columns, axes);
      }
    } else {
      file.failAtLine(line, fmt::format("should be three numbers, found {}", detail::excerpt(text)));
    }
    isFirst = false;
  }
  mesh.attributes = std::move(others).attributes();
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
