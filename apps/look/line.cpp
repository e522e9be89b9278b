#include "apps/look/line.h"

#include <fmt/format.h>

#include "apps/look/controls.h"
#include "apps/look/plan.h"
#include "apps/options/layer_recipe.h"

namespace nephele::apps {
namespace {

/// The file that is looked at: the first argument, unless that is an option.
std::string takeInput(std::vector<std::string>& arguments) {
  if (arguments.empty() || arguments.front().starts_with('-')) return "";
  const std::string input = arguments.front();
  arguments.erase(arguments.begin());
  return input;
}

}  // namespace

LookLine LookLine::of(const CLI::App& app) {
  std::vector<std::string> arguments = app.remaining(), others;
  for (const char* name : {"--config", "--look"})
    if (const CLI::Option* option = app.get_option(name); option->count() > 0)
      arguments.push_back(fmt::format("{}={}", name, option->as<std::string>()));
  std::string input = takeInput(arguments);
  if (input.ends_with(".toml")) {
    arguments.insert(arguments.begin(), {isLayerRecipe(input) ? "--recipe" : "--config", input});
    input.clear();
  }
  LookLine line{LookSubject::of(input), {}};
  line.settings = settingsOfLine(line.subject, arguments, others);
  if (!others.empty())
    throw CLI::ParseError(
        fmt::format("'{}' is no option of cloud or render, or a second file", others.front()),
        CLI::ExitCodes::ExtrasError);
  try {
    const LookPlan check(line.subject, line.settings);
  } catch (const LookFault& fault) {
    throw CLI::ParseError(fault.what(), CLI::ExitCodes::ValidationError);
  }
  return line;
}

}  // namespace nephele::apps
