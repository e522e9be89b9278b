#include "apps/app.h"
#include "apps/felt/felt_scripts.h"
#include "apps/felt/function_list.h"
#include "apps/felt/repl.h"
#include "apps/options/felt_options.h"

namespace nephele::apps {
namespace {

void doAction(const FeltArguments& arguments, Run& run) {
  using Action = FeltArguments::Action;
  switch (arguments.action) {
    case Action::run:
      return runScript(arguments, run);
    case Action::check:
      return checkScripts(arguments, run);
    case Action::functions:
      if (arguments.asMarkdown) return listFunctionsAsMarkdown(run);
      return listFunctions(arguments.words.empty() ? "" : arguments.words[0], run);
    case Action::format:
      return formatScripts(arguments, run);
    case Action::repl:
      return answerLines(arguments.limits(), run);
  }
}

constexpr const char* kActions =
    "Actions:\n"
    "  run SCRIPT         Runs a script; what it prints goes to the standard output.\n"
    "  check SCRIPT...    Tells what is wrong with scripts without running them.\n"
    "  functions [WORD]   Says what scripts may call.\n"
    "  format SCRIPT...   Writes scripts as they should look, in place.\n"
    "  repl               Answers statements and expressions line by line; :help says more.\n"
    "Scripts that are at fault end the program with 2, files and data that are with 1.\n";

}  // namespace

Verb feltVerb() {
  return verbOf("felt", "Runs, checks and formats scripts of fields.",
                "nephele felt run data/felt/cumulus.felt --set billow=0.3 --explain", addFeltOptions,
                doAction, kActions);
}

}  // namespace nephele::apps
