#include "nephele/modeling/base/printable.h"

#include <charconv>

namespace nephele {

std::string printable(std::string_view text, std::size_t most) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string result;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '\n')
      result += "\\n";
    else if (c == '\t')
      result += "\\t";
    else if (code < 0x20 || code == 0x7f)
      result += {'\\', 'x', kDigits[code >> 4], kDigits[code & 15]};
    else
      result += c;
    if (result.size() > most) return result.substr(0, most - 3) + "...";
  }
  return result;
}

std::string quoted(std::string_view text, std::size_t most) {
  std::string result = "'";
  result += printable(text, most);
  result += '\'';
  return result;
}

std::string numberText(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value, std::chars_format::general, 6).ptr};
}

bool isUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto first = static_cast<unsigned char>(text[i]);
    const std::size_t length = first < 0x80            ? 1
                               : first >> 5 == 0b110   ? 2
                               : first >> 4 == 0b1110  ? 3
                               : first >> 3 == 0b11110 ? 4
                                                       : 0;
    if (length == 0 || length > text.size() - i) return false;
    char32_t code = length == 1 ? first : first & (0xffu >> (length + 1));
    for (std::size_t k = 1; k < length; ++k) {
      const auto next = static_cast<unsigned char>(text[i + k]);
      if (next >> 6 != 0b10) return false;
      code = code << 6 | (next & 0x3fu);
    }
    constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
    if (code < kLeast[length] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return false;
    i += length;
  }
  return true;
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
