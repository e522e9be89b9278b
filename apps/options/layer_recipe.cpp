#include "apps/options/layer_recipe.h"

#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "apps/options/cloud_quantities.h"
#include "apps/options/toml_file.h"
#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/cloud/density_profile.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::apps {
namespace {

/// One key of a table, which shows in the file what is wrong with it.
class Entry {
 public:
  Entry(TomlFile& file, const toml::key& name, const toml::node& value)
      : key(name.str()), file_(file), name_(name), value_(value) {}

  [[noreturn]] void refuse(const std::string& what, felt::Code code = felt::Code::outOfRange) const {
    file_.refuse(code, value_.source(), nephele::quoted(key) + ' ' + what);
  }

  /// Says which key was probably meant.
  [[noreturn]] void refuseKey(const char* table, const std::vector<std::string>& keys) const {
    file_.refuseKey(name_, key, fmt::format("not a key of {}", table), keys);
  }

  std::string text() const {
    if (const auto text = value_.value_exact<std::string>()) return *text;
    if (const auto whole = value_.value_exact<std::int64_t>()) return std::to_string(*whole);
    if (const auto number = value_.value_exact<double>()) return fmt::format("{}", *number);
    refuse("takes a text or a number", felt::Code::wrongType);
  }

  double number(double low, double high) const {
    const auto number = value_.value<double>();
    if (!number || !(*number >= low && *number <= high))
      refuse(fmt::format("takes a number from {:g} to {:g}", low, high), codeOf(number.has_value()));
    return *number;
  }

  int count(int low, int high) const {
    const auto whole = value_.value_exact<std::int64_t>();
    if (!whole || *whole < low || *whole > high)
      refuse(fmt::format("takes a whole number from {} to {}", low, high), codeOf(whole.has_value()));
    return int(*whole);
  }

  Vec3f direction() const {
    const toml::array* list = value_.as_array();
    Vec3f v{};
    bool fits = list && list->size() == 3;
    for (int i = 0; fits && i < 3; ++i) {
      const auto number = (*list)[std::size_t(i)].value<double>();
      fits = number && std::isfinite(*number) && std::abs(*number) < 1e15;
      if (fits) v[i] = float(*number);
    }
    if (!fits || !(length(v) > 0)) refuse("takes a direction [X, Y, Z] that is not 0", codeOf(fits));
    return v / length(v);
  }

  NoiseKind kind() const {
    try {
      return noiseKindOf(text());
    } catch (const felt::ScriptError&) {
      throw;
    } catch (const Error&) {
      file_.refuse(
          felt::Code::outOfRange, value_.source(),
          fmt::format("{}: got {}, allowed: one of {}", key, nephele::quoted(text(), 40), noiseNames()));
    }
  }

  FieldValue field(const Quantity& quantity) const { return fieldOf(text(), quantity); }

  /// A field of numbers from 0 to 1; a file alone is a mask.
  FieldValue share() const {
    const std::string typed = text();
    // Behind the file's name, the grid's may stand.
    const bool isFile = (isVolumeFile(typed) || isVolumeFile(typed.substr(0, typed.rfind(':')))) &&
                        !typed.starts_with("mask:") && !typed.starts_with("attribute:");
    return fieldOf(isFile ? "mask:" + typed + ":0,1" : typed, {.low = 0, .high = 1});
  }

  std::shared_ptr<const TomlText> place() const { return file_.textOf(value_, {}); }

  const std::string key;
  const toml::node& value() const { return value_; }
  TomlFile& file() const { return file_; }

 private:
  static felt::Code codeOf(bool isOfType) {
    return isOfType ? felt::Code::outOfRange : felt::Code::wrongType;
  }

  FieldValue fieldOf(const std::string& form, const Quantity& quantity) const {
    const std::shared_ptr<const TomlText> place = file_.textOf(value_, text());
    try {
      FieldValue value = parseFieldValue(key, form, quantity);
      value.option = fmt::format("--recipe: {}: {}", file_.placeOf(value_), key);
      value.place = place;
      return value;
    } catch (const felt::ScriptError& error) {
      throw place->moved(error, 1);
    } catch (const CLI::ValidationError& error) {
      throw place->fault(felt::Code::outOfRange, error.what());
    }
  }

