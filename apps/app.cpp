#include "apps/app.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <iostream>
#include <new>
#include <set>
#include <span>

#include "apps/detail/call_sheet.h"
#include "apps/detail/command.h"
#include "apps/detail/several_calls.h"
#include "apps/detail/typed_line.h"
#include "apps/manual/man_page.h"
#include "apps/options/config_file.h"
#include "apps/options/first_day.h"
#include "apps/options/old_names.h"
#include "apps/sequence.h"
#include "apps/wedge.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/base/parallel.h"
#include "nephele/modeling/base/printable.h"
#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::apps {
namespace {

std::string commandLineOf(int argc, char** argv) {
  return "nephele " + typedLine(std::vector<std::string>(argv + 1, argv + argc));
}

void writeStatistics(const std::string& path, const nlohmann::json& statistics) {
  OutputFile output(path);
  OutputStream stream(output);
  // Names may be in any encoding, but JSON is UTF-8.
  stream.write(statistics.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + '\n');
  stream.close();
  output.commit();
}

/// One line: what names of files and of what is in them hold beside letters does not reach the terminal.
void printError(const std::string& who, std::string_view what) {
  std::cerr << who << ": error: " << printable(what) << '\n';
}

int usageError(const std::string& who, const std::string& what) {
  printError(who, what);
  std::cerr << "Try '" << who << " --help'.\n";
  return kUsage;
}

int runWork(const std::string& who, ProgramRun& run, const CommonOptions& options,
            const std::function<void()>& work) {
  const auto tellStatistics = [&] {
    if (!options.stats.empty()) writeStatistics(options.stats, run.statistics());
  };
  try {
    try {
      work();
    } catch (const SeveralErrors&) {
      // They are of some of the files; what is in the others is known.
      run.endStages();
      tellStatistics();
      throw;
    } catch (...) {
      run.endStages();
      throw;
    }
    run.finish();
    tellStatistics();
    require(std::cout.flush().good() && std::fflush(stdout) == 0, "the standard output could not be written");
    return 0;
  } catch (const Cancelled&) {
    std::cerr << who << ": stopped; no partial output was left\n";
    return stopSignal() != 0 ? 128 + stopSignal() : kFailed;
  } catch (const CLI::Error& error) {
    return usageError(who, error.what());
  } catch (const std::bad_alloc&) {
    std::cerr << who << ": error: out of memory; lower --memory-limit or the resolution\n";
  } catch (const AlreadyTold& told) {
    return told.exitCode;
  } catch (const felt::ScriptError& error) {
    std::cerr << error.what() << '\n';
    return error.isOfScript() ? kUsage : kFailed;
  } catch (const SeveralErrors& errors) {
    for (const std::string& message : errors.messages()) printError(who, message);
  } catch (const std::exception& error) {
    printError(who, error.what());
  }
  return kFailed;
}

/// After "--" all arguments are files, also where they begin with a dash.
std::vector<std::string> withFilesAfterDashes(std::vector<std::string> arguments) {
  const auto mark = std::find(arguments.begin(), arguments.end(), "--");
  if (mark == arguments.end()) return arguments;
  for (auto file = mark + 1; file != arguments.end(); ++file)
    if (file->starts_with('-')) file->insert(0, "./");
  arguments.erase(mark);
  return arguments;
}

std::vector<std::string> namesOf(const std::vector<Verb>& verbs) {
  std::vector<std::string> names;
  for (const Verb& verb : verbs) names.push_back(verb.name);
  return names;
}

bool given(const CLI::App& app, const char* name) {
  const CLI::Option* option = app.get_option_no_throw(name);
  return option && option->count() > 0;
}

/// What a command line stands for: its arguments, and the calls that it makes of them.
struct Line {
  std::vector<std::string> arguments;
  /// Those that were typed, without what files and looks set.
  std::vector<std::string> typed{};
  /// One for each value of the wedge, or one.
  std::vector<Sequence> sequences{};
  std::optional<Wedge> wedge{};
  SeveralCalls calls{};
  /// Those that came from files and looks, as they would be typed.
  std::string configOptions{};

