// Guides of wisps from vertices, surfaces and shapes. On a surface, a triangle is drawn by its share of the
// area and a point evenly within it; inside a shape, points of the box are drawn until one lies inside.
#include "nephele/modeling/cloud/wisp_guides.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string_view>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/base/random_stream.h"

namespace nephele {
namespace {

/// Points of the box that are tried for each that is wanted, before giving up.
constexpr double kMostTries = 1e6;

void requireOptions(const GuideOptions& o) {
  require(o.count > 0, "guides: count must be > 0, got 0");
  require(o.sizeVariation >= 0 && o.sizeVariation <= 0.99f,
          "guides: sizeVariation must be from 0 to 0.99, got " + numberText(o.sizeVariation));
}

void varySizes(std::vector<WispGuide>& guides, const GuideOptions& options) {
  if (options.sizeVariation == 0) return;
  detail::RandomStream stream({options.seed, 2});
  for (WispGuide& guide : guides) guide.size *= 1 + options.sizeVariation * (2 * stream.uniform() - 1);
}

const MeshAttribute* vertexAttribute(const Mesh& mesh, std::initializer_list<std::string_view> names,
                                     int width) {
  for (const std::string_view name : names)
    for (const MeshAttribute& a : mesh.attributes)
      if (a.name == name && a.width == width && a.domain == MeshAttribute::Domain::vertex) return &a;
  return nullptr;
}

const MeshAttribute* guideSizes(const Mesh& mesh) {
  return vertexAttribute(mesh, {"size", "pscale", "radius"}, 1);
}

/// What the vertices of a mesh say about guides.
class GuideAttributes {
 public:
  GuideAttributes(const Mesh& mesh, const GuideOptions& options) : mesh_(mesh), standard_(options.standard) {
    const auto find = [&](std::string_view name, int width) { return vertexAttribute(mesh, {name}, width); };
    size_ = guideSizes(mesh);
    density_ = find("density", 1);
    color_ = find("color", 3);
    if (!color_) color_ = find("color", 4);
    velocity_ = find("v", 3);
    velocityParts_ = {find("vx", 1), find("vy", 1), find("vz", 1)};
  }

  WispGuide at(std::uint32_t vertex) const {
    WispGuide guide = standard_;
    guide.position = Vec3f(mesh_.positions[vertex]);
    if (size_) guide.size = size_->values[vertex];
    if (density_) guide.density = density_->values[vertex];
    if (color_) guide.color = vector(*color_, vertex);
    if (velocity_) guide.velocity = vector(*velocity_, vertex);
    if (velocityParts_[0] && velocityParts_[1] && velocityParts_[2])
      for (int a = 0; a < 3; ++a) guide.velocity[a] = velocityParts_[std::size_t(a)]->values[vertex];
    requireSound(guide, vertex);
    return guide;
  }

 private:
  static Vec3f vector(const MeshAttribute& a, std::uint32_t vertex) {
    const float* v = a.values.data() + std::size_t(vertex) * std::size_t(a.width);
    return {v[0], v[1], v[2]};
  }
  void requireSound(const WispGuide& g, std::uint32_t vertex) const {
    const auto refuse = [&](const std::string& what) {
      throw Error("guides: vertex " + std::to_string(vertex) + " has " + what);
    };
    if (!isFinite(g.position)) refuse("a position that is not finite");
    if (!(g.size > 0 && std::isfinite(g.size)))
      refuse("the size " + numberText(g.size) + ", which must be > 0 and finite");
    if (!(g.density >= 0 && std::isfinite(g.density)))
      refuse("the density " + numberText(g.density) + ", which must be >= 0 and finite");
    if (!isFinite(g.color)) refuse("a colour that is not finite");
    if (!isFinite(g.velocity)) refuse("a velocity that is not finite");
  }