  TomlFile& file_;
  const toml::key& name_;
  const toml::node& value_;
};

SpectrumOptions spectrumOf(const Entry& table) {
  const toml::table* keys = table.value().as_table();
  if (!keys)
    table.refuse("takes a table: { exponent = 3.67, lowest = 0.5, highest = 4 }", felt::Code::wrongType);
  SpectrumOptions spectrum;
  const auto set = [&](const Entry& entry) {
    const std::string& key = entry.key;
    if (key == "exponent") return void(spectrum.exponent = float(entry.number(-16, 16)));
    if (key == "lowest") return void(spectrum.lowest = float(entry.number(0, 1e6)));
    if (key == "highest") return void(spectrum.highest = float(entry.number(0, 1e6)));
    if (key == "tile") return void(spectrum.tile = float(entry.number(1e-6, 1e6)));
    if (key == "resolution") return void(spectrum.resolution = entry.count(16, 512));
    entry.refuseKey("a spectrum", {"exponent", "lowest", "highest", "tile", "resolution"});
  };
  for (const auto& [name, value] : *keys) {
    const Entry entry(table.file(), name, value);
    table.file().collect([&] { set(entry); });
  }
  return spectrum;
}

void set(LayerRecipe& layer, const Entry& entry) {
  const std::string& key = entry.key;
  if (key == "noise") return void(layer.noise = entry.kind());
  if (key == "spectrum") {
    layer.spectrum = spectrumOf(entry);
    layer.spectrumPlace = entry.place();
    return;
  }
  if (key == "time") return void(layer.time = float(entry.number(-1e6, 1e6)));
  if (key == "period") return void(layer.period = float(entry.number(1e-3, 1e6)));
  if (key == "seed") return void(layer.seed = std::uint32_t(entry.count(0, 1 << 30)));
  if (key == "octaves") return void(layer.octaves = entry.count(1, 16));
  if (key == "octave_lacunarity") return void(layer.octaveLacunarity = entry.number(0.1, 100));
  if (key == "octave_roughness") return void(layer.octaveRoughness = entry.number(0, 10));
  if (key == "amplitude") return void(layer.amplitude = entry.field(kAmplitude));
  if (key == "frequency") return void(layer.frequency = entry.field(kFrequency));
  if (key == "billow") return void(layer.billow = entry.field(kBillow));
  if (key == "billow_scale") return void(layer.billowScale = entry.field(kBillowScale));
  if (key == "mask") return void(layer.mask = entry.share());
  if (key == "direction") return void(layer.direction = entry.direction());
  if (key == "bias") return void(layer.bias = entry.number(0, 1));
  entry.refuseKey("a layer",
                  {"noise", "octaves", "octave_lacunarity", "octave_roughness", "spectrum", "time", "period",
                   "seed", "amplitude", "frequency", "billow", "billow_scale", "mask", "direction", "bias"});
}

LayerRecipe recipeOf(TomlFile& file, const toml::table& table) {
  LayerRecipe layer;
  layer.place = "--recipe: " + file.placeOf(table);
  layer.text = (std::ostringstream() << table).str();
  for (const auto& [name, value] : table) {
    const Entry entry(file, name, value);
    file.collect([&] { set(layer, entry); });
  }
  const auto needs = [&](const char* key, const char* other) {
    if (const auto found = table.find(key); found != table.end() && !table.contains(other))
      file.collect([&] {
        file.refuse(felt::Code::expected, found->first.source(),
                    fmt::format("'{}' needs '{}' beside it", key, other));
      });
  };
  needs("bias", "direction");
  needs("period", "time");
  needs("octave_lacunarity", "octaves");
  needs("octave_roughness", "octaves");
  return layer;
}

/// Layer `index` with the noise that the recipe gives it, its heights left open.
CumuloLayer layerOf(const LayerRecipe& recipe, int index, const CumuloFractal& fractal,
                    FieldSources& sources) {
  CumuloNoise own{.noise = fractal.noise,
                  .frequency = fractal.frequency,
                  .octaves = recipe.octaves,
                  .octaveLacunarity = float(recipe.octaveLacunarity),
                  .octaveRoughness = float(recipe.octaveRoughness)};
  for (int i = 0; i < index; ++i) own.frequency = own.frequency * fractal.lacunarity;
  own.noise.seed = recipe.seed.value_or(cumuloLayerSeed(fractal.seed, index));
  if (recipe.frequency) own.frequency = sources.field(*recipe.frequency);
  if (recipe.noise) own.noise.kind = *recipe.noise;
  if (recipe.spectrum) own.noise.spectrum = *recipe.spectrum;
  if (recipe.time) own.noise.time = recipe.time;
  if (recipe.period) own.noise.period = recipe.period;
  if (recipe.spectrum && own.noise.kind != NoiseKind::spectral)
    throw recipe.spectrumPlace->fault(
        felt::Code::outOfRange,
        fmt::format("only noise = \"fft\" has a spectrum, not \"{}\"", noiseName(own.noise.kind)));
  try {
    return cumuloLayer(own);
  } catch (const Error& error) {
    const auto place = recipe.spectrum    ? recipe.spectrumPlace
                       : recipe.frequency ? recipe.frequency->place
                                          : nullptr;
    if (!place) throw;
    throw place->fault(felt::Code::outOfRange, error.what());
  }
}

void apply(const LayerRecipe& recipe, int index, const CumuloFractal& fractal, FieldSources& sources,
           CumuloLayer& layer) {
  if (recipe.changesNoise()) {
    CumuloLayer own = layerOf(recipe, index, fractal, sources);
    own.amplitude = layer.amplitude;
    own.billow = layer.billow;
    own.billowScale = layer.billowScale;
    layer = own;
  }
  if (recipe.amplitude) layer.amplitude = sources.field(*recipe.amplitude);
  if (recipe.billow) layer.billow = sources.field(*recipe.billow);
  if (recipe.billowScale) layer.billowScale = sources.field(*recipe.billowScale);
  if (recipe.mask) layer.amplitude = layer.amplitude * sources.field(*recipe.mask);
  if (recipe.direction) {
    const Vec3f& d = *recipe.direction;
    const FieldValue growth = parseFieldValue(
        recipe.place + ": direction",
        fmt::format("facing:{},{},{}:-1={},1=1", d.x, d.y, d.z, 1 - recipe.bias), {.low = 0, .high = 1});
    layer.amplitude = layer.amplitude * sources.field(growth);
  }
}

}  // namespace

