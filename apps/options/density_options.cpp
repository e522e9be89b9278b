#include "apps/options/density_options.h"

#include <fmt/format.h>

#include "nephele/modeling/field/operations.h"

namespace nephele::apps {
namespace {

constexpr double kLargestFactor = 1000;

/// The two parts of "FIRST,SECOND"; the second is empty where there is no comma.
std::pair<std::string, std::string> halves(const std::string& text, char separator = ',') {
  const std::size_t at = text.find(separator);
  if (at == std::string::npos) return {text, {}};
  return {text.substr(0, at), text.substr(at + 1)};
}

/// The one number in `part` of the value `text`, within [low, high].
double number(const std::string& option, const std::string& text, const std::string& part, double low,
              double high, const std::string& form) {
  const auto parsed = parseNumber(part);
  if (!parsed || *parsed < low || *parsed > high) refuseValue(option, text, form);
  return *parsed;
}

/// A Length or Frequency in `part` of the value `text`, relative where `suffix` ends it; at least `low`.
template <class Quantity>
Quantity quantity(const std::string& option, const std::string& text, const std::string& part, char suffix,
                  double low, const std::string& form) {
  const bool relative = part.ends_with(suffix);
  return {number(option, text, part.substr(0, part.size() - (relative ? 1 : 0)), low, 1e9, form), relative};
}

void addFalloff(CLI::App& app, DensityArguments& a) {
  app.add_option_function<std::string>(
         "--edge-falloff",
         [&a](const std::string& text) {
           if (text == "smooth")
             a.edgeExponent.reset();
           else if (text == "linear")
             a.edgeExponent = 1.0f;
           else
             a.edgeExponent = float(number("--edge-falloff", text, text, 0.1, 10,
                                           "smooth, linear or an exponent from 0.1 to 10"));
         },
         "How density rises over the edge: smooth, linear, or as a power; more than 1 thins the rim.")
      ->type_name("smooth|linear|EXPONENT")
      ->default_str("smooth");
}

void addInteriorNoise(CLI::App& app, DensityArguments& a) {
  app.add_option_function<std::string>(
         "--interior-noise",
         [&a](const std::string& text) {
           const std::string form =
               "AMOUNT[,FREQUENCY]: an rms from 0 to 2, and cycles > 0 per world unit (2.5) or per longest "
               "side (8x)";
           const auto [amount, frequency] = halves(text);
           a.interiorNoise = number("--interior-noise", text, amount, 0, 2, form);
           if (frequency.empty() && text.find(',') == std::string::npos) return;
           a.interiorFrequency = quantity<Frequency>("--interior-noise", text, frequency, 'x', 1e-9, form);
         },
         fmt::format("Variation of the density inside, rms, and the frequency of its largest clumps "
                     "(default {:g}x).",
                     a.interiorFrequency.value))
      ->type_name("AMOUNT[,FREQUENCY]");
}

void addFlatBase(CLI::App& app, DensityArguments& a) {
  app.add_option_function<std::string>(
         "--flat-base",
         [&a](const std::string& text) {
           const std::string form =
               "off, or HEIGHT[,SOFTNESS]: y in world units (0.3) or above the lowest point in percent of "
               "the longest side (5%), and a length > 0";
           a.base = text == "off" ? DensityArguments::Base::off : DensityArguments::Base::given;
           if (text == "off") return;
           const auto [height, softness] = halves(text);
           a.flatBase = quantity<Length>("--flat-base", text, height, '%', -1e9, form);
           if (!softness.empty() || text.find(',') != std::string::npos)
             a.flatBaseSoftness = quantity<Length>("--flat-base", text, softness, '%', 1e-9, form);
         },
         fmt::format("Cut the underside flat: no density below HEIGHT, all of it SOFTNESS (default {:g}%) "
                     "above. Standard with --species: {:g}%,{:g}%; else off.",
                     a.flatBaseSoftness.value, a.flatBase.value, a.flatBaseSoftness.value))
      ->type_name("HEIGHT[,SOFTNESS]|off");
}

void addHeightProfile(CLI::App& app, DensityArguments& a) {
  app.add_option_function<std::string>(
         "--height-profile",
         [&a](const std::string& text) {
           const std::string form = fmt::format(
               "pairs HEIGHT:FACTOR,... with rising heights and factors from 0 to {:g}", kLargestFactor);
           std::vector<RampStop> stops;
           std::string rest = text;
           while (true) {
             const auto [pair, after] = halves(rest);
             const auto [height, factor] = halves(pair, ':');
             stops.push_back({float(number("--height-profile", text, height, -1e6, 1e6, form)),
                              float(number("--height-profile", text, factor, 0, kLargestFactor, form))});
             if (stops.size() > 1 && stops.back().at < stops[stops.size() - 2].at)
               refuseValue("--height-profile", text, form);
             if (pair.size() == rest.size()) break;
             rest = after;
           }
           a.heightProfile = stops;
         },
         "Factors of the density at heights from 0 (lowest point of the shape) to 1 (highest), linear "
         "between.")
      ->type_name("HEIGHT:FACTOR,...");
}

void addThinOut(CLI::App& app, DensityArguments& a) {
  app.add_option_function<std::string>(
         "--thin-out",
         [&a](const std::string& text) {
           const std::string form =
               "AMOUNT[,FROM]: the share gone at the top, 0 to 1, and a height from 0 to 0.99";
           const auto [amount, from] = halves(text);
           a.thinOut = number("--thin-out", text, amount, 0, 1, form);
           if (!from.empty() || text.find(',') != std::string::npos)
             a.thinOutFrom = number("--thin-out", text, from, 0, 0.99, form);
         },
         fmt::format("Share of the density that is gone at the top, and the height (0 to 1, default {:g}) "
                     "above which it goes.",
                     a.thinOutFrom))
      ->type_name("AMOUNT[,FROM]");
}

}  // namespace

ScalarField DensityArguments::factor(FieldSources& sources, bool generated, std::uint32_t seed) const {
  const Box& shape = sources.box();
  const double longest = sources.longestSide();
  DensityProfile profile{.low = shape.min.y,
                         .high = shape.max.y,
                         .interiorNoise = float(interiorNoise),
                         .interiorFrequency = float(interiorFrequency.perWorldUnit(longest)),
                         .seed = seed,
                         .heightProfile = heightProfile,
                         .thinOut = float(thinOut),
                         .thinOutFrom = float(thinOutFrom)};
  if (base == Base::given || (base == Base::standard && generated))
    profile.flatBase = {
        .height = float(flatBase.worldUnits(longest) + (flatBase.relative ? double(shape.min.y) : 0.0)),
        .softness = float(flatBaseSoftness.worldUnits(longest))};
  const ScalarField all = densityFactor(profile);
  return density.constant && density.constant->value == 1 ? all : all * sources.field(density);
}

void addDensityOptions(CLI::App& app, DensityArguments& arguments) {
  addFieldValue(app, "--density", arguments.density, "Multiplies the density.");
  addFalloff(app, arguments);
  addInteriorNoise(app, arguments);
  addFlatBase(app, arguments);
  addHeightProfile(app, arguments);
  addThinOut(app, arguments);
}

}  // namespace nephele::apps