  bool isSequence() const { return !sequences.empty(); }
  bool isSeveral() const { return isSequence() || wedge; }
  std::vector<std::string> first() const { return isSeveral() ? calls.at(0).arguments : arguments; }
};

/// Options that a file or a look sets come behind those of `typed`.
using WithSettings = std::function<std::vector<std::string>(std::vector<std::string> typed)>;

/// The calls of a wedge, each with `argumentsOf` it.
SeveralCalls callsOf(const Wedge& wedge, std::function<std::vector<std::string>(std::size_t)> argumentsOf) {
  SeveralCalls calls;
  calls.count = wedge.size();
  calls.list = "wedge";
  calls.word = "calls";
  for (std::size_t i = 0; i != calls.count; ++i) calls.made.push_back(i);
  calls.at = [=](std::size_t i) {
    return Call{wedge.label(i), {}, {{"values", wedge.values(i)}}, argumentsOf(i)};
  };
  return calls;
}

/// Every sequence one after the other, of a wedge if there is one.
SeveralCalls callsOf(const std::vector<Sequence>& sequences, const std::optional<Wedge>& wedge) {
  const std::size_t frames = sequences.front().size();
  SeveralCalls calls;
  calls.count = sequences.size() * frames;
  calls.list = wedge ? "wedge" : "frames";
  calls.word = "frames";
  calls.perRange = frames;
  for (std::size_t i = 0; i != sequences.size(); ++i)
    for (const std::size_t frame : sequences[i].made()) calls.made.push_back(i * frames + frame);
  calls.at = [=](std::size_t i) {
    Call call = sequences[i / frames].call(i % frames);
    if (!wedge) return call;
    call.name = wedge->label(i / frames) + ", " + call.name;
    call.values["values"] = wedge->values(i / frames);
    return call;
  };
  return calls;
}

Line lineOf(const Command& command, std::vector<std::string> typed, const WithSettings& withSettings) {
  Line line;
  if (command.hasOwnFrames()) {
    line.arguments = withSettings(std::move(typed));
    return line;
  }
  // A wedge that a file sets is one that was typed.
  const auto isWedge = [](const std::string& argument) { return argument.starts_with("--wedge="); };
  std::vector<std::string> withFile = withSettings(typed);
  std::copy_if(withFile.begin() + std::ptrdiff_t(typed.size()), withFile.end(), std::back_inserter(typed),
               isWedge);
  line.wedge = Wedge::taken(typed, command.app);
  const auto settled = [=](std::vector<std::string> own) {
    own = withSettings(std::move(own));
    std::erase_if(own, isWedge);
    return own;
  };
  line.arguments = settled(typed);
  const bool hasSheet = givenTo("--contact-sheet", line.arguments).has_value();
  const auto withSheet = [=, &command](std::vector<std::string> arguments) {
    return hasSheet ? withPreview(std::move(arguments), command.app) : arguments;
  };
  const auto ofValue = [=, &command, wedge = line.wedge](std::size_t i) {
    std::vector<std::string> own = wedge->arguments(i);
    own.insert(own.begin(), typed.begin(), typed.end());
    return wedge->named(withSheet(settled(std::move(own))), i, command.app);
  };
  if (givenTo("--frames", line.arguments)) {
    if (!line.wedge) line.sequences.push_back(*Sequence::of(withSheet(line.arguments)));
    for (std::size_t i = 0; line.wedge && i != line.wedge->size(); ++i) {
      line.sequences.push_back(*Sequence::of(ofValue(i)));
      line.wedge->requireFew(line.sequences.front().size());
    }
    line.calls = callsOf(line.sequences, line.wedge);
  } else if (line.wedge) {
    line.calls = callsOf(*line.wedge, ofValue);
    // Densities that differ would be hidden by extinctions that suit each of them.
    line.calls.variesInputs = command.app.get_option_no_throw("--extinction") != nullptr;
  }
  return line;
}

void checkCalls(const Command& command, Line& line, const Run& run) {
  std::set<std::string> outputs, inputs;
  const std::size_t frames = line.isSequence() ? line.sequences.front().size() : 1;
  for (std::size_t i = 0; i < line.calls.count; i += frames) {
    run.check();
    Command own(command.verb);
    own.parse(line.calls.at(i).arguments);
    requireDistinctOutputs(own.app, outputs);
    if (!command.options.contactSheet.empty()) requireSeen(own.app, command.app);
    if (line.isSequence()) {
      const Sequence& sequence = line.sequences[i / frames];
      sequence.check(own.app, inputs, run);
      // Calls of other frames take too long to be read.
      for (const auto& [option, path] : sequence.outputs(own.app))
        for (std::size_t frame = 1; frame < frames; ++frame) requireOwnFile(option, path(frame), outputs);
      line.calls.variesInputs = line.calls.variesInputs || sequence.variesInputs(own.app);
    }
    tryOutputs(own.app);
  }
}

/// Looks before the work whether it can be done, with the options of all calls; whether files are there and
/// can be written, with those of the first of every sequence, or of every value.
void check(Command& command, Line& line, const Run& run) {
  if (!line.isSequence() && !command.verb.passesOthersOn) refuseFrameNames(command.app);
  if (line.isSeveral()) {
    checkCalls(command, line, run);
  } else {
    std::set<std::string> outputs;
    requireDistinctOutputs(command.app, outputs);
    tryOutputs(command.app);
  }
  for (const char* option : {"--only", "--shard", "--skip-existing", "--contact-sheet"}) {
    const bool isOfFrames = option == std::string_view("--only") || option == std::string_view("--shard");
    if (!command.hasOwnFrames() && given(command.app, option) &&
        !(isOfFrames ? line.isSequence() : line.isSeveral()))
      throw CLI::ValidationError(option, isOfFrames ? "is for sequences; give --frames"
                                                    : "is for several calls; give --frames or --wedge");
  }
}

/// What the contact sheet shows: all, or of the sequence of every value of a wedge the frame in its middle.
std::vector<MadeCall> shownOf(const Line& line, std::vector<MadeCall> made) {
  if (!line.wedge || !line.isSequence()) return made;
  std::vector<MadeCall> shown;
  const std::size_t frames = made.size() / line.sequences.size();
  for (std::size_t i = 0; frames > 0 && i != line.sequences.size(); ++i) {
    shown.push_back(std::move(made[i * frames + frames / 2]));
    shown.back().name = line.wedge->label(i);
  }
  return shown;
}

void carryOut(Command& command, Line& line, const std::vector<Verb>& verbs, ProgramRun& run) {
  check(command, line, run);
  const CancelScope scope(&run);
  if (!line.isSeveral()) return command.bound.body(run);
  const CommonOptions& options = command.options;
  line.calls.skipExisting = options.skipExisting;
  std::vector<MadeCall> made = makeCalls(command.verb, line.calls, run);
  if (options.contactSheet.empty()) return;
  writeCallSheet(options.contactSheet, shownOf(line, std::move(made)),
                 line.wedge ? line.wedge->columns() : std::nullopt,
                 *std::ranges::find(verbs, "render", &Verb::name), run);
}

/// What the command line asks for.
void work(Command& command, Line& line, const std::vector<Verb>& verbs, ProgramRun& run) {
  try {
    carryOut(command, line, verbs, run);
  } catch (const std::exception& error) {
    if (command.verb.passesOthersOn) throw;
    const std::vector<std::string> names = namesOf(verbs);
    if (const auto shown = shownInConfigFile({command.app, command.verb.name, names}, line.typed, error))
      throw *shown;
    throw;
  }
}

/// Programs may give texts that no shell can, at which messages and names of files would end.
void refuseBytesOfZero(const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments)
    if (argument.find('\0') != std::string::npos)
      throw CLI::ValidationError(
          fmt::format("{} has a byte of zero in it, which no argument may", nephele::quoted(argument)));
}

