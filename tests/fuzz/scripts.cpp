// Scripts: checked, formatted twice, and run with small limits where nothing in them may take long.
#include <string>

#include "nephele/levelset/felt/grid_functions.h"
#include "nephele/modeling/felt/program.h"
#include "nephele/modeling/field/space.h"
#include "nephele/render/felt/render_functions.h"
#include "tests/fuzz/formats.h"
#include "tests/fuzz/harness.h"

namespace nephele::fuzz {
namespace {

using felt::Registry;

/// For checking: all that a script may call, files too.
const Registry& allFunctions() {
  static const Registry* const registry = [] {
    auto* made = new Registry;
    felt::addModelingFunctions(*made);
    felt::addLevelsetFunctions(*made);
    felt::addRenderFunctions(*made);
    return made;
  }();
  return *registry;
}

/// For running: what builds expressions and reads or writes nothing.
const Registry& pureFunctions() {
  static const Registry* const registry = [] {
    auto* made = new Registry;
    felt::addModelingFunctions(*made);
    return made;
  }();
  return *registry;
}

/// What a field's expression may speak of.
const std::vector<felt::Given>& given() {
  static const std::vector<felt::Given> place{{"P", {felt::Kind::vectorField}, identity()}};
  return place;
}

bool formatsAlike(const std::string& text) {
  const std::string once = felt::formattedScript("script", text);
  return felt::formattedScript("script", once) == once;
}

void run(const std::string& text) {
  felt::Context context;
  context.longestSide = 2;
  context.limits.statements = 2000;
  context.limits.calls = 20;
  context.limits.elements = 1000;
  context.limits.depth = 40;
  std::size_t printed = 0;
  context.print = [&](const std::string& line) { printed += line.size(); };
  const felt::Program program("script", text, pureFunctions(), given());
  for (const felt::Diagnostic& warning : program.warnings()) felt::formatted(warning, program.sources());
  program.run(context);
}

}  // namespace

bool useScript(const Input& input) {
  const std::string text(input.bytes);
  try {
    expect(formatsAlike(text), "formatting again changes something");
  } catch (const felt::ScriptError&) {
  }
  // There are no files beside the script that it could import.
  if (text.find("import") != std::string::npos) return true;
  bool isScript = true;
  try {
    const felt::Program program("script", text, allFunctions(), given());
  } catch (const felt::ScriptError& error) {
    expect(!error.diagnostics().empty() && !error.json().empty(), "a script is refused without a fault");
    isScript = false;
    lastError() = error.what();
  }
  // Layers on layers take longer with each of them, and tiles of noise take a tenth of a second.
  for (const char* slow : {"eval", "fft"})
    if (text.find(slow) != std::string::npos) return isScript;
  try {
    run(text);
  } catch (const felt::ScriptError&) {
  }
  return isScript;
}

}  // namespace nephele::fuzz
