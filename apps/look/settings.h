#pragma once

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele::apps {

/// What is set in the viewer: {"cloud": {...}, "render": {...}, "parameters": {...} and so on}, by names of
/// options of these verbs, without dashes, and of parameters of a script. Values are texts as typed, lists of
/// texts for options that repeat, true or false for flags. What is not there is at its default.
using LookSettings = nlohmann::json;

/// All parts that there are, with nothing set.
LookSettings emptySettings();

/// Those settings of a verb that `counts` is true of, by their names, as a text: equal ones have equal texts.
template <class Counts>
std::string keyOf(const nlohmann::json& settings, const Counts& counts) {
  std::string key;
  for (const auto& [name, value] : settings.items())
    if (counts(name)) key += name + "=" + value.dump() + ";";
  return key;
}

/// What is wrong with a setting, as the command line says it.
class LookFault : public Error {
 public:
  /// The option is the first that the message names, if it names one.
  LookFault(std::string verb, const std::string& message);
  const std::string& verb() const { return verb_; }
  /// Without dashes; "" where none is at fault.
  const std::string& option() const { return option_; }

 private:
  std::string verb_, option_;
};

/// Settings that hold nothing but texts, lists of texts and flags, in the parts that there are.
/// @throws LookFault.
LookSettings checkedSettings(const nlohmann::json& given);

/// The settings of one verb as arguments of its command line.
std::vector<std::string> argumentsOf(const nlohmann::json& settings);

/// The way back: options of `app` among `arguments`. What belongs to no option is left in `others`.
nlohmann::json settingsOf(const CLI::App& app, const std::vector<std::string>& arguments,
                          std::vector<std::string>& others);

}  // namespace nephele::apps
