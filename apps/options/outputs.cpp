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
  bool isOutput, isTried;
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

std::vector<Given> givenOptions(CLI::App& app) {
  std::vector<Given> result;
  for (CLI::Option* option : app.get_options()) {
    const bool isTried = isMarked(*option, kOutput), isOutput = isTried || isMarked(*option, kTriedByVerb);
    const bool isNamed = option->get_type_name().starts_with("[NAME=]");
    const std::string name = option->get_name(false, true);
    for (const std::string& value : option->results()) {
      const std::string path = isNamed ? withoutName(value) : value;
      result.push_back({name, path, isOutput, isTried, fileOf(path)});
      if (!isOutput && withoutName(value) != value)
        result.push_back({name, value, false, false, fileOf(withoutName(value))});
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

void requireDistinctOutputs(CLI::App& app) {
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
  }
}

void tryOutputs(CLI::App& app) {
  for (const Given& given : givenOptions(app))
    if (given.isTried) const OutputFile trial(given.value);
}

}  // namespace nephele::apps
