#include "nephele/levelset/io/detail/vdb_identifier.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <vector>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {
namespace {

// Behind the magic number, the versions of file and library, and whether there are offsets.
constexpr std::size_t kBegin = 21, kLength = 36;

/// Two numbers of 64 bits, of the words at even places and at odd ones.
class Digest {
 public:
  /// A whole number of pairs of words, but for the end.
  void add(const char* bytes, std::size_t count) {
    std::array<std::uint64_t, 2> words{};
    for (std::size_t i = 0; i < count; i += sizeof words) {
      words = {};
      std::memcpy(words.data(), bytes + i, std::min(sizeof words, count - i));
      for (std::size_t n = 0; n < words.size(); ++n)
        state_[n] = std::rotl((state_[n] ^ words[n]) * 0x9e3779b97f4a7c15u, 29) + n;
    }
  }
  std::uint64_t operator[](std::size_t n) const {
    std::uint64_t h = state_[n] ^ std::rotl(state_[1 - n], 32);
    h = (h ^ h >> 31) * 0x7fb5d329728ea185u;
    return h ^ h >> 27;
  }

 private:
  std::array<std::uint64_t, 2> state_{1, 2};
};

}  // namespace

void identifyByContents(const std::string& path) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  std::vector<char> part(std::size_t(1) << 20);
  Digest digest;
  for (bool isFirst = true; file; isFirst = false) {
    file.read(part.data(), std::streamsize(part.size()));
    const auto count = std::size_t(file.gcount());
    if (isFirst) {
      if (count < kBegin + kLength) throw Error("too short for a VDB file");
      std::fill_n(part.begin() + kBegin, kLength, '\0');
    }
    digest.add(part.data(), count);
  }
  const std::uint64_t a = digest[0], b = digest[1];
  // Version 8 of RFC 9562: bits of one's own making.
  const std::string identifier =
      fmt::format("{:08x}-{:04x}-8{:03x}-{:x}{:03x}-{:012x}", a >> 32, a >> 16 & 0xffff, a & 0xfff,
                  8 | (b >> 60 & 3), b >> 48 & 0xfff, b & 0xffffffffffff);
  file.clear();
  file.seekp(kBegin);
  file.write(identifier.data(), kLength);
  file.close();
  if (!file) throw Error("its identifier cannot be written");
}

}  // namespace nephele::detail
