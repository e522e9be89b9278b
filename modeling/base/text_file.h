#pragma once

#include <cstddef>
#include <string>

namespace nephele {

/// All bytes of a file; of what has no end, such as a device, no more than `mostBytes` are read.
/// @throws Error naming the path if it cannot be read, is a folder, or is longer.
std::string readTextFile(const std::string& path, std::size_t mostBytes);

/// @throws Error naming the path if it has a byte of zero in it, at which the system would take it to end, so
/// that another file would be opened.
void requireWholeName(const std::string& path);

}  // namespace nephele
