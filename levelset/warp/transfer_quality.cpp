// Measures of a piecewise linear map between two surfaces.
//
// With e1 the first side of a triangle, of length l, and (x, h) the second one's parts along and across it,
// the map's columns in an orthonormal frame are c1 = d1 / l and c2 = (d2 - x d1 / l) / h, where d1 and d2 are
// the sides of the image. T = |c1|^2 + |c2|^2 = s1^2 + s2^2 and A = s1 s2, the ratio of the areas, give
// s1^2 = T / 2 + sqrt(T^2 / 4 - A^2), and s1 / s2 = s1^2 / A without cancellation.
//
// Coverage looks from the reference: points in equal steps along its area, in the order of its triangles, and
// the image triangle nearest to each. A chord of the surface lies above or below the point, along the normal;
// the rim of what is covered lies beside it.
//
// Known limit: where two sheets of the reference lie within an image triangle's size of each other, its
// middle may be nearest to the wrong one.
#include "nephele/levelset/warp/transfer_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

#include "nephele/levelset/grid/disjoint_sets.h"
#include "nephele/levelset/warp/reference_surface.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"

namespace nephele {

namespace {

constexpr double kMostStretch = 1e6, kCollapsed = 100, kLeastArea = 1e-3;
constexpr std::size_t kSamples = 16384;

struct Triangle {
  std::array<Vec3d, 3> object, image;
  /// Among all triangles of the object.
  std::uint32_t number = 0;
};

/// Those of the object that have area, with the images of their corners relative to `origin`.
std::vector<Triangle> mappedTriangles(const Mesh& object, std::span<const Vec3d> images,
                                      const Vec3d& origin) {
  const bool perPosition = images.size() == object.positions.size();
  constexpr double kNoArea = 1e-12;
  std::vector<Triangle> triangles;
  triangles.reserve(object.corners.size() / 3);
  std::uint32_t number = 0;
  for (std::size_t f = 0; f < object.faceCount(); ++f)
    for (std::uint32_t c = object.faceStart[f] + 2; c < object.faceStart[f + 1]; ++c, ++number) {
      Triangle t;
      t.number = number;
      const std::uint32_t corners[] = {object.faceStart[f], c - 1, c};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t v = object.corners[corners[i]];
        t.object[i] = object.positions[v];
        t.image[i] = images[perPosition ? v : corners[i]] - origin;
      }
      const Vec3d a = t.object[1] - t.object[0], b = t.object[2] - t.object[0], d = b - a;
      const double longest = std::max({dot(a, a), dot(b, b), dot(d, d)});
      if (length(cross(a, b)) > kNoArea * longest) triangles.push_back(t);
    }
  return triangles;
}

/// -1 for a mesh that is inside out.
double orientation(const Mesh& mesh) {
  constexpr double kFlat = 1e-6;
  return signedVolume(mesh) < -kFlat * std::pow(surfaceArea(mesh), 1.5) ? -1 : 1;
}

struct Distortion {
  double stretch, area;
};

Distortion distortionOf(const Triangle& t) {
  const Vec3d e1 = t.object[1] - t.object[0], e2 = t.object[2] - t.object[0];
  const Vec3d d1 = t.image[1] - t.image[0], d2 = t.image[2] - t.image[0];
  const double l = length(e1), twice = length(cross(e1, e2)), x = dot(e1, e2) / l, h = twice / l;
  const Vec3d c1 = d1 / l, c2 = (d2 - d1 * (x / l)) / h;
  const double area = length(cross(d1, d2)) / twice;
  const double half = 0.5 * (dot(c1, c1) + dot(c2, c2));
  const double squared = half + std::sqrt(std::max(half * half - area * area, 0.0));
  return {squared < kMostStretch * area ? std::max(squared / area, 1.0) : kMostStretch, area};
}

Vec3d normalOf(const Triangle& t) {
  return cross(t.image[1] - t.image[0], t.image[2] - t.image[0]);
}

/// What is known of every triangle of the object.
struct Facts {
  std::vector<float> stretch;
  std::vector<std::uint8_t> isCollapsed, isFlipped;
  /// The reference's normal at the middle of the image.
  std::vector<Vec3f> normal;
};

double percentile(std::vector<float> values, double share) {
  const auto nth = values.begin() + std::ptrdiff_t(share * double(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), nth, values.end());
  return double(*nth);
}

/// A point of the reference, and the triangle it is in.
struct Sample {
  std::uint32_t triangle;
  Vec3d weights;
};

std::vector<Sample> evenSamples(const detail::ReferenceSurface& reference) {
  const std::size_t count = reference.triangles().faceCount();
  std::vector<double> area(count);
  for (std::size_t t = 0; t < count; ++t) {
    const Vec3d& a = reference.corner(t, 0);
    area[t] = length(cross(reference.corner(t, 1) - a, reference.corner(t, 2) - a));
  }
  const double step = std::accumulate(area.begin(), area.end(), 0.0) / double(kSamples);
  std::vector<Sample> samples;
  if (step <= 0) return samples;
  // Places in the triangles by the generalised golden ratio, which spreads evenly.
  constexpr double kFirst = 0.7548776662466927, kSecond = 0.5698402909980532;
  double sum = -0.5 * step;
  for (std::size_t t = 0; t < count; ++t)
    for (sum += area[t]; sum >= 0 && samples.size() < kSamples; sum -= step) {
      double u = std::fmod(kFirst * double(samples.size() + 1), 1.0),
             v = std::fmod(kSecond * double(samples.size() + 1), 1.0);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      samples.push_back({std::uint32_t(t), {1 - u - v, u, v}});
    }
  return samples;
}

/// Which of the samples images lie on.
std::vector<std::uint8_t> coveredOf(const detail::ReferenceSurface& reference,
                                    const std::vector<Sample>& samples,
                                    const std::vector<Triangle>& triangles, const Facts& facts,
                                    const Progress& progress) {
  Mesh images;
  std::vector<std::uint32_t> which;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (facts.isCollapsed[t]) continue;
    const auto first = std::uint32_t(images.positions.size());
    images.positions.insert(images.positions.end(), triangles[t].image.begin(), triangles[t].image.end());
    images.addFace(std::array<std::uint32_t, 3>{first, first + 1, first + 2});
    which.push_back(t);
  }
  std::vector<std::uint8_t> isCovered(samples.size());
  if (which.empty() || samples.empty()) return isCovered;

