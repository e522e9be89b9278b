// glTF 2, text (.gltf) and binary (.glb): the triangles of the default scene in world coordinates.
//
// Read from the specification with a JSON parser and nothing else, because a hostile file must end in a
// message: every offset, count and index is held against the bytes that are there before it is used, and no
// node is visited twice. Node transforms are applied; a mirroring one turns the winding, as the specification
// asks. Texture coordinates have their origin at the top left in glTF; V is flipped to the bottom left that
// the other formats use. Materials, skins, morph targets and animations are left out. Sparse accessors and
// quantised attributes are read; compressed geometry is refused by the name of the extension.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

using nlohmann::json;

constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr std::size_t kMostVertices = std::size_t{1} << 31;

// x -> m * (x, 1), rows of four.
struct Transform {
  std::array<double, 12> m{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  Vec3d operator()(const Vec3d& p) const {
    return {m[0] * p.x + m[1] * p.y + m[2] * p.z + m[3], m[4] * p.x + m[5] * p.y + m[6] * p.z + m[7],
            m[8] * p.x + m[9] * p.y + m[10] * p.z + m[11]};
  }
  Transform operator*(const Transform& b) const {
    Transform result;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 4; ++c)
        result.m[4 * r + c] = m[4 * r] * b.m[c] + m[4 * r + 1] * b.m[4 + c] + m[4 * r + 2] * b.m[8 + c] +
                              (c == 3 ? m[4 * r + 3] : 0.0);
    return result;
  }
  bool mirrors() const {
    return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[1] * (m[4] * m[10] - m[6] * m[8]) +
               m[2] * (m[4] * m[9] - m[5] * m[8]) <
           0;
  }
};

// Elements of an accessor: `components` numbers each.
struct Values {
  std::size_t count = 0;
  std::size_t components = 0;
  std::vector<double> numbers;

  double at(std::size_t element, std::size_t component) const {
    return numbers[element * components + component];
  }
};

std::string decodeBase64(std::string_view text) {
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    int digit = -1;
    if (c >= 'A' && c <= 'Z')
      digit = c - 'A';
    else if (c >= 'a' && c <= 'z')
      digit = c - 'a' + 26;
    else if (c >= '0' && c <= '9')
      digit = c - '0' + 52;
    else if (c == '+')
      digit = 62;
    else if (c == '/')
      digit = 63;
    else
      continue;
    bits = bits << 6 | static_cast<std::uint32_t>(digit);
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += static_cast<char>(bits >> count & 0xFF);
    }
  }
  return bytes;
}

