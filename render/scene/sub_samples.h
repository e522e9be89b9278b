#pragma once

#include <cstdint>
#include <vector>

#include "nephele/modeling/base/math.h"

namespace nephele {

/// Corners of a tetrahedron, a quarter of a cell from the centre.
inline constexpr Vec3f kQuarterCorners[] = {
    {0.25f, 0.25f, 0.25f}, {-0.25f, -0.25f, 0.25f}, {-0.25f, 0.25f, -0.25f}, {0.25f, -0.25f, -0.25f}};

/// One ray of a pixel: its place from the pixel's corner in pixels, where in its steps it samples, how far
/// beside the nodes of lattices it reads them, in cells, and where on the lens and when, in [0, 1).
struct SubSample {
  double x = 0.5, y = 0.5;
  double step = 0.5;
  Vec3f lattice{};
  double lensU = 0.5, lensV = 0.5, time = 0.5;
};

/// Rays spread over a tent two pixels wide, the same for every pixel; one alone goes through the centre.
/// `seed` moves them.
std::vector<SubSample> pixelPattern(int count, std::uint64_t seed);

/// With the lens and time of a sub-sample in the pixel (x, y): shifted by lattices over the pixels, so that
/// the error of neighbours is not the same and is high in frequency.
SubSample shifted(const SubSample& sub, int x, int y);

/// As a share of a step, in [0, 1), what the steps of the pixel (x, y) are shifted by: the same for lattices.
double stepShift(int x, int y);

}  // namespace nephele
