#include "apps/options/toml_file.h"

#include <fmt/format.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <string>
#include <string_view>

#include "nephele/modeling/base/error.h"
#include "nephele/modeling/base/nearest_name.h"
#include "nephele/modeling/base/printable.h"
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

/// Where a key begins to nest too deep, or the end of the text.
std::size_t deepKeyIn(const std::string& toml) {
  int dots = 0;
  for (std::size_t i = 0; i < toml.size();) {
    const char c = toml[i];
    if (c == '"' || c == '\'') {
      i = endOfText(toml, i);
      continue;
    }
    if (c == '#') {
      i = std::min(toml.find('\n', i), toml.size());
      continue;
    }
    dots = c == '.' ? dots + 1 : std::string_view("\n,={[").find(c) != std::string_view::npos ? 0 : dots;
    if (dots >= kDeepest) return i;
    ++i;
  }
  return toml.size();
}

/// As toml++ says it, without what it was doing.
std::string sentenceOf(const toml::parse_error& error) {
  constexpr std::string_view start = "Error while parsing ";
  const std::string_view text = error.description();
  return std::string(text.starts_with(start) ? text.substr(start.size()) : text);
}

/// The first text with a byte of zero in it, at which names of files and messages would end; null if there is
/// none.
const toml::node* textWithZeroIn(const toml::node& node) {
  if (const auto* text = node.as_string())
    return text->get().find('\0') != std::string::npos ? text : nullptr;
  const toml::node* found = nullptr;
  const auto look = [&](const toml::node& item) {
    if (!found) found = textWithZeroIn(item);
  };
  if (const toml::array* list = node.as_array())
    for (const toml::node& item : *list) look(item);
  if (const toml::table* table = node.as_table())
    for (const auto& [key, item] : *table) look(item);
  return found;
}

}  // namespace

TomlFile TomlFile::read(const std::string& option, const std::string& path) {
  try {
    return {path, readTextFile(path, kLargest)};
  } catch (const felt::ScriptError&) {
    throw;
  } catch (const Error& error) {
    throw CLI::ValidationError(option, error.what());
  }
}

TomlFile::TomlFile(std::string name, std::string text) {
  // toml++ passes over the mark of UTF-8, and does not count it.
  if (text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
  felt::Sources sources;
  sources.add(std::move(name), std::move(text));
  const felt::Source& source = sources[0];
  source_ = std::make_shared<const felt::Sources>(sources);
  if (const std::size_t deep = deepKeyIn(source.text()); deep < source.text().size()) {
    const felt::Span span{0, int(deep), int(deep) + 1};
    throw felt::ScriptError(
        {{felt::Code::tooDeep, span, fmt::format("a key nests more than {} deep", kDeepest)}}, *source_);
  }
  try {
    table_ = toml::parse(source.text());
  } catch (const toml::parse_error& error) {
    refuse(felt::Code::expected, error.source(), sentenceOf(error));
  }
  if (const toml::node* found = textWithZeroIn(table_))
    refuse(felt::Code::wrongType, found->source(), "a text may not have a byte of zero in it");
}

std::string TomlFile::placeOf(const toml::node& node) const {
  return fmt::format("{}:{}", (*source_)[0].name(), node.source().begin.line);
}

int TomlFile::offsetOf(const toml::source_position& position) const {
  return (*source_)[0].offsetOf({int(position.line), int(position.column)});
}

felt::Span TomlFile::spanOf(const toml::source_region& region) const {
  return {0, offsetOf(region.begin), offsetOf(region.end)};
}

std::shared_ptr<const TomlText> TomlFile::textOf(const toml::node& node, const std::string& value) const {
  return std::make_shared<const TomlText>(source_, spanOf(node.source()), value);
}

void TomlFile::refuse(felt::Code code, const toml::source_region& where, std::string message,
                      std::string hint) const {
  throw felt::ScriptError({{code, spanOf(where), std::move(message), std::move(hint)}}, *source_);
}

void TomlFile::refuseKey(const toml::key& key, const std::string& name, const std::string& isNot,
                         const std::vector<std::string>& known, bool listsThem) const {
  const std::string meant = nearestName(name, known);
  std::string hint = meant.empty() ? "" : fmt::format("did you mean `{}`?", meant);
  if (meant.empty() && listsThem) hint = fmt::format("keys: {}", fmt::join(known, ", "));
  refuse(felt::Code::unknownName, key.source(), nephele::quoted(name, 40) + " is " + isNot, std::move(hint));
}

void TomlFile::throwFaults() const {
  if (!faults_.empty()) throw felt::ScriptError(faults_, *source_);
}

}  // namespace nephele::apps
