#include "apps/felt/function_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "apps/felt/felt_scripts.h"
#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/base/printable.h"

namespace nephele::apps {
namespace {

using felt::Function;

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return text;
}

/// Overloads of one name in one group, in the order in which they were added.
struct Entry {
  std::string name;
  std::vector<const Function*> functions;
};
struct Group {
  std::string name;
  std::vector<Entry> entries;
};

/// Of functions, not of operators.
std::vector<Group> groups() {
  std::vector<Group> all;
  for (const Function& function : feltFunctions().functions()) {
    if (function.name.starts_with("operator")) continue;
    auto group = std::ranges::find(all, function.group, &Group::name);
    if (group == all.end()) group = all.insert(all.end(), {function.group, {}});
    auto entry = std::ranges::find(group->entries, function.name, &Entry::name);
    if (entry == group->entries.end()) entry = group->entries.insert(entry, {function.name, {}});
    entry->functions.push_back(&function);
  }
  return all;
}

bool isAbout(const Entry& entry, const std::string& word) {
  return lower(entry.name).find(word) != std::string::npos ||
         std::ranges::any_of(entry.functions, [&](const Function* function) {
           return lower(function->text).find(word) != std::string::npos;
         });
}

std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  std::string word;
  while (words >> word) {
    if (lines.empty() || lines.back().size() + 1 + word.size() > width)
      lines.push_back(word);
    else
      lines.back() += ' ' + word;
  }
  return lines;
}

/// What is said of several is said once, behind the last of them.
bool isSaidLater(const std::vector<const Function*>& functions, std::size_t i, std::string Function::*what) {
  return i + 1 < functions.size() && functions[i]->*what == functions[i + 1]->*what;
}

void print(const Entry& entry, Run& run) {
  for (std::size_t i = 0; i < entry.functions.size(); ++i) {
    const Function& function = *entry.functions[i];
    run.result("  " + function.signature);
    if (isSaidLater(entry.functions, i, &Function::text)) continue;
    for (const std::string& line : wrapped(function.text, 92)) run.result("      " + line);
    if (!function.example.empty()) run.result("      e.g. " + function.example);
  }
}

}  // namespace

void listFunctions(const std::string& word, Run& run) {
  bool isAny = false;
  for (const Group& group : groups()) {
    bool isFirst = true;
    for (const Entry& entry : group.entries) {
      if (!isAbout(entry, lower(word))) continue;
      if (isFirst && isAny) run.result("");
      if (isFirst) run.result(group.name);
      isFirst = false;
      isAny = true;
      print(entry, run);
    }
  }
  if (isAny) return;
  const std::string near = nearestName(word, feltFunctions().names());
  throw Error(fmt::format("no function is called or speaks of {}{}", quoted(word, 60),
                          near.empty() ? "" : fmt::format("; did you mean '{}'?", near)));
}

void listFunctionsAsMarkdown(Run& run) {
  std::string page =
      "# The functions of Felt\n\nMade from the program by `nephele felt functions --markdown`; what is said "
      "here, `nephele felt functions WORD`\nfinds in a terminal. The language itself is told in "
      "[felt.md](felt.md).\n";
  for (const Group& group : groups()) {
    page += fmt::format("\n## {}{}\n", char(std::toupper(group.name[0])), group.name.substr(1));
    for (const Entry& entry : group.entries) {
      page += fmt::format("\n### {}\n", entry.name);
      bool isOpen = false;
      for (std::size_t i = 0; i < entry.functions.size(); ++i) {
        const Function& function = *entry.functions[i];
        page += (isOpen ? "" : "\n```felt-signature\n") + function.signature + "\n";
        isOpen = isSaidLater(entry.functions, i, &Function::text);
        if (isOpen) continue;
        page += "```\n\n" + function.text + "\n";
        if (!function.example.empty()) page += "\n```felt\n" + function.example + "\n```\n";
      }
    }
  }
  std::istringstream lines(page);
  std::string line;
  while (std::getline(lines, line)) run.result(line);
}

}  // namespace nephele::apps
