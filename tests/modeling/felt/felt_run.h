#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "nephele/modeling/felt/program.h"
#include "nephele/modeling/field/space.h"

/// Runs scripts for tests.
namespace nephele::felt {

inline const Registry& allFunctions() {
  static const Registry* const registry = [] {
    auto* made = new Registry;
    addModelingFunctions(*made);
    return made;
  }();
  return *registry;
}

inline std::string printedBy(const Program& program, std::map<std::string, std::string> settings = {},
                             Context* context = nullptr) {
  Context own;
  Context& used = context ? *context : own;
  std::string text;
  used.print = [&](const std::string& line) { text += line + "\n"; };
  program.run(used, {.settings = std::move(settings)});
  used.print = nullptr;
  return text;
}

/// What a script prints. Unless `mustRun`, a script with faults prints nothing.
inline std::string printed(const std::string& script, bool mustRun = true, Context* context = nullptr) {
  try {
    return printedBy(Program("s.felt", script, allFunctions()), {}, context);
  } catch (const Error& error) {
    if (mustRun) ADD_FAILURE() << error.what();
    return "";
  }
}

/// All that is said of a script that has faults.
inline std::string faultsOf(const std::string& script, Context* context = nullptr) {
  try {
    const std::string text = printedBy(Program("s.felt", script, allFunctions()), {}, context);
    return "no fault, but: " + text;
  } catch (const ScriptError& error) {
    return error.what();
  }
}

}  // namespace nephele::felt
