#include "apps/options/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <numeric>
#include <optional>

namespace nephele::apps {
namespace {

std::string refusal(const std::string& text, const std::string& allowed) {
  return fmt::format("got '{}', allowed: {}", text, allowed);
}

}  // namespace

std::optional<double> parseNumber(std::string_view text) {
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<double> parseBytes(std::string_view text) {
  if (text.empty()) return std::nullopt;
  const char unit = text.back();
  const double factor = unit == 'M' || unit == 'm' ? 1e6 : unit == 'G' || unit == 'g' ? 1e9 : 0;
  const auto value = parseNumber(text.substr(0, text.size() - 1));
  return value && *value > 0 && factor > 0 ? std::optional(*value * factor) : std::nullopt;
}

bool isFileType(std::string_view type) {
  return type.find("FILE") != type.npos || type.find("FOLDER") != type.npos;
}

void refuseValue(const std::string& name, const std::string& text, const std::string& allowed) {
  const std::size_t comma = name.rfind(',');
  throw CLI::ValidationError(comma == std::string::npos ? name : name.substr(comma + 1),
                             refusal(text, allowed));
}

void refuseGiven(const std::vector<const CLI::Option*>& options, const std::string& why) {
  for (const CLI::Option* option : options)
    if (option->count() > 0) throw CLI::ValidationError(option->get_name(), why);
}

CLI::Option* allowWords(CLI::Option* option, const std::vector<std::string>& words) {
  return option->check([words](const std::string& text) {
    return std::ranges::count(words, text) > 0
               ? std::string()
               : refusal(text, fmt::format("one of {}", fmt::join(words, "|")));
  });
}

std::optional<Length> parseLength(std::string_view text) {
  const bool relative = text.ends_with('%');
  if (relative) text.remove_suffix(1);
  const auto value = parseNumber(text);
  // Positions are in single precision.
  if (!value || !std::isfinite(float(*value))) return std::nullopt;
  return Length{*value, relative};
}

namespace {

CLI::Option* addLength(CLI::App& app, const std::string& name, const std::function<void(const Length&)>& set,
                       const std::string& description, Sign sign) {
  const std::string allowed =
      fmt::format("a length{} in world units (0.3) or percent of the longest side (5%)",
                  sign == Sign::positive      ? " > 0"
                  : sign == Sign::notNegative ? " >= 0"
                                              : "");
  return app
      .add_option_function<std::string>(
          name,
          [name, set, sign, allowed](const std::string& text) {
            const auto length = parseLength(text);
            if (!length || (sign != Sign::any && length->value < 0) ||
                (sign == Sign::positive && !(float(length->value) > 0)))
              refuseValue(name, text, allowed);
            set(*length);
          },
          description)
      ->type_name("LENGTH");
}

}  // namespace

CLI::Option* addLength(CLI::App& app, const std::string& name, std::optional<Length>& target,
                       const std::string& description, Sign sign) {
  return addLength(
      app, name, [&target](const Length& length) { target = length; }, description, sign);
}

CLI::Option* addLength(CLI::App& app, const std::string& name, Length& target, const std::string& description,
                       Sign sign) {
  auto* option = addLength(
      app, name, [&target](const Length& length) { target = length; }, description, sign);
  if (target.value > 0) option->default_str(fmt::format("{:g}{}", target.value, target.relative ? "%" : ""));
  return option;
}

CLI::Option* addFrequency(CLI::App& app, const std::string& name, Frequency& target,
                          const std::string& description) {
  auto* option = app.add_option_function<std::string>(
      name,
      [&target, name](const std::string& text) {
        const bool relative = text.ends_with('x');
        const auto value = parseNumber(std::string_view(text).substr(0, text.size() - (relative ? 1 : 0)));
        if (!value || !(float(*value) > 0))
          refuseValue(name, text, "cycles > 0 per world unit (2.5) or per longest side (6x)");
        target = {*value, relative};
      },
      description);
  option->type_name("FREQUENCY");
  if (target.value > 0) option->default_str(fmt::format("{:g}{}", target.value, target.relative ? "x" : ""));
  return option;
}

CLI::Option* addNumber(CLI::App& app, const std::string& name, double low, double high,
                       const std::function<void(double)>& set, const std::string& description) {
  const std::string allowed = high < std::numeric_limits<double>::max()
                                  ? fmt::format("a number from {:g} to {:g}", low, high)
                                  : fmt::format("a number of at least {:g}", low);
  auto* option = app.add_option_function<std::string>(
      name,
      [name, low, high, allowed, set](const std::string& text) {
        const auto value = parseNumber(text);
        if (!value || *value < low || *value > high) refuseValue(name, text, allowed);
        set(*value);
      },
      description);
  option->type_name("NUMBER");
  return option;
}

CLI::Option* addNumber(CLI::App& app, const std::string& name, double& target, double low, double high,
                       const std::string& description) {
  return addNumber(
             app, name, low, high, [&target](double value) { target = value; }, description)
      ->default_str(fmt::format("{:g}", target));
}

CLI::Option* addPercent(CLI::App& app, const std::string& name, double& target, double low, double high,
                        const std::string& description) {
  auto* option = app.add_option_function<std::string>(
      name,
      [&target, name, low, high](const std::string& text) {
        const auto value = parseNumber(std::string_view(text).substr(0, text.size() - text.ends_with('%')));
        if (!value || *value < low || *value > high)
          refuseValue(name, text, fmt::format("{:g}% to {:g}%", low, high));
        target = *value / 100;
      },
      description);
  option->type_name("PERCENT");
  return option->default_str(fmt::format("{:g}%", 100 * target));
}

CLI::Option* addOptional(CLI::App& app, const std::string& name, std::optional<double>& target, double low,
                         double high, const std::string& description) {
  return addNumber(
      app, name, low, high, [&target](double value) { target = value; }, description);
}

CLI::Option* addNumbers(CLI::App& app, const std::string& name, const std::string& form, std::size_t count,
                        double low, double high, const std::function<void(const Vec3d&)>& set,
                        const std::string& description) {
  constexpr double any = std::numeric_limits<double>::max();
  const std::string allowed = low > -any ? fmt::format("{}, each {} to {:g}", form, low, high) : form;
  const std::string wanted = high < any   ? allowed
                             : low > -any ? fmt::format("{}, each at least {:g}", form, low)
                                          : form;
  return app
      .add_option_function<std::string>(
          name,
          [=](const std::string& text) {
            const std::vector<double> numbers = parseNumbers(name, text, wanted);
            bool fits = numbers.size() == count;
            for (const double number : numbers) fits = fits && number >= low && number <= high;
            if (!fits) refuseValue(name, text, wanted);
            set({numbers[0], numbers[1], count > 2 ? numbers[2] : 0});
          },
          description)
      ->type_name(form);
}

void addShutter(CLI::App& app, const std::string& unit, const std::function<void(double, double)>& set,
                const std::string& description) {
  app.add_option_function<std::string>(
         "--shutter",
         [=](const std::string& text) {
           const std::string form = "OPEN,CLOSE in " + unit + ", each -100 to 100, OPEN not after CLOSE";
           const std::vector<double> n = parseNumbers("--shutter", text, form);
           if (n.size() != 2 || n[0] > n[1] || n[0] < -100 || n[1] > 100)
             refuseValue("--shutter", text, form);
           set(n[0], n[1]);
         },
         description)
      ->type_name("OPEN,CLOSE")
      ->default_str("0,0");
}

CLI::Option* addCount(CLI::App& app, const std::string& name, int& target, int low, int high,
                      const std::string& description) {
  const std::string allowed = high < std::numeric_limits<int>::max()
                                  ? fmt::format("a whole number from {} to {}", low, high)
                                  : fmt::format("a whole number of at least {}", low);
  auto* option = app.add_option_function<std::string>(
      name,
      [&target, name, low, high, allowed](const std::string& text) {
        int value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error != std::errc() || end != text.data() + text.size() || value < low || value > high)
          refuseValue(name, text, allowed);
        target = value;
      },
      description);
  option->type_name("COUNT");
  option->default_str(std::to_string(target));
  return option;
}

CLI::Option* addOutput(CLI::App& app, const std::string& name, std::string& target,
                       const std::vector<std::string>& extensions, const std::string& description,
                       OutputTrial trial) {
  auto* option = app.add_option_function<std::string>(
      name,
      [&target, name, extensions](const std::string& text) {
        std::string extension = std::filesystem::path(text).extension().string();
        std::transform(extension.begin(), extension.end(), extension.begin(),
                       [](unsigned char c) { return std::tolower(c); });
        if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end()) {
          std::string allowed;
          for (const std::string& e : extensions) allowed += (allowed.empty() ? "" : ", ") + e;
          refuseValue(name, text, "a file that ends in " + allowed);
        }
        target = text;
      },
      description);
  option->type_name("FILE");
  return markOutput(option, trial);
}

