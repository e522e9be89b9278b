#pragma once

#include <CLI/App.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/options/options.h"
#include "apps/options/toml_text.h"

namespace nephele::apps {

/// What the numbers of a parameter are and which are allowed.
struct Quantity {
  enum class Unit {
    number,
    length,    ///< World units ("0.3"), or percent of the longest side ("5%").
    frequency  ///< Cycles per world unit ("2.5"), or per longest side ("6x").
  };
  Unit unit = Unit::number;
  /// Of the number as typed.
  double low = 0, high = 1e30;
  bool lowIsAllowed = true;

  /// "a number from 0 to 100", for messages.
  std::string allowed() const;
  /// "LENGTH", for help.
  std::string word() const;
};

/// A number as typed, with or without the unit that makes it relative to the longest side.
struct Amount {
  double value = 0;
  bool isRelative = false;

  /// In world units, cycles per world unit, or as it is.
  double inWorldUnits(Quantity::Unit unit, double longestSide) const;
};

/// A parameter as typed: one value, or one that varies in space. docs/cloud.md describes the forms.
struct FieldValue {
  Quantity quantity{};
  /// What it was given to ("--amplitude", "cloud.toml:7: amplitude") and the value as typed, for messages.
  std::string option{}, text{};
  /// The same in Felt, of which all other forms are short for something.
  std::string expression{};
  /// Where it is the same everywhere.
  std::optional<Amount> constant{};
  /// Whether it was typed as an expression, so that what it may be shows only when it is made.
  bool isTypedAsExpression = false;
  /// Files that it may read.
  std::vector<std::string> files{};
  /// Where it stands, if it is of a file.
  std::shared_ptr<const TomlText> place{};
};

/// Reads `text`, the value given to `option`. @throws CLI::ValidationError naming the option, the text and
/// what is allowed in place of the part that does not fit; felt::ScriptError with the faults of an
/// expression.
FieldValue parseFieldValue(const std::string& option, const std::string& text, const Quantity& quantity);

/// A parameter that may vary; the target's value at the call is the default that --help shows.
CLI::Option* addFieldValue(CLI::App& app, const std::string& name, FieldValue& target,
                           const std::string& description);

/// The forms of a value that varies, for --help.
std::string fieldValueHelp();

}  // namespace nephele::apps
