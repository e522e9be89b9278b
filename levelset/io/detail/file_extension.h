#pragma once

#include <filesystem>
#include <string>

namespace nephele::detail {

/// The extension of a file's name with its dot, in small letters.
inline std::string lowerExtension(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

}  // namespace nephele::detail