  const Mesh& mesh_;
  WispGuide standard_;
  const MeshAttribute *size_ = nullptr, *density_ = nullptr, *color_ = nullptr, *velocity_ = nullptr;
  std::array<const MeshAttribute*, 3> velocityParts_{};
};

WispGuide blended(const std::array<WispGuide, 3>& g, const Vec3f& w) {
  WispGuide result;
  // What all three agree on stays as it is, to the last bit: white is no colour.
  const auto blend = [&](auto member) {
    return g[0].*member + w.y * (g[1].*member - g[0].*member) + w.z * (g[2].*member - g[0].*member);
  };
  result.position = blend(&WispGuide::position);
  result.size = blend(&WispGuide::size);
  result.density = blend(&WispGuide::density);
  result.color = blend(&WispGuide::color);
  result.velocity = blend(&WispGuide::velocity);
  return result;
}

}  // namespace

bool bringsGuideSizes(const Mesh& mesh) {
  return guideSizes(mesh) != nullptr;
}

std::vector<WispGuide> guidesOnVertices(const Mesh& mesh, const GuideOptions& options) {
  requireOptions(options);
  requireValid(mesh);
  require(!mesh.positions.empty(), "guides: there are no vertices");
  const GuideAttributes attributes(mesh, options);
  std::vector<WispGuide> guides;
  guides.reserve(mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) guides.push_back(attributes.at(std::uint32_t(v)));
  if (!bringsGuideSizes(mesh)) varySizes(guides, options);
  return guides;
}

std::vector<WispGuide> guidesOnSurface(const Mesh& mesh, const GuideOptions& options) {
  requireOptions(options);
  const Mesh triangles = triangulated(mesh);
  std::vector<double> areas;
  double sum = 0;
  for (std::size_t f = 0; f < triangles.faceCount(); ++f) {
    const auto corner = triangles.face(f);
    const Vec3d a = triangles.positions[corner[0]];
    const double area =
        0.5 * length(cross(triangles.positions[corner[1]] - a, triangles.positions[corner[2]] - a));
    areas.push_back(sum += std::isfinite(area) ? area : 0);
  }
  require(sum > 0 && std::isfinite(sum), "guides: the mesh has no area to scatter them on");
  const GuideAttributes attributes(triangles, options);
  detail::RandomStream stream({options.seed, 1});
  std::vector<WispGuide> guides;
  for (std::size_t i = 0; i < options.count; ++i) {
    const double at = stream.uniformDouble() * sum;
    const auto f = std::size_t(std::upper_bound(areas.begin(), areas.end(), at) - areas.begin());
    const auto corner = triangles.face(std::min(f, areas.size() - 1));
    const float root = std::sqrt(stream.uniform()), share = stream.uniform();
    guides.push_back(blended({attributes.at(corner[0]), attributes.at(corner[1]), attributes.at(corner[2])},
                             {1 - root, root * (1 - share), root * share}));
  }
  if (!bringsGuideSizes(mesh)) varySizes(guides, options);
  return guides;
}

std::vector<WispGuide> guidesInside(const ScalarField& level, const Box& box, const GuideOptions& options) {
  requireOptions(options);
  require(!box.isEmpty() && isFinite(box.size()), "guides: the box to scatter them in is empty or unbounded");
  constexpr std::size_t kTried = 4096;
  detail::RandomStream stream({options.seed, 1});
  std::vector<WispGuide> guides;
  std::vector<float> x(kTried), y(kTried), z(kTried), values(kTried);
  for (double tried = 0; guides.size() < options.count; tried += double(kTried)) {
    require(tried <= kMostTries * double(guides.size() + 1),
            "guides: the shape fills less than a millionth of its box");
    for (std::size_t i = 0; i < kTried; ++i) {
      x[i] = box.min.x + stream.uniform() * box.size().x;
      y[i] = box.min.y + stream.uniform() * box.size().y;
      z[i] = box.min.z + stream.uniform() * box.size().z;
    }
    level.eval({x, y, z}, values);
    for (std::size_t i = 0; i < kTried && guides.size() < options.count; ++i) {
      if (!(values[i] > 0)) continue;
      guides.push_back(options.standard);
      guides.back().position = {x[i], y[i], z[i]};
    }
  }
  varySizes(guides, options);
  return guides;
}

Mesh pointsOf(const DotSpans& dots) {
  dots.requireFit("pointsOf");
  Mesh mesh;
  mesh.positions.reserve(dots.size());
  for (const Vec3f& p : dots.positions) mesh.positions.emplace_back(p);
  const auto add = [&](const char* name, int width) -> std::vector<float>& {
    mesh.attributes.push_back({name, MeshAttribute::Domain::vertex, width, {}});
    return mesh.attributes.back().values;
  };
  const auto addNumbers = [&](const char* name, std::span<const float> values) {
    if (!values.empty()) add(name, 1).assign(values.begin(), values.end());
  };
  if (!dots.colors.empty()) {
    std::vector<float>& values = add("color", 3);
    values.reserve(3 * dots.size());
    for (const Vec3f& c : dots.colors) values.insert(values.end(), {c.x, c.y, c.z});
  }
  addNumbers("size", dots.radii);
  addNumbers("mass", dots.masses);
  for (int a = 0; a < 3 && !dots.velocities.empty(); ++a) {
    static constexpr const char* kNames[] = {"vx", "vy", "vz"};
    std::vector<float>& values = add(kNames[a], 1);
    values.reserve(dots.size());
    for (const Vec3f& v : dots.velocities) values.push_back(v[a]);
  }
  return mesh;
}

}  // namespace nephele
