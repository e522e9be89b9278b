#pragma once

#include <string>

// toml++ is slow to compile: only what reads TOML files includes this header.
#include <toml++/toml.h>

namespace nephele::apps {

/// The whole file. @throws toml::parse_error @throws Error naming the file if it cannot be read, is a folder,
/// or has keys that nest more than 32 deep, which toml++ would follow until the stack ends.
toml::table readToml(const std::string& path);

}  // namespace nephele::apps
