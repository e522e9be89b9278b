#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/options/field_sources.h"
#include "nephele/modeling/cloud/cumulo.h"

namespace nephele::apps {

/// One [[layer]] of a recipe; what is not given follows the fractal form. docs/recipes.md describes the keys.
struct LayerRecipe {
  /// "--recipe: cloud.toml:7", for messages.
  std::string place;
  /// All that it says, in one form: the same for tables that say the same.
  std::string text;
  std::optional<NoiseKind> noise;
  std::optional<SpectrumOptions> spectrum;
  /// Where that stands.
  std::shared_ptr<const TomlText> spectrumPlace;
  std::optional<float> time, period;
  std::optional<std::uint32_t> seed;
  int octaves = 1;
  double octaveLacunarity = 2, octaveRoughness = 0.5;
  std::optional<FieldValue> amplitude, frequency, billow, billowScale;
  /// Multiplies the amplitude: from 0, no bumps, to 1.
  std::optional<FieldValue> mask;
  /// Where bumps grow: as high as stated where the surface faces this way, (1 - bias) of it where it faces
  /// away, linear in the cosine between.
  std::optional<Vec3f> direction;
  double bias = 1;

  bool changesNoise() const {
    return noise || spectrum || time || period || seed || frequency || octaves > 1;
  }
};

/// Reads the recipe of all layers. @throws felt::ScriptError with all that is wrong with it, shown in the
/// file, also that it has no layers; CLI::ValidationError where it cannot be read.
std::vector<LayerRecipe> readLayerRecipe(const std::string& path);

/// Whether a TOML file has layers, and not options. @throws felt::ScriptError where it is no TOML;
/// CLI::ValidationError where it cannot be read.
bool isLayerRecipe(const std::string& path);

/// The layers of `fractal`, of which the first are changed as the recipes say. What is not changed is the
/// same bit for bit. @throws Error naming the place in the recipe, or showing it.
std::vector<CumuloLayer> recipeLayers(const std::vector<LayerRecipe>& recipes, const CumuloFractal& fractal,
                                      FieldSources& sources);

}  // namespace nephele::apps
