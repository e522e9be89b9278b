// glTF 2, text (.gltf) and binary (.glb): the triangles of the default scene in world coordinates.
//
// No node is visited twice. Node transforms are applied; a mirroring one turns the winding, as the
// specification asks. Texture coordinates have their origin at the top left in glTF; V is flipped to the
// bottom left that the other formats use. Materials, skins, morph targets and animations are left out.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "nephele/levelset/io/detail/gltf_document.h"
#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::detail {
namespace {

using nlohmann::json;

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

class GltfReader {
 public:
  explicit GltfReader(const MeshFile& file) : file_(file), document_(file) {}

  Mesh read() {
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
    const json& nodes = document_.list(document_.root(), "nodes");
    std::vector<Visit> open;
    const auto addAll = [&](const json& indices, const Transform& parent) {
      // Backwards, so that the first child is visited first.
      for (std::size_t i = indices.size(); i-- > 0;) {
        if (!indices[i].is_number_unsigned()) file_.fail("a node index is not a whole number >= 0");
        open.push_back({indices[i].get<std::size_t>(), parent});
      }
    };
    if (!document_.list(document_.root(), "scenes").empty()) {
      addAll(document_.list(document_.item("scenes", document_.size(document_.root(), "scene", 0)), "nodes"),
             {});
    } else {
      std::vector<bool> isChild(nodes.size());
      for (const json& node : nodes)
        for (const json& child : document_.list(node, "children"))
          if (child.is_number_unsigned() && child.get<std::size_t>() < nodes.size())
            isChild[child.get<std::size_t>()] = true;
      for (std::size_t i = nodes.size(); i-- > 0;)
        if (!isChild[i]) open.push_back({i, {}});
    }

    std::vector<bool> visited(nodes.size());
    while (!open.empty()) {
      const Visit visit = open.back();
      open.pop_back();
      const json& node = document_.item("nodes", visit.node);
      if (!node.is_object()) file_.fail(fmt::format("node {} is not an object", visit.node));
      if (visited[visit.node])
        file_.fail(fmt::format("node {} has two parents or is its own ancestor", visit.node));
      visited[visit.node] = true;
      const Transform world = visit.parent * localTransform(node);
      addAll(document_.list(node, "children"), world);
      if (node.contains("mesh")) addMesh(document_.size(node, "mesh"), node.value("name", ""), world);
    }
  }

  void addMesh(std::size_t index, std::string name, const Transform& world) {
    const json& mesh = document_.item("meshes", index);
    if (name.empty()) name = mesh.value("name", "");
    if (name.empty()) name = fmt::format("mesh_{}", index);
    const auto firstFace = static_cast<std::uint32_t>(mesh_.faceCount());
    std::size_t primitive = 0;
    for (const json& entry : document_.list(mesh, "primitives"))
      addPrimitive(entry, fmt::format("mesh {} primitive {}", index, primitive++), world);
    const auto faceCount = static_cast<std::uint32_t>(mesh_.faceCount()) - firstFace;
    if (faceCount > 0) mesh_.groups.push_back({name, firstFace, faceCount});
  }

  void addPrimitive(const json& primitive, const std::string& where, const Transform& world) {
    const std::size_t mode = document_.size(primitive, "mode", 4);
    if (mode < 4 || mode > 6) return;  // points and lines
    const json& attributes = document_.member(primitive, "attributes");
    const GltfValues positions = document_.readAccessor(document_.size(attributes, "POSITION"));
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
      const GltfValues values = document_.readAccessor(document_.size(primitive, "indices"));
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
      const GltfValues uv = document_.readAccessor(document_.size(attributes, key.c_str()));
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
      const GltfValues color = document_.readAccessor(document_.size(attributes, "COLOR_0"));
      if (color.components < 3 || color.count != positions.count)
        file_.fail(fmt::format("{}: COLOR_0 does not fit POSITION", where));
      colors_.resize(4 * base, 1.0f);
      for (std::size_t v = 0; v < color.count; ++v)
        for (std::size_t k = 0; k < 4; ++k)
          colors_.push_back(k < color.components ? static_cast<float>(color.at(v, k)) : 1.0f);
    }
  }

  const MeshFile& file_;
  GltfDocument document_;
  std::array<std::vector<float>, 4> uvSets_;
  std::vector<float> colors_;
  Mesh mesh_;
};

}  // namespace

Mesh readGltf(const MeshFile& file) {
  try {
    return GltfReader(file).read();
  } catch (const json::exception& error) {
    file.fail("the JSON part is broken: " + jsonFault(error.what()));
  }
}

}  // namespace nephele::detail
