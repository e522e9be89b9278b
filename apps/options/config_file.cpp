#include "apps/options/config_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/looks.h"
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

// Whether any of `arguments` is neither an option nor what one takes.
bool hasInput(const CLI::App& verb, const std::vector<std::string>& arguments) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (!arguments[i].starts_with("-")) return true;
    const CLI::Option* option = verb.get_option_no_throw(arguments[i]);
    if (option && option->get_expected_min() > 0) ++i;
  }
  return false;
}

// Options that a table sets and `arguments` do not.
struct Settings {
  const ConfiguredVerb& verb;
  const std::string& path;
  const std::vector<std::string> typed;
  std::vector<std::string> arguments;

  // The name of today for a key.
  std::string nameOf(const toml::key& key) const {
    return currentName(verb.name, "--" + std::string(key.str())).substr(2);
  }

  void add(const std::string& key, const CLI::Option& option, const toml::node& value) {
    if (isGiven(option, typed)) return;
    if (auto flag = value.value_exact<bool>()) {
      if (option.get_expected_min() != 0)
        refuse(path, value.source().begin, fmt::format("'{}' takes a value, not true or false", key));
      if (*flag) arguments.push_back("--" + key);
    } else if (const toml::array* list = value.as_array()) {
      for (const toml::node& item : *list)
        arguments.push_back(fmt::format("--{}={}", key, textOf(path, key, item)));
    } else {
      arguments.push_back(fmt::format("--{}={}", key, textOf(path, key, value)));
    }
  }

  const CLI::Option& optionOf(const std::string& key, const toml::node& value) const {
    const CLI::Option* option = verb.app.get_option_no_throw("--" + key);
    if (option && key != "config" && key != "look" && !key.starts_with("help")) return *option;
    std::vector<std::string> names;
    for (const CLI::Option* one : verb.app.get_options())
      for (const std::string& name : one->get_lnames()) names.push_back(name);
    const std::string meant = closestWord(key, names);
    refuse(path, value.source().begin,
           fmt::format("'{}' is not an option of this verb{}", key,
                       meant.empty() ? "" : fmt::format("; did you mean '{}'?", meant)));
  }
};

// Of a table of its own where there is one, which other verbs pass over.
std::vector<std::string> withTable(const ConfiguredVerb& verb, const std::string& path,
                                   const toml::table& table, std::vector<std::string> arguments) {
  Settings settings{verb, path, arguments, arguments};
  for (const auto& [name, value] : table) {
    const std::string key = value.is_table() ? std::string(name.str()) : settings.nameOf(name);
    if (!value.is_table()) {
      settings.add(key, settings.optionOf(key, value), value);
    } else if (key == verb.name) {
      for (const auto& [inner, own] : *value.as_table()) {
        const std::string option = settings.nameOf(inner);
        settings.add(option, settings.optionOf(option, own), own);
      }
    } else if (std::ranges::count(verb.verbs, key) == 0) {
      refuse(path, value.source().begin, fmt::format("'{}' is neither an option nor a verb", key));
    }
  }
  return std::move(settings.arguments);
}

// What a look says of the verb, but for what does not go with what was typed: it is the look of another
// shape, or at another resolution, then.
std::vector<std::string> withLook(const ConfiguredVerb& verb, const std::string& name,
                                  std::vector<std::string> arguments) {
  const std::string path = "the look " + name;
  const toml::table table = toml::parse(lookText(name));
  const toml::table* own = table[verb.name].as_table();
  if (!own && verb.name == "turntable") own = table["render"].as_table();
  if (!own) throw CLI::ValidationError("--look", fmt::format("'{}' says nothing of {}", name, verb.name));
  const bool hasOwnInput = hasInput(verb.app, arguments);
  Settings settings{verb, path, arguments, arguments};
  std::vector<const CLI::Option*> left;
  const auto fits = [&](const CLI::Option& option) {
    for (const CLI::Option* other : option.get_excludes())
      if (other->get_positional() ? hasOwnInput : isGiven(*other, settings.typed)) return false;
    return std::ranges::none_of(
        option.get_needs(), [&](const CLI::Option* other) { return std::ranges::count(left, other) > 0; });
  };
  // What others need comes first.
  for (const bool needs : {false, true})
    for (const auto& [key, value] : *own) {
      const CLI::Option& option = settings.optionOf(std::string(key.str()), value);
      if (option.get_needs().empty() == needs) continue;
      if (fits(option))
        settings.add(std::string(key.str()), option, value);
      else
        left.push_back(&option);
    }
  return std::move(settings.arguments);
}

}  // namespace

std::optional<std::string> givenTo(const std::string& option, const std::vector<std::string>& arguments) {
  std::optional<std::string> text;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == option && i + 1 < arguments.size()) text = arguments[i + 1];
    if (arguments[i].starts_with(option + "=")) text = arguments[i].substr(option.size() + 1);
  }
  return text;
}

std::vector<std::string> withConfigFile(const ConfiguredVerb& verb, std::vector<std::string> arguments) {
  const std::optional<std::string> path = givenTo("--config", arguments), look = givenTo("--look", arguments);
  if (path) arguments = withTable(verb, *path, readToml("--config", *path), std::move(arguments));
  if (look) arguments = withLook(verb, *look, std::move(arguments));
  return arguments;
}

}  // namespace nephele::apps
