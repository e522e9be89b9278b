#pragma once

#include <span>
#include <string>

namespace nephele::apps {

/// Arguments as one would type them in a shell.
std::string typedLine(std::span<const std::string> arguments);

}  // namespace nephele::apps
