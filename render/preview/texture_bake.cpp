// A texture for one surface from that of another.
//
// The texture is filled in bands of rows, each by one thread, from the triangles whose texture coordinates
// reach into it. How much of the picture a sample covers follows from areas: of the image triangle per
// sample, and of texture coordinates per area in the reference's triangle.
//
// Known limits: triangles smaller than a sample may be missed, and are filled in as gutter. Where charts of
// the object overlap, their colours are averaged. Chart borders of the picture need a gutter of their own.
#include "nephele/render/preview/texture_bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "nephele/levelset/warp/reference_surface.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/render/image/texture_image.h"

namespace nephele {

namespace {

constexpr int kBand = 8;

using Corners = std::array<std::array<double, 2>, 3>;

/// Texture coordinates of triangles.
class Coordinates {
 public:
  Coordinates(const Mesh& triangles, const char* which) : mesh_(triangles) {
    for (const MeshAttribute& a : triangles.attributes)
      if (a.name == "uv" && a.width == 2) attribute_ = &a;
    require(attribute_ != nullptr, fmt::format("texture: the {} has no texture coordinates", which));
  }

  Corners of(std::size_t triangle) const {
    Corners result;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t corner = 3 * triangle + i;
      const std::size_t item =
          attribute_->domain == MeshAttribute::Domain::corner ? corner : mesh_.corners[corner];
      for (std::size_t k = 0; k < 2; ++k) result[i][k] = double(attribute_->values[2 * item + k]);
    }
    return result;
  }

 private:
  const Mesh& mesh_;
  const MeshAttribute* attribute_ = nullptr;
};

double twiceArea(const Corners& c) {
  return (c[1][0] - c[0][0]) * (c[2][1] - c[0][1]) - (c[2][0] - c[0][0]) * (c[1][1] - c[0][1]);
}

double twiceArea(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  return length(cross(b - a, c - a));
}

/// A triangle of the object in units of samples of the texture, y down.
struct Patch {
  Corners place;
  std::array<Vec3d, 3> image;
  double twice;
  /// Area of the image per sample.
  double areaPerSample;
};

std::vector<Patch> patchesOf(const Mesh& object, std::span<const Vec3d> images, int columns, int rows) {
  const Coordinates coordinates(object, "object");
  std::vector<Patch> patches;
  for (std::size_t t = 0; t < object.faceCount(); ++t) {
    Patch patch{coordinates.of(t), {}, 0, 0};
    bool isFinite = true;
    for (std::size_t i = 0; i < 3; ++i) {
      auto& [x, y] = patch.place[i];
      x *= columns;
      y = (1 - y) * rows;
      isFinite &= std::abs(x) < 1e8 && std::abs(y) < 1e8;
      patch.image[i] = images[object.corners[3 * t + i]];
    }
    patch.twice = twiceArea(patch.place);
    if (!isFinite || patch.twice == 0) continue;
    patch.areaPerSample = twiceArea(patch.image[0], patch.image[1], patch.image[2]) / std::abs(patch.twice);
    patches.push_back(patch);
  }
  return patches;
}

/// Patches by the bands of the texture that they reach into, which repeats.
std::vector<std::vector<std::uint32_t>> banded(const std::vector<Patch>& patches, int rows, int bandRows) {
  std::vector<std::vector<std::uint32_t>> bands(std::size_t((rows + bandRows - 1) / bandRows));
  for (std::uint32_t p = 0; p < patches.size(); ++p) {
    const Corners& c = patches[p].place;
    const double low = std::min({c[0][1], c[1][1], c[2][1]}), high = std::max({c[0][1], c[1][1], c[2][1]});
    for (double turn = std::floor(low / rows); turn * rows <= high; ++turn) {
      const auto first = std::size_t(std::max(low - turn * rows, 0.0)) / std::size_t(bandRows),
                 last = std::size_t(std::min(high - turn * rows, rows - 1.0)) / std::size_t(bandRows);
      for (std::size_t b = first; b <= last; ++b)
        if (bands[b].empty() || bands[b].back() != p) bands[b].push_back(p);
    }
  }
  return bands;
}

struct Sum {
  Vec3f colour{};
  int count = 0;
};

class Filler {
 public:
  Filler(const Mesh& reference, const Image& picture, const TextureBakeOptions& options)
      : options_(options),
        triangles_(triangulated(reference)),
        coordinates_(triangles_, "reference"),
        surface_(triangles_),
        picture_(picture) {}

