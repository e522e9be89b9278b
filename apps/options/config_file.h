#pragma once

#include <CLI/App.hpp>
#include <optional>
#include <string>
#include <vector>

namespace nephele::apps {

/// The verb whose options are set, and the names of all verbs.
struct ConfiguredVerb {
  const CLI::App& app;
  const std::string& name;
  const std::vector<std::string>& verbs;
};

/// Adds to `arguments` (those of one verb, in order) the options that the TOML file named by --config sets
/// and that the arguments do not: the command line wins. Keys are option names without dashes; `true` stands
/// for a flag, an array for an option that is repeated; old names do. A table named after a verb is for that
/// verb alone. Then the same of the look named by --look, as far as it goes with what is there.
/// @throws CLI::ParseError naming the file, the line and the key, or the look.
std::vector<std::string> withConfigFile(const ConfiguredVerb& verb, std::vector<std::string> arguments);

/// The last text that `arguments` give to an option, as words of their own or behind an equals sign.
std::optional<std::string> givenTo(const std::string& option, const std::vector<std::string>& arguments);

}  // namespace nephele::apps
