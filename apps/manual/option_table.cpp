#include "apps/manual/option_table.h"

#include <set>
#include <sstream>

#include "apps/detail/command.h"
#include "apps/options/options.h"
#include "apps/options/outputs.h"

namespace nephele::apps {
namespace {

std::vector<std::string> optionNamesOf(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options)
    if (!option->get_lnames().empty()) names.push_back(option->get_lnames().front());
  return names;
}

void add(const CLI::App& app, std::vector<OptionRow>& rows) {
  for (const CLI::Option* option : app.get_options()) {
    const std::vector<std::string>&longs = option->get_lnames(), &shorts = option->get_snames();
    const bool isInput = option->get_positional();
    const std::string name = isInput ? option->get_name(true, false) : longs.empty() ? "" : longs.front();
    if (name.empty() || name == "help" || name == "help-all") continue;
    const bool isFlag = option->get_items_expected_max() == 0;
    rows.push_back({name, shorts.empty() ? "" : "-" + shorts.front(), isFlag ? "" : option->get_type_name(),
                    option->get_default_str(), option->get_description(), option->get_group(), isInput,
                    isFlag, isOutput(*option), option->get_required(), option->get_items_expected_max() > 1,
                    optionNamesOf(option->get_excludes()), optionNamesOf(option->get_needs())});
  }
  for (const CLI::App* group :
       app.get_subcommands([](const CLI::App* sub) { return sub->get_name().empty(); }))
    add(*group, rows);
}

}  // namespace

std::vector<std::string> OptionRow::choices() const {
  std::vector<std::string> words;
  std::istringstream parts(type);
  for (std::string word; std::getline(parts, word, '|');) {
    // "hg:G" and "NUMBER" stand for more than themselves.
    const bool isWord = word.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-_") == std::string::npos;
    if (word.empty() || !isWord) return {};
    words.push_back(word);
  }
  return words.size() > 1 ? words : std::vector<std::string>{};
}

bool OptionRow::isFile() const {
  return isOutput || isFileType(type);
}

std::vector<OptionRow> optionTable(const Verb& verb) {
  const Command command(verb);
  std::vector<OptionRow> rows;
  add(command.app, rows);
  return rows;
}

}  // namespace nephele::apps
