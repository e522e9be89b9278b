#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "apps/app.h"
#include "apps/look/subject.h"

namespace nephele::apps {

/// The controls of the viewer, made from the options of the verbs cloud and render: groups with label, type,
/// unit, slider, choices, default and help of each. Those of the first day come first.
nlohmann::json lookControls(const LookSubject& subject);

/// Parameters of a script, in the same form. @throws felt::ScriptError if the script is at fault.
nlohmann::json lookParameters(const LookSubject& subject);

/// The looks that come with the program, as settings for this subject.
nlohmann::json shippedLooks(const LookSubject& subject);

/// Settings from a command line of both verbs: an option that both have is the cloud's. Files of settings and
/// looks that it names are read. What belongs to neither stays in `others`.
/// @throws CLI::ParseError.
nlohmann::json settingsOfLine(const LookSubject& subject, const std::vector<std::string>& arguments,
                              std::vector<std::string>& others);

}  // namespace nephele::apps
