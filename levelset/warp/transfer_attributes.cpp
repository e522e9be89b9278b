// Attributes from the surface of one mesh to another, through the images of its positions.
//
// Every position asks once for its nearest point. A face whose corners fell into one triangle, or into one
// chart with no seam within reach of their mean, takes what they found: most faces do. The others walk over
// the triangles around the one nearest to their mean, as far as their corners are away, without stepping over
// a seam, and look for the nearest points among these alone. Where texture coordinates wrap, the walk goes on
// and counts the turns.
//
// Known limits: a face that lies across a seam squeezes what is beyond onto it. A face that spans several
// charts shows one of them. A face around a pole spans all of what is around it.
#include "nephele/levelset/warp/transfer_attributes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "nephele/levelset/warp/detail/attribute_charts.h"
#include "nephele/levelset/warp/reference_surface.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

using detail::AttributeCharts;
using detail::ReferenceSurface;
using Point = ReferenceSurface::Point;

constexpr float kFar = std::numeric_limits<float>::infinity();

std::vector<const MeshAttribute*> chosen(const Mesh& reference, const std::vector<std::string>& names) {
  std::vector<const MeshAttribute*> found;
  std::string all;
  for (const MeshAttribute& a : reference.attributes) all += (all.empty() ? "" : ", ") + a.name;
  require(!reference.attributes.empty(), "transfer: the reference has no attributes");
  for (const std::string& name : names) {
    const auto a = std::ranges::find(reference.attributes, name, &MeshAttribute::name);
    require(a != reference.attributes.end(),
            fmt::format("transfer: the reference has no attribute '{}'; it has {}", name, all));
    if (std::ranges::find(found, &*a) == found.end()) found.push_back(&*a);
  }
  if (names.empty())
    for (const MeshAttribute& a : reference.attributes)
      if (a.name != "nx" && a.name != "ny" && a.name != "nz") found.push_back(&a);
  require(!found.empty(), "transfer: the reference has no attributes but its normals");
  for (const MeshAttribute* a : found)
    for (const float v : a->values)
      require(
          std::isfinite(v),
          fmt::format("transfer: the reference's attribute '{}' has values that are not finite", a->name));
  return found;
}

/// Nearest points of all positions that faces use.
std::vector<Point> nearestPoints(const ReferenceSurface& surface, const Mesh& object,
                                 std::span<const Vec3d> images, const Progress& progress) {
  std::vector<std::uint8_t> isUsed(object.positions.size());
  for (const std::uint32_t v : object.corners) isUsed[v] = 1;
  std::vector<Point> points(object.positions.size());
  parallelFor(
      points.size(), 256,
      [&](std::size_t begin, std::size_t end) {
        float radius = kFar;
        for (std::size_t v = begin; v < end; ++v) {
          if (!isUsed[v]) continue;
          points[v] = surface.nearest(images[v], radius);
          // Images lie on the surface or about as near to it as each other: the first try is short.
          radius = 4 * points[v].distance + 1e-5f * surface.tree().box().longestSide();
        }
      },
      progress);
  return points;
}

/// Where a corner reads its value.
struct Place {
  Point at;
  AttributeCharts::Offset offset{};
};

/// Finds the places of one face after the other, for one attribute.
class FacePlaces {
 public:
  FacePlaces(const ReferenceSurface& surface, const AttributeCharts& charts, const NearestOnMesh* seams)
      : surface_(surface), charts_(charts), seams_(seams) {}

  void find(std::span<const std::uint32_t> face, std::span<const Vec3d> images,
            const std::vector<Point>& nearest, std::span<Place> places) {
    bool isOneTriangle = true, isOneChart = true;
    for (std::size_t i = 0; i < face.size(); ++i) {
      places[i] = {nearest[face[i]]};
      isOneTriangle &= places[i].at.triangle == places[0].at.triangle;
      isOneChart &= charts_.chart(places[i].at.triangle) == charts_.chart(places[0].at.triangle);
    }
    if (isOneTriangle || (isOneChart && !seams_)) return;

    Vec3d mean;
    for (const std::uint32_t v : face) mean += images[v] / double(face.size());
    double reach = 0;
    for (const std::uint32_t v : face) reach = std::max(reach, length(images[v] - mean));
    const Vec3d local = mean - surface_.origin();
    constexpr double kBeyond = 1.2;
    const auto around = float(kBeyond * reach);
    if (isOneChart && !seams_->nearest(Vec3f(local), around)) return;

    walk(surface_.nearest(mean).triangle, local, around);
    for (std::size_t i = 0; i < face.size(); ++i)
      place(images[face[i]] - surface_.origin(), reach, places[i]);
  }

