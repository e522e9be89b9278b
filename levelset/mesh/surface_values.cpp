// Numbers on a surface: interpolated at vertices, or the cosine of the interpolated normal.
//
// Normals are the sums of the normals of the faces around a vertex, weighted by the faces' angles there
// (Thuermer and Wuethrich, Computing vertex normals from polygonal facets, 1998), so that they do not depend
// on how flat parts are cut into triangles. Interpolated directions stay in the cone around the mean of the
// corners' normals that holds these, which bounds their cosine.
//
// A brick of samples collects the triangles that can be nearest to any of them, once, and lets them compete
// (triangle_kernels.cpp): all of them lie within the distance of its middle and twice its half diagonal.
#include "nephele/levelset/mesh/surface_values.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "nephele/levelset/mesh/surface_geometry.h"
#include "nephele/levelset/mesh/triangle_kernels.h"

namespace nephele::detail {

namespace {

class LinearValues final : public SurfaceValues {
 public:
  LinearValues(std::vector<std::uint32_t> corners, std::vector<float> values)
      : corners_(std::move(corners)), values_(std::move(values)) {}

  float at(std::uint32_t triangle, const Vec3d& weights) const override {
    double sum = 0;
    for (int i = 0; i < 3; ++i) sum += weights[i] * double(corner(triangle, i));
    const Interval range = over(triangle);
    return std::clamp(float(sum), range.min, range.max);
  }
  Interval over(std::uint32_t triangle) const override {
    return Interval::of(corner(triangle, 0))
        .hull(Interval::of(corner(triangle, 1)))
        .hull(Interval::of(corner(triangle, 2)));
  }
  float atVertex(std::uint32_t vertex) const override { return values_[vertex]; }

 private:
  float corner(std::uint32_t triangle, int i) const {
    return values_[corners_[3 * std::size_t(triangle) + std::size_t(i)]];
  }

  std::vector<std::uint32_t> corners_;
  std::vector<float> values_;
};

double angleBetween(const Vec3d& a, const Vec3d& b) {
  return std::atan2(length(cross(a, b)), dot(a, b));
}

class FacingValues final : public SurfaceValues {
 public:
  FacingValues(const Mesh& mesh, const Vec3f& direction)
      : corners_(mesh.corners), normals_(mesh.positions.size()), direction_(direction) {
    faceNormals_.reserve(mesh.faceCount());
    const std::vector<std::uint32_t> first = firstEqualPosition(mesh.positions);
    std::vector<Vec3d> sums(mesh.positions.size());
    for (std::size_t t = 0; t < mesh.faceCount(); ++t) {
      const auto face = mesh.face(t);
      const Vec3d p[3] = {mesh.positions[face[0]], mesh.positions[face[1]], mesh.positions[face[2]]};
      const Vec3d normal = normalize(cross(p[1] - p[0], p[2] - p[0]));
      faceNormals_.push_back(Vec3f(normal));
      for (int i = 0; i < 3; ++i)
        sums[first[face[std::size_t(i)]]] +=
            normal * angleBetween(p[(i + 1) % 3] - p[i], p[(i + 2) % 3] - p[i]);
    }
    for (std::size_t v = 0; v < sums.size(); ++v) normals_[v] = Vec3f(normalize(sums[first[v]]));
  }

  float at(std::uint32_t triangle, const Vec3d& weights) const override {
    Vec3d sum;
    for (int i = 0; i < 3; ++i) sum += Vec3d(corner(triangle, i)) * weights[i];
    // Where the corners' normals cancel, those of the face decide.
    constexpr double kCancelled = 1e-6;
    const Vec3d normal = length(sum) > kCancelled ? normalize(sum) : Vec3d(faceNormals_[triangle]);
    return cosine(normal);
  }
  Interval over(std::uint32_t triangle) const override {
    Vec3d sum;
    for (int i = 0; i < 3; ++i) sum += Vec3d(corner(triangle, i));
    const Vec3d mean = normalize(sum);
    double cone = 0;
    bool hasNormals = length(sum) > 0;
    for (int i = 0; i < 3; ++i) {
      cone = std::max(cone, angleBetween(mean, Vec3d(corner(triangle, i))));
      hasNormals &= corner(triangle, i) != Vec3f{};
    }
    // In a wider cone normals may cancel, and a corner without one leaves it to the face.
    constexpr double kWide = 1.5, kRounding = 1e-6;
    if (!hasNormals || cone > kWide) return {-1.0f, 1.0f};
    const double angle = angleBetween(mean, Vec3d(direction_));
    const double least = std::cos(std::min(angle + cone, M_PI)), most = std::cos(std::max(angle - cone, 0.0));
    return {float(std::max(least - kRounding, -1.0)), float(std::min(most + kRounding, 1.0))};
  }
  float atVertex(std::uint32_t vertex) const override { return cosine(Vec3d(normals_[vertex])); }

