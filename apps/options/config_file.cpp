#include "apps/options/config_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "apps/options/old_names.h"
#include "apps/options/options.h"
#include "apps/options/toml_file.h"

namespace nephele::apps {
namespace {

[[noreturn]] void refuse(const std::string& path, const toml::source_position& where,
                         const std::string& what) {
  const std::string place = where.line > 0 ? fmt::format("{}:{}", path, where.line) : path;
  throw CLI::ParseError(fmt::format("--config: {}: {}", place, what), CLI::ExitCodes::InvalidError);
}

bool isGiven(const CLI::Option& option, const std::vector<std::string>& arguments) {
  return std::any_of(arguments.begin(), arguments.end(), [&](const std::string& argument) {
    for (const std::string& name : option.get_lnames())
      if (argument == "--" + name || argument.starts_with("--" + name + "=")) return true;
    for (const std::string& name : option.get_snames())
      if (argument.starts_with("-" + name) && !argument.starts_with("--")) return true;
    return false;
  });
}

std::string textOf(const std::string& path, const std::string& key, const toml::node& value) {
  if (auto text = value.value_exact<std::string>()) return *text;
  if (auto whole = value.value_exact<std::int64_t>()) return std::to_string(*whole);
  if (auto number = value.value_exact<double>()) return fmt::format("{}", *number);
  refuse(path, value.source().begin,
         fmt::format("'{}' must be a text, a number, true, false or an array", key));
}

}  // namespace

std::vector<std::string> withConfigFile(const CLI::App& app, const std::string& verb,
                                        std::vector<std::string> arguments) {
  std::optional<std::string> path;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == "--config" && i + 1 < arguments.size()) path = arguments[i + 1];
    if (arguments[i].starts_with("--config=")) path = arguments[i].substr(9);
  }
  if (!path) return arguments;

  const toml::table table = readToml("--config", *path);

  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back(name);

  const std::vector<std::string> typed = arguments;
  for (const auto& [name, value] : table) {
    const std::string key = currentName(verb, "--" + std::string(name.str())).substr(2);
    const CLI::Option* option = app.get_option_no_throw("--" + key);
    if (!option || key == "config" || key.starts_with("help")) {
      const std::string meant = closestWord(key, names);
      refuse(*path, value.source().begin,
             fmt::format("'{}' is not an option of this verb{}", key,
                         meant.empty() ? "" : fmt::format("; did you mean '{}'?", meant)));
    }
    if (isGiven(*option, typed)) continue;
    if (auto flag = value.value_exact<bool>()) {
      if (option->get_expected_min() != 0)
        refuse(*path, value.source().begin, fmt::format("'{}' takes a value, not true or false", key));
      if (*flag) arguments.push_back("--" + key);
    } else if (const toml::array* list = value.as_array()) {
      for (const toml::node& item : *list)
        arguments.push_back(fmt::format("--{}={}", key, textOf(*path, key, item)));
    } else {
      arguments.push_back(fmt::format("--{}={}", key, textOf(*path, key, value)));
    }
  }
  return arguments;
}

}  // namespace nephele::apps
