// PLY, binary little-endian: writing.
//
// Positions are floats where that loses nothing, else doubles, and colours bytes where that loses nothing,
// else floats. Texture coordinates stay with vertices where every corner of a vertex has the same; other
// attributes of corners are lists of the faces.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>
#include <string>
#include <utility>

#include "nephele/levelset/io/detail/mesh_io_private.h"

namespace nephele::detail {
namespace {

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

// True if bytes read back as these colours.
bool fitBytes(const std::vector<float>& colors) {
  return std::ranges::all_of(colors, [](float value) {
    return value >= 0 && value <= 1 && value == static_cast<float>(std::lround(255 * value) * (1.0 / 255));
  });
}

// Names of the properties of one element, each a word. Of two of the same name readers keep one, or mix them
// up.
class PropertyNames {
 public:
  explicit PropertyNames(std::set<std::string> taken) : taken_(std::move(taken)) {}

  /// Says that a name is going to be added, so that others do not become it.
  void expect(const std::string& name) { expected_.insert(word(name)); }
  std::string add(const std::string& name) {
    const std::string wanted = word(name);
    std::string unique = wanted;
    for (int k = 2; taken_.count(unique) > 0 || (k > 2 && expected_.count(unique) > 0); ++k)
      unique = fmt::format("{}_{}", wanted, k);
    taken_.insert(unique);
    return unique;
  }

 private:
  static std::string word(std::string name) {
    for (char& c : name) c = c > ' ' && c <= '~' ? c : '_';
    return name.empty() ? "unnamed" : name;
  }
  std::set<std::string> taken_, expected_;
};

// Names that readers would make texture coordinates, colours or an opacity of, were they those of attributes.
std::set<std::string> meaningfulNames(const std::vector<const MeshAttribute*>& attributes,
                                      const MeshAttribute* color, bool hasUv) {
  const auto has = [&](const std::set<std::string>& names) {
    return std::ranges::any_of(
        attributes, [&](const MeshAttribute* a) { return a->width == 1 && names.count(a->name) > 0; });
  };
  std::set<std::string> result;
  const std::set<std::string> u{"s", "u", "texture_u"}, v{"t", "v", "texture_v"}, red{"red", "diffuse_red"},
      green{"green", "diffuse_green"}, blue{"blue", "diffuse_blue"}, alpha{"alpha", "diffuse_alpha"};
  if (!hasUv && has(u) && has(v))
    for (const auto* names : {&u, &v}) result.insert(names->begin(), names->end());
  if (!color && has(red) && has(green) && has(blue))
    for (const auto* names : {&red, &green, &blue}) result.insert(names->begin(), names->end());
  if (color && color->width == 3) result.insert(alpha.begin(), alpha.end());
  return result;
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
  PropertyNames names({"vertex_indices", "vertex_index", "texcoord"});
  if (uv && !uvPerVertex) lists.push_back({"texcoord", uv, 0, 2});
  for (const MeshAttribute& a : mesh.attributes) {
    if (a.domain != MeshAttribute::Domain::corner || &a == uv || a.width < 1) continue;
    if (a.name == "color" && a.width == 4) {
      lists.push_back({names.add("color"), &a, 0, 3});
      lists.push_back({names.add("alpha"), &a, 3, 1});
    } else {
      lists.push_back({names.add(a.name), &a, 0, static_cast<std::size_t>(a.width)});
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
  PropertyNames names(meaningfulNames(others, color, uvPerVertex));
  const auto nameOf = [](const MeshAttribute& a, int k) {
    return a.width == 1 ? a.name : fmt::format("{}_{}", a.name, k);
  };
  for (const MeshAttribute* a : others)
    for (int k = 0; k < a->width; ++k) names.expect(nameOf(*a, k));
  for (const char* axis : {"x", "y", "z"})
    out.text(fmt::format("property {} {}\n", fitsFloat ? "float" : "double", names.add(axis)));
  static constexpr const char* kChannels[] = {"red", "green", "blue", "alpha"};
  const bool hasBytes = color && fitBytes(color->values);
  for (int k = 0; color && k < color->width; ++k)
    out.text(fmt::format("property {} {}\n", hasBytes ? "uchar" : "float", names.add(kChannels[k])));
  for (const char* coordinate : {"s", "t"})
    if (uvPerVertex) out.text(fmt::format("property float {}\n", names.add(coordinate)));
  for (const MeshAttribute* a : others)
    for (int k = 0; k < a->width; ++k) out.text(fmt::format("property float {}\n", names.add(nameOf(*a, k))));
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
      if (hasBytes)
        out.put(static_cast<std::uint8_t>(std::lround(255 * c)));
      else
        out.put(c);
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