 private:
  float cosine(const Vec3d& normal) const {
    return float(std::clamp(dot(normal, Vec3d(direction_)), -1.0, 1.0));
  }
  const Vec3f& corner(std::uint32_t triangle, int i) const {
    return normals_[corners_[3 * std::size_t(triangle) + std::size_t(i)]];
  }

  std::vector<std::uint32_t> corners_;
  std::vector<Vec3f> normals_, faceNormals_;
  Vec3f direction_;
};

/// Weights of the corners at the point of a feature that is nearest to `p`.
Vec3d weightsAt(Feature feature, const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const auto along = [&p](const Vec3d& start, const Vec3d& end) {
    const Vec3d side = end - start;
    return std::clamp(dot(p - start, side) / dot(side, side), 0.0, 1.0);
  };
  switch (feature) {
    case Feature::face:
      return barycentrics(p, a, b, c);
    case Feature::edgeAB: {
      const double t = along(a, b);
      return {1 - t, t, 0};
    }
    case Feature::edgeBC: {
      const double t = along(b, c);
      return {0, 1 - t, t};
    }
    case Feature::edgeCA: {
      const double t = along(c, a);
      return {t, 0, 1 - t};
    }
    case Feature::cornerA:
      return {1, 0, 0};
    case Feature::cornerB:
      return {0, 1, 0};
    case Feature::cornerC:
      break;
  }
  return {0, 0, 1};
}

std::vector<RangeTree::Item> rangesOf(const Mesh& mesh, const SurfaceValues& values) {
  std::vector<RangeTree::Item> items(mesh.faceCount());
  for (std::size_t t = 0; t < items.size(); ++t) {
    for (const std::uint32_t v : mesh.face(t))
      items[t].box = items[t].box.including(Vec3f(mesh.positions[v]));
    items[t].range = values.over(std::uint32_t(t));
  }
  return items;
}

}  // namespace

Vec3d barycentrics(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d corners[3] = {a, b, c};
  const Vec3d normal = cross(b - a, c - a);
  int longest = 0;
  double longestSquared = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec3d side = corners[(i + 1) % 3] - corners[i];
    if (const double squared = dot(side, side); squared > longestSquared) {
      longest = i;
      longestSquared = squared;
    }
  }
  Vec3d weights{1, 0, 0};
  constexpr double kSliver = 1e-14;
  if (dot(normal, normal) > kSliver * longestSquared * longestSquared) {
    for (int i = 0; i < 3; ++i) {
      const Vec3d& q = corners[(i + 1) % 3];
      weights[i] = std::max(0.0, dot(cross(corners[(i + 2) % 3] - q, p - q), normal));
    }
    const double sum = weights.x + weights.y + weights.z;
    return sum > 0 ? weights / sum : Vec3d{1, 0, 0};
  }
  if (longestSquared > 0) {
    const Vec3d& start = corners[longest];
    const double t =
        std::clamp(dot(p - start, corners[(longest + 1) % 3] - start) / longestSquared, 0.0, 1.0);
    weights = {};
    weights[longest] = 1 - t;
    weights[(longest + 1) % 3] = t;
  }
  return weights;
}

std::unique_ptr<SurfaceValues> linearValues(const std::vector<std::uint32_t>& corners,
                                            std::vector<float> values) {
  return std::make_unique<LinearValues>(corners, std::move(values));
}

std::unique_ptr<SurfaceValues> facingValues(const Mesh& triangles, const Vec3f& direction) {
  return std::make_unique<FacingValues>(triangles, direction);
}

ValuedSurface::ValuedSurface(const Mesh& triangles, std::unique_ptr<SurfaceValues> values)
    : positions_(triangles.positions),
      corners_(triangles.corners),
      values_(std::move(values)),
      nearest_(triangles),
      ranges_(rangesOf(triangles, *values_)) {}

