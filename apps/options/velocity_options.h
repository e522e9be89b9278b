#pragma once

#include <array>
#include <optional>
#include <string>

#include "apps/options/options.h"
#include "nephele/modeling/noise/noise.h"

namespace nephele::apps {

/// A velocity as typed: "noise:amplitude=2%,frequency=6x", "curl:...", "-20,0,5%", a volume file, or an
/// expression after "=".
struct VelocityArguments {
  enum class Source { noise, curl, constant, file, expression };

  Source source = Source::noise;
  /// Rms of each component, per unit of time.
  Length amplitude{1, true};
  Frequency frequency{6, true};
  NoiseKind kind = NoiseKind::perlin;
  int octaves = 1, seed = 0;
  double lacunarity = 2, roughness = 0.5;
  std::optional<float> time;
  /// The same everywhere, lengths per unit of time.
  std::array<Length, 3> constant{};
  /// In Felt, of P, time and seed.
  std::string expression;
  /// Of the file: its path and the name of the grid, or "" to look for the usual ones.
  std::string path, grid;

  /// The velocity around a shape of this longest side; `frame` and `seedOfAll` are what an expression calls
  /// time and seed. @throws Error naming the file, or that it is too fast for single precision.
  VectorField field(double longestSide, double frame = 0, int seedOfAll = 0) const;
};

/// Reads `text`, the value of the option `name`. @throws CLI::ValidationError naming the option, the key and
/// what is allowed; felt::ScriptError with the faults of an expression.
void parseVelocity(const std::string& name, const std::string& text, VelocityArguments& velocity);

}  // namespace nephele::apps
