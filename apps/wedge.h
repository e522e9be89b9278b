#pragma once

#include <CLI/App.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace nephele::apps {

/// A command line that stands for one call for each value of an option, or for each pair of values of two:
/// --wedge OPTION=VALUES. Values are separated by commas, or by semicolons where they have commas themselves;
/// FIRST-LAST and FIRST-LASTxSTEP are numbers. With --frames it stands for a sequence for each of them.
class Wedge {
 public:
  /// Most calls that a wedge may stand for.
  static constexpr std::size_t kMost = 1000;

  /// Takes --wedge off `arguments` of a verb with the options of `app`; nothing where there is none.
  /// @throws CLI::ValidationError naming what is wrong: the option, its values, or how many they are.
  static std::optional<Wedge> taken(std::vector<std::string>& arguments, const CLI::App& app);

  std::size_t size() const;
  /// Refuses a sequence of so many `frames` for each value where there would be too many calls.
  /// @throws CLI::ValidationError
  void requireFew(std::size_t frames) const;
  /// Columns of a table of all calls, row by row; nothing for one option.
  std::optional<int> columns() const;
  /// What call `index` has in addition to the others. A flag that is off is there, as --flag=false, so that
  /// no file and no look sets it, until `named` takes it off.
  std::vector<std::string> arguments(std::size_t index) const;
  /// Options and their values: {"billow": "0.5"}
  std::map<std::string, std::string> values(std::size_t index) const;
  /// "seed 3, billow 0.5"
  std::string label(std::size_t index) const;
  /// `arguments` with names of outputs of its own: the number of the call, from 1, where there is a place for
  /// it, or else the values, as in cloud.billow_0.5.vdb. With --frames the place is for the frame, behind the
  /// values: cloud.billow_0.5.####.vdb.
  std::vector<std::string> named(std::vector<std::string> arguments, std::size_t index,
                                 const CLI::App& app) const;

 private:
  struct Axis {
    std::string option;
    std::vector<std::string> values;
    bool isFlag = false;
  };
  const std::string& valueOf(std::size_t axis, std::size_t index) const;
  std::string fileName(const std::string& path, std::size_t index, bool isSequence) const;

  std::vector<Axis> axes_;
};

}  // namespace nephele::apps
