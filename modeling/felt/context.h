#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/progress.h"

namespace nephele::felt {

/// Where a run ends that would not end by itself.
struct Limits {
  /// Statements that are carried out, loops and functions included.
  std::int64_t statements = 20'000'000;
  /// Calls of functions of the script that are under way at the same time.
  int calls = 200;
  /// Elements of an array, and characters of a string.
  std::int64_t elements = 1'000'000;
  /// Operations between a field and the points that it is asked at, along the longest way.
  int depth = 4000;
  /// Bytes of what one function samples or makes. Nothing: four fifths of what the process may use.
  std::optional<double> memoryBytes{};
};

/// What a script runs in.
struct Context {
  /// Where `print` puts its lines. Default: nowhere.
  std::function<void(const std::string&)> print{};
  /// Longest side of the box of the main shape, world units: what `2.5%` and `6x` refer to. Functions that
  /// read the first shape set it; without it such numbers are an error.
  std::optional<double> longestSide{};
  /// Files that were read: none of them is written.
  std::vector<std::string> filesRead{};
  Limits limits{};
  /// Is asked between statements whether to go on, and told by long functions how far they are.
  const Progress* progress = &silent();
};

}  // namespace nephele::felt
