#include "nephele/levelset/felt/written_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "nephele/levelset/io/output_file.h"
#include "nephele/modeling/felt/diagnostic.h"

namespace nephele::felt {

namespace {

namespace fs = std::filesystem;

bool areOneFile(const std::string& a, const std::string& b) {
  std::error_code failed;
  if (fs::equivalent(a, b, failed)) return true;
  return fs::weakly_canonical(a, failed) == fs::weakly_canonical(b, failed);
}

}  // namespace

std::string requireWritable(const Context& context, const std::string& path,
                            std::initializer_list<const char*> endings) {
  std::string ending = fs::path(path).extension().string(), list;
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  for (const char* allowed : endings) list += (list.empty() ? "" : ", ") + std::string(allowed);
  if (std::find(endings.begin(), endings.end(), ending) == endings.end())
    throw CallError(Code::outOfRange, fmt::format("\"{}\" must end with {}", path, list));
  for (const std::string& read : context.filesRead)
    if (areOneFile(path, read))
      throw CallError(Code::failed, fmt::format("\"{}\" is a file that the script has read", path),
                      "write to another file: what was read stays as it is");
  const OutputFile probe(path);
  return ending;
}

}  // namespace nephele::felt
