#include "nephele/modeling/base/printable.h"

#include <fmt/format.h>

namespace nephele {

std::string printable(std::string_view text, std::size_t most) {
  std::string result;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '\n')
      result += "\\n";
    else if (c == '\t')
      result += "\\t";
    else if (code < 0x20 || code == 0x7f)
      result += fmt::format("\\x{:02x}", code);
    else
      result += c;
    if (result.size() > most) return result.substr(0, most - 3) + "...";
  }
  return result;
}

std::string jsonFault(std::string_view message) {
  constexpr std::size_t kMost = 160;
  // "[json.exception.parse_error.101] parse error at line 1, column 2: what happened"
  if (const std::size_t end = message.find("] "); message.starts_with('[') && end != std::string_view::npos)
    message.remove_prefix(end + 2);
  if (const std::size_t colon = message.find(": ");
      message.starts_with("parse error") && colon != std::string_view::npos)
    message.remove_prefix(colon + 2);
  return printable(message, kMost);
}

}  // namespace nephele
