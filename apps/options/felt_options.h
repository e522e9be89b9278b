#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "nephele/modeling/felt/context.h"

namespace nephele::apps {

/// The options of the verb felt as typed.
struct FeltArguments {
  enum class Action { run, check, functions, format, repl };

  Action action = Action::run;
  /// Scripts, or the word that `functions` looks for.
  std::vector<std::string> words;

  /// NAME=VALUE, as typed.
  std::vector<std::string> settings;
  bool explain = false, json = false;
  int statements = 20'000'000, calls = 200, elements = 1'000'000, depth = 4000;

  bool onlyChecks = false, toOutput = false;
  bool asMarkdown = false;

  felt::Limits limits() const;
  /// The script that there is one of. @throws CLI::ParseError if there is none, or more than one.
  const std::string& script() const;
};

/// Declares the options on `app`. Those that do not belong to the action are refused while parsing.
void addFeltOptions(CLI::App& app, FeltArguments& arguments);

}  // namespace nephele::apps
