#include "apps/looks.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <string_view>
#include <utility>

#include "apps/options/options.h"
#include "nephele/modeling/base/nearest_name.h"

namespace nephele::apps {

namespace {

// Written by CMake from data/looks.
constexpr std::pair<std::string_view, std::string_view> kLooks[] = {
#include "apps/look_texts.inc"
};

}  // namespace

std::vector<std::string> lookNames() {
  std::vector<std::string> names;
  for (const auto& [name, text] : kLooks) names.emplace_back(name);
  return names;
}

std::string lookText(const std::string& name) {
  for (const auto& [known, text] : kLooks)
    if (known == name) return std::string(text);
  const std::string meant = nearestName(name, lookNames());
  throw CLI::ValidationError("--look",
                             fmt::format("there is no look '{}'{}; there are: {}", name,
                                         meant.empty() ? "" : fmt::format(", did you mean '{}'?", meant),
                                         fmt::join(lookNames(), ", ")));
}

}  // namespace nephele::apps
