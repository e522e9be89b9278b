#pragma once

#include <string>

#include "apps/app.h"

namespace nephele::apps {

/// Prints what scripts may call, by groups: signature, what it does, an example. With a word those that have
/// it in their name or text. @throws Error with the nearest name if there are none.
void listFunctions(const std::string& word, Run& run);

/// The same of all as a page of Markdown.
void listFunctionsAsMarkdown(Run& run);

}  // namespace nephele::apps
