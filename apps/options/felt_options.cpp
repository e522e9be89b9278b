#include "apps/options/felt_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "apps/options/options.h"

namespace nephele::apps {
namespace {

using Action = FeltArguments::Action;

constexpr int kMostOfAnything = 2'000'000'000;

const std::vector<std::pair<std::string, Action>>& actions() {
  static const std::vector<std::pair<std::string, Action>> all{{"run", Action::run},
                                                               {"check", Action::check},
                                                               {"functions", Action::functions},
                                                               {"format", Action::format},
                                                               {"repl", Action::repl}};
  return all;
}

/// Options that only some actions take.
struct Belonging {
  const char* option;
  std::vector<Action> actions;
};

const std::vector<Belonging>& belongings() {
  static const std::vector<Belonging> all{{"--set", {Action::run}},
                                          {"--explain", {Action::run}},
                                          {"--json", {Action::run, Action::check}},
                                          {"--max-statements", {Action::run, Action::repl}},
                                          {"--max-calls", {Action::run, Action::repl}},
                                          {"--max-elements", {Action::run, Action::repl}},
                                          {"--max-depth", {Action::run, Action::repl}},
                                          {"--check", {Action::format}},
                                          {"--stdout", {Action::format}},
                                          {"--markdown", {Action::functions}}};
  return all;
}

void refuseWhatDoesNotBelong(const CLI::App& app, Action action) {
  for (const Belonging& belonging : belongings()) {
    if (app.get_option(belonging.option)->count() == 0 || std::ranges::count(belonging.actions, action) > 0)
      continue;
    std::string words;
    for (const auto& [word, of] : actions())
      if (std::ranges::count(belonging.actions, of) > 0) words += (words.empty() ? "" : " and ") + word;
    throw CLI::ValidationError(belonging.option, "goes with " + words + " only");
  }
}

}  // namespace

felt::Limits FeltArguments::limits() const {
  return {.statements = statements, .calls = calls, .elements = elements, .depth = depth};
}

const std::string& FeltArguments::script() const {
  if (words.empty()) throw CLI::RequiredError("a script");
  if (words.size() > 1)
    throw CLI::ValidationError("run", fmt::format("takes one script; '{}' is one too many", words[1]));
  return words[0];
}

void addFeltOptions(CLI::App& app, FeltArguments& a) {
  addChoice(app, "action", a.action, actions(), "What to do.")->required()->default_str("");
  app.add_option("scripts", a.words, "Scripts, - for the standard input; for functions a word to look for.")
      ->type_name("FILE");

  app.add_option("--set", a.settings, "A value for a parameter of the script, as an expression.")
      ->type_name("NAME=VALUE")
      ->allow_extra_args(false)
      ->group("Run");
  app.add_flag("--explain", a.explain,
               "Print parameters, every field with its operations and its cost per point, and every cache "
               "with its size.")
      ->group("Run");
  app.add_flag("--json", a.json, "Print faults as JSON, one object per line, for editors.")->group("Run");
  const auto limit = [&](const char* name, int& target, const char* description) {
    addCount(app, name, target, 1, kMostOfAnything, description)->group("Limits");
  };
  limit("--max-statements", a.statements, "Statements that are carried out before the run is given up.");
  limit("--max-calls", a.calls, "Calls of functions of the script that are under way at the same time.");
  limit("--max-elements", a.elements, "Elements of an array, and characters of a string.");
  limit("--max-depth", a.depth, "Operations between a field and the points that it is asked at.");

  auto* check = app.add_flag("--check", a.onlyChecks, "Change nothing; fail if a script is not formatted.")
                    ->group("Format");
  app.add_flag("--stdout", a.toOutput, "Print the formatted scripts; the files stay as they are.")
      ->excludes(check)
      ->group("Format");
  app.add_flag("--markdown", a.asMarkdown, "All functions as a page of documentation.")->group("Functions");
  app.callback([&app, &a] { refuseWhatDoesNotBelong(app, a.action); });
}

}  // namespace nephele::apps
