#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace nephele::apps {

/// Adds to `arguments` (those of one verb, in order) the options that the TOML file named by --config sets
/// and that the arguments do not: the command line wins. Keys are option names without dashes; `true` stands
/// for a flag, an array for an option that is repeated; old names do.
/// @throws CLI::ParseError naming the file, the line and the key.
std::vector<std::string> withConfigFile(const CLI::App& app, const std::string& verb,
                                        std::vector<std::string> arguments);

}  // namespace nephele::apps