float ValuedSurface::at(const Vec3f& p, Cursor& cursor) const {
  // A little more than the distance to a point of the mesh, so that rounding cannot hide that point.
  constexpr float kSlack = 1.0001f, kFar = std::numeric_limits<float>::infinity();
  auto hit = nearest_.nearest(p, cursor.hasPoint ? length(cursor.point - p) * kSlack : kFar);
  if (!hit && cursor.hasPoint) hit = nearest_.nearest(p, kFar);
  if (!hit) return std::numeric_limits<float>::quiet_NaN();
  cursor = {hit->point, true};
  const std::uint32_t* corner = corners_.data() + 3 * std::size_t(hit->triangle);
  return values_->at(hit->triangle, barycentrics(Vec3d(hit->point), positions_[corner[0]],
                                                 positions_[corner[1]], positions_[corner[2]]));
}

void ValuedSurface::atBrick(const Vec3i& firstVoxel, float voxelSize, std::span<float, 512> values) const {
  constexpr float kMiddle = 3.5f, kHalfDiagonal = 6.0622f, kSlack = 1.001f;
  // So many that asking for each sample is cheaper.
  constexpr std::size_t kMostTriangles = 1500;
  const auto pointAt = [&](int s) {
    return Vec3f(firstVoxel + Vec3i{s & 7, s >> 3 & 7, s >> 6}) * voxelSize;
  };
  const Vec3f middle = (Vec3f(firstVoxel) + Vec3f{kMiddle, kMiddle, kMiddle}) * voxelSize;
  const auto hit = nearest_.nearest(middle, std::numeric_limits<float>::infinity());
  const auto near =
      hit ? nearest_.trianglesNear(middle, (hit->distance + 2 * kHalfDiagonal * voxelSize) * kSlack,
                                   kMostTriangles)
          : std::nullopt;
  NearestSamples found;
  std::fill_n(found.code, NearestSamples::kSize, -1);
  if (near) {
    const std::vector<std::uint32_t>& triangles = *near;
    const float reach = (hit->distance / voxelSize + kHalfDiagonal) * kSlack;
    std::fill_n(found.squared, NearestSamples::kSize, reach * reach);
    std::vector<TriangleShape> shapes(triangles.size());
    std::vector<PlacedTriangle> placed(triangles.size());
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const std::uint32_t* corner = corners_.data() + 3 * std::size_t(triangles[i]);
      const auto local = [&](int k) { return positions_[corner[k]] / double(voxelSize) - Vec3d(firstVoxel); };
      shapes[i] = triangleShape(local(0), local(1), local(2));
      placed[i] = placeTriangle(i, shapes[i], Vec3f(local(0)));
    }
    std::sort(placed.begin(), placed.end(), [](const PlacedTriangle& a, const PlacedTriangle& b) {
      return a.order != b.order ? a.order < b.order : a.index < b.index;
    });
    nearestTriangles(shapes.data(), placed.data(), placed.size(), reach, found);
  }
  Cursor cursor;
  for (int s = 0; s < NearestSamples::kSize; ++s) {
    float& value = values[std::size_t(s)];
    if (found.code[s] < 0) {
      value = at(pointAt(s), cursor);
      continue;
    }
    const std::uint32_t triangle = (*near)[std::size_t(found.code[s] / 8)];
    const std::uint32_t* corner = corners_.data() + 3 * std::size_t(triangle);
    const Vec3d& a = positions_[corner[0]];
    const Vec3d& b = positions_[corner[1]];
    const Vec3d& c = positions_[corner[2]];
    value = values_->at(triangle, weightsAt(Feature(found.code[s] % 8), Vec3d(pointAt(s)), a, b, c));
  }
}

Interval ValuedSurface::range(const Box& box) const {
  const Vec3f centre = box.center();
  const Vec3f half = box.size() * 0.5f;
  if (!isFinite(centre) || !isFinite(half)) return range();
  const auto hit = nearest_.nearest(centre, std::numeric_limits<float>::infinity());
  if (!hit) return range();
  // No point of the box is farther from the surface than this, so nothing beyond is nearest to any.
  constexpr float kRounding = 1e-5f;
  const float reach = hit->distance + length(half);
  const float slack = kRounding * (reach + length(max(max(box.max, -box.min), nearest_.box().size())));
  return ranges_.near(box, reach + slack).value_or(range());
}

}  // namespace nephele::detail
