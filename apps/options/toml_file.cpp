#include "apps/options/toml_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "nephele/modeling/base/error.h"

namespace nephele::apps {
namespace {

constexpr int kDeepest = 32;

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

void requireShallow(const std::string& path, const std::string& toml) {
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
    dots = c == '.' ? dots + 1 : c == '\n' || c == ',' || c == '=' || c == '{' || c == '[' ? 0 : dots;
    require(dots < kDeepest, fmt::format("{}:{}: a key nests more than {} deep", path, line, kDeepest));
    ++i;
  }
}

}  // namespace

toml::table readToml(const std::string& path) {
  require(!std::filesystem::is_directory(path), path + ": is a folder, not a TOML file");
  std::ifstream file(path, std::ios::binary);
  require(file.good(), path + ": cannot be opened for reading");
  std::ostringstream text;
  text << file.rdbuf();
  const std::string toml = text.str();
  requireShallow(path, toml);
  return toml::parse(toml, path);
}

}  // namespace nephele::apps
