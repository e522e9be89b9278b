#include "apps/felt/felt_scripts.h"

#include <fmt/format.h>

#include <iostream>
#include <iterator>
#include <sstream>

#include "apps/felt/explain.h"
#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele::apps {
namespace {

constexpr std::size_t kLongestScript = 1 << 24;

void say(const std::string& text) {
  std::fputs((text + "\n").c_str(), stderr);
}

void tellWarnings(const felt::Program& program, bool asJson) {
  for (const felt::Diagnostic& warning : program.warnings())
    say(asJson ? formattedAsJson(warning, program.sources()) : formatted(warning, program.sources()));
}

void tell(const felt::ScriptError& error, bool asJson) {
  if (asJson)
    std::fputs(error.json().c_str(), stderr);
  else
    say(error.what());
}

felt::Program checked(const ScriptText& script, const Run& run) {
  return felt::Program(script.name, script.text, feltFunctions(),
                       namesOfPlace(double(run.frame().value_or(0)), 0).given);
}

void describe(const felt::Named& named, Run& run) {
  nlohmann::json entry{{"name", named.name}, {"type", typeName(named.type)}};
  if (!named.type.isField())
    entry["value"] = shown(named.value, named.type);
  else if (named.operations > 0)
    entry["operations"] = named.operations;
  run.stats["variables"].push_back(std::move(entry));
}

}  // namespace

std::map<std::string, std::string> settingsOf(const std::vector<std::string>& texts,
                                              const felt::Program& program) {
  std::vector<std::string> names;
  for (const felt::ScriptParameter& parameter : program.parameters()) names.push_back(parameter.name);
  std::map<std::string, std::string> settings;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) refuseValue("--set", text, "NAME=VALUE");
    const std::string name = text.substr(0, equals);
    if (std::ranges::count(names, name) == 0) {
      const std::string near = nearestName(name, names);
      throw CLI::ValidationError(
          "--set", fmt::format("{} has no parameter '{}'{}", program.sources()[0].name(), name,
                               !near.empty()   ? fmt::format("; did you mean '{}'?", near)
                               : names.empty() ? "; it declares none"
                                               : fmt::format("; it has {}", fmt::join(names, ", "))));
    }
    settings[name] = text.substr(equals + 1);
  }
  return settings;
}

ScriptText readScript(const std::string& path) {
  return path == "-" ? ScriptText{"standard input", readTextFile("/dev/stdin", kLongestScript)}
                     : ScriptText{path, readTextFile(path, kLongestScript)};
}

felt::Context feltContext(const felt::Limits& limits, const Run& run) {
  const auto print = [&run](const std::string& text) {
    std::istringstream lines(text);
    std::string line;
    if (text.empty()) run.result(line);
    while (std::getline(lines, line)) run.result(line);
  };
  felt::Context context{.print = print, .limits = limits, .progress = &run};
  context.limits.memoryBytes = run.memoryLimitBytes;
  return context;
}

void runScript(const FeltArguments& arguments, Run& run) {
  try {
    const felt::Program program = checked(readScript(arguments.script()), run);
    tellWarnings(program, arguments.json);
    const felt::RunOptions options{.settings = settingsOf(arguments.settings, program),
                                   .countsOperations = arguments.explain};
    felt::Context context = feltContext(arguments.limits(), run);
    run.begin("run");
    const std::vector<felt::Named> variables = program.run(context, options);
    run.stats["variables"] = nlohmann::json::array();
    for (const felt::Named& named : variables) describe(named, run);
    if (arguments.explain) explain(program, variables, run);
  } catch (const felt::ScriptError& error) {
    tell(error, arguments.json);
    throw AlreadyTold{error.isOfScript() ? kUsage : kFailed};
  }
}

void checkScripts(const FeltArguments& arguments, Run& run) {
  if (arguments.words.empty()) throw CLI::RequiredError("a script");
  bool isGood = true;
  std::vector<std::string> unread;
  for (const std::string& path : arguments.words) {
    run.begin("check");
    try {
      tellWarnings(checked(readScript(path), run), arguments.json);
    } catch (const felt::ScriptError& error) {
      tell(error, arguments.json);
      isGood = false;
    } catch (const Error& error) {
      unread.emplace_back(error.what());
    }
  }
  if (!unread.empty()) throw SeveralErrors(std::move(unread));
  if (!isGood) throw AlreadyTold{kUsage};
}

void formatScripts(const FeltArguments& arguments, Run& run) {
  if (arguments.words.empty()) throw CLI::RequiredError("a script");
  bool isFormatted = true, isBroken = false;
  for (const std::string& path : arguments.words) {
    run.begin("format");
    const ScriptText script = readScript(path);
    try {
      const std::string text = felt::formattedScript(script.name, script.text);
      if (arguments.onlyChecks && text != script.text) {
        say(script.name + ": is not formatted");
        isFormatted = false;
      } else if (arguments.onlyChecks || (path != "-" && !arguments.toOutput && text == script.text)) {
        continue;
      } else if (arguments.toOutput || path == "-") {
        std::cout << text;
      } else {
        OutputFile output(path);
        OutputStream stream(output);
        stream.write(text);
        stream.close();
        output.commit();
        run.result(path + ": formatted");
      }
    } catch (const felt::ScriptError& error) {
      tell(error, false);
      isBroken = true;
    }
  }
  if (isBroken) throw AlreadyTold{kUsage};
  if (!isFormatted) throw AlreadyTold{kFailed};
}

}  // namespace nephele::apps
