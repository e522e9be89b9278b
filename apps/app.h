#pragma once

#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "apps/options/options.h"
#include "apps/run.h"

namespace nephele::apps {

/// What a verb does with the options that were bound to one command line.
struct BoundVerb {
  std::function<void(Run&)> body;
  /// How large the input is, for sequences; null where nothing is chosen by that.
  std::function<Extent(Run&)> measure{};
};

/// One verb of the program.
struct Verb {
  std::string name;
  std::string summary;
  /// One worked command line, shown by --help.
  std::string example;
  /// Declares the verb's options, bound to variables that what it returns works on.
  std::function<BoundVerb(CLI::App&)> bind;
  /// What --help says between the options and the example.
  std::string notes{};
  /// What is no option of it is not refused but left for the verb to read, and so are files of options.
  bool passesOthersOn = false;
};

/// A verb whose body, and what measures its input, work on the options that were bound.
template <class Options>
Verb verbOf(std::string name, std::string summary, std::string example, void (*bind)(CLI::App&, Options&),
            void (*body)(const Options&, Run&), std::string notes = {},
            std::type_identity_t<std::function<Extent(const Options&, Run&)>> measure = {}) {
  const auto bound = [=](CLI::App& app) {
    const auto options = std::make_shared<Options>();
    bind(app, *options);
    BoundVerb verb{[=](Run& run) { body(*options, run); }};
    if (measure) verb.measure = [=](Run& run) { return measure(*options, run); };
    return verb;
  };
  return {std::move(name), std::move(summary), std::move(example), bound, std::move(notes)};
}

Verb levelsetVerb();
Verb cloudVerb();
Verb advectVerb();
Verb wispsVerb();
Verb meshVerb();
Verb cutVerb();
Verb transferVerb();
Verb transformVerb();
Verb renderVerb();
Verb turntableVerb();
Verb infoVerb();
Verb feltVerb();
Verb lookVerb();

/// Every verb, in the order of the overview.
std::vector<Verb> allVerbs();

class ProgramRun;
struct CommonOptions;
/// Makes what a verb, by its name, is run with.
using MakeRun = std::function<std::unique_ptr<ProgramRun>(const std::string& verb, const CommonOptions&)>;

/// Does what the program does for these arguments of a verb, and returns the statistics; nothing is printed
/// but by the run. @throws CLI::Error and felt::ScriptError for arguments that cannot be used, Error,
/// Cancelled.
nlohmann::json callVerb(const std::string& name, std::vector<std::string> arguments, const MakeRun& makeRun);

/// Parses the command line, runs one verb, and returns the exit code: 0 success, 1 failed, 2 usage, 128 +
/// signal where a signal stopped it.
int runProgram(int argc, char** argv, const std::vector<Verb>& verbs);

}  // namespace nephele::apps
