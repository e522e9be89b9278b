#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

std::string withoutZeros(std::string text) {
  constexpr const char* kShown = "\\x00";
  for (std::size_t at = 0; (at = text.find('\0', at)) != std::string::npos;) text.replace(at, 1, kShown);
  return text;
}

}  // namespace

Error::Error(const std::string& message) : std::runtime_error(withoutZeros(message)) {}

}  // namespace nephele
