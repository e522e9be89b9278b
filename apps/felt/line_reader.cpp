#include "apps/felt/line_reader.h"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>

#ifdef NEPHELE_WITH_READLINE
// Needs <cstdio> before it.
#include <readline/history.h>
#include <readline/readline.h>
#endif

namespace nephele::apps {
namespace {

#ifdef NEPHELE_WITH_READLINE

constexpr int kMostRemembered = 1000;

std::function<std::vector<std::string>()> wordsToComplete;

/// The next word that begins with `begun`, as readline asks for them.
char* nextWord(const char* begun, int state) {
  static std::vector<std::string> words;
  static std::size_t at;
  if (state == 0) {
    words = wordsToComplete();
    at = 0;
  }
  while (at < words.size()) {
    const std::string& word = words[at++];
    if (word.starts_with(begun)) return ::strdup(word.c_str());
  }
  return nullptr;
}

char** completions(const char* begun, int, int) {
  rl_completion_append_character = '\0';
  return rl_completion_matches(begun, nextWord);
}

std::string historyPath() {
  const char* home = std::getenv("HOME");
  return home && *home ? std::string(home) + "/.nephele_felt_history" : "";
}

#endif

}  // namespace

#ifdef NEPHELE_WITH_READLINE

LineReader::LineReader(std::function<std::vector<std::string>()> words)
    : isTerminal_(::isatty(STDIN_FILENO) && ::isatty(STDOUT_FILENO)) {
  if (!isTerminal_) return;
  wordsToComplete = std::move(words);
  rl_readline_name = "nephele";
  rl_attempted_completion_function = completions;
  rl_completer_word_break_characters = " \t\n\"(){}[],;+-*/^%<>=!?.";
  // A signal ends the line, so that whoever waits for it learns of the signal.
  rl_signal_event_hook = [] {
    rl_done = 1;
    return 0;
  };
  using_history();
  if (!historyPath().empty()) read_history(historyPath().c_str());
  stifle_history(kMostRemembered);
}

LineReader::~LineReader() {
  if (isTerminal_ && !historyPath().empty()) write_history(historyPath().c_str());
}

std::optional<std::string> LineReader::next(const std::string& prompt) {
  if (isTerminal_) {
    const std::unique_ptr<char, decltype(&std::free)> typed(::readline(prompt.c_str()), &std::free);
    if (!typed) return std::nullopt;
    if (*typed) add_history(typed.get());
    return typed.get();
  }
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  return line;
}

#else

LineReader::LineReader(std::function<std::vector<std::string>()>)
    : isTerminal_(::isatty(STDIN_FILENO) && ::isatty(STDOUT_FILENO)) {}
LineReader::~LineReader() = default;

std::optional<std::string> LineReader::next(const std::string& prompt) {
  if (isTerminal_) std::cout << prompt << std::flush;
  std::string line;
  if (!std::getline(std::cin, line)) return std::nullopt;
  return line;
}

#endif

}  // namespace nephele::apps
