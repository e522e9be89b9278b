#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/detail/several_calls.h"

namespace nephele::apps {

/// Arguments that ask for a preview beside the output, where the verb can make one and none is asked for.
std::vector<std::string> withPreview(std::vector<std::string> arguments, const CLI::App& app);

/// Refuses a sheet with a call of the options `call` where there would be nothing to see of it, or in another
/// size than of `first`.
/// @throws CLI::ValidationError
void requireSeen(const CLI::App& call, const CLI::App& first);

/// Small pictures of what `calls` made, each with its name below, in `columns` where they are given. They are
/// the previews; where the verb makes none, `render` looks at the outputs, with one camera and one
/// extinction.
/// @throws Error naming the file.
void writeCallSheet(const std::string& path, const std::vector<MadeCall>& calls, std::optional<int> columns,
                    const Verb& render, ProgramRun& run);

}  // namespace nephele::apps