 private:
  /// Visits what hangs together with `first` within `radius` of `middle`, the nearest steps first.
  void walk(std::uint32_t first, const Vec3d& middle, float radius) {
    // A bound for references that are far finer than the object.
    constexpr std::size_t kMost = 20000;
    visited_.clear();
    order_.clear();
    visit(first, {});
    for (std::size_t i = 0; i < order_.size() && order_.size() < kMost; ++i) {
      const std::uint32_t t = order_[i];
      const AttributeCharts::Offset offset = visited_.at(t);
      for (int edge = 0; edge < 3; ++edge) {
        const auto step = charts_.across(t, edge);
        if (!step || visited_.contains(step->triangle)) continue;
        const Vec3d& a = surface_.corner(step->triangle, 0);
        const Vec3d& b = surface_.corner(step->triangle, 1);
        const Vec3d& c = surface_.corner(step->triangle, 2);
        const Vec3d w = detail::nearestWeights(middle, a, b, c);
        if (length(a * w.x + b * w.y + c * w.z - middle) <= double(radius))
          visit(step->triangle, {offset.u + step->offset.u, offset.v + step->offset.v});
      }
    }
  }

  void visit(std::uint32_t triangle, const AttributeCharts::Offset& offset) {
    visited_.emplace(triangle, offset);
    order_.push_back(triangle);
  }

  /// The nearest point of what was visited. Of points that are about as near the one that was reached first:
  /// around the end of a seam a triangle may be reached from both sides, and the way there decides.
  void place(const Vec3d& image, double reach, Place& result) const {
    constexpr double kSame = 1e-3;
    double best = std::numeric_limits<double>::infinity();
    for (const std::uint32_t t : order_) {
      const Vec3d w =
          detail::nearestWeights(image, surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2));
      const double far = length(surface_.position(t, w) - image);
      if (far >= best - kSame * reach) continue;
      best = far;
      result = {{t, w, float(far)}, visited_.at(t)};
    }
  }

  const ReferenceSurface& surface_;
  const AttributeCharts& charts_;
  const NearestOnMesh* seams_;
  std::unordered_map<std::uint32_t, AttributeCharts::Offset> visited_;
  std::vector<std::uint32_t> order_;
};

/// The seams as triangles without area.
std::unique_ptr<NearestOnMesh> seamTree(const ReferenceSurface& surface, const AttributeCharts& charts) {
  Mesh lines;
  lines.positions = surface.triangles().positions;
  const std::vector<std::uint32_t>& ends = charts.seams();
  for (std::size_t i = 0; i < ends.size(); i += 2)
    lines.addFace(std::array<std::uint32_t, 3>{ends[i], ends[i + 1], ends[i + 1]});
  return ends.empty() ? nullptr : std::make_unique<NearestOnMesh>(lines);
}

std::vector<Place> cornerPlaces(const ReferenceSurface& surface, const AttributeCharts& charts,
                                const Mesh& object, std::span<const Vec3d> images,
                                const std::vector<Point>& nearest, const Progress& progress) {
  const auto seams = seamTree(surface, charts);
  std::vector<Place> places(object.corners.size());
  parallelFor(
      object.faceCount(), 256,
      [&](std::size_t begin, std::size_t end) {
        FacePlaces finder(surface, charts, seams.get());
        for (std::size_t f = begin; f < end; ++f) {
          const auto face = object.face(f);
          finder.find(face, images, nearest, std::span(places).subspan(object.faceStart[f], face.size()));
        }
      },
      progress);
  return places;
}

double valueAt(const MeshAttribute& attribute, const Point& at, std::span<const std::uint32_t> items,
               std::size_t k) {
  double sum = 0;
  for (int i = 0; i < 3; ++i)
    sum += at.weights[i] *
           double(attribute.values[std::size_t(items[std::size_t(i)]) * std::size_t(attribute.width) + k]);
  return sum;
}

MeshAttribute ofVertices(const ReferenceSurface& surface, const MeshAttribute& attribute,
                         const std::vector<Point>& nearest) {
  const auto width = std::size_t(attribute.width);
  MeshAttribute carried{attribute.name, attribute.domain, attribute.width, {}};
  carried.values.resize(nearest.size() * width);
  const std::vector<std::uint32_t>& corners = surface.triangles().corners;
  parallelFor(nearest.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const std::span items(corners.data() + 3 * std::size_t(nearest[v].triangle), 3);
      for (std::size_t k = 0; k < width; ++k)
        carried.values[v * width + k] = float(valueAt(attribute, nearest[v], items, k));
    }
  });
  return carried;
}

/// Texture coordinates of a face: back to where the reference's begin, and sensible on poles.
class FaceCoordinates {
 public:
  FaceCoordinates(const AttributeCharts& charts, const MeshAttribute& attribute) : charts_(charts) {
    for (std::size_t k = 0; k < 2; ++k) {
      low_[k] = double(attribute.values[k]);
      for (std::size_t i = k; i < attribute.values.size(); i += 2)
        low_[k] = std::min(low_[k], double(attribute.values[i]));
    }
  }

