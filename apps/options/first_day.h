#pragma once

#include <CLI/App.hpp>
#include <string_view>
#include <vector>

namespace nephele::apps {

/// The options of a verb that one needs on the first day, in groups, with their dashes.
struct FirstDay {
  std::string_view verb, group;
  std::vector<std::string_view> options;
};
const std::vector<FirstDay>& firstDays();

/// Leaves only those options of a verb to be shown that one needs on the first day, some fifteen in groups.
/// Verbs with few options show all of theirs, but those that all verbs have.
/// Returns how many options there are in all.
int showFirstDay(CLI::App& app, std::string_view verb);

}  // namespace nephele::apps
