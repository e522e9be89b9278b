#include "apps/options/picture/scale_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <utility>

namespace nephele::apps {

namespace {

constexpr double kShortest = 1e-3, kLongest = 1e6;

std::optional<double> metresFrom(const std::string& text) {
  constexpr std::array<std::pair<std::string_view, double>, 4> units{
      {{"km", 1000.0}, {"cm", 0.01}, {"ft", 0.3048}, {"m", 1.0}}};
  for (const auto& [name, metres] : units)
    if (text.ends_with(name)) {
      const std::optional<double> number = parseNumber(text.substr(0, text.size() - name.size()));
      return number ? std::optional(*number * metres) : std::nullopt;
    }
  return std::nullopt;
}

}  // namespace

float ScaleOptions::metresPerUnit(double worldUnits) const {
  return longestSide && worldUnits > 0 ? float(*longestSide / worldUnits) : 1.0f;
}

void addScaleOptions(CLI::App& app, ScaleOptions& options) {
  app.add_option_function<std::string>(
         "--scale",
         [&options](const std::string& text) {
           options.longestSide = metresFrom(text);
           if (!options.longestSide ||
               !(*options.longestSide >= kShortest && *options.longestSide <= kLongest))
             refuseValue("--scale", text, "a length with its unit (km, m, cm or ft), 1 mm to 1000 km");
         },
         fmt::format("What the longest side of the volume is in the world, as 1km: the extinction is that of "
                     "a cumulus of "
                     "that size ({:g} per metre where the density is 1), its phase function that of droplets "
                     "(mie:{:g}) and its albedo {:g}, unless they are given.",
                     double(RealCloud::kExtinction), double(RealCloud::kDiameter),
                     double(RealCloud::kAlbedo)))
      ->type_name("LENGTH")
      ->default_str("none; a world unit is a metre");
  app.add_flag(
      "--aerial-perspective", options.aerialPerspective,
      "The air of --sky clear between the camera and what is seen: paler and bluer, the farther it is.");
}

}  // namespace nephele::apps
