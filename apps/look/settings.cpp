#include "apps/look/settings.h"

#include <fmt/format.h>

#include "apps/options/options.h"

namespace nephele::apps {
namespace {

std::string optionIn(const std::string& message) {
  const std::size_t dashes = message.find("--");
  if (dashes == std::string::npos) return "";
  std::size_t end = dashes + 2;
  while (end < message.size() &&
         (std::isalnum(static_cast<unsigned char>(message[end])) || message[end] == '-'))
    ++end;
  return message.substr(dashes + 2, end - dashes - 2);
}

bool isName(const std::string& text) {
  if (text.empty() || text.size() > 64 || text.front() == '-') return false;
  for (const char c : text)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '-' && c != '_') return false;
  return true;
}

bool isTexts(const nlohmann::json& value) {
  if (!value.is_array() || value.size() > 64) return false;
  for (const auto& item : value)
    if (!item.is_string()) return false;
  return true;
}

}  // namespace

LookFault::LookFault(std::string verb, const std::string& message)
    : Error(message), verb_(std::move(verb)), option_(optionIn(message)) {}

LookSettings emptySettings() {
  LookSettings result;
  for (const char* part : {"cloud", "wisps", "cut", "transfer", "render", "parameters"})
    result[part] = nlohmann::json::object();
  return result;
}

LookSettings checkedSettings(const nlohmann::json& given) {
  LookSettings result = emptySettings();
  if (given.is_null()) return result;
  if (!given.is_object()) throw LookFault("", "settings: must be an object");
  for (const auto& [part, values] : given.items()) {
    if (!result.contains(part)) throw LookFault("", "settings: '" + part + "' is not a part of them");
    if (!values.is_object()) throw LookFault("", "settings: '" + part + "' must be an object");
    for (const auto& [name, value] : values.items()) {
      if (!isName(name)) throw LookFault(part, "settings: '" + name + "' is no name of an option");
      const bool isOfLine = name == "help" || name == "help-all" || name == "size";
      if (isOfLine && part != "parameters")
        throw LookFault(part, fmt::format("--{}: is for command lines, not for settings", name));
      if (!value.is_string() && !value.is_boolean() && !isTexts(value))
        throw LookFault(part, fmt::format("--{}: must be a text, a list of texts, true or false", name));
      result[part][name] = value;
    }
  }
  return result;
}

std::vector<std::string> argumentsOf(const nlohmann::json& settings) {
  std::vector<std::string> arguments;
  for (const auto& [name, value] : settings.items()) {
    if (value.is_boolean()) {
      if (value.get<bool>())
        arguments.push_back("--" + name);
      else if (name == "backdrop")
        arguments.push_back("--no-" + name);
    } else if (value.is_array()) {
      for (const auto& item : value) arguments.push_back("--" + name + "=" + item.get<std::string>());
    } else {
      arguments.push_back("--" + name + "=" + value.get<std::string>());
    }
  }
  return arguments;
}

nlohmann::json settingsOf(const CLI::App& app, const std::vector<std::string>& arguments,
                          std::vector<std::string>& others) {
  nlohmann::json settings = nlohmann::json::object();
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const std::size_t equals = argument.starts_with("--") ? argument.find('=') : std::string::npos;
    const std::string word = argument.substr(0, equals);
    const CLI::Option* option = word.starts_with('-') ? app.get_option_no_throw(word) : nullptr;
    if (!option || option->get_lnames().empty()) {
      others.push_back(argument);
      continue;
    }
    const std::string name = option->get_lnames().front();
    if (option->get_items_expected_max() == 0) {
      if (equals != std::string::npos)
        refuseValue(word, argument.substr(equals + 1), "no value; it is a flag");
      settings[name] = !word.starts_with("--no-");
      continue;
    }
    std::vector<std::string> values;
    if (equals != std::string::npos)
      values.push_back(argument.substr(equals + 1));
    else if (i + 1 < arguments.size())
      values.push_back(arguments[++i]);
    const bool repeats = option->get_items_expected_max() > 1;
    while (repeats && option->get_allow_extra_args() && equals == std::string::npos &&
           i + 1 < arguments.size() && !arguments[i + 1].starts_with('-'))
      values.push_back(arguments[++i]);
    if (!repeats) {
      settings[name] = values.empty() ? std::string() : values.front();
      continue;
    }
    auto& list = settings[name];
    for (std::string& value : values) list.push_back(std::move(value));
  }
  return settings;
}

}  // namespace nephele::apps
