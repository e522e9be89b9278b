// The text of OBJ files: shortest decimal forms that read back to the same value (the same float where the
// value is a float), written without a locale.
#include "nephele/levelset/io/obj_text.h"

#include <fmt/format.h>

#include <bit>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <span>
#include <unordered_map>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

// A name on one line, as statements need, which a backslash at its end would join with the next.
std::string oneLine(std::string name) {
  for (char& c : name) c = c == '\n' || c == '\r' ? ' ' : c;
  if (name.ends_with('\\')) name += ' ';
  return name;
}

// What no reader takes is not written: `nan` and `inf` are no numbers of an OBJ file.
void requireFinite(std::span<const float> values, const char* what, std::string_view where,
                   std::size_t index) {
  for (const float value : values)
    if (!std::isfinite(value))
      throw Error(fmt::format("{} of {} {} is {}, which an .obj cannot hold", what, where, index,
                              std::isnan(value) ? "not a number" : "infinite"));
}

}  // namespace

TextWriter& TextWriter::number(double value) {
  char digits[32];
  const auto single = static_cast<float>(value);
  const auto end = static_cast<double>(single) == value ? std::to_chars(digits, digits + 32, single).ptr
                                                        : std::to_chars(digits, digits + 32, value).ptr;
  return text({digits, static_cast<std::size_t>(end - digits)});
}

TextWriter& TextWriter::integer(std::uint64_t value) {
  char digits[24];
  const auto end = std::to_chars(digits, digits + 24, value).ptr;
  return text({digits, static_cast<std::size_t>(end - digits)});
}

void TextWriter::flush() {
  if (!stream_) return;
  std::fwrite(buffer_.data(), 1, buffer_.size(), stream_);
  buffer_.clear();
}

ObjCoordinates writeObjPoints(TextWriter& out, const Mesh& mesh, const Vec3d& offset) {
  const MeshAttribute* color = nullptr;
  const MeshAttribute* uv = nullptr;
  for (const MeshAttribute& a : mesh.attributes) {
    if (a.name == "color" && a.domain == MeshAttribute::Domain::vertex && a.width >= 3) color = &a;
    if (a.name == "uv" && a.width == 2) uv = &a;
  }
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    out.text("v");
    const Vec3d p = mesh.positions[v] + offset;
    for (int k = 0; k < 3; ++k) out.text(" ").number(p[k]);
    if (color) {
      const std::span<const float> values{color->values.data() + v * static_cast<std::size_t>(color->width),
                                          3};
      requireFinite(values, "the colour", "vertex", v);
      for (const float value : values) out.text(" ").number(value);
    }
    out.text("\n");
  }
  ObjCoordinates result;
  if (!uv) return result;
  result.index.reserve(mesh.corners.size());
  std::unordered_map<std::uint64_t, std::uint32_t> known;
  known.reserve(mesh.positions.size());
  const bool isOfCorners = uv->domain == MeshAttribute::Domain::corner;
  for (std::size_t c = 0; c < mesh.corners.size(); ++c) {
    const std::size_t item = isOfCorners ? c : mesh.corners[c];
    requireFinite({uv->values.data() + 2 * item, 2}, "a texture coordinate",
                  isOfCorners ? "corner" : "vertex", item);
    const float u = uv->values[2 * item], v = uv->values[2 * item + 1];
    const std::uint64_t key =
        std::uint64_t{std::bit_cast<std::uint32_t>(u)} << 32 | std::bit_cast<std::uint32_t>(v);
    const auto [entry, isNew] = known.try_emplace(key, static_cast<std::uint32_t>(known.size()) + 1);
    if (isNew) out.text("vt ").number(u).text(" ").number(v).text("\n");
    result.index.push_back(entry->second);
  }
  result.count = static_cast<std::uint32_t>(known.size());
  return result;
}

void writeObjLibraries(TextWriter& out, const std::vector<std::string>& files, const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  for (const std::string& file : files) {
    // Absolute, as relative paths of which nothing exists stay relative.
    const fs::path relative =
        fs::proximate(fs::absolute(file, ignored), folder.empty() ? "." : folder, ignored);
    out.text("mtllib ").text(oneLine(relative.empty() ? file : relative.generic_string())).text("\n");
  }
}

void writeObjFaces(TextWriter& out, const Mesh& mesh, const ObjCoordinates& uv, bool areGroupsNamed,
                   std::uint64_t vertices, std::uint64_t coordinates) {
  std::size_t group = 0, end = 0;
  std::string material;
  for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
    if (group > 0 && f == end && (group == mesh.groups.size() || mesh.groups[group].firstFace > f)) {
      if (areGroupsNamed) out.text("g default\n");
      if (!material.empty()) out.text("usemtl \n");
      material.clear();
    }
    for (; group < mesh.groups.size() && mesh.groups[group].firstFace <= f; ++group) {
      const MeshGroup& begun = mesh.groups[group];
      end = begun.firstFace + begun.faceCount;
      if (areGroupsNamed) out.text("g ").text(oneLine(begun.name)).text("\n");
      if (begun.material != material) out.text("usemtl ").text(oneLine(begun.material)).text("\n");
      material = begun.material;
    }
    out.text("f");
    for (std::uint32_t c = mesh.faceStart[f]; c < mesh.faceStart[f + 1]; ++c) {
      out.text(" ").integer(vertices + mesh.corners[c] + 1);
      if (!uv.index.empty()) out.text("/").integer(coordinates + uv.index[c]);
    }
    out.text("\n");
  }
}

}  // namespace nephele::detail
