#include "nephele/modeling/base/text_file.h"

#include <filesystem>
#include <fstream>
#include <system_error>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele {

std::string_view withoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  return text;
}

std::string readTextFile(const std::string& path, std::size_t mostBytes) {
  requireWholeName(path);
  std::error_code ignored;
  require(!std::filesystem::is_directory(path, ignored), path + ": is a folder, not a file");
  std::ifstream file(path, std::ios::binary);
  require(file.good(), path + ": cannot be opened for reading");
  std::string text;
  std::vector<char> block(1 << 16);
  while (file.read(block.data(), std::streamsize(block.size())) || file.gcount() > 0) {
    text.append(block.data(), std::size_t(file.gcount()));
    require(text.size() <= mostBytes, path + ": is larger than " + std::to_string(mostBytes) + " bytes");
  }
  require(file.eof() && !file.bad(), path + ": cannot be read");
  text.erase(0, text.size() - withoutByteOrderMark(text).size());
  return text;
}

void requireWholeName(const std::string& path) {
  require(path.find('\0') == std::string::npos,
          path + ": the name of a file may not have a byte of zero in it");
}

}  // namespace nephele
