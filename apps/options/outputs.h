#pragma once

#include <CLI/App.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace nephele::apps {

/// Who finds out before the work whether an output can be written.
enum class OutputTrial { program, verb };

/// Says that the value of an option is a file, or a folder, that the verb writes.
CLI::Option* markOutput(CLI::Option* option, OutputTrial trial = OutputTrial::program);

/// Whether that was said of an option.
bool isOutput(const CLI::Option& option);

/// Whether it is one for each call that a command line stands for: --stats and --contact-sheet are of all.
bool isOutputOfCall(const CLI::Option& option);

/// The file that `value` of `option` names: "[NAME=]FILE" may have the name of a light in front.
std::string_view pathOf(const CLI::Option& option, std::string_view value);

/// The first value that is given for `option`; nothing where none is, or the verb has no such option.
std::string givenValue(const CLI::App& app, const std::string& option);

/// The files and folders that one call makes, but for streams.
std::vector<std::string> outputsOf(const CLI::App& app);

/// Refuses an output of `option` that is one of `known`, which other calls write, and adds it to them.
/// @throws CLI::ValidationError naming the option.
void requireOwnFile(const std::string& option, const std::string& path, std::set<std::string>& known);

/// Refuses outputs that are the same file as each other, as an input, or as one of `known`, which other calls
/// write; those of this call are added to them. --output may be an input: that is work in place, since
/// outputs are renamed when they are whole. Streams ("/dev/null") may be given often.
/// @throws CLI::ValidationError naming the options.
void requireDistinctOutputs(const CLI::App& app, std::set<std::string>& known);

/// Opens every output that is the program's to try, and removes it again.
/// @throws Error naming the path of one that cannot be written.
void tryOutputs(const CLI::App& app);

}  // namespace nephele::apps
