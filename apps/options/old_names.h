#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace nephele::apps {

/// What `name` ("--object-colour") of a verb is called today: itself, unless it is an old name.
std::string currentName(std::string_view verb, const std::string& name);

/// The arguments of a verb with today's names in place of old ones, for each of which `note` is called once
/// with a sentence. Values that begin with a minus and a digit are joined to the options before them, which
/// otherwise would look like options.
std::vector<std::string> withCurrentNames(std::string_view verb, std::vector<std::string> arguments,
                                          const std::function<void(const std::string&)>& note);

}  // namespace nephele::apps