  /// All samples of a patch with rows first <= y < end, of `rows` in all.
  void fill(const Patch& patch, int first, int end, std::vector<Sum>& sums, float& radius) const {
    const int columns = options_.width * options_.samples, rows = options_.height * options_.samples;
    const Corners& c = patch.place;
    const double low = std::min({c[0][1], c[1][1], c[2][1]}), high = std::max({c[0][1], c[1][1], c[2][1]});
    // The repetitions of these rows that the patch reaches.
    for (double turn = std::floor(low / rows); turn * rows <= high; ++turn)
      for (int y = first; y < end; ++y) {
        const double py = turn * rows + y + 0.5;
        if (py < low || py > high) continue;
        double begin = 1e300, stop = -1e300;
        for (std::size_t i = 0; i < 3; ++i) {
          const auto &a = c[i], &b = c[(i + 1) % 3];
          if ((a[1] <= py) == (b[1] <= py)) continue;
          const double x = a[0] + (py - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
          begin = std::min(begin, x);
          stop = std::max(stop, x);
        }
        for (double x = std::ceil(begin - 0.5); x + 0.5 <= stop; ++x) {
          const auto column = int(x - std::floor(x / columns) * columns);
          Sum& sum =
              sums[std::size_t((y - first) / options_.samples * options_.width + column / options_.samples)];
          sum.colour += colourAt(patch, x + 0.5, py, radius);
          ++sum.count;
        }
      }
  }

 private:
  Vec3f colourAt(const Patch& patch, double x, double y, float& radius) const {
    const Corners& c = patch.place;
    const double v = ((x - c[0][0]) * (c[2][1] - c[0][1]) - (c[2][0] - c[0][0]) * (y - c[0][1])) /
                     patch.twice,
                 w = ((c[1][0] - c[0][0]) * (y - c[0][1]) - (x - c[0][0]) * (c[1][1] - c[0][1])) /
                     patch.twice;
    const Vec3d p = patch.image[0] * (1 - v - w) + patch.image[1] * v + patch.image[2] * w;
    const auto at = surface_.nearest(p, radius);
    radius = 2 * at.distance + 1e-4f * surface_.tree().box().longestSide();
    const Corners uv = coordinates_.of(at.triangle);
    double place[2];
    for (std::size_t k = 0; k < 2; ++k)
      place[k] = uv[0][k] * at.weights.x + uv[1][k] * at.weights.y + uv[2][k] * at.weights.z;
    const double area = twiceArea(surface_.corner(at.triangle, 0), surface_.corner(at.triangle, 1),
                                  surface_.corner(at.triangle, 2));
    const double covered =
        area > 0 ? std::abs(twiceArea(uv)) / area * patch.areaPerSample * picture_.width() * picture_.height()
                 : 0;
    return picture_.at(place[0], place[1], std::sqrt(covered));
  }

  const TextureBakeOptions& options_;
  Mesh triangles_;
  Coordinates coordinates_;
  detail::ReferenceSurface surface_;
  Texture picture_;
};

/// Continues the charts by one texel at a time, each the mean of its neighbours that have a colour.
void grow(std::vector<Vec3f>& colours, std::vector<std::uint8_t>& isKnown, int width, int height, int steps) {
  for (int step = 0; step < steps; ++step) {
    std::vector<std::pair<std::size_t, Vec3f>> next;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t here = std::size_t(y) * std::size_t(width) + std::size_t(x);
        if (isKnown[here]) continue;
        Vec3f sum;
        int count = 0;
        for (int j = std::max(y - 1, 0); j <= std::min(y + 1, height - 1); ++j)
          for (int i = std::max(x - 1, 0); i <= std::min(x + 1, width - 1); ++i)
            if (const std::size_t there = std::size_t(j) * std::size_t(width) + std::size_t(i);
                isKnown[there])
              sum += colours[there], ++count;
        if (count > 0) next.emplace_back(here, sum / float(count));
      }
    if (next.empty()) return;
    for (const auto& [texel, colour] : next) colours[texel] = colour, isKnown[texel] = 1;
  }
}

}  // namespace