/// What `arguments` stand for; `command` has read those of its first call.
Line parsedLine(Command& command, const std::vector<Verb>& verbs, std::vector<std::string> arguments,
                const std::function<void(const std::string&)>& note) {
  refuseBytesOfZero(arguments);
  const std::string& name = command.verb.name;
  const std::vector<std::string> names = namesOf(verbs);
  // Calls of a line are made of it when this function is over.
  const auto withSettings = [&command, &name, names](std::vector<std::string> typed) {
    if (command.verb.passesOthersOn) return typed;
    return withConfigFile({command.app, name, names}, std::move(typed));
  };
  arguments = withCurrentNames(name, withFilesAfterDashes(std::move(arguments)), note);
  Line line = lineOf(command, arguments, withSettings);
  line.typed = arguments;
  const std::vector<std::string> settings = withSettings(arguments);
  line.configOptions = typedLine(std::span(settings).subspan(arguments.size()));
  try {
    command.parse(line.first());
  } catch (const CLI::Success&) {
    throw;
  } catch (const std::exception&) {
    Command fresh(command.verb);
    if (!command.verb.passesOthersOn) checkConfigFile({fresh.app, name, names}, arguments, fresh.app);
    throw;
  }
  return line;
}

/// Works on as many threads as the options say.
template <class Work>
auto withThreads(const CommonOptions& options, const Work& work) {
  using tbb::global_control;
  constexpr auto kMost = global_control::max_allowed_parallelism;
  const global_control limit(
      kMost, options.threads > 0 ? std::size_t(options.threads) : global_control::active_value(kMost));
  return work();
}

