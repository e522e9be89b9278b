#pragma once

#include <string>

namespace nephele::detail {

/// Whether a movie (.mp4, .mov; .mkv) holds all that it announces: its parts, one after the other as their
/// sizes say, fill the file.
bool isWholeMovie(const std::string& path);

}  // namespace nephele::detail
