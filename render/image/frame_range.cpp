#include "nephele/render/image/frame_range.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <string_view>

#include "nephele/modeling/base/error.h"

namespace nephele {
namespace {

constexpr const char* kForms = "FRAME, FIRST-LAST or FIRST-LASTxSTEP, several separated by commas";

[[noreturn]] void refuse(std::string_view part, const std::string& why) {
  throw Error(fmt::format("frames: '{}' {}; allowed: {}", part.substr(0, 60), why, kForms));
}

// Takes a number off the front of `rest`, part of `part`; nothing if there is none.
std::optional<int> takeNumber(std::string_view& rest, std::string_view part) {
  const std::size_t digits = std::min(rest.find_first_not_of("0123456789"), rest.size());
  if (digits == 0) return std::nullopt;
  int value = 0;
  const auto result = std::from_chars(rest.data(), rest.data() + digits, value);
  if (result.ec != std::errc() || value > FrameRange::kLast)
    refuse(part, fmt::format("has a number beyond the largest, {}", FrameRange::kLast));
  rest.remove_prefix(digits);
  return value;
}

bool take(std::string_view& rest, char sign) {
  if (!rest.starts_with(sign)) return false;
  rest.remove_prefix(1);
  return true;
}

struct Part {
  int first = 0, last = 0, step = 1;

  explicit Part(std::string_view part) {
    std::string_view rest = part;
    const std::optional<int> from = takeNumber(rest, part);
    std::optional<int> to = from, by = 1;
    if (take(rest, '-')) {
      to = takeNumber(rest, part);
      if (to && take(rest, 'x')) by = takeNumber(rest, part);
    }
    if (!from || !to || !by || !rest.empty()) refuse(part, "is not a range of frames");
    first = *from;
    last = *to;
    step = *by;
    if (last < first) refuse(part, "runs backwards");
    if (step == 0) refuse(part, "has a step of 0");
  }
};

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string_view::npos ? "" : text.substr(first, last - first + 1);
}

// A place for a number: its length in the text, 0 if there is none, and the digits that it asks for.
struct Place {
  std::size_t length = 0;
  int width = 0;
};

// One or two digits.
std::size_t digitsAt(std::string_view text, std::size_t at) {
  std::size_t count = 0;
  while (count != 2 && at + count < text.size() && text[at + count] >= '0' && text[at + count] <= '9')
    ++count;
  return count;
}

Place placeAt(std::string_view text, std::size_t at) {
  const std::string_view rest = text.substr(at);
  if (rest[0] == '#') {
    const std::size_t length = std::min(rest.find_first_not_of('#'), rest.size());
    return {length, int(length)};
  }
  const bool percent = rest.starts_with("%0"), dollar = rest.starts_with("$F");
  if (rest.starts_with("%d")) return {2, 0};
  if (!percent && !dollar) return {};
  const std::size_t digits = digitsAt(rest, 2), end = 2 + digits;
  if (percent && (digits == 0 || end >= rest.size() || rest[end] != 'd')) return {};
  int width = 0;
  std::from_chars(rest.data() + 2, rest.data() + end, width);
  return {percent ? end + 1 : end, width};
}

}  // namespace

FrameRange FrameRange::parse(const std::string& text) {
  FrameRange range;
  range.first_ = kLast;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t comma = std::min(text.find(',', start), text.size());
    const std::string_view typed = trimmed(std::string_view(text).substr(start, comma - start));
    start = comma + 1;
    const Part part(typed);
    const int steps = (part.last - part.first) / part.step;
    if (steps >= kMost - int(range.frames_.size()))
      refuse(typed, fmt::format("makes more than {} frames", kMost));
    // Not by adding the step: that could go beyond the largest int.
    for (int i = 0; i <= steps; ++i) range.frames_.push_back(part.first + i * part.step);
    range.first_ = std::min(range.first_, part.first);
    range.last_ = std::max(range.last_, part.last);
  }
  std::sort(range.frames_.begin(), range.frames_.end());
  range.frames_.erase(std::unique(range.frames_.begin(), range.frames_.end()), range.frames_.end());
  return range;
}

bool FrameRange::contains(int frame) const {
  return std::binary_search(frames_.begin(), frames_.end(), frame);
}

std::vector<int> FrameRange::shard(int index, int count) const {
  require(count >= 1 && index >= 1 && index <= count,
          fmt::format("shard: expected I/N with 1 <= I <= N, got {}/{}", index, count));
  std::vector<int> frames;
  for (std::size_t i = std::size_t(index) - 1; i < frames_.size(); i += std::size_t(count))
    frames.push_back(frames_[i]);
  return frames;
}

namespace {

// Calls `found(at, place)` for every place in the file name of `text`; returns how many there are.
template <class Found>
int eachPlace(const std::string& text, const Found& found) {
  const std::size_t slash = text.rfind('/'), start = slash == std::string::npos ? 0 : slash + 1;
  int count = 0;
  for (std::size_t at = start; at < text.size();) {
    const Place place = placeAt(text, at);
    if (place.length > 0) {
      ++count;
      found(at, place);
    }
    at += std::max<std::size_t>(place.length, 1);
  }
  return count;
}

}  // namespace

int FramePattern::places(const std::string& text) {
  return eachPlace(text, [](std::size_t, const Place&) {});
}

FramePattern FramePattern::parse(const std::string& text) {
  FramePattern pattern;
  pattern.text_ = text;
  const int count = eachPlace(text, [&](std::size_t at, const Place& place) {
    pattern.before_ = text.substr(0, at);
    pattern.after_ = text.substr(at + place.length);
    pattern.width_ = place.width;
  });
  if (count != 1)
    throw Error(
        fmt::format("'{}' has {} place{} for the frame number in its file name; allowed: one of ####, "
                    "%04d, $F4, as in NAME.####.exr",
                    text, count, count == 1 ? "" : "s"));
  return pattern;
}

std::string FramePattern::path(int frame) const {
  return fmt::format("{}{:0{}d}{}", before_, frame, width_, after_);
}

std::string FramePattern::withWords(const std::string& words) const {
  const std::size_t slash = before_.rfind('/'), start = slash == std::string::npos ? 0 : slash + 1;
  const std::size_t last = before_.find_last_not_of("._-");
  const std::size_t end = last == std::string::npos ? start : std::max(last + 1, start);
  return before_.substr(0, end) + (end == start ? "" : ".") + words + (end == before_.size() ? "." : "") +
         text_.substr(end);
}

std::string FramePattern::folder() const {
  const std::string folder = std::filesystem::path(text_).parent_path().string();
  return folder.empty() ? "." : folder;
}

}  // namespace nephele
