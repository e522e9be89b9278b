#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "apps/options/outputs.h"
#include "nephele/levelset/mesh/mesh_repair.h"
#include "nephele/modeling/base/math.h"

namespace nephele::apps {

/// A length as typed: world units ("0.3") or a percentage of the longest side of the input's box ("5%").
struct Length {
  double value = 0;
  bool relative = false;

  double worldUnits(double longestSide) const { return relative ? value * 0.01 * longestSide : value; }
};

/// A frequency as typed: cycles per world unit ("2.5") or per longest side of the input's box ("6x").
struct Frequency {
  double value = 0;
  bool relative = false;

  double perWorldUnit(double longestSide) const { return relative ? value / longestSide : value; }
};

enum class Sign { positive, notNegative, any };

/// Whether values of an option of this type name files or folders.
bool isFileType(std::string_view type);

/// Refuses the value `text` of an option declared as `name` ("-o,--output"), saying what is allowed.
[[noreturn]] void refuseValue(const std::string& name, const std::string& text, const std::string& allowed);

/// Refuses the first of `options` that is given, saying `why` it cannot be.
void refuseGiven(const std::vector<const CLI::Option*>& options, const std::string& why);

/// Options of types that several verbs take. All are checked while parsing: what does not fit is a usage
/// error (exit 2) that names the option, the value and what is allowed. The target's value at the call is the
/// default that
/// --help shows.
CLI::Option* addLength(CLI::App& app, const std::string& name, Length& target, const std::string& description,
                       Sign sign = Sign::notNegative);
/// The same, for a length that need not be given.
CLI::Option* addLength(CLI::App& app, const std::string& name, std::optional<Length>& target,
                       const std::string& description, Sign sign = Sign::notNegative);
CLI::Option* addFrequency(CLI::App& app, const std::string& name, Frequency& target,
                          const std::string& description);
/// A finite number in [low, high].
CLI::Option* addNumber(CLI::App& app, const std::string& name, double& target, double low, double high,
                       const std::string& description);
/// The same, handed to `set`.
CLI::Option* addNumber(CLI::App& app, const std::string& name, double low, double high,
                       const std::function<void(double)>& set, const std::string& description);
/// Declares a size in pixels, each side from 1 to 65536.
CLI::Option* addSize(CLI::App& app, const std::string& name, int& width, int& height,
                     const std::string& description);
/// Declares --size and --view of a picture that `preview` asks for.
void addPreviewFrame(CLI::App& app, CLI::Option* preview, int& width, int& height, float& azimuthDegrees,
                     float& elevationDegrees);
/// A share in percent, with or without the sign, in [low, high]; `target` is the share itself.
CLI::Option* addPercent(CLI::App& app, const std::string& name, double& target, double low, double high,
                        const std::string& description);
/// As addNumber, for a number that need not be given.
CLI::Option* addOptional(CLI::App& app, const std::string& name, std::optional<double>& target, double low,
                         double high, const std::string& description);
/// A list of `count` (2 or 3) numbers, each within [low, high], shown as `form` ("X,Y,Z").
CLI::Option* addNumbers(CLI::App& app, const std::string& name, const std::string& form, std::size_t count,
                        double low, double high, const std::function<void(const Vec3d&)>& set,
                        const std::string& description);
/// --shutter OPEN,CLOSE, two times of which the first is not the later; `unit` is what they count.
void addShutter(CLI::App& app, const std::string& unit, const std::function<void(double, double)>& set,
                const std::string& description);
CLI::Option* addCount(CLI::App& app, const std::string& name, int& target, int low, int high,
                      const std::string& description);
/// One of a few words, each standing for a value.
template <class T>
CLI::Option* addChoice(CLI::App& app, const std::string& name, T& target,
                       const std::vector<std::pair<std::string, T>>& choices,
                       const std::string& description) {
  std::string words, standard;
  for (const auto& [word, value] : choices) {
    words += (words.empty() ? "" : "|") + word;
    if (value == target) standard = word;
  }
  auto* option = app.add_option_function<std::string>(
      name,
      [&target, name, choices, words](const std::string& text) {
        for (const auto& [word, value] : choices)
          if (word == text) {
            target = value;
            return;
          }
        refuseValue(name, text, "one of " + words);
      },
      description);
  option->type_name(words)->default_str(standard);
  return option;
}
/// Refuses each value of `option` that is none of these.
CLI::Option* allowWords(CLI::Option* option, const std::vector<std::string>& words);
/// A file that the verb writes; `extensions` are the ones allowed ({".obj", ".ply"}).
CLI::Option* addOutput(CLI::App& app, const std::string& name, std::string& target,
                       const std::vector<std::string>& extensions, const std::string& description,
                       OutputTrial trial = OutputTrial::program);

/// Refuses a command line that has none of the outputs `names` ("--output"), of which any one is enough.
void requireOneOutput(CLI::App& app, const std::vector<std::string>& names);

/// A list of input files, each with the option in front.
CLI::Option* addInputs(CLI::App& app, const std::string& name, std::vector<std::string>& target,
                       const std::string& description);

/// --repair, the same for every verb that takes a mesh.
CLI::Option* addRepair(CLI::App& app, MeshRepairOptions::Mode& target);

/// The length that all of `text` is, of any sign, or nothing.
std::optional<Length> parseLength(std::string_view text);

/// The finite number that all of `text` is, or nothing.
std::optional<double> parseNumber(std::string_view text);

/// The bytes, > 0, that "8G" or "512M" means, or nothing.
std::optional<double> parseBytes(std::string_view text);

/// The numbers of a comma-separated list, or a usage error that names `option`, `text` and the `form` wanted.
std::vector<double> parseNumbers(const std::string& option, const std::string& text, const std::string& form);

}  // namespace nephele::apps
