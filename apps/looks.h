#pragma once

#include <string>
#include <vector>

namespace nephele::apps {

/// Names of the looks that come with the program: the files of data/looks, which it holds.
std::vector<std::string> lookNames();

/// The TOML text of a look, with a table for each verb that it is for.
/// @throws CLI::ValidationError naming the looks that there are.
std::string lookText(const std::string& name);

}  // namespace nephele::apps