void requireOneOutput(CLI::App& app, const std::vector<std::string>& names) {
  app.callback([&app, names] {
    if (std::ranges::none_of(names, [&](const std::string& name) { return app.count(name) > 0; }))
      throw CLI::RequiredError(fmt::format("one of {}", fmt::join(names, ", ")));
  });
}

CLI::Option* addInputs(CLI::App& app, const std::string& name, std::vector<std::string>& target,
                       const std::string& description) {
  return app.add_option(name, target, description)
      ->type_name("FILE")
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

CLI::Option* addRepair(CLI::App& app, MeshRepairOptions::Mode& target) {
  using Mode = MeshRepairOptions::Mode;
  return addChoice<Mode>(
      app, "--repair", target, {{"auto", Mode::automatic}, {"off", Mode::off}, {"wrap", Mode::wrap}},
      "What to do with a mesh that is not closed: auto repairs it, off refuses it; wrap wraps every mesh.");
}

std::vector<double> parseNumbers(const std::string& option, const std::string& text,
                                 const std::string& form) {
  std::vector<double> numbers;
  std::string_view rest = text;
  while (true) {
    const std::size_t comma = rest.find(',');
    const auto value = parseNumber(rest.substr(0, comma));
    if (!value) refuseValue(option, text, form);
    numbers.push_back(*value);
    if (comma == std::string_view::npos) return numbers;
    rest.remove_prefix(comma + 1);
  }
}

CLI::Option* addSize(CLI::App& app, const std::string& name, int& width, int& height,
                     const std::string& description) {
  return app
      .add_option_function<std::string>(
          name,
          [name, &width, &height](const std::string& text) {
            int w = 0, h = 0, used = 0;
            if (std::sscanf(text.c_str(), "%dx%d%n", &w, &h, &used) != 2 ||
                std::size_t(used) != text.size() || w < 1 || h < 1 || w > 65536 || h > 65536)
              refuseValue(name, text, "WxH, each 1 to 65536");
            width = w;
            height = h;
          },
          description)
      ->type_name("WxH")
      ->default_str(fmt::format("{}x{}", width, height));
}

void addPreviewFrame(CLI::App& app, CLI::Option* preview, int& width, int& height, float& azimuthDegrees,
                     float& elevationDegrees) {
  addSize(app, "--size", width, height, "Pixels across and down.")->needs(preview);
  addNumbers(
      app, "--view", "AZIMUTH,ELEVATION", 2, -360, 360,
      [&azimuthDegrees, &elevationDegrees](const Vec3d& v) {
        azimuthDegrees = float(v.x);
        elevationDegrees = float(v.y);
      },
      "Where the camera stands, in degrees: azimuth from the front (+z) towards +x, elevation from the "
      "horizon.")
      ->default_str(fmt::format("{:g},{:g}", azimuthDegrees, elevationDegrees))
      ->needs(preview);
}

}  // namespace nephele::apps
