// Wavefront OBJ.
//
// Read: v (with optional colour behind x y z), vt, f with v, v/vt, v//vn and v/vt/vn, negative (relative)
// indices, polygons, g and o as groups, usemtl as their materials, continuation lines. Normals are checked
// for range and otherwise dropped; lines, points, curves and smoothing groups are passed over. Indices may
// point forward, as some exporters do; they are checked at the end. Written: shortest decimal forms that read
// back to the same value (the same float where the value is a float).
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "nephele/levelset/io/detail/mesh_io_private.h"
#include "nephele/levelset/io/obj_text.h"
#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFu;

// Indices of one kind (vertex, texture coordinate): turned into 0-based ones, with the largest
// remembered.
struct IndexRange {
  const char* name;
  std::size_t count = 0;
  std::int64_t largest = 0;
  std::size_t lineOfLargest = 0;

  std::uint32_t resolve(std::int64_t index, const TextScanner& scanner) {
    if (index > 0) {
      if (index > largest) {
        largest = index;
        lineOfLargest = scanner.line();
      }
      return static_cast<std::uint32_t>(index - 1);
    }
    if (index == 0) scanner.fail(fmt::format("{} index 0 (indices start at 1)", name));
    // -index overflows for the lowest integer.
    if (std::uint64_t{0} - static_cast<std::uint64_t>(index) > count)
      scanner.fail(fmt::format("{} index {} is out of range ({} so far)", name, index, count));
    return static_cast<std::uint32_t>(static_cast<std::int64_t>(count) + index);
  }
  void check(const MeshFile& file) const {
    if (largest > static_cast<std::int64_t>(count))
      file.failAtLine(lineOfLargest,
                      fmt::format("{} index {} is out of range (the file has {})", name, largest, count));
  }
};

class ObjReader {
 public:
  explicit ObjReader(const MeshFile& file) : file_(file), scanner_(file, true) {}

  Mesh read() {
    for (; !scanner_.atEnd(); scanner_.nextLine()) {
      const std::string_view keyword = scanner_.word();
      if (keyword == "v") {
        readVertex();
      } else if (keyword == "f") {
        readFace();
      } else if (keyword == "vt") {
        uvs_.push_back(scanner_.single("a texture coordinate"));
        uvs_.push_back(scanner_.atLineEnd() ? 0.0f : scanner_.single("a texture coordinate"));
        ++uvRange_.count;
      } else if (keyword == "g" || keyword == "o") {
        startGroup(scanner_.rest());
      } else if (keyword == "usemtl") {
        closeGroup();
        material_ = scanner_.rest();
        hasGroups_ = true;
      } else if (keyword == "mtllib") {
        const std::filesystem::path library(scanner_.rest());
        mesh_.materialFiles.push_back((std::filesystem::path(file_.path).parent_path() / library).string());
      }
    }
    vertexRange_.check(file_);
    uvRange_.check(file_);
    finish();
    return std::move(mesh_);
  }

 private:
  void readVertex() {
    const double x = scanner_.number("a coordinate");
    const double y = scanner_.number("a coordinate");
    const double z = scanner_.number("a coordinate");
    mesh_.positions.emplace_back(x, y, z);
    ++vertexRange_.count;
    if (scanner_.atLineEnd()) return;
    const float w = scanner_.single("a weight or colour");
    if (scanner_.atLineEnd()) return;  // x y z w: the weight belongs to curves
    const float green = scanner_.single("a colour");
    const float blue = scanner_.atLineEnd() ? green : scanner_.single("a colour");
    colors_.resize(3 * (mesh_.positions.size() - 1), 1.0f);
    colors_.insert(colors_.end(), {w, green, blue});
  }

  void readFace() {
    const std::size_t firstCorner = mesh_.corners.size();
    while (!scanner_.atLineEnd()) {
      mesh_.corners.push_back(vertexRange_.resolve(scanner_.integer("a vertex index"), scanner_));
      if (scanner_.take('/')) {
        if (scanner_.atInteger()) {
          const std::uint32_t uv = uvRange_.resolve(scanner_.integer("a texture index"), scanner_);
          uvIndices_.resize(mesh_.corners.size() - 1, kNone);
          uvIndices_.push_back(uv);
        }
        if (scanner_.take('/') && scanner_.atInteger()) scanner_.integer("a normal index");
      }
      if (!scanner_.atBlankOrLineEnd())
        scanner_.fail(fmt::format("a face corner should look like 1, 1/2 or 1/2/3, found {} at its end",
                                  excerpt(scanner_.word())));
    }
    const std::size_t cornerCount = mesh_.corners.size() - firstCorner;
    if (cornerCount < 3)
      scanner_.fail(fmt::format("a face needs at least 3 vertices, this one has {}", cornerCount));
    if (mesh_.corners.size() >= kNone) file_.fail("has more than 4294967294 face corners");
    mesh_.faceStart.push_back(static_cast<std::uint32_t>(mesh_.corners.size()));
  }

  void startGroup(std::string_view name) {
    closeGroup();
    groupName_ = name.empty() ? "default" : std::string(name);
    hasGroups_ = true;
  }

  void closeGroup() {
    const auto end = static_cast<std::uint32_t>(mesh_.faceCount());
    if (end > groupStart_) {
      const std::string& name = groupName_.empty() ? material_ : groupName_;
      if (!mesh_.groups.empty() && mesh_.groups.back().name == name &&
          mesh_.groups.back().material == material_)
        mesh_.groups.back().faceCount += end - groupStart_;
      else
        mesh_.groups.push_back({name.empty() ? "default" : name, groupStart_, end - groupStart_, material_});
    }
    groupStart_ = end;
  }

  void finish() {
    closeGroup();
    if (!hasGroups_) mesh_.groups.clear();
    if (!colors_.empty()) {
      colors_.resize(3 * mesh_.positions.size(), 1.0f);
      mesh_.attributes.push_back({"color", MeshAttribute::Domain::vertex, 3, std::move(colors_)});
    }
    if (!uvIndices_.empty()) {
      uvIndices_.resize(mesh_.corners.size(), kNone);
      std::vector<float> values(2 * mesh_.corners.size(), 0.0f);
      for (std::size_t c = 0; c < uvIndices_.size(); ++c) {
        if (uvIndices_[c] == kNone) continue;
        values[2 * c] = uvs_[2 * std::size_t{uvIndices_[c]}];
        values[2 * c + 1] = uvs_[2 * std::size_t{uvIndices_[c]} + 1];
      }
      mesh_.attributes.push_back({"uv", MeshAttribute::Domain::corner, 2, std::move(values)});
    }
  }

  const MeshFile& file_;
  TextScanner scanner_;
  Mesh mesh_;
  IndexRange vertexRange_{"vertex"}, uvRange_{"texture"};
  std::vector<float> uvs_, colors_;
  std::vector<std::uint32_t> uvIndices_;  // per corner; shorter while the last corners have none
  std::string groupName_, material_;
  std::uint32_t groupStart_ = 0;
  bool hasGroups_ = false;
};

}  // namespace

Mesh readObj(const MeshFile& file) {
  return ObjReader(file).read();
}

void writeObj(std::FILE* stream, const Mesh& mesh, const std::string& folder) {
  TextWriter out(stream);
  writeObjLibraries(out, mesh.materialFiles, folder);
  const ObjCoordinates uv = writeObjPoints(out, mesh);
  writeObjFaces(out, mesh, uv);
  out.text(kObjEnd);
}

}  // namespace nephele::detail