  const NearestOnMesh nearest(images);
  const float touching = 1e-4f * boundingBox(reference.triangles()).longestSide();
  parallelFor(
      samples.size(), 256,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) {
          const Vec3d p = reference.position(samples[s].triangle, samples[s].weights);
          const auto hit = nearest.nearest(Vec3f(p), std::numeric_limits<float>::infinity());
          if (!hit) continue;
          const Triangle& t = triangles[which[hit->triangle]];
          const Vec3d normal = reference.normal({samples[s].triangle, samples[s].weights});
          const double longest = std::max({length(t.image[1] - t.image[0]), length(t.image[2] - t.image[1]),
                                           length(t.image[0] - t.image[2])});
          const Vec3d away = Vec3d(hit->point) - p;
          const double along = dot(away, normal);
          const bool isAbove = 2 * along * along >= dot(away, away) && double(hit->distance) < longest;
          isCovered[s] = (isAbove || hit->distance <= touching) &&
                         dot(normal, Vec3d(facts.normal[which[hit->triangle]])) > 0;
        }
      },
      progress);
  return isCovered;
}

std::vector<Sample> middleSamples(std::size_t triangles) {
  std::vector<Sample> samples(triangles);
  for (std::uint32_t t = 0; t < triangles; ++t) samples[t] = {t, {1.0 / 3, 1.0 / 3, 1.0 / 3}};
  return samples;
}

/// Of the triangles that `isIn` says, which hang together by their corners. `whole`: the area of all.
SurfaceRegion largestRegion(const Mesh& triangles, const std::function<bool(std::size_t)>& isIn, double whole,
                            const Vec3d& origin) {
  const std::vector<std::uint32_t> first = firstEqualPosition(triangles.positions);
  detail::DisjointSets sets(triangles.positions.size());
  const auto vertex = [&](std::size_t t, std::size_t corner) {
    return first[triangles.corners[3 * t + corner]];
  };
  for (std::size_t t = 0; t < triangles.faceCount(); ++t) {
    if (!isIn(t)) continue;
    sets.join(vertex(t, 0), vertex(t, 1));
    sets.join(vertex(t, 0), vertex(t, 2));
  }
  std::vector<double> areas(triangles.positions.size());
  std::vector<Vec3d> moments(triangles.positions.size());
  for (std::size_t t = 0; t < triangles.faceCount(); ++t) {
    if (!isIn(t)) continue;
    const Vec3d &a = triangles.positions[vertex(t, 0)], &b = triangles.positions[vertex(t, 1)],
                &c = triangles.positions[vertex(t, 2)];
    const double area = 0.5 * length(cross(b - a, c - a));
    const std::uint32_t root = sets.root(vertex(t, 0));
    areas[root] += area;
    moments[root] += (a + b + c) * (area / 3);
  }
  const auto most = std::max_element(areas.begin(), areas.end());
  if (most == areas.end() || !(*most > 0) || !(whole > 0)) return {};
  return {moments[std::size_t(most - areas.begin())] / *most + origin, *most / whole};
}

