#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/noise/noise.h"
#include "tests/support/check_field.h"

/// What the tests of noises measure and share.
namespace nephele::test {

/// Many cells, so that samples are nearly independent.
inline const Box kWide{{-500, -500, -500}, {500, 500, 500}};

/// Points that statistics are taken from. A sanitized program is some ten times slower.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr std::size_t kSamples = 1000000;
#else
inline constexpr std::size_t kSamples = 10000000;
#endif

struct Statistics {
  double mean = 0, rms = 0, low = 1e9, high = -1e9;
};

/// Of random points in kWide; the same at any thread count.
inline Statistics statistics(const ScalarField& field, std::size_t count) {
  constexpr std::size_t kPiece = 50000;
  std::vector<Statistics> pieces(count / kPiece);
  parallelFor(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      std::mt19937 random(unsigned(p) + 1);
      const Points points = randomPoints(kWide, kPiece, random);
      const auto values = evaluate(field, points);
      Statistics& s = pieces[p];
      for (const float v : values.data[0]) {
        s.mean += v;
        s.rms += double(v) * v;
        s.low = std::min(s.low, double(v));
        s.high = std::max(s.high, double(v));
      }
    }
  });
  Statistics all;
  for (const Statistics& s : pieces) {
    all.mean += s.mean;
    all.rms += s.rms;
    all.low = std::min(all.low, s.low);
    all.high = std::max(all.high, s.high);
  }
  all.mean /= double(count);
  all.rms = std::sqrt(all.rms / double(count));
  return all;
}

/// A small tile, for tests that do not look at the spectrum.
inline SpectrumOptions smallSpectrum() {
  return {.lowest = 0.5f, .highest = 2, .tile = 8, .resolution = 64};
}

inline NoiseOptions optionsOf(NoiseKind kind, bool moves) {
  NoiseOptions o{.kind = kind, .seed = 7, .spectrum = smallSpectrum()};
  if (moves) o.time = 3.7f;
  return o;
}

}  // namespace nephele::test
