#include "apps/options/old_names.h"

#include <fmt/format.h>

#include <set>

namespace nephele::apps {
namespace {

struct OldName {
  /// "" for all verbs.
  std::string_view verb, old, current;
  /// The old option is still there, since it may be given beside the new one.
  bool isKept = false;
};

constexpr OldName kOldNames[] = {
    {"", "--object-colour", "--object-color"}, {"", "--ground-colour", "--ground-color"},
    {"", "--spp", "--samples", true},          {"", "--through-centre", "--through-center"},
    {"wisps", "--size", "--wisp-size"},        {"wisps", "--size-variation", "--wisp-size-variation"},
};

const OldName* find(std::string_view verb, std::string_view name) {
  for (const OldName& entry : kOldNames)
    if (entry.old == name && (entry.verb.empty() || entry.verb == verb)) return &entry;
  return nullptr;
}

bool isNegativeNumber(std::string_view text) {
  const auto isDigit = [&](std::size_t i) { return text.size() > i && text[i] >= '0' && text[i] <= '9'; };
  return text.starts_with('-') && (isDigit(1) || (text.substr(1).starts_with('.') && isDigit(2)));
}

}  // namespace

std::string currentName(std::string_view verb, const std::string& name) {
  const OldName* entry = find(verb, name);
  return entry && !entry->isKept ? std::string(entry->current) : name;
}

std::vector<std::string> withCurrentNames(std::string_view verb, std::vector<std::string> arguments,
                                          const std::function<void(const std::string&)>& note) {
  std::set<std::string> noted;
  std::vector<std::string> result;
  for (std::string& argument : arguments) {
    const std::string name = argument.substr(0, argument.find('='));
    if (const OldName* entry = find(verb, name)) {
      if (noted.insert(name).second)
        note(fmt::format("{} is called {} now; the old name still works", name, entry->current));
      argument = currentName(verb, name) + argument.substr(name.size());
    }
    const bool follows = !result.empty() && result.back().starts_with("--") && result.back().size() > 2 &&
                         result.back().find('=') == std::string::npos;
    if (follows && isNegativeNumber(argument))
      result.back() += "=" + argument;
    else
      result.push_back(std::move(argument));
  }
  return result;
}

}  // namespace nephele::apps
