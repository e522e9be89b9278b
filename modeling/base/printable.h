#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace nephele {

/// `text` as a terminal may have it: control characters as \n, \t or \x1b, and no more than `most`
/// characters, the last of which are dots then. Letters of any encoding stay.
std::string printable(std::string_view text, std::size_t most = std::string_view::npos);

/// The same between single quotes.
std::string quoted(std::string_view text, std::size_t most = std::string_view::npos);

/// A number as messages and scripts show it: six digits, with a point whatever the locale of the process.
std::string numberText(double value);

/// Whether `text` is whole characters in UTF-8: none in a longer form than it needs, no surrogates.
bool isUtf8(std::string_view text);

/// What a message of nlohmann's JSON library says, without the library's own words.
std::string jsonFault(std::string_view message);

}  // namespace nephele
