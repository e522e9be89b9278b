#include "apps/options/toml_file.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <string>
#include <string_view>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/text_file.h"

namespace nephele::apps {
namespace {

constexpr int kDeepest = 32;
constexpr std::size_t kLargest = std::size_t(1) << 24;

/// Passes over the text that begins with these quotes, and returns where it ends.
std::size_t endOfText(const std::string& toml, std::size_t begin) {
  const char quote = toml[begin];
  const std::size_t quotes = toml.compare(begin, 3, std::string(3, quote)) == 0 ? 3 : 1;
  const std::string end(quotes, quote);
  for (std::size_t i = begin + quotes; i < toml.size(); ++i) {
    if (quote == '"' && toml[i] == '\\')
      ++i;
    else if (toml.compare(i, quotes, end) == 0)
      return i + quotes;
    else if (quotes == 1 && toml[i] == '\n')
      return i;
  }
  return toml.size();
}

/// The line of a key that nests too deep, or 0.
int lineOfDeepKey(const std::string& toml) {
  int line = 1, dots = 0;
  for (std::size_t i = 0; i < toml.size();) {
    const char c = toml[i];
    if (c == '"' || c == '\'') {
      const std::size_t end = endOfText(toml, i);
      line += int(std::count(toml.begin() + std::ptrdiff_t(i), toml.begin() + std::ptrdiff_t(end), '\n'));
      i = end;
      continue;
    }
    if (c == '#') {
      i = std::min(toml.find('\n', i), toml.size());
      continue;
    }
    line += c == '\n';
    dots = c == '.' ? dots + 1 : std::string_view("\n,={[").find(c) != std::string_view::npos ? 0 : dots;
    if (dots >= kDeepest) return line;
    ++i;
  }
  return 0;
}

}  // namespace

toml::table readToml(const std::string& option, const std::string& path) {
  std::string toml;
  try {
    toml = readTextFile(path, kLargest);
  } catch (const Error& error) {
    throw CLI::ValidationError(option, error.what());
  }
  if (const int line = lineOfDeepKey(toml))
    throw CLI::ValidationError(option,
                               fmt::format("{}:{}: a key nests more than {} deep", path, line, kDeepest));
  try {
    return toml::parse(toml, path);
  } catch (const toml::parse_error& error) {
    throw CLI::ValidationError(
        option, fmt::format("{}:{}: {}", path, error.source().begin.line, error.description()));
  }
}

}  // namespace nephele::apps
