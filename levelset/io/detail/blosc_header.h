#pragma once

#include <cstdint>

namespace nephele::detail {

/// Blosc believes what the 16 bytes at the beginning of a block say of its length and of that of its
/// contents, and reads and writes beyond both. @throws Error unless they are `length` and `contents`, in
/// bytes.
void checkBloscHeader(const char* block, std::int64_t length, std::int64_t contents);

/// Of what checkBloscHeader reads.
inline constexpr std::int64_t kBloscHeaderBytes = 16;

}  // namespace nephele::detail
