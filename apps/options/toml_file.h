#pragma once

#include <string>

// toml++ is slow to compile: only what reads TOML files includes this header.
#include <toml++/toml.h>

namespace nephele::apps {

/// The whole file that `option` names.
/// @throws CLI::ValidationError naming option, file and line where it is not TOML, cannot be read, is a
/// folder, or has keys that nest more than 32 deep, which toml++ would follow until the stack ends.
toml::table readToml(const std::string& option, const std::string& path);

}  // namespace nephele::apps
