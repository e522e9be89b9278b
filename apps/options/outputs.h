#pragma once

#include <CLI/App.hpp>

namespace nephele::apps {

/// Who finds out before the work whether an output can be written.
enum class OutputTrial { program, verb };

/// Says that the value of an option is a file, or a folder, that the verb writes.
CLI::Option* markOutput(CLI::Option* option, OutputTrial trial = OutputTrial::program);

/// Whether that was said of an option.
bool isOutput(const CLI::Option& option);

/// Refuses outputs that are the same file as each other, or as an input. --output may be an input: that is
/// work in place, since outputs are renamed when they are whole. Streams ("/dev/null") may be given often.
/// @throws CLI::ValidationError naming both options.
void requireDistinctOutputs(CLI::App& app);

/// Opens every output that is the program's to try, and removes it again.
/// @throws Error naming the path of one that cannot be written.
void tryOutputs(CLI::App& app);

}  // namespace nephele::apps