std::vector<LayerRecipe> readLayerRecipe(const std::string& path) {
  TomlFile file = TomlFile::read("--recipe", path);
  std::vector<LayerRecipe> layers;
  for (const auto& [name, value] : file.table()) {
    const Entry entry(file, name, value);
    file.collect([&] {
      if (entry.key != "layer") entry.refuseKey("a recipe", {"layer"});
      const toml::array* tables = entry.value().as_array();
      if (!tables || !tables->is_homogeneous<toml::table>())
        entry.refuse("is a list of tables, each below a line [[layer]]", felt::Code::wrongType);
      for (const toml::node& table : *tables) {
        if (layers.size() == std::size_t(kMaxCumuloLayers))
          file.refuse(felt::Code::limit, table.source(),
                      fmt::format("there are {} layers, allowed: 1 to {}", tables->size(), kMaxCumuloLayers));
        layers.push_back(recipeOf(file, *table.as_table()));
      }
    });
  }
  file.throwFaults();
  if (layers.empty())
    file.refuse(felt::Code::expected, {{1, 1}, {1, 1}, nullptr}, "there is no layer",
                "each begins with a line [[layer]]");
  return layers;
}

bool isLayerRecipe(const std::string& path) {
  return TomlFile::read("--recipe", path).table().contains("layer");
}

std::vector<CumuloLayer> recipeLayers(const std::vector<LayerRecipe>& recipes, const CumuloFractal& fractal,
                                      FieldSources& sources) {
  std::vector<CumuloLayer> layers;
  try {
    layers = cumuloLayers(fractal);
  } catch (const Error& error) {
    // All else was checked when it was read; how far frequencies vary shows only here.
    throw Error(fmt::format("--frequency, --lacunarity: {}", error.what()));
  }
  for (std::size_t i = 0; i < layers.size() && i < recipes.size(); ++i) {
    try {
      apply(recipes[i], int(i), fractal, sources, layers[i]);
    } catch (const Cancelled&) {
      throw;
    } catch (const felt::ScriptError&) {
      throw;
    } catch (const Error& error) {
      const std::string what = error.what();
      throw Error(what.starts_with("--recipe") ? what : recipes[i].place + ": " + what);
    }
  }
  return layers;
}

}  // namespace nephele::apps