int runVerb(const Verb& verb, const std::vector<Verb>& verbs, std::vector<std::string> arguments,
            const std::string& commandLine) {
  Command command(verb);
  const CommonOptions& options = command.options;
  const std::string who = "nephele " + verb.name;
  try {
    const auto note = [&](const std::string& sentence) {
      std::fputs((who + ": " + sentence + "\n").c_str(), stderr);
    };
    Line line = parsedLine(command, verbs, std::move(arguments), note);
    ProgramRun run(verb.name, options);
    run.commandLine = commandLine;
    run.configOptions = line.configOptions;
    return withThreads(options,
                       [&] { return runWork(who, run, options, [&] { work(command, line, verbs, run); }); });
  } catch (const CLI::CallForAllHelp&) {
    std::cout << command.app.help();
    return 0;
  } catch (const CLI::CallForHelp&) {
    const int count = showFirstDay(command.app, verb.name);
    command.app.footer("'nephele " + verb.name + " --help-all' shows all " + std::to_string(count) +
                       " options.\n" + command.app.get_footer());
    std::cout << command.app.help();
    return 0;
  } catch (const CLI::ParseError& error) {
    return usageError(who, error.what());
  } catch (const felt::ScriptError& error) {
    std::cerr << error.what() << '\n';
    return kUsage;
  }
}

int unknownVerb(const std::string& word, const std::vector<Verb>& verbs) {
  const std::string meant = nearestName(word, namesOf(verbs));
  return usageError("nephele", fmt::format("unknown verb '{}'{}", word,
                                           meant.empty() ? "" : fmt::format("; did you mean '{}'?", meant)));
}

/// A man page, or what a shell completes by.
int printManual(const std::string& kind, const std::string& name) try {
  std::cout << (kind == "--man" ? manPage(name) : completionsFor(name));
  return 0;
} catch (const Error& error) {
  return usageError("nephele", error.what());
}

std::string overview(const std::vector<Verb>& verbs) {
  std::string text = "Nephele: clouds and level sets.\nUsage: nephele VERB [OPTIONS]\n\nVerbs:\n";
  for (const Verb& verb : verbs) text += fmt::format("  {:<10} {}\n", verb.name, verb.summary);
  return text +
         "\n'nephele help VERB' explains a verb; 'nephele --version' prints the version.\n"
         "'nephele help --man VERB' is its man page; 'nephele help --completion bash|zsh|fish' completes "
         "words.\n";
}

}  // namespace

std::vector<Verb> allVerbs() {
  return {levelsetVerb(),  cloudVerb(),  advectVerb(),    wispsVerb(), meshVerb(), cutVerb(), transferVerb(),
          transformVerb(), renderVerb(), turntableVerb(), infoVerb(),  feltVerb(), lookVerb()};
}

nlohmann::json callVerb(const std::string& name, std::vector<std::string> arguments, const MakeRun& makeRun) {
  const std::vector<Verb> verbs = allVerbs();
  const auto verb = std::ranges::find(verbs, name, &Verb::name);
  require(verb != verbs.end(), "there is no verb '" + name + "'");
  Command command(*verb);
  const std::string commandLine = "nephele " + name + " " + typedLine(arguments);
  Line line = parsedLine(command, verbs, std::move(arguments), [](const std::string&) {});
  const std::unique_ptr<ProgramRun> run = makeRun(name, command.options);
  run->commandLine = commandLine;
  run->configOptions = line.configOptions;
  withThreads(command.options, [&] { work(command, line, verbs, *run); });
  run->finish();
  if (!command.options.stats.empty()) writeStatistics(command.options.stats, run->statistics());
  return run->statistics();
}

int runProgram(int argc, char** argv, const std::vector<Verb>& verbs) {
  installSignalHandlers();
  const std::string word = argc > 1 ? argv[1] : "--help";
  if (word == "help" && argc > 2) {
    const std::string asked = argv[2];
    if (asked == "--man" || asked == "--completion") return printManual(asked, argc > 3 ? argv[3] : "");
    for (const Verb& verb : verbs)
      if (verb.name == asked) return runVerb(verb, verbs, {"--help"}, commandLineOf(argc, argv));
    return unknownVerb(asked, verbs);
  }
  if (word == "--help" || word == "-h" || word == "help") {
    std::cout << overview(verbs);
    return argc > 1 ? 0 : kUsage;
  }
  if (word == "--version") {
    std::cout << "nephele " << NEPHELE_VERSION << '\n';
    return 0;
  }
  for (const Verb& verb : verbs)
    if (verb.name == word)
      return runVerb(verb, verbs, std::vector<std::string>(argv + 2, argv + argc), commandLineOf(argc, argv));
  return unknownVerb(word, verbs);
}

}  // namespace nephele::apps
