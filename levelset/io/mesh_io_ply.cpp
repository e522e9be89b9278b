// PLY, all three encodings.
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
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <optional>
#include <set>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

enum class Type { none, int8, uint8, int16, uint16, int32, uint32, float32, float64 };

Type typeNamed(std::string_view name) {
  static constexpr std::pair<std::string_view, Type> kNames[] = {
      {"char", Type::int8},      {"int8", Type::int8},       {"uchar", Type::uint8},
      {"uint8", Type::uint8},    {"short", Type::int16},     {"int16", Type::int16},
      {"ushort", Type::uint16},  {"uint16", Type::uint16},   {"int", Type::int32},
      {"int32", Type::int32},    {"uint", Type::uint32},     {"uint32", Type::uint32},
      {"float", Type::float32},  {"float32", Type::float32}, {"double", Type::float64},
      {"float64", Type::float64}};
  for (const auto& [text, type] : kNames)
    if (text == name) return type;
  return Type::none;
}

std::size_t sizeOf(Type type) {
  static constexpr std::array<std::size_t, 9> kSizes{0, 1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

// What full intensity is in a colour of this type.
double fullScale(Type type) {
  switch (type) {
    case Type::float32:
    case Type::float64:
      return 1.0;
    case Type::int16:
    case Type::uint16:
      return 65535.0;
    default:
      return 255.0;
  }
}

struct Property {
  std::string name;
  Type type = Type::none;
  Type countType = Type::none;  // lists only

  bool isList() const { return countType != Type::none; }
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { text, littleEndian, bigEndian };

// Reads scalars one after the other from the data part of a file.
class Source {
 public:
  Source(const MeshFile& file, std::size_t offset, Encoding encoding, std::size_t line)
      : file_(file),
        cursor_(file.bytes.data() + offset),
        end_(file.bytes.data() + file.bytes.size()),
        encoding_(encoding),
        line_(line) {}

  void startRow(const Element& element, std::uint64_t row) {
    element_ = &element;
    row_ = row;
  }
  std::size_t bytesLeft() const { return static_cast<std::size_t>(end_ - cursor_); }
  bool isText() const { return encoding_ == Encoding::text; }

  double value(Type type) {
    if (isText()) return textValue();
    const std::size_t size = sizeOf(type);
    if (bytesLeft() < size) failShort();
    const char* at = cursor_;
    cursor_ += size;
    switch (type) {
      case Type::int8:
        return load<std::int8_t>(at);
      case Type::uint8:
        return load<std::uint8_t>(at);
      case Type::int16:
        return load<std::int16_t>(at);
      case Type::uint16:
        return load<std::uint16_t>(at);
      case Type::int32:
        return load<std::int32_t>(at);
      case Type::uint32:
        return load<std::uint32_t>(at);
      case Type::float32:
        return static_cast<double>(load<float>(at));
      case Type::float64:
        return load<double>(at);
      case Type::none:
        break;
    }
    return 0;
  }

  // A list length: whole, not negative, and no longer than the bytes that are left.
  std::size_t length(const Property& list) {
    const double count = value(list.countType);
    const double room =
        static_cast<double>(isText() ? (bytesLeft() + 1) / 2 : bytesLeft() / sizeOf(list.type));
    if (!(count >= 0) || count != std::floor(count))
      fail(fmt::format("list length {} makes no sense", count));
    if (count > room) {
      if (room == 0) failShort();
      fail(fmt::format("a list of {} values is longer than the file", count));
    }
    return static_cast<std::size_t>(count);
  }

  void skip(const Property& property) {
    std::size_t count = property.isList() ? length(property) : 1;
    if (isText()) {
      for (; count > 0; --count) textValue();
    } else {
      if (bytesLeft() / sizeOf(property.type) < count) failShort();
      cursor_ += count * sizeOf(property.type);
    }
  }

  [[noreturn]] void fail(const std::string& what) const {
    const std::string row = fmt::format("{} {} of {}: {}", element_->name, row_ + 1, element_->count, what);
    if (isText()) file_.failAtLine(line_, row);
    file_.fail(row);
  }

 private:
  template <class T>
  T load(const char* at) const {
    T value;
    if (encoding_ == Encoding::littleEndian) {
      std::memcpy(&value, at, sizeof value);
    } else {
      char reversed[sizeof value];
      std::reverse_copy(at, at + sizeof value, reversed);
      std::memcpy(&value, reversed, sizeof value);
    }
    return value;
  }

  double textValue() {
    while (cursor_ != end_ && static_cast<unsigned char>(*cursor_) <= ' ') {
      if (*cursor_ == '\n' || (*cursor_ == '\r' && (end_ - cursor_ < 2 || cursor_[1] != '\n'))) ++line_;
      ++cursor_;
    }
    if (cursor_ == end_) failShort();
    const char* first = cursor_ + (*cursor_ == '+' ? 1 : 0);
    double result = 0;
    const auto [last, error] = std::from_chars(first, end_, result);
    if (error == std::errc::invalid_argument || (last != end_ && static_cast<unsigned char>(*last) > ' ')) {
      const char* stop = cursor_;
      while (stop != end_ && static_cast<unsigned char>(*stop) > ' ') ++stop;
      fail(fmt::format("expected a number, found {}",
                       excerpt({cursor_, static_cast<std::size_t>(stop - cursor_)})));
    }
    if (error == std::errc::result_out_of_range)
      result = std::strtod(std::string(first, last).c_str(), nullptr);
    cursor_ = last;
    return result;
  }

  [[noreturn]] void failShort() const { fail("the file ends here: it is cut short"); }

  static_assert(std::endian::native == std::endian::little);
  const MeshFile& file_;
  const char* cursor_;
  const char* end_;
  Encoding encoding_;
  std::size_t line_;
  const Element* element_ = nullptr;
  std::uint64_t row_ = 0;
};

// Face lists that may hold values of corners: the same number for every corner of every face.
class CornerLists {
 public:
  // Those of the element's properties that are lists of floats, without the ones that mean something else.
  CornerLists(const Element& element, std::optional<std::size_t> indices,
              std::optional<std::size_t> texture) {
    listOf_.resize(element.properties.size(), -1);
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      if (!property.isList() || i == indices || i == texture) continue;
      if (property.type != Type::float32 && property.type != Type::float64) continue;
      listOf_[i] = static_cast<int>(lists_.size());
      lists_.push_back({{property.name, MeshAttribute::Domain::corner, 0, {}}, {}, true});
    }
  }

  // Reads property `i` of the current row; false if it is no such list.
  bool read(std::size_t i, const Property& property, Source& source) {
    if (listOf_[i] < 0 || !lists_[static_cast<std::size_t>(listOf_[i])].isWhole) return false;
    std::vector<float>& row = lists_[static_cast<std::size_t>(listOf_[i])].row;
    row.resize(source.length(property));
    for (float& value : row) value = static_cast<float>(source.value(property.type));
    return true;
  }

  void closeFace(std::size_t cornerCount) {
    for (List& list : lists_) {
      if (!list.isWhole) continue;
      std::vector<float>& values = list.attribute.values;
      const std::size_t width = list.row.size() / cornerCount;
      if (values.empty()) list.attribute.width = static_cast<int>(std::min<std::size_t>(width, kMostWidth));
      list.isWhole = !list.row.empty() && list.row.size() % cornerCount == 0 &&
                     width == static_cast<std::size_t>(list.attribute.width);
      if (list.isWhole)
        values.insert(values.end(), list.row.begin(), list.row.end());
      else
        values = {};
      list.row.clear();
    }
  }

  // Alpha of corners joins their colours. Lists of names that are taken are told apart as "<name>_corner".
  void addTo(Mesh& mesh) {
    std::erase_if(lists_, [&](const List& list) {
      const auto width = static_cast<std::size_t>(list.attribute.width);
      return !list.isWhole || width == 0 || list.attribute.values.size() != width * mesh.corners.size();
    });
    joinAlpha(mesh.corners.size());
    std::set<std::string> names;
    for (const MeshAttribute& a : mesh.attributes) names.insert(a.name);
    for (List& list : lists_) {
      if (names.contains(list.attribute.name)) list.attribute.name += "_corner";
      if (names.insert(list.attribute.name).second) mesh.attributes.push_back(std::move(list.attribute));
    }
  }

 private:
  struct List {
    MeshAttribute attribute;
    std::vector<float> row;
    bool isWhole;
  };
  static constexpr std::size_t kMostWidth = 1 << 20;

  void joinAlpha(std::size_t cornerCount) {
    const auto named = [&](const char* name, int width) {
      return std::ranges::find_if(lists_, [&](const List& list) {
        return list.attribute.name == name && list.attribute.width == width;
      });
    };
    const auto color = named("color", 3), alpha = named("alpha", 1);
    if (color == lists_.end() || alpha == lists_.end()) return;
    std::vector<float> values;
    values.reserve(4 * cornerCount);
    for (std::size_t c = 0; c < cornerCount; ++c) {
      for (std::size_t k = 0; k < 3; ++k) values.push_back(color->attribute.values[3 * c + k]);
      values.push_back(alpha->attribute.values[c]);
    }
    color->attribute.width = 4;
    color->attribute.values = std::move(values);
    lists_.erase(alpha);
  }

  std::vector<List> lists_;
  // Per property of the element; -1: none.
  std::vector<int> listOf_;
};

class PlyReader {
 public:
  explicit PlyReader(const MeshFile& file) : file_(file) {}

  Mesh read() {
    const std::size_t dataOffset = readHeader();
    Source source(file_, dataOffset, encoding_, headerLines_ + 1);
    for (const Element& element : elements_)
      if (element.name == "vertex") vertexCount_ = element.count;
    for (const Element& element : elements_) {
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
          for (const Property& property : element.properties) source.skip(property);
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
        encoding_ = Encoding::text;
      else if (words[1] == "binary_little_endian")
        encoding_ = Encoding::littleEndian;
      else if (words[1] == "binary_big_endian")
        encoding_ = Encoding::bigEndian;
      else
        bad(fmt::format("unknown format {}", excerpt(words[1])));
      hasFormat = true;
    } else if (words[0] == "element") {
      Element element;
      if (words.size() < 3) bad("'element' needs a name and a count");
      element.name = words[1];
      const auto [end, error] =
          std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
      if (error != std::errc{} || end != words[2].data() + words[2].size())
        bad(fmt::format("element count {} is not a whole number >= 0", excerpt(words[2])));
      for (const Element& other : elements_)
        if (other.name == element.name) bad(fmt::format("element {} appears twice", excerpt(element.name)));
      elements_.push_back(std::move(element));
    } else if (words[0] == "property") {
      if (elements_.empty()) bad("'property' before any 'element'");
      const bool isList = words.size() > 1 && words[1] == "list";
      if (words.size() < (isList ? 5u : 3u)) bad("'property' needs types and a name");
      Property property{std::string(words[isList ? 4 : 2]), typeNamed(words[isList ? 3 : 1]), Type::none};
      if (isList) property.countType = typeNamed(words[2]);
      if (property.type == Type::none || (isList && property.countType == Type::none))
        bad(fmt::format("unknown type in {}", excerpt(line)));
      elements_.back().properties.push_back(std::move(property));
    } else {
      bad(fmt::format("unknown header line {}", excerpt(line)));
    }
    return false;
  }

  // ---- data ----
  void requireRoom(const Element& element, const Source& source) const {
    std::uint64_t rowBytes = 0;
    for (const Property& p : element.properties)
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

  static std::optional<std::size_t> indexOf(const Element& element,
                                            std::initializer_list<std::string_view> names) {
    for (const std::string_view name : names)
      for (std::size_t i = 0; i < element.properties.size(); ++i)
        if (element.properties[i].name == name) return i;
    return std::nullopt;
  }

  void readVertices(const Element& element, Source& source) {
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

  std::uint32_t vertexIndex(double index, const Source& source) const {
    if (!(index >= 0) || !(index < static_cast<double>(vertexCount_)) || index != std::floor(index))
      source.fail(
          fmt::format("vertex index {} is out of range (the file has {} vertices)", index, vertexCount_));
    return static_cast<std::uint32_t>(index);
  }

  void readFaces(const Element& element, Source& source) {
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
        const Property& property = element.properties[i];
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
  void readStrips(const Element& element, Source& source) {
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
  Encoding encoding_ = Encoding::text;
  std::vector<Element> elements_;
  std::size_t headerLines_ = 0;
  std::uint64_t vertexCount_ = 0;
  std::optional<std::size_t> uvAttribute_;
  CornerUvs cornerUvs_;
  std::optional<CornerLists> cornerLists_;
  Mesh mesh_;
};

// ---- writing ----

// True if every corner of a vertex carries the same values.
bool isSingleValued(const Mesh& mesh, const MeshAttribute& attribute, std::vector<float>& perVertex) {
  const auto width = static_cast<std::size_t>(attribute.width);
  perVertex.assign(mesh.positions.size() * width, 0.0f);
  std::vector<bool> seen(mesh.positions.size());
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
    const float* value = attribute.values.data() + c * width;
    float* kept = perVertex.data() + mesh.corners[c] * width;
    if (!seen[mesh.corners[c]])
      std::copy(value, value + width, kept);
    else if (!std::equal(value, value + width, kept))
      return false;
    seen[mesh.corners[c]] = true;
  }
  return true;
}

std::string plyName(std::string name) {
  for (char& c : name) c = c > ' ' && c <= '~' ? c : '_';
  return name.empty() ? "unnamed" : name;
}

// One list of the faces: components first .. first + count - 1 of a corner attribute.
struct FaceList {
  std::string name;
  const MeshAttribute* attribute;
  std::size_t first, count;
};

// Colours as MeshLab has those of wedges, three per corner; it would misread four.
std::vector<FaceList> faceLists(const Mesh& mesh, const MeshAttribute* uv, bool uvPerVertex) {
  std::vector<FaceList> lists;
  if (uv && !uvPerVertex) lists.push_back({"texcoord", uv, 0, 2});
  for (const MeshAttribute& a : mesh.attributes) {
    if (a.domain != MeshAttribute::Domain::corner || &a == uv || a.width < 1) continue;
    std::string name = plyName(a.name);
    if (name == "texcoord" || name == "vertex_indices" || name == "vertex_index") name += "_corner";
    if (name == "color" && a.width == 4) {
      lists.push_back({"color", &a, 0, 3});
      lists.push_back({"alpha", &a, 3, 1});
    } else {
      lists.push_back({name, &a, 0, static_cast<std::size_t>(a.width)});
    }
  }
  return lists;
}

class ByteWriter {
 public:
  explicit ByteWriter(std::FILE* stream) : stream_(stream) {}
  ~ByteWriter() { flush(); }
  ByteWriter(const ByteWriter&) = delete;
  ByteWriter& operator=(const ByteWriter&) = delete;

  void text(const std::string& s) { bytes_ += s; }
  template <class T>
  void put(T value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes_.append(raw, sizeof value);
    if (bytes_.size() > (1u << 16)) flush();
  }

 private:
  void flush() {
    std::fwrite(bytes_.data(), 1, bytes_.size(), stream_);
    bytes_.clear();
  }
  std::FILE* stream_;
  std::string bytes_;
};

}  // namespace

Mesh readPly(const MeshFile& file) {
  return PlyReader(file).read();
}

void writePly(std::FILE* stream, const Mesh& mesh) {
  bool fitsFloat = true;
  for (const Vec3d& p : mesh.positions) fitsFloat = fitsFloat && Vec3d(Vec3f(p)) == p;
  std::size_t mostCorners = 0;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) mostCorners = std::max(mostCorners, mesh.face(f).size());

  const MeshAttribute* color = nullptr;
  const MeshAttribute* uv = nullptr;
  std::vector<const MeshAttribute*> others;
  for (const MeshAttribute& a : mesh.attributes) {
    const bool perVertex = a.domain == MeshAttribute::Domain::vertex;
    if (a.name == "uv" && a.width == 2)
      uv = &a;
    else if (perVertex && a.name == "color" && (a.width == 3 || a.width == 4))
      color = &a;
    else if (perVertex)
      others.push_back(&a);
  }
  std::vector<float> vertexUvs;
  if (uv && uv->domain == MeshAttribute::Domain::vertex) vertexUvs = uv->values;
  const bool uvPerVertex =
      uv && (uv->domain == MeshAttribute::Domain::vertex || isSingleValued(mesh, *uv, vertexUvs));

  ByteWriter out(stream);
  out.text("ply\nformat binary_little_endian 1.0\n");
  out.text(fmt::format("element vertex {}\n", mesh.positions.size()));
  for (const char* axis : {"x", "y", "z"})
    out.text(fmt::format("property {} {}\n", fitsFloat ? "float" : "double", axis));
  static constexpr const char* kChannels[] = {"red", "green", "blue", "alpha"};
  for (int k = 0; color && k < color->width; ++k) out.text(fmt::format("property uchar {}\n", kChannels[k]));
  if (uvPerVertex) out.text("property float s\nproperty float t\n");
  for (const MeshAttribute* a : others)
    for (int k = 0; k < a->width; ++k)
      out.text(a->width == 1 ? fmt::format("property float {}\n", plyName(a->name))
                             : fmt::format("property float {}_{}\n", plyName(a->name), k));
  out.text(fmt::format("element face {}\nproperty list {} {} vertex_indices\n", mesh.faceCount(),
                       mostCorners < 256 ? "uchar" : "uint",
                       mesh.positions.size() < 0x80000000u ? "int" : "uint"));
  const std::vector<FaceList> lists = faceLists(mesh, uv, uvPerVertex);
  const auto isShort = [&](const FaceList& list) { return mostCorners * list.count < 256; };
  for (const FaceList& list : lists)
    out.text(fmt::format("property list {} float {}\n", isShort(list) ? "uchar" : "uint", list.name));
  out.text("end_header\n");

  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      if (fitsFloat)
        out.put(static_cast<float>(mesh.positions[v][k]));
      else
        out.put(mesh.positions[v][k]);
    }
    for (std::size_t k = 0; color && k < static_cast<std::size_t>(color->width); ++k) {
      const float c = color->values[v * static_cast<std::size_t>(color->width) + k];
      out.put(static_cast<std::uint8_t>(std::lround(255 * (c > 0 ? std::min(c, 1.0f) : 0.0f))));
    }
    for (std::size_t k = 0; uvPerVertex && k < 2; ++k) out.put(vertexUvs[2 * v + k]);
    for (const MeshAttribute* a : others)
      for (std::size_t k = 0; k < static_cast<std::size_t>(a->width); ++k)
        out.put(a->values[v * static_cast<std::size_t>(a->width) + k]);
  }
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    const auto face = mesh.face(f);
    if (mostCorners < 256)
      out.put(static_cast<std::uint8_t>(face.size()));
    else
      out.put(static_cast<std::uint32_t>(face.size()));
    for (const std::uint32_t v : face) out.put(v);
    for (const FaceList& list : lists) {
      if (isShort(list))
        out.put(static_cast<std::uint8_t>(list.count * face.size()));
      else
        out.put(static_cast<std::uint32_t>(list.count * face.size()));
      for (std::size_t c = mesh.faceStart[f]; c < mesh.faceStart[f + 1]; ++c) {
        const float* values =
            list.attribute->values.data() + c * static_cast<std::size_t>(list.attribute->width) + list.first;
        for (std::size_t k = 0; k < list.count; ++k) out.put(values[k]);
      }
    }
  }
}

}  // namespace nephele::detail
