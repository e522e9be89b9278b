#include "apps/options/toml_text.h"

#include <algorithm>
#include <string_view>

namespace nephele::apps {
namespace {

constexpr std::string_view kBlank = " \t\r\n";

/// Bytes in UTF-8.
int bytesOf(std::uint32_t letter) {
  return letter < 0x80 ? 1 : letter < 0x800 ? 2 : letter < 0x10000 ? 3 : 4;
}

/// An escape sequence: how long it is, and how many bytes it stands for.
struct Escape {
  std::size_t length = 2;
  int bytes = 1;
};

Escape escapeAt(std::string_view text, bool isLong) {
  if (text.size() < 2) return {text.size(), 1};
  const std::size_t digits = text[1] == 'x' ? 2 : text[1] == 'u' ? 4 : text[1] == 'U' ? 8 : 0;
  if (digits > 0) {
    const std::string hex(text.substr(2, digits));
    return {2 + digits, bytesOf(std::uint32_t(std::strtoul(hex.c_str(), nullptr, 16)))};
  }
  // At the end of a line: it goes on with the next letter.
  if (isLong && kBlank.find(text[1]) != std::string_view::npos)
    return {std::min(text.find_first_not_of(kBlank, 1), text.size()), 0};
  return {};
}

/// Where the bytes of a string stand, from its quotes on.
std::vector<int> offsetsIn(std::string_view literal) {
  const char quote = literal.empty() ? '\0' : literal.front();
  if (quote != '"' && quote != '\'') return {};
  const bool isLong = literal.size() >= 6 && literal.substr(0, 3) == std::string(3, quote);
  const std::size_t quotes = isLong ? 3 : 1, end = literal.size() - std::min(literal.size(), quotes);
  std::size_t i = quotes;
  if (isLong && literal.substr(i, 2) == "\r\n")
    i += 2;
  else if (isLong && literal[i] == '\n')
    ++i;
  std::vector<int> offsets;
  while (i < end) {
    Escape piece{1, 1};
    if (quote == '"' && literal[i] == '\\') piece = escapeAt(literal.substr(i, end - i), isLong);
    offsets.insert(offsets.end(), std::size_t(piece.bytes), int(i));
    i += piece.length;
  }
  offsets.push_back(int(end));
  return offsets;
}

}  // namespace

TomlText::TomlText(std::shared_ptr<const felt::Sources> file, const felt::Span& literal,
                   const std::string& value)
    : file_(std::move(file)), literal_(literal), offsets_(offsetsIn(file_->textOf(literal))) {
  for (int& offset : offsets_) offset += literal.begin;
  // Numbers, and line ends that are read as others.
  if (offsets_.size() != value.size() + 1) offsets_.clear();
}

felt::ScriptError TomlText::fault(felt::Code code, std::string message, std::string hint) const {
  return {{{code, literal_, std::move(message), std::move(hint)}}, *file_};
}

felt::ScriptError TomlText::moved(const felt::ScriptError& error, std::size_t from) const {
  const auto moved = [&](const felt::Span& span) -> felt::Span {
    if (offsets_.empty()) return literal_;
    const auto at = [&](int offset) {
      return offsets_[std::min(from + std::size_t(offset), offsets_.size() - 1)];
    };
    return {literal_.file, at(span.begin), at(span.end)};
  };
  std::vector<felt::Diagnostic> faults = error.diagnostics();
  for (felt::Diagnostic& fault : faults) {
    fault.span = moved(fault.span);
    for (felt::Span& call : fault.calls) call = moved(call);
  }
  return {std::move(faults), *file_};
}

}  // namespace nephele::apps
