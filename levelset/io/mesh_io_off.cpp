// OFF, with the prefixes ST, C and N (texture coordinates, colours and normals of vertices).
//
// One vertex or face per line, comments from '#'. Colours are whole numbers up to 255 or fractions up to 1:
// the largest value in the file tells. Colours behind faces are dropped. Binary, 4-dimensional and
// n-dimensional variants are refused by name.
#include <fmt/format.h>

#include <algorithm>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

// Next line that holds anything.
bool findLine(TextScanner& scanner) {
  while (scanner.atLineEnd()) {
    if (scanner.atEnd()) return false;
    scanner.nextLine();
  }
  return true;
}

std::uint64_t readCount(TextScanner& scanner, const char* what) {
  const std::int64_t count = scanner.integer(what);
  if (count < 0) scanner.fail(fmt::format("{} is negative: {}", what, count));
  return static_cast<std::uint64_t>(count);
}

}  // namespace

Mesh readOff(const MeshFile& file) {
  TextScanner scanner(file, false);
  if (!findLine(scanner)) file.fail("holds only blank lines and comments");
  const std::string_view keyword = scanner.word();
  std::string_view prefix = keyword;
  const auto takePrefix = [&prefix](std::string_view text) {
    const bool found = prefix.starts_with(text);
    if (found) prefix.remove_prefix(text.size());
    return found;
  };
  const bool hasUvs = takePrefix("ST"), hasColors = takePrefix("C"), hasNormals = takePrefix("N");
  if (prefix == "4OFF" || prefix == "nOFF" || prefix == "4nOFF")
    scanner.fail(fmt::format("{} is not supported; only 3-dimensional OFF is", excerpt(keyword)));
  if (prefix != "OFF") scanner.fail(fmt::format("should start with OFF, found {}", excerpt(keyword)));
  if (!scanner.atLineEnd() && !scanner.atInteger()) {
    const std::string_view kind = scanner.word();
    if (kind == "BINARY") scanner.fail("binary OFF is not supported; convert it to text OFF or PLY");
    scanner.fail(fmt::format("expected vertex and face counts, found {}", excerpt(kind)));
  }

  if (!findLine(scanner)) file.fail("ends before the vertex and face counts");
  const std::uint64_t vertexCount = readCount(scanner, "the vertex count");
  const std::uint64_t faceCount = readCount(scanner, "the face count");
  file.requireRoom(vertexCount, 6, "vertices");  // "0 0 0" and a line end
  file.requireRoom(faceCount, 8, "faces");       // "3 0 1 2" and a line end
  scanner.nextLine();

  Mesh mesh;
  mesh.positions.reserve(vertexCount);
  std::vector<float> uvs, colors;
  std::size_t colorWidth = 0;
  for (std::uint64_t v = 0; v < vertexCount; ++v) {
    if (!findLine(scanner))
      scanner.fail(fmt::format("the file ends after {} of {} vertices", v, vertexCount));
    const double x = scanner.number("a coordinate");
    const double y = scanner.number("a coordinate");
    mesh.positions.emplace_back(x, y, scanner.number("a coordinate"));
    for (int k = 0; hasNormals && k < 3; ++k) scanner.number("a normal");
    if (hasColors) {
      // Texture coordinates are the last two of a line; a colour of three values or four stands before them.
      const char* what = hasUvs ? "a colour or texture coordinate" : "a colour";
      const std::size_t behind = hasUvs ? 2 : 0;
      float values[6] = {};
      std::size_t count = 0;
      while (count < 4 + behind && !scanner.atLineEnd()) values[count++] = scanner.single(what);
      const std::size_t width = count < behind ? 0 : count - behind;
      if (width < 3) scanner.fail(fmt::format("a colour needs 3 or 4 values, this one has {}", width));
      if (colorWidth == 0) colorWidth = width;
      if (width != colorWidth)
        scanner.fail(fmt::format("a colour of {} values after colours of {}", width, colorWidth));
      colors.insert(colors.end(), values, values + width);
      uvs.insert(uvs.end(), values + width, values + count);
    } else {
      for (int k = 0; hasUvs && k < 2; ++k) uvs.push_back(scanner.single("a texture coordinate"));
    }
    scanner.nextLine();
  }

  mesh.faceStart.reserve(faceCount + 1);
  for (std::uint64_t f = 0; f < faceCount; ++f) {
    if (!findLine(scanner)) scanner.fail(fmt::format("the file ends after {} of {} faces", f, faceCount));
    const std::int64_t count = scanner.integer("the corner count of a face");
    if (count < 3) scanner.fail(fmt::format("a face needs at least 3 vertices, this one has {}", count));
    for (std::int64_t k = 0; k < count; ++k) {
      const std::int64_t index = scanner.integer("a vertex index");
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertexCount)
        scanner.fail(
            fmt::format("vertex index {} is out of range (the file has {} vertices)", index, vertexCount));
      mesh.corners.push_back(static_cast<std::uint32_t>(index));
    }
    if (mesh.corners.size() >= 0xFFFFFFFFu) file.fail("has more than 4294967294 face corners");
    mesh.faceStart.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
    scanner.nextLine();
  }

  if (!colors.empty()) {
    if (*std::max_element(colors.begin(), colors.end()) > 1)
      for (float& c : colors) c /= 255.0f;
    mesh.attributes.push_back(
        {"color", MeshAttribute::Domain::vertex, static_cast<int>(colorWidth), std::move(colors)});
  }
  if (!uvs.empty()) {
    CornerUvs cornerUvs;
    for (std::size_t c = 0; c < mesh.corners.size(); ++c)
      cornerUvs.set(c, uvs[2 * std::size_t{mesh.corners[c]}], uvs[2 * std::size_t{mesh.corners[c]} + 1]);
    cornerUvs.addTo(mesh);
  }
  return mesh;
}

}  // namespace nephele::detail