  void finish(std::span<float> values, std::span<const Place> places) const {
    for (std::size_t k = 0; k < 2; ++k) {
      meanAtPoles(values, places, k);
      if (charts_.period(int(k)) == 0) continue;
      double least = double(values[k]);
      for (std::size_t i = k; i < values.size(); i += 2) least = std::min(least, double(values[i]));
      constexpr double kRounding = 1e-6;
      const double period = charts_.period(int(k));
      const double shift = period * std::ceil((low_[k] - kRounding - least) / period);
      for (std::size_t i = k; i < values.size(); i += 2)
        values[i] = float(std::max(double(values[i]) + std::max(shift, 0.0), low_[k]));
    }
  }

 private:
  bool isOnPole(const Place& place, std::size_t k) const {
    constexpr double kNear = 1 - 1e-3;
    for (int i = 0; i < 3; ++i)
      if (place.at.weights[i] > kNear)
        return charts_.poleComponent(3 * std::size_t(place.at.triangle) + std::size_t(i)) == int(k);
    return false;
  }

  void meanAtPoles(std::span<float> values, std::span<const Place> places, std::size_t k) const {
    double sum = 0;
    int others = 0;
    for (std::size_t i = 0; i < places.size(); ++i)
      if (!isOnPole(places[i], k)) sum += double(values[2 * i + k]), ++others;
    if (others == 0 || others == int(places.size())) return;
    for (std::size_t i = 0; i < places.size(); ++i)
      if (isOnPole(places[i], k)) values[2 * i + k] = float(sum / others);
  }

  const AttributeCharts& charts_;
  double low_[2];
};

MeshAttribute ofCorners(const AttributeCharts& charts, const MeshAttribute& attribute, const Mesh& object,
                        const std::vector<Place>& places) {
  const auto width = std::size_t(attribute.width);
  MeshAttribute carried{attribute.name, attribute.domain, attribute.width, {}};
  carried.values.resize(places.size() * width);
  std::optional<FaceCoordinates> coordinates;
  if (width == 2) coordinates.emplace(charts, attribute);
  parallelFor(object.faceCount(), 2048, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const std::size_t first = object.faceStart[f], count = object.faceStart[f + 1] - first;
      for (std::size_t c = first; c < first + count; ++c) {
        const std::uint32_t corner = 3 * places[c].at.triangle;
        const std::array<std::uint32_t, 3> items{corner, corner + 1, corner + 2};
        for (std::size_t k = 0; k < width; ++k) {
          const double turns = width != 2 ? 0 : k == 0 ? places[c].offset.u : places[c].offset.v;
          carried.values[c * width + k] = float(valueAt(attribute, places[c].at, items, k) + turns);
        }
      }
      if (coordinates)
        coordinates->finish(std::span(carried.values).subspan(2 * first, 2 * count),
                            std::span(places).subspan(first, count));
    }
  });
  return carried;
}

}  // namespace

Mesh transferAttributes(const Mesh& reference, const Mesh& object, std::span<const Vec3d> images,
                        const TransferOptions& options, const Progress& progress) {
  requireValid(reference);
  requireValid(object);
  require(images.size() == object.positions.size(),
          fmt::format("transfer: {} images for {} positions", images.size(), object.positions.size()));
  for (const Vec3d& p : images) require(isFinite(p), "transfer: an image is not finite");
  chosen(reference, options.names);
  progress.begin("transfer");
  const Mesh triangles = triangulated(reference);
  const std::vector<const MeshAttribute*> attributes = chosen(triangles, options.names);
  const ReferenceSurface surface(triangles);
  const std::vector<Point> nearest = nearestPoints(surface, object, images, progress);

  Mesh result = object;
  const auto put = [&result](MeshAttribute attribute) {
    const auto same = std::ranges::find(result.attributes, attribute.name, &MeshAttribute::name);
    if (same != result.attributes.end())
      *same = std::move(attribute);
    else
      result.attributes.push_back(std::move(attribute));
  };
  // Attributes that have their seams in the same places share the search.
  std::optional<AttributeCharts> last;
  std::vector<Place> places;
  for (const MeshAttribute* attribute : attributes) {
    progress.check();
    if (attribute->domain == MeshAttribute::Domain::vertex) {
      put(ofVertices(surface, *attribute, nearest));
      continue;
    }
    AttributeCharts charts(triangles, *attribute);
    if (!last || !charts.hangsTogetherAs(*last))
      places = cornerPlaces(surface, charts, object, images, nearest, progress);
    put(ofCorners(charts, *attribute, object, places));
    last = std::move(charts);
  }
  return result;
}

}  // namespace nephele
