#pragma once

#include <string>

#include "apps/app.h"

namespace nephele::apps {

/// The man page of a verb, or with the name "" that of the program, in troff.
/// @throws Error if there is no such verb.
std::string manPage(const std::string& name);

/// What a shell, "bash", "zsh" or "fish", reads to complete verbs, options and their values.
/// @throws Error if it is another shell.
std::string completionsFor(const std::string& shell);

}  // namespace nephele::apps
