#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "apps/options/options.h"

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
  enum class Source {
    constant,
    along,      ///< A ramp along `direction` over the box of the shape; "height" is one along y.
    facing,     ///< A ramp over the cosine between the surface's normal and `direction`.
    mask,       ///< A ramp over a grid.
    attribute,  ///< A ramp over a vertex attribute of the mesh.
    noise       ///< A ramp over smooth noise, see FieldSources.
  };
  struct Stop {
    double at = 0;
    Amount amount;
  };

  Source source = Source::constant;
  Quantity quantity{};
  /// What it was given to ("--amplitude", "cloud.toml:7: amplitude") and the value as typed, for messages.
  std::string option{}, text{};
  /// One for a constant; else in rising order.
  std::vector<Stop> stops{};
  Vec3f direction{0, 1, 0};
  /// Of a mask: the file, and the name of the grid or "" for the first that fits.
  std::string path{}, grid{};
  /// Of an attribute.
  std::string attribute{};
  bool hasSpheres = false;
  /// Of noise.
  Amount frequency{};
  int octaves = 3;
  /// Numbers that multiply it.
  std::vector<FieldValue> factors{};

  bool isConstant() const { return source == Source::constant && factors.empty(); }
  /// The largest of its values on a shape with this longest side, or more where there are factors.
  Amount largest(double longestSide) const;
  double largestInWorldUnits(double longestSide) const {
    return largest(longestSide).inWorldUnits(quantity.unit, longestSide);
  }
};

/// Reads `text`, the value given to `option`. @throws CLI::ValidationError naming the option, the text and
/// what is allowed in place of the part that does not fit.
FieldValue parseFieldValue(const std::string& option, const std::string& text, const Quantity& quantity);

/// A parameter that may vary; the target's value at the call is the default that --help shows.
CLI::Option* addFieldValue(CLI::App& app, const std::string& name, FieldValue& target,
                           const std::string& description);

/// The forms of a value that varies, for --help.
std::string fieldValueHelp();

}  // namespace nephele::apps
