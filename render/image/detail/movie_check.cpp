// Whether a movie was written to its end.
//
// MP4 and its elder QuickTime are boxes: 4 bytes of size, 4 of kind, and 8 more of size where the first is 1.
// Matroska is two elements, a header and a segment: an identifier, then a size, each as long as the number of
// zeros before its first bit says. Both have sizes that are filled in at the end, where writing went well.
#include "nephele/render/image/detail/movie_check.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <fstream>
#include <string_view>

namespace nephele::detail {
namespace {

using Head = std::array<unsigned char, 16>;

constexpr std::uint64_t kMatroska = 0x1a45dfa3, kSegment = 0x18538067;

std::uint64_t number(const Head& head, std::size_t from, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = from; i != std::min(from + count, head.size()); ++i) value = value << 8 | head[i];
  return value;
}

struct Part {
  std::uint64_t size = 0;  // with its head; 0 if that makes no sense
  bool isTable = false, isPictures = false;
};

Part box(const Head& head) {
  const std::string_view kind(reinterpret_cast<const char*>(head.data()) + 4, 4);
  const std::uint64_t size = number(head, 0, 4) == 1 ? number(head, 8, 8) : number(head, 0, 4);
  return {size < 8 ? 0 : size, kind == "moov", kind == "mdat"};
}

Part element(const Head& head) {
  const auto name = std::size_t(std::countl_zero(head[0])) + 1;
  if (name > 4) return {};
  const auto length = std::size_t(std::countl_zero(head[name])) + 1;
  if (length > 8) return {};
  const std::uint64_t most = (std::uint64_t(1) << 7 * length) - 1;
  const std::uint64_t size = number(head, name, length) & most;
  // The largest stands for a size that is not known yet.
  if (size == most) return {};
  const std::uint64_t id = number(head, 0, name);
  return {name + length + size, id == kMatroska, id == kSegment};
}

}  // namespace

bool isWholeMovie(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const auto end = std::uint64_t(std::max<std::streamoff>(file.tellg(), 0));
  bool hasTable = false, hasPictures = false;
  for (std::uint64_t at = 0; at != end;) {
    Head head{};
    file.seekg(std::streamoff(at));
    file.read(reinterpret_cast<char*>(head.data()),
              std::streamsize(std::min<std::uint64_t>(head.size(), end - at)));
    const bool isMatroska = number(head, 0, 4) == kMatroska || number(head, 0, 4) == kSegment;
    const Part part = isMatroska ? element(head) : box(head);
    if (!file.good() || part.size == 0 || part.size > end - at) return false;
    hasTable |= part.isTable;
    hasPictures |= part.isPictures;
    at += part.size;
  }
  return hasTable && hasPictures;
}

}  // namespace nephele::detail
