#include "nephele/levelset/io/detail/blosc_header.h"

#include <fmt/format.h>

#include <cstring>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {

void checkBloscHeader(const char* block, std::int64_t length, std::int64_t contents) {
  if (length < kBloscHeaderBytes) throw Error("damaged: a compressed block is too short");
  std::uint32_t claimed[4];
  static_assert(sizeof(claimed) == kBloscHeaderBytes);
  std::memcpy(claimed, block, sizeof(claimed));
  if (claimed[1] != contents || claimed[3] != length)
    throw Error(fmt::format("damaged: a compressed block claims {} bytes for {}, where {} stand for {}",
                            claimed[3], claimed[1], length, contents));
}

}  // namespace nephele::detail
