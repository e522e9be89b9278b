// Vertex attributes in space: the closest point of the surface, or a sum over the spheres of vertices
// (Tessendorf, Resolution Independent Volumes, 3.6). Both know their range in a box from a tree of the ranges
// of triangles and spheres. The gridded cache of the notes is surface_grid.cpp.
#include "nephele/levelset/cloud/attribute_field.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/cloud/detail/vertex_spheres.h"
#include "nephele/levelset/mesh/surface_grid.h"
#include "nephele/levelset/mesh/surface_values.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/field/constant_node.h"

namespace nephele {

namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// The part of an attribute that a name stands for.
struct Part {
  std::string name;
  const MeshAttribute* attribute;
  int component;
};

std::string partName(const MeshAttribute& attribute, int component) {
  if (attribute.width == 1) return attribute.name;
  constexpr std::string_view kColour = "rgba", kVector = "xyzw";
  const bool isColour = attribute.name.starts_with("color") || attribute.name == "Cd";
  if (attribute.width > 4) return fmt::format("{}.{}", attribute.name, component);
  return fmt::format("{}.{}", attribute.name, (isColour ? kColour : kVector)[std::size_t(component)]);
}

std::vector<Part> partsOf(const Mesh& mesh) {
  std::vector<Part> parts;
  for (const MeshAttribute& a : mesh.attributes)
    if (a.domain == MeshAttribute::Domain::vertex)
      for (int c = 0; c < a.width; ++c) parts.push_back({partName(a, c), &a, c});
  return parts;
}

[[noreturn]] void failUnknown(const Mesh& mesh, const std::string& name) {
  std::string known, ofCorners;
  for (const std::string& n : attributeNames(mesh)) known += (known.empty() ? "" : ", ") + n;
  for (const MeshAttribute& a : mesh.attributes)
    if (a.domain == MeshAttribute::Domain::corner) ofCorners += (ofCorners.empty() ? "" : ", ") + a.name;
  throw Error(fmt::format("the mesh has no vertex attribute '{}'; it has {}{}", name,
                          known.empty() ? "none" : known,
                          ofCorners.empty() ? "" : " (per corner, which will not do: " + ofCorners + ")"));
}

std::vector<bool> usedVertices(const Mesh& mesh) {
  std::vector<bool> used(mesh.positions.size());
  for (const std::uint32_t v : mesh.corners) used[v] = true;
  return used;
}

std::vector<float> valuesOf(const Mesh& mesh, const std::string& name) {
  const std::vector<Part> parts = partsOf(mesh);
  const auto part = std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.name == name; });
  if (part == parts.end()) failUnknown(mesh, name);
  const auto width = std::size_t(part->attribute->width);
  require(part->attribute->values.size() == width * mesh.positions.size(),
          fmt::format("attribute '{}' has {} values for {} vertices", name, part->attribute->values.size(),
                      mesh.positions.size()));
  const std::vector<bool> used = usedVertices(mesh);
  std::vector<float> values(mesh.positions.size());
  std::size_t bad = 0, firstBad = 0;
  for (std::size_t v = 0; v < values.size(); ++v) {
    values[v] = part->attribute->values[v * width + std::size_t(part->component)];
    if (!used[v] || std::isfinite(values[v])) continue;
    if (bad++ == 0) firstBad = v;
  }
  require(bad == 0, fmt::format("attribute '{}' is not finite at {} of {} vertices, first at vertex {}", name,
                                bad, values.size(), firstBad));
  return values;
}

class ClosestNode final : public FieldNode<float> {
 public:
  explicit ClosestNode(std::shared_ptr<const detail::ValuedSurface> surface) : surface_(std::move(surface)) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    detail::ValuedSurface::Cursor cursor;
    for (int i = 0; i < points.count; ++i)
      values[0][i] = surface_->at({points.x[i], points.y[i], points.z[i]}, cursor);
  }
  Interval range(const Box& box, RangeMemo&) const override { return surface_->range(box); }
  NodePtr<float> restricted(Restriction& restriction) const override {
    return detail::constantFrom<float>(range(restriction.box, restriction.memo.ranges));
  }
  float differenceStep() const override { return 1e-4f * surface_->nearest().box().longestSide(); }

 private:
  std::shared_ptr<const detail::ValuedSurface> surface_;
};

class SpheresNode final : public FieldNode<float> {
 public:
  SpheresNode(std::shared_ptr<const detail::ValuedSurface> surface, detail::VertexSpheres spheres,
              const Interval& all)
      : surface_(std::move(surface)), spheres_(std::move(spheres)), all_(all) {}

  void eval(const PointBlock& points, const BlockLanes<1>& values, Scratch&) const override {
    detail::ValuedSurface::Cursor cursor;
    for (int i = 0; i < points.count; ++i) {
      const Vec3f p{points.x[i], points.y[i], points.z[i]};
      // Less than this in all, and the closest surface point fills it up.
      constexpr double kFullWeight = 0.05;
      const auto [weight, weighted] = spheres_.at(p);
      const double sum =
          weight < kFullWeight
              ? (weighted + (kFullWeight - weight) * double(surface_->at(p, cursor))) / kFullWeight
              : weighted / weight;
      values[0][i] = std::isnan(sum) ? kNan : std::clamp(float(sum), all_.min, all_.max);
    }
  }
  Interval range(const Box& box, RangeMemo&) const override {
    const Interval closest = surface_->range(box);
    const std::optional<Interval> spheres = spheres_.near(box);
    // Blends of different numbers round.
    const Interval hull = spheres ? closest.hull(*spheres) : closest;
    if (hull.isPoint()) return hull;
    const float rounding = 2e-7f * hull.magnitude();
    return {std::max(hull.min - rounding, all_.min), std::min(hull.max + rounding, all_.max)};
  }
  NodePtr<float> restricted(Restriction& restriction) const override {
    return detail::constantFrom<float>(range(restriction.box, restriction.memo.ranges));
  }
  float differenceStep() const override { return 1e-4f * surface_->nearest().box().longestSide(); }

