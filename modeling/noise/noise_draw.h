#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "nephele/modeling/noise/noise.h"
#include "nephele/modeling/noise/perlin_lattice.h"

/// What noises draw from their seeds. For the implementation of noises.
namespace nephele::detail {

/// How far from the identity a rotation times its transpose may be.
inline constexpr float kNotOrthogonal = 1e-3f;

/// A sequence of numbers that follow from a seed (PCG-style mixing of a counter).
class Draw {
 public:
  explicit Draw(std::uint32_t seed) : state_(seed * 0x9e3779b97f4a7c15ull + 0xd1b54a32d192ed03ull) {}

  std::uint32_t bits() {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return std::uint32_t(z >> 32);
  }
  /// Uniform in [0, 1).
  float uniform() { return float(bits() >> 8) * 0x1p-24f; }

 private:
  std::uint64_t state_;
};

/// The lattice of a seed: turned, moved and scaled as `options` say, else as drawn. @throws Error, in the
/// name of `caller`, as `perlin` does.
PerlinLattice drawnLattice(const PerlinOptions& options, const std::string& caller);

/// The sum of octave(frequency_i) with fractal amplitudes and unit rms. @throws Error as `fractalSum` does.
ScalarField sumOctaves(const FractalSumOptions& options,
                       const std::function<ScalarField(float frequency)>& octave);

}  // namespace nephele::detail
