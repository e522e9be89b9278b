#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace nephele {

/// The text behind a mark of byte order, with which some programs begin UTF-8.
std::string_view withoutByteOrderMark(std::string_view text);

/// All bytes of a file but a mark of byte order; of what has no end, such as a device, no more than
/// `mostBytes` are read.
/// @throws Error naming the path if it cannot be read, is a folder, or is longer.
std::string readTextFile(const std::string& path, std::size_t mostBytes);

/// @throws Error naming the path if it has a byte of zero in it, at which the system would take it to end, so
/// that another file would be opened.
void requireWholeName(const std::string& path);

}  // namespace nephele