/// What is bad, triangle by triangle, and where most of it is.
void findRegions(const detail::ReferenceSurface& reference, const Mesh& object,
                 const std::vector<Triangle>& triangles, const Facts& facts, const Progress& progress,
                 TransferQuality& quality) {
  const Mesh fans = triangulated(object);
  quality.stretch.assign(fans.faceCount(), 1.0f);
  double bad = 0;
  const double whole = surfaceArea(fans);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const bool isWrong = facts.isCollapsed[i] || facts.isFlipped[i];
    const float stretch = isWrong ? std::numeric_limits<float>::infinity() : facts.stretch[i];
    quality.stretch[triangles[i].number] = stretch;
    const auto& t = triangles[i].object;
    if (stretch >= TransferQuality::kBadStretch) bad += 0.5 * length(cross(t[1] - t[0], t[2] - t[0]));
  }
  quality.badFraction = whole > 0 ? bad / whole : 0;
  quality.worst = largestRegion(
      fans, [&](std::size_t t) { return quality.stretch[t] >= TransferQuality::kBadStretch; }, whole, {});
  const Mesh& target = reference.triangles();
  quality.isCovered = coveredOf(reference, middleSamples(target.faceCount()), triangles, facts, progress);
  quality.uncovered = largestRegion(
      target, [&](std::size_t t) { return quality.isCovered[t] == 0; }, surfaceArea(target),
      reference.origin());
}

}  // namespace

TransferQuality transferQuality(const Mesh& reference, const Mesh& object, std::span<const Vec3d> images,
                                const Progress& progress) {
  requireValid(reference);
  requireValid(object);
  require(images.size() == object.positions.size() || images.size() == object.corners.size(),
          fmt::format("transfer quality: {} images for {} positions and {} corners", images.size(),
                      object.positions.size(), object.corners.size()));
  require(object.faceCount() > 0, "transfer quality: the object has no faces");
  for (const Vec3d& p : images) require(isFinite(p), "transfer quality: an image is not finite");
  for (const Vec3d& p : object.positions)
    require(isFinite(p), "transfer quality: the object has positions that are not finite");

  progress.check();
  const detail::ReferenceSurface surface(reference);
  const std::vector<Triangle> triangles = mappedTriangles(object, images, surface.origin());
  TransferQuality quality;
  quality.triangleCount = triangles.size();
  if (triangles.empty()) return quality;

  const double side = orientation(surface.triangles()) * orientation(object);
  const double leastArea = kLeastArea * surfaceArea(surface.triangles()) / surfaceArea(object);
  Facts facts{std::vector<float>(triangles.size()), std::vector<std::uint8_t>(triangles.size()),
              std::vector<std::uint8_t>(triangles.size()), std::vector<Vec3f>(triangles.size())};
  parallelFor(
      triangles.size(), 512,
      [&](std::size_t begin, std::size_t end) {
        float radius = std::numeric_limits<float>::infinity();
        for (std::size_t i = begin; i < end; ++i) {
          const Triangle& t = triangles[i];
          const Distortion distortion = distortionOf(t);
          facts.stretch[i] = float(distortion.stretch);
          facts.isCollapsed[i] = distortion.stretch > kCollapsed || distortion.area < leastArea;
          if (facts.isCollapsed[i]) continue;
          const Vec3d middle = (t.image[0] + t.image[1] + t.image[2]) / 3.0 + surface.origin();
          const auto at = surface.nearest(middle, radius);
          // Chords of one mesh lie about as deep as each other.
          radius = 2 * at.distance + float(length(t.image[1] - t.image[0]));
          const Vec3d normal = surface.normal(at);
          facts.normal[i] = Vec3f(normal);
          facts.isFlipped[i] = side * dot(normalOf(t), normal) < 0;
        }
      },
      SubProgress(progress, 0, 0.5));

  const double count = double(triangles.size());
  quality.degenerateFraction =
      double(std::count(facts.isCollapsed.begin(), facts.isCollapsed.end(), 1)) / count;
  quality.flippedFraction = double(std::count(facts.isFlipped.begin(), facts.isFlipped.end(), 1)) / count;
  quality.stretchMedian = percentile(facts.stretch, 0.5);
  quality.stretchP95 = percentile(facts.stretch, 0.95);
  const std::vector<Sample> samples = evenSamples(surface);
  const auto isCovered = coveredOf(surface, samples, triangles, facts, SubProgress(progress, 0.5, 0.75));
  if (!samples.empty())
    quality.coverage = double(std::count(isCovered.begin(), isCovered.end(), 1)) / double(samples.size());
  findRegions(surface, object, triangles, facts, SubProgress(progress, 0.75, 1), quality);
  return quality;
}

}  // namespace nephele