 private:
  std::shared_ptr<const detail::ValuedSurface> surface_;
  detail::VertexSpheres spheres_;
  Interval all_;
};

/// The sphere of every vertex that a face uses; equal positions share the first's.
std::vector<detail::ValueSphere> spheresOf(const Mesh& mesh, const detail::SurfaceValues& values,
                                           float radius) {
  const std::vector<std::uint32_t> first = firstEqualPosition(mesh.positions);
  std::vector<float> radii(mesh.positions.size(), 0.0f);
  for (std::size_t t = 0; t < mesh.faceCount(); ++t) {
    const auto face = mesh.face(t);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = face[i], b = face[(i + 1) % 3];
      // Wide enough to reach across the triangles around a vertex and overlap with all of their neighbours.
      constexpr float kOverlap = 2.0f;
      const float wanted =
          radius > 0 ? radius : kOverlap * float(length(mesh.positions[a] - mesh.positions[b]));
      for (const std::uint32_t v : {first[a], first[b]}) radii[v] = std::max(radii[v], wanted);
    }
  }
  std::vector<detail::ValueSphere> spheres;
  for (std::uint32_t v = 0; v < radii.size(); ++v)
    if (radii[v] > 0) spheres.push_back({Vec3f(mesh.positions[v]), radii[v], values.atVertex(v)});
  return spheres;
}

void requireOptions(const AttributeFieldOptions& options) {
  const auto requireLength = [](const char* name, float value) {
    require(std::isfinite(value) && value >= 0,
            fmt::format("attribute field: {} must be >= 0, got {}", name, value));
  };
  requireLength("radius", options.radius);
  requireLength("voxelSize", options.voxelSize);
  requireLength("band", options.band);
}

void requireTriangles(const Mesh& mesh) {
  requireValid(mesh);
  require(mesh.faceCount() > 0, "attribute field: the mesh has no faces");
  require(mesh.isTriangles(), "attribute field: the mesh must be triangulated");
}

ScalarField fieldOf(const Mesh& mesh, std::unique_ptr<detail::SurfaceValues> values,
                    const AttributeFieldOptions& options, const Progress& progress) {
  std::vector<detail::ValueSphere> spheres;
  if (options.spread == AttributeFieldOptions::Spread::spheres)
    spheres = spheresOf(mesh, *values, options.radius);
  auto surface = std::make_shared<const detail::ValuedSurface>(mesh, std::move(values));
  progress.check();
  const Interval all = surface->range();
  if (all.isPoint()) return ScalarField(all.min);
  const ScalarField exact =
      options.spread == AttributeFieldOptions::Spread::closest
          ? ScalarField(std::make_shared<ClosestNode>(surface))
          : ScalarField(std::make_shared<SpheresNode>(surface, detail::VertexSpheres(spheres), all));
  if (!(options.voxelSize > 0)) return exact;
  detail::SurfaceGridOptions grids{options.voxelSize, options.band, all};
  if (options.spread == AttributeFieldOptions::Spread::closest)
    grids.sample = [&](const Vec3i& firstVoxel, float voxelSize, std::span<float, 512> samples) {
      surface->atBrick(firstVoxel, voxelSize, samples);
    };
  return detail::griddedNear(surface->nearest(), exact, grids, progress);
}

}  // namespace

std::vector<std::string> attributeNames(const Mesh& mesh) {
  std::vector<std::string> names;
  for (const Part& part : partsOf(mesh)) names.push_back(part.name);
  return names;
}

std::optional<AttributePart> attributePart(const Mesh& mesh, const std::string& name) {
  for (const Part& part : partsOf(mesh))
    if (part.name == name)
      return AttributePart{std::size_t(part.attribute - mesh.attributes.data()), part.component};
  return std::nullopt;
}

ScalarField attributeField(const Mesh& mesh, const std::string& name, const AttributeFieldOptions& options,
                           const Progress& progress) {
  requireTriangles(mesh);
  requireOptions(options);
  return fieldOf(mesh, detail::linearValues(mesh.corners, valuesOf(mesh, name)), options, progress);
}

ScalarField facingField(const Mesh& mesh, const Vec3f& direction, const AttributeFieldOptions& options,
                        const Progress& progress) {
  requireTriangles(mesh);
  requireOptions(options);
  require(isFinite(direction) && length(Vec3d(direction)) > 0,
          fmt::format("facing field: the direction must be finite and not zero, got {}, {}, {}", direction.x,
                      direction.y, direction.z));
  return fieldOf(mesh, detail::facingValues(mesh, Vec3f(normalize(Vec3d(direction)))), options, progress);
}

}  // namespace nephele
