// STL, the triangle format without connectivity.
//
// Many binary files start with "solid" and many text files carry odd headers, so the size decides first: a
// file whose facet count at byte 80 fits its length exactly is binary. Equal positions are merged as they
// arrive, which gives back the connectivity that the format drops; positions that differ in one bit stay
// apart (that is for the repair). Solids of a text file become groups. Facet normals and the two attribute
// bytes of a facet are not kept.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele::detail {
namespace {

constexpr std::size_t kHeaderBytes = 84;
constexpr std::size_t kFacetBytes = 50;

static_assert(std::endian::native == std::endian::little, "STL facets are copied as they are");

std::uint32_t binaryFacetCount(const MeshFile& file) {
  std::uint32_t count = 0;
  std::memcpy(&count, file.bytes.data() + 80, 4);
  return count;
}

bool looksLikeText(const MeshFile& file) {
  const std::string_view start = withoutByteOrderMark(file.bytes).substr(0, 512);
  const std::size_t first = start.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && start.find('\0') == std::string_view::npos &&
         (start.substr(first).starts_with("solid") || start.substr(first).starts_with("SOLID"));
}

// Shares equal positions of a mesh whose corners run 0, 1, 2, ...
void weld(Mesh& mesh) {
  const std::vector<std::uint32_t> first = firstEqualPosition(mesh.positions);
  std::vector<std::uint32_t> kept(first.size());
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    kept[i] = first[i] == i ? count++ : kept[first[i]];
    if (first[i] == i) mesh.positions[kept[i]] = mesh.positions[i];
  }
  mesh.positions.resize(count);
  mesh.positions.shrink_to_fit();
  for (std::uint32_t& corner : mesh.corners) corner = kept[corner];
}

void addCorner(Mesh& mesh, const Vec3d& p) {
  mesh.corners.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
  mesh.positions.push_back(p);
}

Mesh readBinary(const MeshFile& file) {
  const std::size_t count = binaryFacetCount(file);
  const std::size_t available = (file.bytes.size() - kHeaderBytes) / kFacetBytes;
  if (count > available)
    file.fail(fmt::format("is cut short: it declares {} triangles but holds {}", count, available));
  if (count > 0xFFFFFFFFu / 3) file.fail(fmt::format("has too many triangles: {}", count));
  Mesh mesh;
  mesh.positions.reserve(3 * count);
  mesh.corners.reserve(3 * count);
  mesh.faceStart.reserve(count + 1);
  for (std::size_t f = 0; f < count; ++f) {
    float values[12];
    std::memcpy(values, file.bytes.data() + kHeaderBytes + f * kFacetBytes, sizeof values);
    for (int k = 1; k < 4; ++k) {
      const Vec3d p(values[3 * k], values[3 * k + 1], values[3 * k + 2]);
      if (!isFinite(p)) file.fail(fmt::format("triangle {}: a coordinate is not finite", f + 1));
      addCorner(mesh, p);
    }
    mesh.faceStart.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  }
  return mesh;
}

bool equalsIgnoringCase(std::string_view word, std::string_view lower) {
  return std::equal(word.begin(), word.end(), lower.begin(), lower.end(),
                    [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; });
}

Mesh readText(const MeshFile& file) {
  Mesh mesh;
  TextScanner scanner(file, false);
  bool inSolid = false, inLoop = false;
  std::string name;
  std::uint32_t groupStart = 0;
  for (; !scanner.atEnd(); scanner.nextLine()) {
    const std::string_view keyword = scanner.word();
    if (keyword.empty()) continue;
    if (equalsIgnoringCase(keyword, "vertex")) {
      if (!inLoop) scanner.fail("'vertex' outside of 'outer loop'");
      const double x = scanner.number("a coordinate");
      const double y = scanner.number("a coordinate");
      addCorner(mesh, {x, y, scanner.number("a coordinate")});
    } else if (equalsIgnoringCase(keyword, "outer")) {
      if (inLoop) scanner.fail("'outer loop' inside of a loop");
      inLoop = true;
    } else if (equalsIgnoringCase(keyword, "endloop")) {
      const std::size_t count = mesh.corners.size() - mesh.faceStart.back();
      if (!inLoop || count < 3)
        scanner.fail(fmt::format("a facet needs at least 3 vertices, this one has {}", count));
      mesh.faceStart.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
      inLoop = false;
    } else if (equalsIgnoringCase(keyword, "solid")) {
      if (inLoop) scanner.fail("'solid' inside of a facet");
      inSolid = true;
      name = scanner.rest();
    } else if (equalsIgnoringCase(keyword, "endsolid")) {
      if (inLoop) scanner.fail("'endsolid' inside of a facet");
      inSolid = false;
      const auto end = static_cast<std::uint32_t>(mesh.faceCount());
      if (end > groupStart)
        mesh.groups.push_back({name.empty() ? "default" : name, groupStart, end - groupStart});
      groupStart = end;
    } else if (!equalsIgnoringCase(keyword, "facet") && !equalsIgnoringCase(keyword, "endfacet")) {
      scanner.fail(fmt::format("unknown word {}", excerpt(keyword)));
    }
  }
  if (inSolid || inLoop) scanner.fail("the file ends without 'endsolid': it is cut short");
  if (mesh.groups.size() < 2) mesh.groups.clear();
  return mesh;
}

}  // namespace

Mesh readStl(const MeshFile& file) {
  Mesh mesh;
  const bool holdsHeader = file.bytes.size() >= kHeaderBytes;
  const bool exactlyBinary =
      holdsHeader && file.bytes.size() == kHeaderBytes + kFacetBytes * std::uint64_t{binaryFacetCount(file)};
  if (!exactlyBinary && looksLikeText(file)) {
    mesh = readText(file);
  } else {
    if (!holdsHeader)
      file.fail(fmt::format("is neither a text STL nor, with {} bytes, a binary one", file.bytes.size()));
    mesh = readBinary(file);
  }
  weld(mesh);
  return mesh;
}

void writeStl(std::FILE* stream, const Mesh& source) {
  const Mesh mesh = triangulated(source);
  char header[kHeaderBytes] = "binary STL";
  const auto count = static_cast<std::uint32_t>(mesh.faceCount());
  std::memcpy(header + 80, &count, 4);
  std::fwrite(header, 1, sizeof header, stream);

  std::vector<char> block;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    const Vec3f p[3] = {Vec3f(mesh.positions[face[0]]), Vec3f(mesh.positions[face[1]]),
                        Vec3f(mesh.positions[face[2]])};
    const Vec3f n(normalize(cross(Vec3d(p[1]) - Vec3d(p[0]), Vec3d(p[2]) - Vec3d(p[0]))));
    const float values[12] = {n.x,    n.y,    n.z,    p[0].x, p[0].y, p[0].z,
                              p[1].x, p[1].y, p[1].z, p[2].x, p[2].y, p[2].z};
    const auto* bytes = reinterpret_cast<const char*>(values);
    block.insert(block.end(), bytes, bytes + sizeof values);
    block.insert(block.end(), 2, '\0');
    if (block.size() > (1u << 16) || f + 1 == mesh.faceCount()) {
      std::fwrite(block.data(), 1, block.size(), stream);
      block.clear();
    }
  }
}

}  // namespace nephele::detail
