#include "apps/options/config_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/looks.h"
#include "apps/options/old_names.h"
#include "apps/options/options.h"
#include "apps/options/toml_file.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::apps {
namespace {

bool isGiven(const CLI::Option& option, const std::vector<std::string>& arguments) {
  return std::any_of(arguments.begin(), arguments.end(), [&](const std::string& argument) {
    for (const std::string& name : option.get_lnames())
      if (argument == "--" + name || argument.starts_with("--" + name + "=")) return true;
    for (const std::string& name : option.get_snames())
      if (argument.starts_with("-" + name) && !argument.starts_with("--")) return true;
    return false;
  });
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

// An option as a table sets it: once for every item of an array.
struct Setting {
  struct Value {
    const toml::node& node;
    std::string text;
  };
  std::string name;
  const CLI::Option& option;
  std::vector<Value> values;
};

Setting::Value valueOf(const TomlFile& file, const std::string& key, const toml::node& node) {
  if (auto text = node.value_exact<std::string>()) return {node, *text};
  if (auto whole = node.value_exact<std::int64_t>()) return {node, std::to_string(*whole)};
  if (auto number = node.value_exact<double>()) return {node, fmt::format("{}", *number)};
  file.refuse(felt::Code::wrongType, node.source(),
              nephele::quoted(key) + " must be a text, a number, true, false or an array");
}

const CLI::Option& optionOf(const CLI::App& app, const TomlFile& file, const toml::key& key,
                            const std::string& name) {
  const CLI::Option* option = app.get_option_no_throw("--" + name);
  if (option && name != "config" && name != "look" && !name.starts_with("help")) return *option;
  std::vector<std::string> names;
  for (const CLI::Option* one : app.get_options())
    for (const std::string& other : one->get_lnames()) names.push_back(other);
  file.refuseKey(key, name, "not an option of this verb", names, false);
}

Setting settingOf(const ConfiguredVerb& verb, const TomlFile& file, const toml::key& key,
                  const toml::node& value) {
  const std::string name = currentName(verb.name, "--" + std::string(key.str())).substr(2);
  Setting setting{name, optionOf(verb.app, file, key, name), {}};
  if (setting.option.get_items_expected_max() == 0 && !value.is_boolean())
    file.refuse(felt::Code::wrongType, value.source(), nephele::quoted(name) + " is true or false");
  if (const auto flag = value.value_exact<bool>()) {
    if (setting.option.get_expected_min() != 0)
      file.refuse(felt::Code::wrongType, value.source(),
                  nephele::quoted(name) + " takes a value, not true or false");
    // Of others, false is how it is where nobody gives them.
    if (*flag || setting.option.check_lname("no-" + name)) setting.values.push_back({value, ""});
  } else if (const toml::array* list = value.as_array()) {
    for (const toml::node& item : *list) setting.values.push_back(valueOf(file, name, item));
  } else {
    setting.values.push_back(valueOf(file, name, value));
  }
  return setting;
}

void add(const Setting& setting, std::vector<std::string>& arguments) {
  for (const Setting::Value& value : setting.values)
    if (const auto flag = value.node.value_exact<bool>())
      arguments.push_back((*flag ? "--" : "--no-") + setting.name);
    else
      arguments.push_back(fmt::format("--{}={}", setting.name, value.text));
}

// What a file sets for the verb that `arguments` do not: options, and the table of the verb's own. Tables of
// other verbs are passed over.
std::vector<Setting> settingsOf(const ConfiguredVerb& verb, TomlFile& file,
                                const std::vector<std::string>& arguments) {
  std::vector<Setting> settings;
  const auto take = [&](const toml::key& key, const toml::node& value) {
    file.collect([&] {
      Setting setting = settingOf(verb, file, key, value);
      if (!isGiven(setting.option, arguments)) settings.push_back(std::move(setting));
    });
  };
  const auto refuseTable = [&](const toml::key& key) {
    file.collect([&] {
      file.refuseKey(key, std::string(key.str()), "neither an option nor a verb", verb.verbs, false);
    });
  };
  for (const auto& [key, value] : file.table()) {
    if (!value.is_table()) {
      take(key, value);
    } else if (key.str() == verb.name) {
      for (const auto& [inner, own] : *value.as_table()) take(inner, own);
    } else if (std::ranges::count(verb.verbs, key.str()) == 0) {
      refuseTable(key);
    }
  }
  file.throwFaults();
  return settings;
}

// "--layers: got '99'" as the file says it.
std::string inFile(const Setting& setting, const std::string& message) {
  const std::string start = "--" + setting.name;
  return message.starts_with(start) ? setting.name + message.substr(start.size()) : message;
}

// The value of one option alone, as an app reads it that has read nothing yet.
void check(const TomlFile& file, const Setting& setting, CLI::App& fresh) {
  CLI::Option* option = fresh.get_option_no_throw("--" + setting.name);
  for (const Setting::Value& value : setting.values) {
    if (value.node.is_boolean()) continue;
    const auto text = [&] { return file.textOf(value.node, value.text); };
    try {
      option->clear();
      option->add_result(value.text);
      option->run_callback();
    } catch (const felt::ScriptError& error) {
      throw text()->moved(error, 1);
    } catch (const CLI::ParseError& error) {
      throw text()->fault(felt::Code::outOfRange, inFile(setting, error.what()));
    }
  }
}

// Which of the values of an option a message is about: the one that it shows, or the only one.
const Setting::Value* valueIn(const Setting& setting, const std::string& message, bool isOfExpression) {
  for (const Setting::Value& value : setting.values) {
    const std::string shown =
        isOfExpression && value.text.starts_with('=') ? value.text.substr(1) : value.text;
    if (message.find(shown.substr(0, shown.find('\n'))) != std::string::npos) return &value;
  }
  return !isOfExpression && setting.values.size() == 1 ? &setting.values.front() : nullptr;
}

std::vector<Setting> settingsOfLook(const ConfiguredVerb& verb, const TomlFile& file,
                                    const std::string& name) {
  const toml::table* own = file.table()[verb.name].as_table();
  if (!own && verb.name == "turntable") own = file.table()["render"].as_table();
  if (!own) throw CLI::ValidationError("--look", fmt::format("'{}' says nothing of {}", name, verb.name));
  std::vector<Setting> settings;
  for (const auto& [key, value] : *own) settings.push_back(settingOf(verb, file, key, value));
  return settings;
}

// Adds what `arguments` do not set, but for what does not go with them: the settings are those of another
// shape, or at another resolution, then.
void addFitting(const ConfiguredVerb& verb, const std::vector<Setting>& settings,
                std::vector<std::string>& arguments) {
  const bool hasOwnInput = hasInput(verb.app, arguments);
  const std::vector<std::string> typed = arguments;
  std::vector<const CLI::Option*> left;
  const auto fits = [&](const CLI::Option& option) {
    for (const CLI::Option* other : option.get_excludes())
      if (other->get_positional() ? hasOwnInput : isGiven(*other, typed)) return false;
    return std::ranges::none_of(
        option.get_needs(), [&](const CLI::Option* other) { return std::ranges::count(left, other) > 0; });
  };
  // What others need comes first.
  for (const bool needs : {false, true})
    for (const Setting& setting : settings) {
      if (setting.option.get_needs().empty() == needs) continue;
      if (!fits(setting.option))
        left.push_back(&setting.option);
      else if (!isGiven(setting.option, typed))
        add(setting, arguments);
    }
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
  if (path) {
    TomlFile file = TomlFile::read("--config", *path);
    addFitting(verb, settingsOf(verb, file, arguments), arguments);
  }
  if (look) {
    const TomlFile file("the look " + *look, lookText(*look));
    addFitting(verb, settingsOfLook(verb, file, *look), arguments);
  }
  return arguments;
}

void checkConfigFile(const ConfiguredVerb& verb, const std::vector<std::string>& arguments, CLI::App& fresh) {
  const std::optional<std::string> path = givenTo("--config", arguments);
  if (!path) return;
  TomlFile file = TomlFile::read("--config", *path);
  for (const Setting& setting : settingsOf(verb, file, arguments))
    file.collect([&] { check(file, setting, fresh); });
  file.throwFaults();
}

std::optional<felt::ScriptError> shownInConfigFile(const ConfiguredVerb& verb,
                                                   const std::vector<std::string>& arguments,
                                                   const std::exception& error) {
  const std::string message = error.what();
  const std::optional<std::string> path = givenTo("--config", arguments);
  if (!path || !message.starts_with("--")) return std::nullopt;
  const auto* expression = dynamic_cast<const felt::ScriptError*>(&error);
  TomlFile file = TomlFile::read("--config", *path);
  for (const Setting& setting : settingsOf(verb, file, arguments)) {
    if (!message.starts_with("--" + setting.name + ":")) continue;
    const Setting::Value* value = valueIn(setting, message, expression != nullptr);
    if (!value) return std::nullopt;
    const auto text = file.textOf(value->node, value->text);
    if (expression) return text->moved(*expression, 1);
    const bool isOfUse = dynamic_cast<const CLI::Error*>(&error) != nullptr;
    return text->fault(isOfUse ? felt::Code::outOfRange : felt::Code::failed, inFile(setting, message));
  }
  return std::nullopt;
}

}  // namespace nephele::apps