BakedTexture bakeTexture(const Mesh& reference, const Image& picture, const Mesh& object,
                         std::span<const Vec3d> images, const TextureBakeOptions& options,
                         const Progress& progress) {
  requireValid(reference);
  requireValid(object);
  for (const auto& [name, value, least] :
       {std::tuple{"width", options.width, 1}, std::tuple{"height", options.height, 1},
        std::tuple{"number of samples", options.samples, 1}, std::tuple{"gutter", options.gutter, 0}})
    require(value >= least && value <= 1 << 16,
            fmt::format("texture: the {} must be {} to 65536, got {}", name, least, value));
  require(images.size() == object.positions.size(),
          fmt::format("texture: {} images for {} positions", images.size(), object.positions.size()));
  require(object.faceCount() > 0, "texture: the object has no faces");
  for (const Vec3d& p : images) require(isFinite(p), "texture: an image is not finite");

  progress.begin("bake texture");
  const int width = options.width, height = options.height;
  const Filler filler(reference, picture, options);
  const std::vector<Patch> patches =
      patchesOf(triangulated(object), images, width * options.samples, height * options.samples);
  const int bandRows = kBand * options.samples;
  const auto bands = banded(patches, height * options.samples, bandRows);
  std::vector<Vec3f> colours(std::size_t(width) * std::size_t(height));
  std::vector<std::uint8_t> isKnown(colours.size());
  parallelFor(
      bands.size(), 1,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
          const int firstRow = int(b) * kBand, rowCount = std::min(kBand, height - firstRow);
          std::vector<Sum> sums(std::size_t(rowCount) * std::size_t(width));
          float radius = std::numeric_limits<float>::infinity();
          for (const std::uint32_t p : bands[b]) {
            progress.check();
            filler.fill(patches[p], firstRow * options.samples, (firstRow + rowCount) * options.samples, sums,
                        radius);
          }
          for (std::size_t i = 0; i < sums.size(); ++i) {
            if (sums[i].count == 0) continue;
            const std::size_t texel = std::size_t(firstRow) * std::size_t(width) + i;
            colours[texel] = sums[i].colour / float(sums[i].count);
            isKnown[texel] = 1;
          }
        }
      },
      progress);

  const auto covered = std::count(isKnown.begin(), isKnown.end(), 1);
  Vec3d mean;
  for (std::size_t i = 0; i < colours.size(); ++i)
    if (isKnown[i]) mean += Vec3d(colours[i]) / double(covered);
  grow(colours, isKnown, width, height, options.gutter);

  BakedTexture result;
  result.covered = double(covered) / double(colours.size());
  result.image.width = width;
  result.image.height = height;
  static constexpr const char* kNames[] = {"R", "G", "B"};
  for (int k = 0; k < 3; ++k) {
    std::vector<float>& values = result.image.add(kNames[k]).values;
    for (std::size_t i = 0; i < colours.size(); ++i) values[i] = isKnown[i] ? colours[i][k] : float(mean[k]);
  }
  std::ranges::fill(result.image.add("A").values, 1.0f);
  return result;
}

}  // namespace nephele
