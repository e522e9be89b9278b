#include "apps/detail/command.h"

#include <fmt/format.h>

#include "nephele/modeling/base/nearest_name.h"

// All of CLI11 here alone: the others take CLI/App.hpp, or each would compile its formatter and its reader of
// configuration files again.
#include <CLI/CLI.hpp>
#include <algorithm>

#include "apps/looks.h"
#include "apps/options/common_group.h"
#include "apps/options/options.h"

namespace nephele::apps {
namespace {

void addSeveralCalls(CLI::App& app, CommonOptions& options) {
  app.add_option("--frames", options.frames,
                 "Make one call for every frame, 1-48 or 1001-1100x2,1150, with its number in place of the "
                 "####, %04d or $F4 in names of files.")
      ->type_name("FRAMES")
      ->group(kSeveralGroup);
  app.add_option("--only", options.only,
                 "Make only those of --frames that are in this range, too; what is chosen from the data is "
                 "chosen from all.")
      ->type_name("FRAMES")
      ->group(kSeveralGroup);
  app.add_option("--shard", options.shard, "Make the share of machine I of N (from 1): every N-th frame.")
      ->type_name("I/N")
      ->group(kSeveralGroup);
  if (!app.get_option_no_throw("--output")) return;
  app.add_option(
         "--wedge", options.wedges,
         "Make one call for every value of an option, seed=1-12 or billow=0,0.5,1,2, each with outputs "
         "of its own name; given twice, for every pair. With --frames, a sequence for every value, of which "
         "--only and --shard make their part. Semicolons separate what has commas.")
      ->type_name("OPTION=VALUES")
      ->allow_extra_args(false)
      ->group(kSeveralGroup);
  app.add_flag("--skip-existing", options.skipExisting,
               "Keep the outputs of calls that are there, whole and made with the same options.")
      ->group(kSeveralGroup);
  addOutput(app, "--contact-sheet", options.contactSheet, {".png"},
            "All frames, or all values of --wedge (with --frames the middle frame of each), small on one "
            "picture (.png), each with its name.")
      ->group(kSeveralGroup);
}

void addCommonOptions(CLI::App& app, CommonOptions& options) {
  const std::string group = kCommonGroup;
  addCount(app, "--threads", options.threads, 0, 4096, "Threads to use; 0: all that the process may use.")
      ->group(group);
  app.add_flag("--quiet", options.quiet, "Print errors only.")->group(group);
  app.add_flag("--verbose", options.verbose, "Print the time of every stage.")->group(group);
  app.add_option("--config", options.config, "Read options by name from a TOML file; the command line wins.")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--look", options.look,
                 fmt::format("Options that go together, by name: {}. The command line and --config win.",
                             fmt::join(lookNames(), ", ")))
      ->type_name("NAME")
      ->group(group);
  markOutput(app.add_option("--stats", options.stats, "Write statistics as one JSON object."))
      ->type_name("FILE")
      ->group(group);
  addChoice<std::string>(app, "--progress", options.progress, {{"auto", "auto"}, {"alf", "alf"}},
                         "auto, or alf for lines that farm software reads.")
      ->group(group);
  app.add_option("--memory-limit", options.memoryLimit,
                 "Refuse work that needs more: 8G, 512M or a share of memory.")
      ->capture_default_str()
      ->group(group);
  app.add_flag("--overwrite", options.overwrite, "Replace outputs that exist; this is the default.")
      ->group(group);
}

std::vector<std::string> optionNames(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (const CLI::App* group :
       app.get_subcommands([](const CLI::App* sub) { return sub->get_name().empty(); }))
    for (const std::string& name : optionNames(*group)) names.push_back(name);
  return names;
}

/// CLI11 takes "--flag=-1" as an order to switch the flag off.
void refuseValueOfFlag(const CLI::App& app, const std::string& argument) {
  const std::size_t equals = argument.find('=');
  if (!argument.starts_with("--") || equals == std::string::npos) return;
  const std::string name = argument.substr(0, equals);
  const CLI::Option* option = app.get_option_no_throw(name);
  if (option && option->get_items_expected_max() == 0)
    refuseValue(name, argument.substr(equals + 1), "no value; it is a flag");
}

void refuseRepeated(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    if (const std::size_t times = option->results().size();
        times > std::size_t(std::max(1, option->get_items_expected_max())))
      throw CLI::ValidationError(option->get_name(), fmt::format("is given {} times, allowed: once", times));
}

void refuseEmptyNames(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (!isFileType(option->get_type_name())) continue;
    for (const std::string& value : option->results())
      if (value.empty()) refuseValue(option->get_name(false, true), value, "the name of a file");
  }
}

}  // namespace

Command::Command(const Verb& of) : verb(of), app(of.summary, "nephele " + of.name) {
  app.footer((verb.notes.empty() ? "" : verb.notes + "\n") + "Example:\n  " + verb.example);
  app.set_help_flag("-h,--help", "Print the options of the first day and exit.");
  app.set_help_all_flag("--help-all", "Print all options and exit.");
  app.get_formatter()->column_width(34);
  // Collected, so that a suggestion can be made for each.
  app.allow_extras();
  bound = verb.bind(app);
  ownFrames_ = verb.passesOthersOn || app.get_option_no_throw("--frames") != nullptr;
  if (!ownFrames_) addSeveralCalls(app, options);
  addCommonOptions(app, options);
}

void Command::parse(std::vector<std::string> arguments) {
  for (const std::string& argument : arguments) refuseValueOfFlag(app, argument);
  std::reverse(arguments.begin(), arguments.end());
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ArgumentMismatch&) {
    refuseRepeated(app);
    throw;
  }
  refuseEmptyNames(app);
  if (verb.passesOthersOn) return;
  for (const std::string& extra : app.remaining()) {
    if (!extra.starts_with('-'))
      throw CLI::ParseError(fmt::format("'{}' is one argument too many", extra), CLI::ExitCodes::ExtrasError);
    const std::string meant = nearestName(extra.substr(0, extra.find('=')), optionNames(app));
    throw CLI::ParseError(fmt::format("unknown option '{}'{}", extra,
                                      meant.empty() ? "" : fmt::format("; did you mean '{}'?", meant)),
                          CLI::ExitCodes::ExtrasError);
  }
}

}  // namespace nephele::apps
