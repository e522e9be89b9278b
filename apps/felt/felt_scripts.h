#pragma once

#include <map>
#include <string>
#include <vector>

#include "apps/app.h"
#include "apps/options/expression_names.h"
#include "apps/options/felt_options.h"
#include "nephele/modeling/felt/program.h"

namespace nephele::apps {

/// A script and what it is called in messages.
struct ScriptText {
  std::string name, text;
};
/// The script at `path`; "-" is the standard input. @throws Error naming the path.
ScriptText readScript(const std::string& path);

/// Values of --set, NAME=VALUE each, as names and expressions. @throws CLI::ValidationError if one is not of
/// that form, or the program has no such parameter.
std::map<std::string, std::string> settingsOf(const std::vector<std::string>& texts,
                                              const felt::Program& program);

/// What a script runs in: what it prints are results of `run`.
felt::Context feltContext(const felt::Limits& limits, const Run& run);

/// Runs a script; with --explain says what has become of it.
void runScript(const FeltArguments& arguments, Run& run);

/// Tells the faults of scripts without running them; each is looked at.
void checkScripts(const FeltArguments& arguments, Run& run);

/// Writes scripts as they should look, where they lie or to the standard output.
void formatScripts(const FeltArguments& arguments, Run& run);

}  // namespace nephele::apps
