#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "nephele/modeling/field/field.h"
#include "nephele/modeling/noise/noise.h"

/// What cuts a shape: scalar fields whose zero surface is the blade, and cells around points. Any shape is a
/// knife, too: a sphere cuts out a ball, a mesh's distance its solid.
/// Source: Tessendorf, Resolution Independent Volumes, chapter 5.
namespace nephele {

/// A blade: the surface where `field` is 0, which parts its positive side from its negative one.
struct Knife {
  Knife(const ScalarField& field_, float steepest_ = 1.0f) : field(field_), steepest(steepest_) {}

  ScalarField field;
  /// No gradient of `field` near the blade is longer, >= 1. 1: the field is a distance, or less. Above 1 the
  /// field is divided by the length of its gradient where it cuts, so that a kerf has its width.
  float steepest;
};

/// A plane: (x - point) . normal / |normal|.
struct BladePlane {
  Vec3f point{};
  Vec3f normal{0, 1, 0};
};

struct RandomBladesOptions {
  int count = 5;
  /// The box of what is to be cut.
  Box box{};
  /// All planes pass through the middle of the box: `count` of them part a ball into count^2 - count + 2
  /// pieces. Otherwise each passes through a random point of the middle half of the box.
  bool throughCentre = false;
  std::uint32_t seed = 0;
};

/// Planes of random directions. The first ones of a longer list are those of a shorter one.
/// @throws Error if count < 0 or the box is empty or unbounded.
std::vector<BladePlane> randomBlades(const RandomBladesOptions& options);

/// The distance to the plane. @throws Error if the normal is zero or anything is not finite.
Knife flatKnife(const BladePlane& blade);

/// How a plane is roughened, as by fracture.
struct RoughnessOptions {
  /// Root mean square of the height of the blade over its plane, world units, >= 0.
  float amplitude = 0.0f;
  /// Of the first octave: kind, frequency (cycles per world unit, > 0), seed.
  NoiseOptions noise{};
  int octaves = 4;
  float roughness = 0.5f;
  float lacunarity = 2.0f;
};

/// A plane with hills: K(x) = (x - p) . n + amplitude N(x - ((x - p) . n) n), with N of unit rms. The noise
/// is read on the plane, so that the blade is a height field: in one piece, without islands.
/// @throws Error as `flatKnife` and `fractalSum`, and if amplitude is negative or not finite.
Knife roughKnife(const BladePlane& blade, const RoughnessOptions& options);

/// `count` points spread evenly at random over the inside (> 0) of `shape` in `box`.
/// @throws Error if count < 0, the box is empty or unbounded, or a million draws find no point.
std::vector<Vec3f> scatteredPoints(const ScalarField& shape, const Box& box, int count, std::uint32_t seed);

/// The cell of points[index]: positive where it is the nearest of all, the distance to the cell's boundary
/// inside the cell; outside, a bound of it. @throws Error if the index is out of range, a point is not
/// finite, or another point equals that one.
ScalarField voronoiCell(std::span<const Vec3f> points, std::size_t index);

/// On which sides of all knives a piece lies.
struct PieceCode {
  /// For each knife whether the piece lies on its positive side.
  std::vector<bool> sides;

  bool operator==(const PieceCode&) const = default;
};

/// What knives leave of a shape on the sides that `code` says: min(shape, +-K_1 - kerf / 2, ...). One field
/// for all pieces of that code; where they do not hang together is not its business. The order of the knives
/// does not matter. Knives that are no distances are divided by the length of their gradient, if kerf > 0.
/// @throws Error if code and knives differ in number, or the kerf is negative or not finite.
ScalarField pieceField(const ScalarField& shape, std::span<const Knife> knives, const PieceCode& code,
                       float kerf = 0.0f);

}  // namespace nephele
