#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "apps/app.h"
#include "apps/look/subject.h"

namespace nephele::apps {

/// The controls of the viewer, made from the options of the verbs of all that can be shown and of render:
/// groups with label, type, unit, slider, choices, default and help of each, and the views that it belongs
/// to. Those of the first day come first.
nlohmann::json lookControls(const LookSubject& subject);

/// Parameters of a script, in the same form. @throws felt::ScriptError if the script is at fault.
nlohmann::json lookParameters(const LookSubject& subject);

/// Whether the look of this name that comes with the program is of wisps. @throws CLI::ValidationError where
/// there is none.
bool isLookOfWisps(const std::string& name);

/// The looks that come with the program, as what is shown and settings for this subject.
nlohmann::json shippedLooks(const LookSubject& subject);

/// Settings from a command line of the verb of what is shown and of render: an option that both have is not
/// render's. Files of settings and looks that it names are read. What belongs to neither stays in `others`.
/// @throws CLI::ParseError.
nlohmann::json settingsOfLine(const LookSubject& subject, LookShow::What what,
                              const std::vector<std::string>& arguments, std::vector<std::string>& others);

}  // namespace nephele::apps
