// PLY, all three encodings: reading.
//
// The header is compiled into a table of properties; rows are then walked by that table, so unknown elements
// and properties of any type are passed over. Faces come from lists "vertex_indices" (or "vertex_index") of
// element face and from triangle strips; texture coordinates from s t, u v or texture_u texture_v of vertices
// or from a face list "texcoord"; colours become "color" in 0..1. Other scalar vertex properties keep their
// names, and so do face lists of floats that have the same number of values for every corner of the file:
// those of "color" (red, green, blue of each corner) are the colours of MeshLab's wedges. Header lines may
// end in LF, CR LF or CR; the first line tells which, because binary data may begin with a byte that looks
// like a line end. Declared counts are held against the bytes that are left before anything is allocated.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/levelset/io/detail/ply_corner_lists.h"
#include "nephele/levelset/io/detail/ply_source.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

class PlyReader {
 public:
  explicit PlyReader(const MeshFile& file) : file_(file) {}

  Mesh read() {
    const std::size_t dataOffset = readHeader();
    PlySource source(file_, dataOffset, encoding_, headerLines_ + 1);
    for (const PlyElement& element : elements_)
      if (element.name == "vertex") vertexCount_ = element.count;
    for (const PlyElement& element : elements_) {
      requireRoom(element, source);
      if (element.name == "vertex") {
        readVertices(element, source);
      } else if (element.name == "face") {
        readFaces(element, source);
      } else if (element.name == "tristrips") {
        readStrips(element, source);
      } else {
        for (std::uint64_t row = 0; row < element.count && !element.properties.empty(); ++row) {
          source.startRow(element, row);
          for (const PlyProperty& property : element.properties) source.skip(property);
        }
      }
    }
    if (mesh_.faceCount() > 0 && mesh_.positions.empty()) file_.fail("has faces but no vertices");
    addTextureCoordinates();
    if (cornerLists_) cornerLists_->addTo(mesh_);
    return std::move(mesh_);
  }

 private:
  // ---- header ----
  std::size_t readHeader() {
    const std::string_view bytes = file_.bytes;
    std::size_t offset = 0;
    std::string_view lineEnd;
    bool hasFormat = false;
    while (true) {
      const std::size_t stop = bytes.find_first_of("\r\n", offset);
      if (headerLines_ == 0 && bytes.substr(0, stop) != "ply")
        file_.fail("does not start with the line 'ply'");
      if (stop == std::string_view::npos) file_.fail("the header has no 'end_header' line");
      if (lineEnd.empty()) lineEnd = bytes.substr(stop).starts_with("\r\n") ? "\r\n" : bytes.substr(stop, 1);
      ++headerLines_;
      const std::string_view line = bytes.substr(offset, stop - offset);
      // A text editor may have mixed line ends; only the one after end_header must be exact.
      const bool mixed = !bytes.substr(stop).starts_with(lineEnd);
      offset = stop + (mixed ? (bytes.substr(stop).starts_with("\r\n") ? 2 : 1) : lineEnd.size());
      if (readHeaderLine(line, hasFormat)) break;
    }
    if (!hasFormat) file_.fail("the header has no 'format' line");
    return offset;
  }

  static std::vector<std::string_view> wordsOf(std::string_view line) {
    std::vector<std::string_view> words;
    std::size_t at = 0;
    while ((at = line.find_first_not_of(" \t", at)) != std::string_view::npos) {
      const std::size_t stop = std::min(line.find_first_of(" \t", at), line.size());
      words.push_back(line.substr(at, stop - at));
      at = stop;
    }
    return words;
  }

  // True at end_header.
  bool readHeaderLine(std::string_view line, bool& hasFormat) {
    const std::vector<std::string_view> words = wordsOf(line);
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info" || words[0] == "ply") return false;
    if (words[0] == "end_header") return true;
    const auto bad = [&](const std::string& what) { file_.failAtLine(headerLines_, what); };
    if (words[0] == "format") {
      if (words.size() < 2) bad("'format' without a format");
      if (words[1] == "ascii")
        encoding_ = PlyEncoding::text;
      else if (words[1] == "binary_little_endian")
        encoding_ = PlyEncoding::littleEndian;
      else if (words[1] == "binary_big_endian")
        encoding_ = PlyEncoding::bigEndian;
      else
        bad(fmt::format("unknown format {}", excerpt(words[1])));
      hasFormat = true;
    } else if (words[0] == "element") {
      PlyElement element;
      if (words.size() < 3) bad("'element' needs a name and a count");
      element.name = words[1];
      const auto [end, error] =
          std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
      if (error != std::errc{} || end != words[2].data() + words[2].size())
        bad(fmt::format("element count {} is not a whole number >= 0", excerpt(words[2])));
      for (const PlyElement& other : elements_)
        if (other.name == element.name) bad(fmt::format("element {} appears twice", excerpt(element.name)));
      elements_.push_back(std::move(element));
    } else if (words[0] == "property") {
      if (elements_.empty()) bad("'property' before any 'element'");
      const bool isList = words.size() > 1 && words[1] == "list";
      if (words.size() < (isList ? 5u : 3u)) bad("'property' needs types and a name");
      PlyProperty property{std::string(words[isList ? 4 : 2]), plyTypeNamed(words[isList ? 3 : 1]),
                           PlyType::none};
      if (isList) property.countType = plyTypeNamed(words[2]);
      if (property.type == PlyType::none || (isList && property.countType == PlyType::none))
        bad(fmt::format("unknown type in {}", excerpt(line)));
      elements_.back().properties.push_back(std::move(property));
    } else {
      bad(fmt::format("unknown header line {}", excerpt(line)));
    }
    return false;
  }

