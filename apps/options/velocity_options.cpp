#include "apps/options/velocity_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "apps/options/expression_names.h"
#include "nephele/levelset/flow/advection_files.h"
#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/field/operations.h"

namespace nephele::apps {
namespace {

constexpr const char* kForm =
    "noise: or curl: and keys such as amplitude=2%,frequency=6x,octaves=3,seed=1, X,Y,Z, each in world units "
    "(0.3) or percent of the longest side (5%) per unit of time, or a .vdb or .nvdb file";

/// One "key=value" of the option.
class Entry {
 public:
  Entry(std::string option, const std::string& text) : option_(std::move(option)) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) refuseValue(option_, text, "key=value");
    key = text.substr(0, equals);
    value_ = text.substr(equals + 1);
  }

  [[noreturn]] void refuse(const std::string& allowed) const {
    refuseValue(option_, key + "=" + value_, allowed);
  }

  double number(double low, double high) const {
    return checked(value_, low, high, fmt::format("a number from {:g} to {:g}", low, high));
  }
  int count(int low, int high) const {
    const std::string allowed = fmt::format("a whole number from {} to {}", low, high);
    const double value = checked(value_, low, high, allowed);
    if (value != std::floor(value)) refuse(allowed);
    return int(value);
  }
  Length length() const {
    const bool relative = value_.ends_with('%');
    return {
        checked(without(relative), 0, kAny,
                "a length >= 0 per unit of time, in world units (0.3) or percent of the longest side (5%)"),
        relative};
  }
  Frequency frequency() const {
    const bool relative = value_.ends_with('x');
    return {checked(without(relative), std::numeric_limits<double>::min(), kAny,
                    "cycles > 0 per world unit (2.5) or per longest side (6x)"),
            relative};
  }
  NoiseKind kind() const {
    try {
      return noiseKindOf(value_);
    } catch (const Error&) {
      refuse("one of " + noiseNames());
    }
  }

  std::string key;

 private:
  static constexpr double kAny = 1e30;

  std::string without(bool hasUnit) const { return value_.substr(0, value_.size() - (hasUnit ? 1 : 0)); }

  double checked(const std::string& text, double low, double high, const std::string& allowed) const {
    try {
      const std::vector<double> numbers = parseNumbers(option_, text, allowed);
      if (numbers.size() == 1 && numbers[0] >= low && numbers[0] <= high) return numbers[0];
    } catch (const CLI::ValidationError&) {
      // Said below, with the key.
    }
    refuse(allowed);
  }

  std::string option_, value_;
};

void set(VelocityArguments& velocity, const Entry& entry) {
  const std::vector<std::string> keys{"amplitude", "frequency", "octaves", "lacunarity",
                                      "roughness", "seed",      "kind",    "time"};
  if (entry.key == "amplitude") return void(velocity.amplitude = entry.length());
  if (entry.key == "frequency") return void(velocity.frequency = entry.frequency());
  if (entry.key == "octaves") return void(velocity.octaves = entry.count(1, 16));
  if (entry.key == "lacunarity") return void(velocity.lacunarity = entry.number(0.1, 100));
  if (entry.key == "roughness") return void(velocity.roughness = entry.number(0, 10));
  if (entry.key == "seed") return void(velocity.seed = entry.count(0, 1 << 30));
  if (entry.key == "kind") return void(velocity.kind = entry.kind());
  if (entry.key == "time") return void(velocity.time = float(entry.number(-1e6, 1e6)));
  std::string list;
  for (const std::string& key : keys) list += (list.empty() ? "" : ", ") + key;
  const std::string meant = nearestName(entry.key, keys);
  entry.refuse("the keys " + list + (meant.empty() ? "" : "; did you mean " + meant + "?"));
}

}  // namespace

void parseVelocity(const std::string& name, const std::string& text, VelocityArguments& velocity) {
  if (text.starts_with('=')) {
    velocity.source = VelocityArguments::Source::expression;
    velocity.expression = text.substr(1);
    checkedExpression(name, velocity.expression, {felt::Kind::vectorField}, namesOfPlace(0, 0));
    return;
  }
  const std::size_t colon = text.find(':');
  const std::string word = text.substr(0, colon);
  if (word == "noise" || word == "curl") {
    velocity.source = word == "noise" ? VelocityArguments::Source::noise : VelocityArguments::Source::curl;
    std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
    std::set<std::string> given;
    while (!rest.empty()) {
      const std::size_t comma = rest.find(',');
      const Entry entry(name, rest.substr(0, comma));
      if (!given.insert(entry.key).second)
        refuseValue(name, text, "each key once; " + entry.key + " is there twice");
      set(velocity, entry);
      rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    }
    const bool hasCreases =
        velocity.kind == NoiseKind::worley || velocity.kind == NoiseKind::worleyDifference;
    if (velocity.source == VelocityArguments::Source::curl && hasCreases)
      refuseValue(name, text, "for curl a noise without creases: not worley, not worley_difference");
    return;
  }
  if (!isVolumeFile(text) && std::count(text.begin(), text.end(), ',') == 2) {
    velocity.source = VelocityArguments::Source::constant;
    std::string_view rest = text;
    for (Length& component : velocity.constant) {
      const std::size_t end = std::min(rest.find(','), rest.size());
      const auto length = parseLength(rest.substr(0, end));
      if (!length) refuseValue(name, text, kForm);
      component = *length;
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
    return;
  }
  if (!isVolumeFile(text)) refuseValue(name, text, kForm);
  velocity.source = VelocityArguments::Source::file;
  velocity.path = text;
}

VectorField VelocityArguments::field(double longestSide, double frame, int seedOfAll) const {
  if (source == Source::file) return readVelocity(path, grid);
  if (!grid.empty())
    throw CLI::ValidationError("--velocity-grid", "is for a --velocity that comes from a file");
  if (source == Source::constant) {
    Vec3f same;
    for (int i = 0; i < 3; ++i) same[i] = float(constant[std::size_t(i)].worldUnits(longestSide));
    require(isFinite(same), "--velocity: is faster than numbers of 32 bits can say");
    return VectorField(same);
  }
  if (source == Source::expression)
    return evaluated("--velocity", expression, {felt::Kind::vectorField}, namesOfPlace(frame, seedOfAll),
                     longestSide)
        .as<VectorField>();
  double share = 0;
  for (int i = 0; i < octaves; ++i) share += std::pow(roughness, 2 * i);
  const double rms = amplitude.worldUnits(longestSide) / std::sqrt(share);
  VectorField sum(Vec3f{});
  for (int i = 0; i < octaves; ++i) {
    const NoiseOptions options{
        .kind = kind,
        .frequency = float(frequency.perWorldUnit(longestSide) * std::pow(lacunarity, i)),
        // Terms must not share their zeros.
        .seed = std::uint32_t(seed) + 1009u * std::uint32_t(i),
        .time = time};
    const VectorField term = source == Source::curl ? curlNoise(options) : vectorNoise(options);
    const VectorField scaled = term * ScalarField(float(rms * std::pow(roughness, i)));
    sum = i == 0 ? scaled : sum + scaled;
  }
  return sum;
}

}  // namespace nephele::apps