std::string decodePercent(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned code = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::sscanf(std::string(text.substr(i + 1, 2)).c_str(), "%2x", &code) == 1) {
      result += static_cast<char>(code);
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

class GltfReader {
 public:
  explicit GltfReader(const MeshFile& file) : file_(file) {}

  Mesh read() {
    parse();
    checkExtensions();
    loadBuffers();
    walkNodes();
    for (std::size_t set = 0; set < uvSets_.size(); ++set) {
      if (uvSets_[set].empty()) continue;
      uvSets_[set].resize(2 * mesh_.corners.size(), 0.0f);
      mesh_.attributes.push_back({set == 0 ? "uv" : fmt::format("uv{}", set), MeshAttribute::Domain::corner,
                                  2, std::move(uvSets_[set])});
    }
    if (!colors_.empty()) {
      colors_.resize(4 * mesh_.positions.size(), 1.0f);
      mesh_.attributes.push_back({"color", MeshAttribute::Domain::vertex, 4, std::move(colors_)});
    }
    return std::move(mesh_);
  }

 private:
  // ---- container ----
  std::uint32_t wordAt(std::size_t offset) const {
    std::uint32_t word = 0;
    std::memcpy(&word, file_.bytes.data() + offset, 4);
    return word;
  }

  void parse() {
    std::string_view text = file_.bytes;
    if (file_.bytes.starts_with("glTF")) {
      if (file_.bytes.size() < 20) file_.fail("is cut short: no room for a GLB header");
      if (wordAt(4) != 2)
        file_.fail(fmt::format("is GLB version {}; only version 2 is supported", wordAt(4)));
      const std::size_t declared = wordAt(8);
      if (declared > file_.bytes.size())
        file_.fail(
            fmt::format("is cut short: it declares {} bytes but holds {}", declared, file_.bytes.size()));
      text = {};
      for (std::size_t offset = 12; offset + 8 <= declared;) {
        const std::size_t length = wordAt(offset);
        const std::uint32_t type = wordAt(offset + 4);
        if (length > declared - offset - 8) file_.fail("a chunk runs over the end of the file");
        const std::string_view chunk = file_.bytes.substr(offset + 8, length);
        if (type == kJsonChunk && text.empty()) text = chunk;
        if (type == kBinaryChunk && binary_.empty()) binary_ = chunk;
        offset += 8 + length;
      }
      if (text.empty()) file_.fail("has no JSON chunk");
    } else if (file_.path.ends_with(".glb") || file_.path.ends_with(".GLB")) {
      file_.fail("does not start with 'glTF'");
    }
    root_ = json::parse(text);
    if (!root_.is_object()) file_.fail("the JSON part is not an object");
    const std::string version = member(root_, "asset").value("version", "");
    if (!version.starts_with("2."))
      file_.fail(fmt::format("is glTF version {}; only 2.x is supported", excerpt(version)));
  }

  void checkExtensions() const {
    if (!root_.contains("extensionsRequired")) return;
    for (const json& entry : list(root_, "extensionsRequired")) {
      const std::string name = entry.get<std::string>();
      const bool leavesGeometryAlone = name == "KHR_mesh_quantization" ||
                                       name.starts_with("KHR_materials_") ||
                                       name.starts_with("KHR_texture_") || name.starts_with("EXT_texture_") ||
                                       name.starts_with("KHR_lights_") || name.starts_with("EXT_lights_");
      if (!leavesGeometryAlone)
        file_.fail(fmt::format("requires the extension {}, which is not supported", excerpt(name)));
    }
  }

  void loadBuffers() {
    for (const json& buffer : list(root_, "buffers")) {
      const std::size_t length = size(buffer, "byteLength");
      std::string bytes;
      if (!buffer.contains("uri")) {
        bytes = binary_;
      } else {
        const std::string uri = buffer.at("uri").get<std::string>();
        if (uri.starts_with("data:")) {
          const std::size_t comma = uri.find(";base64,");
          if (comma == std::string::npos) file_.fail("a buffer is a data URI but not base64");
          bytes = decodeBase64(std::string_view(uri).substr(comma + 8));
        } else {
          bytes =
              readWholeFile((std::filesystem::path(file_.path).parent_path() / decodePercent(uri)).string());
        }
      }
      if (bytes.size() < length)
        file_.fail(
            fmt::format("buffer {} declares {} bytes but holds {}", buffers_.size(), length, bytes.size()));
      bytes.resize(length);
      buffers_.push_back(std::move(bytes));
    }
  }

  // ---- JSON with checks ----
  const json& member(const json& object, const char* key) const {
    const auto found = object.is_object() ? object.find(key) : object.end();
    if (!object.is_object() || found == object.end())
      file_.fail(fmt::format("'{}' is missing in the JSON part", key));
    return *found;
  }
  // The list under `key`, empty if there is none.
  const json& list(const json& object, const char* key) const {
    static const json kEmpty = json::array();
    if (!object.is_object() || !object.contains(key)) return kEmpty;
    if (!object.at(key).is_array()) file_.fail(fmt::format("'{}' is not a list", key));
    return object.at(key);
  }
  std::size_t size(const json& object, const char* key) const {
    const json& value = member(object, key);
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > 0xFFFFFFFFFFull)
      file_.fail(fmt::format("'{}' should be a whole number >= 0", key));
    return value.get<std::size_t>();
  }
  std::size_t size(const json& object, const char* key, std::size_t fallback) const {
    return object.is_object() && object.contains(key) ? size(object, key) : fallback;
  }
  const json& item(const char* listName, std::size_t index) const {
    const json& items = list(root_, listName);
    if (index >= items.size())
      file_.fail(fmt::format("refers to entry {} of '{}', which has {}", index, listName, items.size()));
    return items[index];
  }

  // ---- accessors ----
  static std::size_t componentSize(std::size_t type) {
    switch (type) {
      case 5120:
      case 5121:
        return 1;
      case 5122:
      case 5123:
        return 2;
      case 5125:
      case 5126:
        return 4;
      default:
        return 0;
    }
  }

  template <class T>
  static double load(const char* at, double scale) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value) * scale;
  }
  static double number(const char* at, std::size_t type, bool normalized) {
    switch (type) {
      case 5120:
        return normalized ? std::max(load<std::int8_t>(at, 1.0 / 127), -1.0) : load<std::int8_t>(at, 1);
      case 5121:
        return load<std::uint8_t>(at, normalized ? 1.0 / 255 : 1);
      case 5122:
        return normalized ? std::max(load<std::int16_t>(at, 1.0 / 32767), -1.0) : load<std::int16_t>(at, 1);
      case 5123:
        return load<std::uint16_t>(at, normalized ? 1.0 / 65535 : 1);
      case 5125:
        return load<std::uint32_t>(at, 1);
      default:
        return load<float>(at, 1);
    }
  }

  // `count` elements of `elementSize` bytes in a buffer view, `stride` apart (set from the view where it has
  // one).
  const char* window(std::size_t viewIndex, std::size_t offset, std::size_t count, std::size_t elementSize,
                     std::size_t& stride) const {
    const json& view = item("bufferViews", viewIndex);
    const std::size_t bufferIndex = size(view, "buffer");
    if (bufferIndex >= buffers_.size())
      file_.fail(fmt::format("refers to buffer {}, which is not there", bufferIndex));
    const std::size_t viewOffset = size(view, "byteOffset", 0), viewLength = size(view, "byteLength");
    const std::string& buffer = buffers_[bufferIndex];
    if (viewOffset > buffer.size() || viewLength > buffer.size() - viewOffset)
      file_.fail(fmt::format("buffer view {} runs over the end of its buffer", viewIndex));
    stride = size(view, "byteStride", elementSize);
    if (stride < elementSize || stride > 4096)
      file_.fail(fmt::format("buffer view {} has a bad byteStride", viewIndex));
    const bool fits = count == 0 || (offset <= viewLength && elementSize <= viewLength - offset &&
                                     count - 1 <= (viewLength - offset - elementSize) / stride);
    if (!fits)
      file_.fail(
          fmt::format("an accessor of {} elements runs over the end of buffer view {}", count, viewIndex));
    return buffer.data() + viewOffset + offset;
  }

  Values readAccessor(std::size_t index) const {
    const json& accessor = item("accessors", index);
    static constexpr std::pair<std::string_view, std::size_t> kTypes[] = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
    const std::string typeName = member(accessor, "type").get<std::string>();
    Values values;
    for (const auto& [name, components] : kTypes)
      if (name == typeName) values.components = components;
    const std::size_t type = size(accessor, "componentType");
    if (values.components == 0 || componentSize(type) == 0)
      file_.fail(fmt::format("accessor {} has an unsupported type ({}, {})", index, excerpt(typeName), type));
    const bool normalized = accessor.value("normalized", false);
    const std::size_t elementSize = values.components * componentSize(type);
    values.count = size(accessor, "count");

    if (accessor.contains("bufferView")) {
      std::size_t stride = 0;
      const char* first = window(size(accessor, "bufferView"), size(accessor, "byteOffset", 0), values.count,
                                 elementSize, stride);
      values.numbers.resize(values.count * values.components);
      for (std::size_t i = 0; i < values.count; ++i)
        for (std::size_t k = 0; k < values.components; ++k)
          values.numbers[i * values.components + k] =
              number(first + i * stride + k * componentSize(type), type, normalized);
    } else {
      // Zeros without bytes behind them: the only count that the file's size does not bound.
      if (values.count > (1u << 24))
        file_.fail(fmt::format("accessor {} declares {} elements without data", index, values.count));
      values.numbers.assign(values.count * values.components, 0.0);
    }

    if (accessor.contains("sparse")) {
      const json& sparse = accessor.at("sparse");
      const json& where = member(sparse, "indices");
      const json& what = member(sparse, "values");
      const std::size_t count = size(sparse, "count"), indexType = size(where, "componentType");
      if (componentSize(indexType) == 0)
        file_.fail(fmt::format("accessor {} has unsupported sparse indices", index));
      std::size_t indexStride = 0, valueStride = 0;
      const char* indices = window(size(where, "bufferView"), size(where, "byteOffset", 0), count,
                                   componentSize(indexType), indexStride);
      const char* data =
          window(size(what, "bufferView"), size(what, "byteOffset", 0), count, elementSize, valueStride);
      for (std::size_t i = 0; i < count; ++i) {
        const double at = number(indices + i * indexStride, indexType, false);
        if (!(at >= 0) || !(at < static_cast<double>(values.count)))
          file_.fail(fmt::format("accessor {}: sparse index {} is out of range", index, at));
        for (std::size_t k = 0; k < values.components; ++k)
          values.numbers[static_cast<std::size_t>(at) * values.components + k] =
              number(data + i * valueStride + k * componentSize(type), type, normalized);
      }
    }
    return values;
  }

  // ---- scene ----
  static Transform localTransform(const json& node) {
    Transform t;
    if (node.contains("matrix")) {
      const auto columns = node.at("matrix").get<std::array<double, 16>>();
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 4; ++c) t.m[4 * r + c] = columns[4 * c + r];
      return t;
    }
    const auto s = node.value("scale", std::array<double, 3>{1, 1, 1});
    const auto q = node.value("rotation", std::array<double, 4>{0, 0, 0, 1});
    const auto p = node.value("translation", std::array<double, 3>{0, 0, 0});
    const auto [x, y, z, w] = q;
    t.m = {s[0] * (1 - 2 * (y * y + z * z)), s[1] * 2 * (x * y - z * w),
           s[2] * 2 * (x * z + y * w),       p[0],
           s[0] * 2 * (x * y + z * w),       s[1] * (1 - 2 * (x * x + z * z)),
           s[2] * 2 * (y * z - x * w),       p[1],
           s[0] * 2 * (x * z - y * w),       s[1] * 2 * (y * z + x * w),
           s[2] * (1 - 2 * (x * x + y * y)), p[2]};
    return t;
  }

  void walkNodes() {
    struct Visit {
      std::size_t node;
      Transform parent;
    };
    const json& nodes = list(root_, "nodes");
    std::vector<Visit> open;
    const auto addAll = [&](const json& indices, const Transform& parent) {
      // Backwards, so that the first child is visited first.
      for (std::size_t i = indices.size(); i-- > 0;) {
        if (!indices[i].is_number_unsigned()) file_.fail("a node index is not a whole number >= 0");
        open.push_back({indices[i].get<std::size_t>(), parent});
      }
    };
    if (!list(root_, "scenes").empty()) {
      addAll(list(item("scenes", size(root_, "scene", 0)), "nodes"), {});
    } else {
      std::vector<bool> isChild(nodes.size());
      for (const json& node : nodes)
        for (const json& child : list(node, "children"))
          if (child.is_number_unsigned() && child.get<std::size_t>() < nodes.size())
            isChild[child.get<std::size_t>()] = true;
      for (std::size_t i = nodes.size(); i-- > 0;)
        if (!isChild[i]) open.push_back({i, {}});
    }

    std::vector<bool> visited(nodes.size());
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const json& node = item("nodes", visit.node);
      if (!node.is_object()) file_.fail(fmt::format("node {} is not an object", visit.node));
      if (visited[visit.node])
        file_.fail(fmt::format("node {} has two parents or is its own ancestor", visit.node));
      visited[visit.node] = true;
      const Transform world = visit.parent * localTransform(node);
      addAll(list(node, "children"), world);
      if (node.contains("mesh")) addMesh(size(node, "mesh"), node.value("name", ""), world);
    }
  }

  void addMesh(std::size_t index, std::string name, const Transform& world) {
    const json& mesh = item("meshes", index);
    if (name.empty()) name = mesh.value("name", "");
    if (name.empty()) name = fmt::format("mesh_{}", index);
    const auto firstFace = static_cast<std::uint32_t>(mesh_.faceCount());
    std::size_t primitive = 0;
    for (const json& entry : list(mesh, "primitives"))
      addPrimitive(entry, fmt::format("mesh {} primitive {}", index, primitive++), world);
    const auto faceCount = static_cast<std::uint32_t>(mesh_.faceCount()) - firstFace;
    if (faceCount > 0) mesh_.groups.push_back({name, firstFace, faceCount});
  }

  void addPrimitive(const json& primitive, const std::string& where, const Transform& world) {
    const std::size_t mode = size(primitive, "mode", 4);
    if (mode < 4 || mode > 6) return;  // points and lines
    const json& attributes = member(primitive, "attributes");
    const Values positions = readAccessor(size(attributes, "POSITION"));
    if (positions.components != 3) file_.fail(fmt::format("{}: POSITION is not VEC3", where));
    const std::size_t base = mesh_.positions.size();
    if (base + positions.count > kMostVertices) file_.fail("has more than 2147483648 vertices");
    for (std::size_t v = 0; v < positions.count; ++v) {
      const Vec3d p = world({positions.at(v, 0), positions.at(v, 1), positions.at(v, 2)});
      if (!isFinite(p)) file_.fail(fmt::format("{}: vertex {}: a coordinate is not finite", where, v));
      mesh_.positions.push_back(p);
    }

    std::vector<std::uint32_t> indices;
    if (primitive.contains("indices")) {
      const Values values = readAccessor(size(primitive, "indices"));
      if (values.components != 1) file_.fail(fmt::format("{}: indices are not SCALAR", where));
      for (const double value : values.numbers) {
        if (!(value >= 0) || !(value < static_cast<double>(positions.count)) || value != std::floor(value))
          file_.fail(fmt::format("{}: vertex index {} is out of range ({} vertices)", where, value,
                                 positions.count));
        indices.push_back(static_cast<std::uint32_t>(value));
      }
    } else {
      for (std::size_t v = 0; v < positions.count; ++v) indices.push_back(static_cast<std::uint32_t>(v));
    }
    if (mode == 4 && indices.size() % 3 != 0)
      file_.fail(fmt::format("{}: {} indices do not make triangles", where, indices.size()));

    const std::size_t firstCorner = mesh_.corners.size();
    std::vector<std::uint32_t> source;  // vertex of the primitive for each new corner
    const bool mirrored = world.mirrors();
    const auto addTriangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      if (mode != 4 && (a == b || b == c || c == a)) return;  // strips turn on repeated vertices
      if (mirrored) std::swap(b, c);
      for (const std::uint32_t v : {a, b, c}) {
        source.push_back(v);
        mesh_.corners.push_back(static_cast<std::uint32_t>(base) + v);
      }
      mesh_.faceStart.push_back(static_cast<std::uint32_t>(mesh_.corners.size()));
    };
    if (firstCorner + 3 * indices.size() >= 0xFFFFFFFFu) file_.fail("has more than 4294967294 face corners");
    for (std::size_t i = 2; i < indices.size(); i += mode == 4 ? 3 : 1) {
      if (mode == 6)
        addTriangle(indices[0], indices[i - 1], indices[i]);
      else if (mode == 5 && i % 2 == 1)
        addTriangle(indices[i - 1], indices[i - 2], indices[i]);
      else
        addTriangle(indices[i - 2], indices[i - 1], indices[i]);
    }

    for (std::size_t set = 0; set < uvSets_.size(); ++set) {
      const std::string key = fmt::format("TEXCOORD_{}", set);
      if (!attributes.contains(key)) continue;
      const Values uv = readAccessor(size(attributes, key.c_str()));
      if (uv.components != 2 || uv.count != positions.count)
        file_.fail(fmt::format("{}: {} does not fit POSITION", where, key));
      std::vector<float>& values = uvSets_[set];
      values.resize(2 * firstCorner, 0.0f);
      for (const std::uint32_t v : source) {
        values.push_back(static_cast<float>(uv.at(v, 0)));
        values.push_back(static_cast<float>(1.0 - uv.at(v, 1)));
      }
    }
    if (attributes.contains("COLOR_0")) {
      const Values color = readAccessor(size(attributes, "COLOR_0"));
      if (color.components < 3 || color.count != positions.count)
        file_.fail(fmt::format("{}: COLOR_0 does not fit POSITION", where));
      colors_.resize(4 * base, 1.0f);
      for (std::size_t v = 0; v < color.count; ++v)
        for (std::size_t k = 0; k < 4; ++k)
          colors_.push_back(k < color.components ? static_cast<float>(color.at(v, k)) : 1.0f);
    }
  }

  const MeshFile& file_;
  json root_;
  std::string_view binary_;
  std::vector<std::string> buffers_;
  std::array<std::vector<float>, 4> uvSets_;
  std::vector<float> colors_;
  Mesh mesh_;
};

}  // namespace

Mesh readGltf(const MeshFile& file) {
  try {
    return GltfReader(file).read();
  } catch (const json::exception& error) {
    // nlohmann's text reads "[json.exception.type_error.302] what happened".
    const std::string_view text = error.what();
    const std::size_t start = text.find("] ");
    std::string what(start == std::string_view::npos ? text : text.substr(start + 2));
    for (char& c : what) c = c >= ' ' && c <= '~' ? c : '?';
    if (what.size() > 160) what = what.substr(0, 157) + "...";
    file.fail("the JSON part is broken: " + what);
  }
}

}  // namespace nephele::detail
