#pragma once

#include <CLI/App.hpp>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::apps {

/// The verb whose options are set, and the names of all verbs.
struct ConfiguredVerb {
  const CLI::App& app;
  const std::string& name;
  const std::vector<std::string>& verbs;
};

/// Adds to `arguments` (those of one verb, in order) the options that the TOML file named by --config sets
/// and that the arguments do not, as far as they go with these: the command line wins, over what excludes
/// what is typed, too. Keys are option names without dashes; `true` stands for a flag, an array for an option
/// that is repeated; old names do. A table named after a verb is for that verb alone. Then the same of the
/// look named by --look.
/// @throws felt::ScriptError with all keys that the verb does not have, and values that no option takes;
/// CLI::ParseError naming the file that cannot be read, or the look.
std::vector<std::string> withConfigFile(const ConfiguredVerb& verb, std::vector<std::string> arguments);

/// Where the options could not be read: whether that is because of values of the file of --config, which are
/// shown in it then. `fresh` is the verb's app, which must not be used any more.
/// @throws felt::ScriptError with all of them.
void checkConfigFile(const ConfiguredVerb& verb, const std::vector<std::string>& arguments, CLI::App& fresh);

/// What a run has thrown, shown where the file of --config gives the value that is at fault: what is wrong
/// with an expression, and what is said of an option, shows in some cases only when it is made use of.
/// Nothing where the value is not of the file. `arguments` are those that were typed.
std::optional<felt::ScriptError> shownInConfigFile(const ConfiguredVerb& verb,
                                                   const std::vector<std::string>& arguments,
                                                   const std::exception& error);

/// The last text that `arguments` give to an option, as words of their own or behind an equals sign.
std::optional<std::string> givenTo(const std::string& option, const std::vector<std::string>& arguments);

}  // namespace nephele::apps
