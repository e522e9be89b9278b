#pragma once

#include <string>

namespace nephele::detail {

/// Gives a finished .vdb file an identifier that follows from all else that it holds, in place of the one
/// that OpenVDB draws at random: what is written twice is the same file. Cost: the file is read once.
/// @throws Error if it cannot be read or written.
void identifyByContents(const std::string& path);

}  // namespace nephele::detail
