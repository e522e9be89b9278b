#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/detail/several_calls.h"

namespace nephele::apps {

/// Arguments that ask for a preview beside the output, where the verb can make one and none is asked for.
std::vector<std::string> withPreview(std::vector<std::string> arguments, const CLI::App& app);

/// Refuses a sheet of calls like the first, with the options of `first`, where there would be nothing to see.
/// @throws CLI::ValidationError
void requireSeen(const CLI::App& first);

/// Small pictures of what `calls` made, each with its name below, in `columns` where they are given. They are
/// the previews; where the verb makes none, `render` looks at the outputs, with one camera and one
/// extinction.
/// @throws Error naming the file.
void writeCallSheet(const std::string& path, const std::vector<MadeCall>& calls, std::optional<int> columns,
                    const Verb& render, ProgramRun& run);

}  // namespace nephele::apps
