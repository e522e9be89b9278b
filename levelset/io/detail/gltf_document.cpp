// The container of glTF 2 and its accessors, from the specification, with a JSON parser and nothing else.
//
// Sparse accessors and quantised attributes are read; compressed geometry is refused by the name of the
// extension.
#include "nephele/levelset/io/detail/gltf_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <utility>

namespace nephele::detail {
namespace {

using nlohmann::json;

constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;

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

std::uint32_t wordAt(std::string_view bytes, std::size_t offset) {
  std::uint32_t word = 0;
  std::memcpy(&word, bytes.data() + offset, 4);
  return word;
}

std::size_t componentSize(std::size_t type) {
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
double load(const char* at, double scale) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return static_cast<double>(value) * scale;
}
double number(const char* at, std::size_t type, bool normalized) {
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

}  // namespace

GltfDocument::GltfDocument(const MeshFile& file) : file_(file) {
  parse();
  checkExtensions();
  loadBuffers();
}

void GltfDocument::parse() {
  std::string_view text = file_.bytes;
  if (file_.bytes.starts_with("glTF")) {
    if (file_.bytes.size() < 20) file_.fail("is cut short: no room for a GLB header");
    if (wordAt(file_.bytes, 4) != 2)
      file_.fail(fmt::format("is GLB version {}; only version 2 is supported", wordAt(file_.bytes, 4)));
    const std::size_t declared = wordAt(file_.bytes, 8);
    if (declared > file_.bytes.size())
      file_.fail(
          fmt::format("is cut short: it declares {} bytes but holds {}", declared, file_.bytes.size()));
    text = {};
    for (std::size_t offset = 12; offset + 8 <= declared;) {
      const std::size_t length = wordAt(file_.bytes, offset);
      const std::uint32_t type = wordAt(file_.bytes, offset + 4);
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

void GltfDocument::checkExtensions() const {
  if (!root_.contains("extensionsRequired")) return;
  for (const json& entry : list(root_, "extensionsRequired")) {
    const std::string name = entry.get<std::string>();
    const bool leavesGeometryAlone = name == "KHR_mesh_quantization" || name.starts_with("KHR_materials_") ||
                                     name.starts_with("KHR_texture_") || name.starts_with("EXT_texture_") ||
                                     name.starts_with("KHR_lights_") || name.starts_with("EXT_lights_");
    if (!leavesGeometryAlone)
      file_.fail(fmt::format("requires the extension {}, which is not supported", excerpt(name)));
  }
}

std::string GltfDocument::pathOf(const std::string& uri) const {
  namespace fs = std::filesystem;
  // A file from anywhere must not choose what is read of this machine.
  const fs::path name = fs::path(decodePercent(uri)).lexically_normal();
  if (name.empty() || name.is_absolute() || *name.begin() == "..")
    file_.fail(fmt::format("a buffer is at {}, outside of the folder of the file", excerpt(uri)));
  const fs::path path = fs::path(file_.path).parent_path() / name;
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    file_.fail(fmt::format("a buffer is at {}, where there is no file", excerpt(uri)));
  return path.string();
}

void GltfDocument::loadBuffers() {
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
        bytes = readWholeFile(pathOf(uri));
      }
    }
    if (bytes.size() < length)
      file_.fail(
          fmt::format("buffer {} declares {} bytes but holds {}", buffers_.size(), length, bytes.size()));
    bytes.resize(length);
    buffers_.push_back(std::move(bytes));
  }
  constexpr std::size_t kAnyScene = std::size_t(1) << 22, kRepeats = 16;
  elementsLeft_ = kAnyScene;
  for (const std::string& bytes : buffers_) elementsLeft_ += kRepeats * bytes.size();
}

const nlohmann::json& GltfDocument::member(const json& object, const char* key) const {
  const auto found = object.is_object() ? object.find(key) : object.end();
  if (!object.is_object() || found == object.end())
    file_.fail(fmt::format("'{}' is missing in the JSON part", key));
  return *found;
}

const nlohmann::json& GltfDocument::list(const json& object, const char* key) const {
  static const json kEmpty = json::array();
  if (!object.is_object() || !object.contains(key)) return kEmpty;
  if (!object.at(key).is_array()) file_.fail(fmt::format("'{}' is not a list", key));
  return object.at(key);
}

std::size_t GltfDocument::size(const json& object, const char* key) const {
  const json& value = member(object, key);
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() > 0xFFFFFFFFFFull)
    file_.fail(fmt::format("'{}' should be a whole number >= 0", key));
  return value.get<std::size_t>();
}

std::size_t GltfDocument::size(const json& object, const char* key, std::size_t fallback) const {
  return object.is_object() && object.contains(key) ? size(object, key) : fallback;
}

const nlohmann::json& GltfDocument::item(const char* listName, std::size_t index) const {
  const json& items = list(root_, listName);
  if (index >= items.size())
    file_.fail(fmt::format("refers to entry {} of '{}', which has {}", index, listName, items.size()));
  return items[index];
}

// `count` elements of `elementSize` bytes in a buffer view, `stride` apart (set from the view where it has
// one).
const char* GltfDocument::window(std::size_t viewIndex, std::size_t offset, std::size_t count,
                                 std::size_t elementSize, std::size_t& stride) const {
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

GltfValues GltfDocument::readAccessor(std::size_t index) {
  const json& accessor = item("accessors", index);
  static constexpr std::pair<std::string_view, std::size_t> kTypes[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
  const std::string typeName = member(accessor, "type").get<std::string>();
  GltfValues values;
  for (const auto& [name, components] : kTypes)
    if (name == typeName) values.components = components;
  const std::size_t type = size(accessor, "componentType");
  if (values.components == 0 || componentSize(type) == 0)
    file_.fail(fmt::format("accessor {} has an unsupported type ({}, {})", index, excerpt(typeName), type));
  const bool normalized = accessor.value("normalized", false);
  const std::size_t elementSize = values.components * componentSize(type);
  values.count = size(accessor, "count");
  if (values.count > elementsLeft_)
    file_.fail("repeats its data so often that the mesh would be out of proportion to the file");
  elementsLeft_ -= values.count;

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
    if (values.count > (1u << 20))
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

}  // namespace nephele::detail
