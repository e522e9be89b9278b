#include "apps/options/outputs.h"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "apps/options/options.h"
#include "nephele/levelset/io/output_file.h"

namespace nephele::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kOutput = "output";
constexpr const char* kTriedByVerb = "output tried by the verb";

bool isMarked(const CLI::Option& option, const char* mark) try {
  // CLI11 asks for an option that could be changed.
  return const_cast<CLI::Option&>(option).get_validator(mark) != nullptr;
} catch (const CLI::OptionNotFound&) {
  return false;
}

/// What is given for an option.
struct Given {
  std::string option, value;
  bool isOutput, isOfCall, isTried;
  /// Where it leads; empty where no file can be meant.
  fs::path file;
};

fs::path fileOf(const std::string& path) {
  std::error_code error;
  if (path.empty() || isStream(path)) return {};
  fs::path file = fs::weakly_canonical(fs::absolute(outputTarget(path), error), error);
  if (error) return {};
  return file.has_filename() ? file : file.parent_path();
}

std::string withoutName(const std::string& value) {
  return value.substr(value.find('=') + 1);
}

std::vector<Given> givenOptions(const CLI::App& app) {
  std::vector<Given> result;
  for (const CLI::Option* option : app.get_options()) {
    const bool isOfCall = isOutputOfCall(*option), isTried = isMarked(*option, kOutput);
    const std::string name = option->get_name(false, true);
    for (const std::string& value : option->results()) {
      const std::string path(pathOf(*option, value));
      result.push_back({name, path, isOutput(*option), isOfCall, isTried, fileOf(path)});
      if (!isOutput(*option) && withoutName(value) != value)
        result.push_back({name, value, false, false, false, fileOf(withoutName(value))});
    }
  }
  return result;
}

}  // namespace

CLI::Option* markOutput(CLI::Option* option, OutputTrial trial) {
  return option->check(CLI::Validator([](std::string&) { return std::string(); }, std::string(),
                                      trial == OutputTrial::program ? kOutput : kTriedByVerb));
}

bool isOutput(const CLI::Option& option) {
  return isMarked(option, kOutput) || isMarked(option, kTriedByVerb);
}

bool isOutputOfCall(const CLI::Option& option) {
  return isOutput(option) && !option.check_lname("stats") && !option.check_lname("contact-sheet");
}

std::string_view pathOf(const CLI::Option& option, std::string_view value) {
  return option.get_type_name().starts_with("[NAME=]") ? value.substr(value.find('=') + 1) : value;
}

std::string givenValue(const CLI::App& app, const std::string& option) {
  const CLI::Option* found = app.get_option_no_throw(option);
  return found && found->count() > 0 ? found->results().front() : "";
}

std::vector<std::string> outputsOf(const CLI::App& app) {
  std::vector<std::string> paths;
  for (const Given& given : givenOptions(app))
    if (given.isOfCall && !given.file.empty()) paths.push_back(given.value);
  return paths;
}

void requireOwnFile(const std::string& option, const std::string& path, std::set<std::string>& known) {
  const fs::path file = fileOf(path);
  if (!file.empty() && !known.insert(file.string()).second)
    refuseValue(option, path, "a file that no other of the calls writes");
}

void requireDistinctOutputs(const CLI::App& app, std::set<std::string>& known) {
  const std::vector<Given> given = givenOptions(app);
  for (std::size_t i = 0; i != given.size(); ++i) {
    const Given& output = given[i];
    if (!output.isOutput || output.file.empty()) continue;
    for (std::size_t k = 0; k != given.size(); ++k) {
      const Given& other = given[k];
      if (k == i || other.file != output.file || (other.isOutput && k > i)) continue;
      if (!other.isOutput && output.option == "-o,--output") continue;
      const bool isLater = output.option == "-o,--output";
      refuseValue(isLater ? other.option : output.option, output.value,
                  "another file than that of " + (isLater ? output.option : other.option));
    }
    if (output.isOfCall)
      requireOwnFile(output.option, output.value, known);
    else
      known.insert(output.file.string());
  }
}

void tryOutputs(const CLI::App& app) {
  for (const Given& given : givenOptions(app))
    if (given.isTried) const OutputFile trial(given.value);
}

}  // namespace nephele::apps
