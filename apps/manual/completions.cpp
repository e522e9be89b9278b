// Completions of shells from the table of options.
#include <fmt/format.h>

#include "apps/manual/man_page.h"
#include "apps/manual/option_table.h"
#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

std::string firstSentence(const std::string& text) {
  const std::size_t end = std::min(text.find(". "), text.find('\n'));
  std::string sentence = text.substr(0, end);
  if (sentence.ends_with('.')) sentence.pop_back();
  return sentence;
}

/// Between single quotes, where `special` needs a backslash.
std::string quoted(const std::string& text, const std::string& special) {
  std::string result;
  for (const char c : text) {
    if (c == '\'')
      result += "'\\''";
    else if (special.find(c) != std::string::npos)
      result += std::string("\\") + c;
    else
      result += c;
  }
  return "'" + result + "'";
}

std::string verbNames(const std::vector<Verb>& verbs) {
  std::string names;
  for (const Verb& verb : verbs) names += (names.empty() ? "" : " ") + verb.name;
  return names;
}

/// The words that stand behind the name of a verb, where there are such.
std::vector<std::string> wordsBehind(const Verb& verb) {
  for (const OptionRow& row : optionTable(verb))
    if (row.isInput) return row.choices();
  return {};
}

std::string forBash(const std::vector<Verb>& verbs) {
  std::string text = fmt::format(
      R"(# Completion of nephele for bash.
_nephele() {{
  local word=$2 before=$3 verb=${{COMP_WORDS[1]}} options= words=
  if [ "$COMP_CWORD" = 1 ]; then
    COMPREPLY=($(compgen -W "{0} help --help --version" -- "$word"))
    return
  fi
  if [ "$verb" = help ]; then
    COMPREPLY=($(compgen -W "{0}" -- "$word"))
    return
  fi
  case $verb in
)",
      verbNames(verbs));
  for (const Verb& verb : verbs) {
    std::string options, words;
    for (const OptionRow& row : optionTable(verb)) {
      if (row.isInput) continue;
      options += " --" + row.name;
      if (const auto choices = row.choices(); !choices.empty())
        words += fmt::format("        --{}) words='{}' ;;\n", row.name, fmt::join(choices, " "));
    }
    if (const auto behind = wordsBehind(verb); !behind.empty())
      words += fmt::format("        {}) words='{}' ;;\n", verb.name, fmt::join(behind, " "));
    text +=
        fmt::format("    {})\n      options='{} --help --help-all'\n      case $before in\n{}      esac ;;\n",
                    verb.name, options.substr(1), words);
  }
  return text + R"(  esac
  if [ -n "$words" ]; then
    COMPREPLY=($(compgen -W "$words" -- "$word"))
  elif [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
  else
    COMPREPLY=($(compgen -f -- "$word"))
  fi
}
complete -o filenames -F _nephele nephele
)";
}

std::string forZsh(const std::vector<Verb>& verbs) {
  std::string text =
      "#compdef nephele\n# Completion of nephele for zsh.\n_nephele() {\n  local -a verbs\n  verbs=(\n";
  for (const Verb& verb : verbs)
    text += fmt::format("    {}\n", quoted(verb.name + ":" + firstSentence(verb.summary), ""));
  text +=
      "  )\n  local verb=$words[2]\n  if (( CURRENT == 2 )) || [[ $verb == help ]]; then\n"
      "    (( CURRENT == 2 )) && verbs+=('help:Says what a verb does')\n    _describe verb verbs\n    "
      "return\n  fi\n"
      "  shift words\n  (( CURRENT-- ))\n  case $verb in\n";
  for (const Verb& verb : verbs) {
    text += fmt::format("    {})\n      _arguments \\\n", verb.name);
    for (const OptionRow& row : optionTable(verb)) {
      if (row.isInput) continue;
      std::string value;
      if (!row.isFlag) {
        value = ":" +
                (row.type.empty()        ? std::string("value")
                 : row.choices().empty() ? row.type
                                         : row.name) +
                ":";
        std::string sort = row.isFile() ? "_files" : " ";
        if (const auto choices = row.choices(); !choices.empty())
          sort = fmt::format("({})", fmt::join(choices, " "));
        for (const char c : std::string(value).substr(1, value.size() - 2))
          if (c == ':') value = ":value:";
        value += sort;
      }
      std::string help;
      for (const char c : firstSentence(row.help))
        help += c == '[' || c == ']' || c == ':' || c == '\\' ? std::string("\\") + c : std::string(1, c);
      text += fmt::format("        {} \\\n", quoted(fmt::format("{}--{}{}[{}]{}", row.repeats ? "*" : "",
                                                                row.name, row.isFlag ? "" : "=", help, value),
                                                    ""));
    }
    if (const auto behind = wordsBehind(verb); !behind.empty())
      text += fmt::format("        '1:word:({})' \\\n", fmt::join(behind, " "));
    text += "        '*:file:_files' ;;\n";
  }
  return text + "  esac\n}\n_nephele \"$@\"\n";
}

std::string forFish(const std::vector<Verb>& verbs) {
  std::string text = "# Completion of nephele for fish.\n";
  for (const Verb& verb : verbs)
    text += fmt::format("complete -c nephele -f -n __fish_use_subcommand -a {} -d {}\n", verb.name,
                        quoted(firstSentence(verb.summary), "\\"));
  text += fmt::format(
      "complete -c nephele -f -n __fish_use_subcommand -a help -d 'Says what a verb does'\n"
      "complete -c nephele -f -n '__fish_seen_subcommand_from help' -a '{}'\n",
      verbNames(verbs));
  for (const Verb& verb : verbs) {
    if (const auto behind = wordsBehind(verb); !behind.empty())
      text += fmt::format(
          "complete -c nephele -f -n '__fish_seen_subcommand_from {}; and test (count (commandline -opc)) "
          "-eq "
          "2' -a '{}'\n",
          verb.name, fmt::join(behind, " "));
    for (const OptionRow& row : optionTable(verb)) {
      if (row.isInput) continue;
      text +=
          fmt::format("complete -c nephele -n '__fish_seen_subcommand_from {}' -l {}", verb.name, row.name);
      if (!row.shortName.empty()) text += " -s " + row.shortName.substr(1);
      if (!row.isFlag) text += row.isFile() ? " -r -F" : " -x";
      if (const auto choices = row.choices(); !choices.empty())
        text += fmt::format(" -a '{}'", fmt::join(choices, " "));
      text += fmt::format(" -d {}\n", quoted(firstSentence(row.help), "\\"));
    }
  }
  return text;
}

}  // namespace

std::string completionsFor(const std::string& shell) {
  const std::vector<Verb> verbs = allVerbs();
  if (shell == "bash") return forBash(verbs);
  if (shell == "zsh") return forZsh(verbs);
  if (shell == "fish") return forFish(verbs);
  throw Error(fmt::format("there are completions for bash, zsh and fish, not for '{}'", shell));
}

}  // namespace nephele::apps
