#pragma once

#include <filesystem>
#include <map>

#include "nephele/levelset/felt/grid_functions.h"
#include "tests/modeling/felt/felt_run.h"
#include "tests/support/test_data.h"

/// Runs scripts with the functions of grids for tests.
namespace nephele::felt {

inline const Registry& gridFunctions() {
  static const Registry* const registry = [] {
    auto* made = new Registry;
    addModelingFunctions(*made);
    addLevelsetFunctions(*made);
    return made;
  }();
  return *registry;
}

/// All variables of a script by name. A script that cannot be run fails the test and has none.
inline std::map<std::string, Value> ran(const std::string& script, Context* context = nullptr) {
  Context own;
  std::map<std::string, Value> values;
  try {
    for (Named& named : Program("s.felt", script, gridFunctions()).run(context ? *context : own))
      values[named.name] = std::move(named.value);
  } catch (const Error& error) {
    ADD_FAILURE() << error.what();
  }
  return values;
}

/// What is said of a script that cannot be run.
inline std::string refusal(const std::string& script, Context* context = nullptr) {
  Context own;
  try {
    Program("s.felt", script, gridFunctions()).run(context ? *context : own);
    return "no fault";
  } catch (const ScriptError& error) {
    return error.what();
  }
}

}  // namespace nephele::felt
