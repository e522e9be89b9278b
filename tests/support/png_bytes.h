#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace nephele::test {

/// CRC-32 of the PNG specification, annex D, bit by bit.
inline std::uint32_t checksum(std::string_view bytes) {
  std::uint32_t crc = ~0u;
  for (const char byte : bytes) {
    crc ^= std::uint8_t(byte);
    for (int bit = 0; bit != 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
  }
  return ~crc;
}

inline std::string bigEndian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += char(value >> shift);
  return bytes;
}

/// A zlib stream of one stored block (RFC 1950, 1951), of less than 64 kB.
inline std::string stored(std::string_view bytes) {
  std::uint32_t a = 1, b = 0;
  for (const char byte : bytes) {
    a = (a + std::uint8_t(byte)) % 65521;
    b = (b + a) % 65521;
  }
  const auto size = std::uint16_t(bytes.size());
  std::string stream{'\x78', '\x01', '\x01', char(size), char(size >> 8), char(~size), char(~size >> 8)};
  return stream.append(bytes) + bigEndian(b << 16 | a);
}

inline std::string pngChunk(const std::string& name, std::string_view content) {
  const std::string body = name + std::string(content);
  return bigEndian(std::uint32_t(content.size())) + body + bigEndian(checksum(body));
}

/// A PNG file of `rows`, each with a filter byte before it. `colourType`: 0 grey, 2 RGB. `chunks` come before
/// the pixels.
struct PngPicture {
  std::uint32_t width = 1, height = 1;
  char depth = 8, colourType = 2;
  std::string rows{};

  std::string with(const std::string& chunks) const {
    const std::string header =
        bigEndian(width) + bigEndian(height) + std::string{depth, colourType, '\0', '\0', '\0'};
    return "\x89PNG\r\n\x1a\n" + pngChunk("IHDR", header) + chunks + pngChunk("IDAT", stored(rows)) +
           pngChunk("IEND", "");
  }
};

}  // namespace nephele::test
