#include "apps/look/line.h"

#include <fmt/format.h>

#include "apps/look/controls.h"
#include "apps/look/plan.h"
#include "apps/options/layer_recipe.h"

namespace nephele::apps {
namespace {

/// The files that are looked at: the first arguments, at most two, up to an option.
std::vector<std::string> takeInputs(std::vector<std::string>& arguments) {
  std::vector<std::string> inputs;
  while (inputs.size() < 2 && !arguments.empty() && !arguments.front().starts_with('-')) {
    inputs.push_back(arguments.front());
    arguments.erase(arguments.begin());
  }
  return inputs;
}

/// What is shown where the command line does not say: what its look is of, or all that there is.
LookShow::What whatOf(const CLI::App& app, const LookSubject& subject) {
  const CLI::Option* show = app.get_option("--show");
  if (show->count() > 0) return *LookShow::named(show->as<std::string>());
  const CLI::Option* look = app.get_option("--look");
  if (subject.hasCloud() && look->count() > 0 && isLookOfWisps(look->as<std::string>()))
    return LookShow::What::wisps;
  return subject.reference.empty() ? LookShow::What::cloud : LookShow::What::transfer;
}

}  // namespace

LookLine LookLine::of(const CLI::App& app) {
  std::vector<std::string> arguments = app.remaining(), others;
  for (const char* name : {"--config", "--look"})
    if (const CLI::Option* option = app.get_option(name); option->count() > 0)
      arguments.push_back(fmt::format("{}={}", name, option->as<std::string>()));
  std::vector<std::string> inputs = takeInputs(arguments);
  if (inputs.size() == 1 && inputs[0].ends_with(".toml")) {
    arguments.insert(arguments.begin(), {isLayerRecipe(inputs[0]) ? "--recipe" : "--config", inputs[0]});
    inputs.clear();
  }
  LookLine line{LookSubject::of(inputs), LookShow::What::cloud, {}};
  line.what = whatOf(app, line.subject);
  line.settings = settingsOfLine(line.subject, line.what, arguments, others);
  if (!others.empty())
    throw CLI::ParseError(fmt::format("'{}' is no option of {} or render, or one file too many",
                                      others.front(), LookShow::verb(line.what)),
                          CLI::ExitCodes::ExtrasError);
  try {
    const LookPlan check(line.subject, line.settings, line.what);
  } catch (const LookFault& fault) {
    throw CLI::ParseError(fault.what(), CLI::ExitCodes::ValidationError);
  }
  return line;
}

}  // namespace nephele::apps
