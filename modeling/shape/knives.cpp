// Knives are fields, so all that is here is expressions: planes, planes with noise read at the foot of the
// point on the plane, and cells as intersections of half spaces.
//
// The text of the notes multiplies the shape by the knife, which has the right zero surface and the wrong
// slope: the outer surface moves by up to a voxel when it is meshed. min(shape, +-knife) has neither fault.
// What the gradient of a noise can reach is bounded by what was found in 4 million samples of each kind, with
// a third added; it only says how far from the blade a knife must be looked at.
#include "nephele/modeling/shape/knives.h"

#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/field/calculus.h"
#include "nephele/modeling/field/operations.h"
#include "nephele/modeling/field/space.h"
#include "nephele/modeling/noise/noise_draw.h"
#include "nephele/modeling/shape/combinations.h"
#include "nephele/modeling/shape/shapes.h"

namespace nephele {

namespace {

/// Lengths of gradients that noises of frequency 1 stay below.
float steepestOf(NoiseKind kind) {
  switch (kind) {
    case NoiseKind::perlin:
      return 16;
    case NoiseKind::simplex:
      return 24;
    case NoiseKind::worley:
      return 6;
    case NoiseKind::worleyDifference:
      return 17;
    case NoiseKind::value:
      return 12;
    case NoiseKind::gabor:
    case NoiseKind::spectral:
      return 45;
  }
  return 45;
}

void requireBox(const Box& box, const char* caller) {
  require(!box.isEmpty() && isFinite(box.min) && isFinite(box.max),
          std::string(caller) + ": the box must be bounded and not empty");
}

Vec3f drawnDirection(detail::Draw& draw) {
  const float up = 2 * draw.uniform() - 1, turn = 2 * kPi * draw.uniform();
  const float side = std::sqrt(std::max(1 - up * up, 0.0f));
  return {side * std::cos(turn), up, side * std::sin(turn)};
}

Vec3f drawnPoint(detail::Draw& draw, const Box& box) {
  const float x = draw.uniform(), y = draw.uniform(), z = draw.uniform();
  return box.min + Vec3f{x, y, z} * box.size();
}

}  // namespace

std::vector<BladePlane> randomBlades(const RandomBladesOptions& options) {
  require(options.count >= 0, "randomBlades: count must be >= 0, got " + std::to_string(options.count));
  requireBox(options.box, "randomBlades");
  const Vec3f centre = options.box.center();
  const Box middle{centre - options.box.size() * 0.25f, centre + options.box.size() * 0.25f};
  detail::Draw draw(options.seed);
  std::vector<BladePlane> blades;
  for (int i = 0; i < options.count; ++i) {
    const Vec3f normal = drawnDirection(draw);
    const Vec3f point = drawnPoint(draw, middle);
    blades.push_back({options.throughCentre ? centre : point, normal});
  }
  return blades;
}

Knife flatKnife(const BladePlane& blade) {
  return {plane(blade.point, blade.normal)};
}

Knife roughKnife(const BladePlane& blade, const RoughnessOptions& options) {
  require(std::isfinite(options.amplitude) && options.amplitude >= 0,
          "roughKnife: amplitude must be >= 0, got " + numberText(options.amplitude));
  const ScalarField height = memo(plane(blade.point, blade.normal));
  const FractalSumOptions octaves{.octaves = options.octaves,
                                  .frequency = 1.0f,
                                  .lacunarity = options.lacunarity,
                                  .roughness = options.roughness,
                                  .seed = options.noise.seed};
  const ScalarField noise = fractalSum(options.noise, octaves);
  if (options.amplitude == 0) return {height};
  const VectorField foot = position() - VectorField(normalize(blade.normal)) * height;
  double slope = 0, squares = 0;
  for (int i = 0; i < options.octaves; ++i) {
    const double weight = std::pow(double(options.roughness), i);
    slope += weight * std::pow(double(options.lacunarity), i);
    squares += weight * weight;
  }
  slope *= double(options.amplitude * options.noise.frequency * steepestOf(options.noise.kind)) /
           std::sqrt(squares);
  return {height + options.amplitude * compose(noise, foot), float(std::hypot(1.0, slope))};
}

std::vector<Vec3f> scatteredPoints(const ScalarField& shape, const Box& box, int count, std::uint32_t seed) {
  require(count >= 0, "scatteredPoints: count must be >= 0, got " + std::to_string(count));
  requireBox(box, "scatteredPoints");
  constexpr std::size_t kMostMisses = 1000000;
  detail::Draw draw(seed);
  std::vector<Vec3f> points;
  std::array<std::vector<float>, 3> lanes;
  for (auto& lane : lanes) lane.resize(kBlockSize);
  std::vector<float> values(kBlockSize);
  for (std::size_t misses = 0; points.size() < std::size_t(count); misses += kBlockSize) {
    require(misses < kMostMisses, "scatteredPoints: the shape fills too little of its box to find " +
                                      std::to_string(count) + " points inside; choose points of your own");
    for (std::size_t i = 0; i < kBlockSize; ++i) {
      const Vec3f p = drawnPoint(draw, box);
      for (int axis = 0; axis < 3; ++axis) lanes[std::size_t(axis)][i] = p[axis];
    }
    shape.eval({lanes[0], lanes[1], lanes[2]}, values);
    for (std::size_t i = 0; i < kBlockSize && points.size() < std::size_t(count); ++i)
      if (values[i] > 0) {
        points.push_back({lanes[0][i], lanes[1][i], lanes[2][i]});
        misses = 0;
      }
  }
  return points;
}

ScalarField voronoiCell(std::span<const Vec3f> points, std::size_t index) {
  require(index < points.size(),
          "voronoiCell: there is no point " + std::to_string(index) + " of " + std::to_string(points.size()));
  std::vector<ScalarField> sides;
  for (std::size_t j = 0; j < points.size(); ++j) {
    require(isFinite(points[j]), "voronoiCell: point " + std::to_string(j) + " is not finite");
    if (j == index) continue;
    require(points[j] != points[index],
            "voronoiCell: points " + std::to_string(index) + " and " + std::to_string(j) + " are equal");
    sides.push_back(plane((points[index] + points[j]) * 0.5f, points[index] - points[j]));
  }
  if (sides.empty()) return ScalarField(std::numeric_limits<float>::max());
  return intersection(sides);
}

ScalarField pieceField(const ScalarField& shape, std::span<const Knife> knives, const PieceCode& code,
                       float kerf) {
  require(code.sides.size() == knives.size(), "pieceField: the code has " +
                                                  std::to_string(code.sides.size()) + " sides for " +
                                                  std::to_string(knives.size()) + " knives");
  require(std::isfinite(kerf) && kerf >= 0, "pieceField: the kerf must be >= 0, got " + numberText(kerf));
  ScalarField piece = shape;
  for (std::size_t k = 0; k < knives.size(); ++k) {
    ScalarField knife = knives[k].field;
    if (kerf > 0 && knives[k].steepest > 1) {
      knife = memo(knife);
      knife = knife / length(grad(knife));
    }
    piece = min(piece, (code.sides[k] ? knife : -knife) - 0.5f * kerf);
  }
  return piece;
}

}  // namespace nephele
