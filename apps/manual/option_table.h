#pragma once

#include <string>
#include <vector>

#include "apps/app.h"

namespace nephele::apps {

/// An option of a verb, as help texts, man pages, completions and bindings show it.
struct OptionRow {
  /// Without dashes; of inputs what help calls them.
  std::string name;
  /// "-o", or "" where there is none.
  std::string shortName{};
  /// "FILE", "perlin|simplex|..."; "" of flags.
  std::string type{};
  /// "" where it has none.
  std::string standard{};
  std::string help{};
  std::string group{};
  bool isInput = false, isFlag = false, isOutput = false, isRequired = false;
  /// It may be given several times.
  bool repeats = false;
  /// Names of options that do not go with it, and of those that it goes with alone.
  std::vector<std::string> excludes{}, needs{};

  /// The words that it takes, if these are all.
  std::vector<std::string> choices() const;
  /// Whether its value is the name of a file or folder.
  bool isFile() const;
};

/// All options of `verb` but those that ask for help, in the order of --help-all.
std::vector<OptionRow> optionTable(const Verb& verb);

}  // namespace nephele::apps
