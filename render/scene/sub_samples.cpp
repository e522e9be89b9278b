// Sampling: every pixel uses the same well spread points, warped to a tent filter, so that neighbours differ
// by what they see and not by luck. Where in its step a ray samples is spread over the rays of a pixel too,
// and shifted from pixel to pixel by a rank-1 lattice (the R2 sequence of M. Roberts), whose error is
// high-frequency: steps leave no bands, and no grain.
// Linear interpolation errs in proportion to f (1 - f), f the place within a cell, which would show the
// lattices as faint terraces; four rays that read a quarter of a cell to the sides of theirs cancel it but
// for its constant part.
#include "nephele/render/scene/sub_samples.h"

#include <algorithm>
#include <cmath>

namespace nephele {

namespace {

double fraction(double x) {
  return x - std::floor(x);
}

// Uniform in [0, 1) to a tent over [-1, 1].
double tent(double u) {
  return u < 0.5 ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u);
}

}  // namespace

std::vector<SubSample> pixelPattern(int count, std::uint64_t seed) {
  if (count == 1) return {SubSample{}};
  // Powers of the root of x^4 = x + 1: the lattice of R3, even in all three coordinates for every count.
  constexpr double a = 0.8191725133961644, b = 0.6710436067037893, c = 0.5497004779019702;
  const double shift = fraction(double(seed % 65536) * 0.6180339887498949);
  std::vector<SubSample> pattern;
  for (int i = 0; i != count; ++i)
    pattern.push_back({0.5 + tent(fraction(0.5 + shift + a * (i + 1))),
                       0.5 + tent(fraction(0.5 + shift + b * (i + 1))), fraction(shift + c * (i + 1))});
  // Few points do not lie evenly around the centre, which would move the picture by a part of a pixel.
  double meanX = 0, meanY = 0;
  for (const SubSample& sub : pattern) meanX += sub.x / count, meanY += sub.y / count;
  for (SubSample& sub : pattern) sub.x += 0.5 - meanX, sub.y += 0.5 - meanY;
  // Every part of a step once: the order comes from the lattice, the places are even.
  std::vector<int> order(pattern.size());
  for (std::size_t i = 0; i != order.size(); ++i) order[i] = int(i);
  std::sort(order.begin(), order.end(),
            [&](int i, int j) { return pattern[std::size_t(i)].step < pattern[std::size_t(j)].step; });
  for (std::size_t rank = 0; rank != order.size(); ++rank)
    pattern[std::size_t(order[rank])].step = double(rank) / count;
  for (std::size_t i = 0; i + 3 < pattern.size(); i += 4)
    for (std::size_t corner = 0; corner != 4; ++corner) pattern[i + corner].lattice = kQuarterCorners[corner];
  // Lens and time: the same lattice in an order that has nothing to do with the place in the pixel.
  std::uint64_t random = 0x9e3779b97f4a7c15u + seed;
  for (std::size_t i = order.size() - 1; i != 0; --i) {
    random = random * 6364136223846793005u + 1442695040888963407u;
    std::swap(order[i], order[std::size_t((random >> 33) % (i + 1))]);
  }
  for (std::size_t i = 0; i != order.size(); ++i) {
    const double n = order[i] + 1;
    pattern[i].lensU = fraction(0.5 + a * n);
    pattern[i].lensV = fraction(0.5 + b * n);
    pattern[i].time = fraction(0.5 + c * n);
  }
  // Times are even as well, for pictures in which nothing else is blurred.
  std::sort(order.begin(), order.end(),
            [&](int i, int j) { return pattern[std::size_t(i)].time < pattern[std::size_t(j)].time; });
  for (std::size_t rank = 0; rank != order.size(); ++rank)
    pattern[std::size_t(order[rank])].time = double(rank) / count;
  return pattern;
}

SubSample shifted(const SubSample& sub, int x, int y) {
  constexpr double a = 0.7548776662466927, b = 0.5698402909980532;
  SubSample result = sub;
  result.lensU = fraction(sub.lensU + a * x - b * y);
  result.lensV = fraction(sub.lensV + b * x - a * y);
  result.time = fraction(sub.time + b * x + a * y);
  return result;
}

double stepShift(int x, int y) {
  return fraction(0.7548776662466927 * x + 0.5698402909980532 * y);
}

}  // namespace nephele
