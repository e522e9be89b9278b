#include "apps/options/descriptions.h"

#include <CLI/App.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "nephele/levelset/io/mesh_io.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/render/image/exr_io.h"

namespace nephele::apps {
namespace {

constexpr std::size_t kMostTriangles = 500000;

/// The extension in capitals, without its dot.
std::string formatOf(const std::string& path) {
  std::string format = std::filesystem::path(path).extension().string();
  for (char& c : format) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return format.substr(format.empty() ? 0 : 1);
}

Description list(const auto& p) {
  return {p.x, p.y, p.z};
}

/// The least and the greatest of each component, and how many are not finite.
void addRange(const MeshAttribute& attribute, Description& d) {
  const auto width = std::size_t(std::max(attribute.width, 1));
  std::vector<float> least(width, std::numeric_limits<float>::infinity()), most(width, -least[0]);
  std::size_t notFinite = 0;
  for (std::size_t i = 0; i < attribute.values.size(); ++i) {
    const float value = attribute.values[i];
    if (!std::isfinite(value)) {
      ++notFinite;
      continue;
    }
    least[i % width] = std::min(least[i % width], value);
    most[i % width] = std::max(most[i % width], value);
  }
  if (std::ranges::all_of(least, [](float value) { return std::isfinite(value); })) {
    d["least"] = least;
    d["greatest"] = most;
  }
  if (notFinite > 0) d["values_not_finite"] = notFinite;
}

Description meshDescription(const std::string& path, bool alwaysCountPairs) {
  const Mesh mesh = readMesh(path);
  const MeshDiagnosis is = diagnose(mesh);
  Description d{{"kind", "mesh"},
                {"format", formatOf(path)},
                {"vertices", is.vertices},
                {"faces", is.faces},
                {"triangles", is.triangles}};
  d["components"] = is.components;
  d["box_min"] = list(is.box.min);
  d["box_max"] = list(is.box.max);
  d["area"] = is.area;
  if (is.closed()) d["volume"] = is.volume;
  d["closed"] = is.closed();
  d["manifold"] = is.manifold();
  d["euler_characteristic"] = is.eulerCharacteristic;
  if (is.manifold()) d["genus"] = is.genus();
  for (const MeshAttribute& a : mesh.attributes) {
    const char* domain = a.domain == MeshAttribute::Domain::corner ? "corner" : "vertex";
    d["attributes"].push_back({{"name", a.name}, {"width", a.width}, {"domain", domain}});
    addRange(a, d["attributes"].back());
  }
  for (const MeshGroup& g : mesh.groups) d["groups"].push_back({{"name", g.name}, {"faces", g.faceCount}});
  d["merged_vertices"] = is.mergedVertices;
  constexpr double kAll = std::numeric_limits<double>::infinity(), kPairsInAMoment = 100;
  if (alwaysCountPairs || is.triangles <= kMostTriangles) {
    if (const auto count = countSelfIntersections(mesh, alwaysCountPairs ? kAll : kPairsInAMoment))
      d["self_intersections"] = *count;
    else if (!alwaysCountPairs)
      d["self_intersections"] = "not counted: too many triangles are near each other";
  }
  d["problems"] = is.problems();
  return d;
}

Description volumeDescription(const std::string& path) {
  static constexpr const char* kClasses[] = {"unknown", "level set", "fog volume", "staggered"};
  Description d{{"kind", "volume"}, {"grids", Description::array()}};
  for (const VdbGrid& grid : readVdbFile(path)) {
    const VdbGridInfo g = describe(grid);
    const bool isEmpty = g.activeVoxels == 0;
    d["grids"].push_back({{"name", g.name},
                          {"type", g.type},
                          {"class", kClasses[static_cast<int>(g.gridClass)]},
                          {"active_voxels", g.activeVoxels},
                          {"size", list(isEmpty ? Vec3i{} : g.indexMax - g.indexMin + Vec3i{1, 1, 1})},
                          {"voxel_size", list(g.voxelSize)},
                          {"uniform", g.uniform},
                          {"half", g.halfFloat},
                          {"memory_bytes", g.memoryBytes}});
    Description& last = d["grids"].back();
    if (g.type == "float" || g.type == "double") {
      const VdbValueRange values = valueRange(grid);
      last["values"] = {values.min, values.max};
      last["background"] = g.background;
      if (values.notFinite > 0) last["values_not_finite"] = values.notFinite;
    }
    last["metadata"] = g.metadata;
  }
  return d;
}

}  // namespace

Description describeFile(const std::string& path, const DescriptionOptions& options) {
  const std::string extension = CLI::detail::to_lower(std::filesystem::path(path).extension().string());
  Description description;
  if (isVolumeFile(path))
    description = volumeDescription(path);
  else if (extension == ".exr" || extension == ".png" || extension == ".hdr")
    description = {{"kind", "image"}, {"content", describeImage(path, options.mostBytes)}};
  else
    description = meshDescription(path, options.alwaysCountPairs);
  // Names inside files may be in any encoding, but JSON is UTF-8.
  return Description::parse(description.dump(-1, ' ', false, Description::error_handler_t::replace));
}

}  // namespace nephele::apps
