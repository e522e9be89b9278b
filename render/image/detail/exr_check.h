#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace nephele::detail {

/// What an OpenEXR file says of its first part.
struct ExrCheck {
  bool isDeep = false;
  /// Of deep parts: bytes that the samples of each chunk take.
  std::int64_t sampleBytes = 0;
};

/// Follows an OpenEXR file ahead of the library that reads it, which trusts lengths, sizes and places: every
/// attribute, window, table of offsets and chunk is compared with what the file can hold.
/// Cost: the header, and 40 bytes of every chunk.
/// @throws Error naming the path and what is damaged.
ExrCheck checkExr(const std::string& path);

}  // namespace nephele::detail