  // ---- data ----
  void requireRoom(const PlyElement& element, const PlySource& source) const {
    std::uint64_t rowBytes = 0;
    for (const PlyProperty& p : element.properties)
      rowBytes += source.isText() ? 2 : sizeOf(p.isList() ? p.countType : p.type);
    if (rowBytes == 0 && element.count > 0 && (element.name == "vertex" || element.name == "face"))
      file_.fail(fmt::format("element {} has no properties", element.name));
    if (rowBytes > 0 && element.count > (source.bytesLeft() + 1) / rowBytes)
      file_.fail(fmt::format(
          "is cut short: it declares {} rows of '{}', but the {} bytes left hold at most {}", element.count,
          printable(element.name), source.bytesLeft(), (source.bytesLeft() + 1) / rowBytes));
    if (element.count > 0xFFFFFFFEu)
      file_.fail(fmt::format("has too many rows of '{}'", printable(element.name)));
  }

  static std::string printable(const std::string& name) {
    const std::string text = excerpt(name);
    return text.substr(1, text.size() - 2);
  }

  static std::optional<std::size_t> indexOf(const PlyElement& element,
                                            std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names)
      for (std::size_t i = 0; i < element.properties.size(); ++i)
        if (element.properties[i].name == name) return i;
    return std::nullopt;
  }

  void readVertices(const PlyElement& element, PlySource& source) {
    // Where each property goes: -1 nowhere, 0..2 the position, from 3 on a slot of an attribute.
    std::vector<int> target(element.properties.size(), -1);
    std::vector<double> scale(element.properties.size(), 1.0);
    static constexpr const char* kAxes[] = {"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = indexOf(element, {kAxes[axis]});
      if (!i || element.properties[*i].isList())
        file_.fail(fmt::format("element vertex has no property {}", kAxes[axis]));
      target[*i] = axis;
    }

    int slots = 3;
    std::vector<std::pair<std::size_t, int>> attributeOfSlot;  // attribute, component
    const auto bindTo = [&](std::size_t property, std::size_t attribute, int component) {
      target[property] = slots++;
      attributeOfSlot.emplace_back(attribute, component);
    };
    const auto colour = [&](const char* name) {
      return indexOf(element, {name, std::string("diffuse_") + name});
    };
    const auto red = colour("red"), green = colour("green"), blue = colour("blue"), alpha = colour("alpha");
    if (red && green && blue) {
      mesh_.attributes.push_back({"color", MeshAttribute::Domain::vertex, alpha ? 4 : 3, {}});
      int component = 0;
      for (const auto& p : {red, green, blue, alpha}) {
        if (!p) continue;
        scale[*p] = 1.0 / fullScale(element.properties[*p].type);
        bindTo(*p, mesh_.attributes.size() - 1, component++);
      }
    }
    const auto u = indexOf(element, {"s", "u", "texture_u"}), v = indexOf(element, {"t", "v", "texture_v"});
    if (u && v) {
      uvAttribute_ = mesh_.attributes.size();
      mesh_.attributes.push_back({"uv", MeshAttribute::Domain::vertex, 2, {}});
      bindTo(*u, *uvAttribute_, 0);
      bindTo(*v, *uvAttribute_, 1);
    }
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      if (target[i] != -1 || element.properties[i].isList()) continue;
      mesh_.attributes.push_back({element.properties[i].name, MeshAttribute::Domain::vertex, 1, {}});
      bindTo(i, mesh_.attributes.size() - 1, 0);
    }

    mesh_.positions.resize(element.count);
    for (MeshAttribute& a : mesh_.attributes)
      a.values.resize(element.count * static_cast<std::size_t>(a.width));
    for (std::uint64_t row = 0; row < element.count; ++row) {
      source.startRow(element, row);
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        if (target[i] < 0) {
          source.skip(element.properties[i]);
          continue;
        }
        if (element.properties[i].isList()) file_.fail("a vertex list property has the name of a scalar one");
        const double value = source.value(element.properties[i].type);
        if (target[i] < 3) {
          if (!std::isfinite(value))
            source.fail(fmt::format("coordinate {} is not finite", kAxes[target[i]]));
          mesh_.positions[row][target[i]] = value;
        } else {
          const auto [attribute, component] = attributeOfSlot[static_cast<std::size_t>(target[i] - 3)];
          MeshAttribute& a = mesh_.attributes[attribute];
          a.values[row * static_cast<std::size_t>(a.width) + static_cast<std::size_t>(component)] =
              static_cast<float>(value * scale[i]);
        }
      }
    }
  }

  std::uint32_t vertexIndex(double index, const PlySource& source) const {
    if (!(index >= 0) || !(index < static_cast<double>(vertexCount_)) || index != std::floor(index))
      source.fail(
          fmt::format("vertex index {} is out of range (the file has {} vertices)", index, vertexCount_));
    return static_cast<std::uint32_t>(index);
  }

  void readFaces(const PlyElement& element, PlySource& source) {
    const auto indices = indexOf(element, {"vertex_indices", "vertex_index"});
    const auto texture = indexOf(element, {"texcoord"});
    if (element.count > 0 && (!indices || !element.properties[*indices].isList()))
      file_.fail("element face has no list vertex_indices");
    cornerLists_.emplace(element, indices, texture);
    mesh_.faceStart.reserve(element.count + 1);
    mesh_.corners.reserve(3 * element.count);
    std::vector<double> uv;
    for (std::uint64_t row = 0; row < element.count; ++row) {
      source.startRow(element, row);
      uv.clear();
      const std::size_t firstCorner = mesh_.corners.size();
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const PlyProperty& property = element.properties[i];
        if (i == indices) {
          const std::size_t count = source.length(property);
          if (count < 3) source.fail(fmt::format("a face needs at least 3 vertices, this one has {}", count));
          for (std::size_t k = 0; k < count; ++k)
            mesh_.corners.push_back(vertexIndex(source.value(property.type), source));
        } else if (i == texture && property.isList()) {
          uv.resize(source.length(property));
          for (double& value : uv) value = source.value(property.type);
        } else if (!cornerLists_->read(i, property, source)) {
          source.skip(property);
        }
      }
      const std::size_t cornerCount = mesh_.corners.size() - firstCorner;
      cornerLists_->closeFace(cornerCount);
      if (!uv.empty()) {
        if (uv.size() != 2 * cornerCount)
          source.fail(fmt::format("{} texture values for {} corners, expected {}", uv.size(), cornerCount,
                                  2 * cornerCount));
        for (std::size_t k = 0; k < cornerCount; ++k)
          cornerUvs_.set(firstCorner + k, static_cast<float>(uv[2 * k]), static_cast<float>(uv[2 * k + 1]));
      }
      closeFace();
    }
  }

  void closeFace() {
    if (mesh_.corners.size() >= 0xFFFFFFFFu) file_.fail("has more than 4294967294 face corners");
    mesh_.faceStart.push_back(static_cast<std::uint32_t>(mesh_.corners.size()));
  }

  // Strips end at -1; every other triangle runs backwards; repeated vertices only steer the strip.
  void readStrips(const PlyElement& element, PlySource& source) {
    const auto indices = indexOf(element, {"vertex_indices", "vertex_index"});
    for (std::uint64_t row = 0; row < element.count; ++row) {
      source.startRow(element, row);
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        if (i != indices || !element.properties[i].isList()) {
          source.skip(element.properties[i]);
          continue;
        }
        const std::size_t count = source.length(element.properties[i]);
        std::array<std::uint32_t, 3> last{};
        std::size_t inStrip = 0;
        for (std::size_t k = 0; k < count; ++k) {
          const double index = source.value(element.properties[i].type);
          if (index == -1 || index == 4294967295.0) {
            inStrip = 0;
            continue;
          }
          last = {last[1], last[2], vertexIndex(index, source)};
          if (++inStrip < 3) continue;
          auto [a, b, c] = last;
          if (a == b || b == c || c == a) continue;
          if (inStrip % 2 == 0) std::swap(a, b);
          mesh_.corners.insert(mesh_.corners.end(), {a, b, c});
          closeFace();
        }
      }
    }
  }

  // Vertex coordinates move to the corners, where every other format has them; lists of faces win over them.
  void addTextureCoordinates() {
    const std::size_t before = mesh_.attributes.size();
    cornerUvs_.addTo(mesh_);
    if (!uvAttribute_) return;
    const auto at = mesh_.attributes.begin() + static_cast<std::ptrdiff_t>(*uvAttribute_);
    if (mesh_.attributes.size() == before) {
      std::vector<float> values(2 * mesh_.corners.size());
      for (std::size_t c = 0; c < mesh_.corners.size(); ++c)
        for (std::size_t k = 0; k < 2; ++k)
          values[2 * c + k] = at->values[2 * std::size_t{mesh_.corners[c]} + k];
      *at = {"uv", MeshAttribute::Domain::corner, 2, std::move(values)};
    } else {
      mesh_.attributes.erase(at);
    }
  }

  const MeshFile& file_;
  PlyEncoding encoding_ = PlyEncoding::text;
  std::vector<PlyElement> elements_;
  std::size_t headerLines_ = 0;
  std::uint64_t vertexCount_ = 0;
  std::optional<std::size_t> uvAttribute_;
  CornerUvs cornerUvs_;
  std::optional<PlyCornerLists> cornerLists_;
  Mesh mesh_;
};

}  // namespace

Mesh readPly(const MeshFile& file) {
  return PlyReader(file).read();
}

}  // namespace nephele::detail
