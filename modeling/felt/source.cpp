#include "nephele/modeling/felt/source.h"

#include <algorithm>

#include "nephele/modeling/base/error.h"

namespace nephele::felt {

namespace {

constexpr std::size_t kLongestText = std::size_t(16) << 20;

}  // namespace

Source::Source(std::string name, std::string text) : name_(std::move(name)), text_(std::move(text)) {
  lineStarts_.push_back(0);
  for (std::size_t i = 0; i < text_.size(); ++i)
    if (text_[i] == '\n') lineStarts_.push_back(static_cast<int>(i) + 1);
}

int Source::lineStart(int offset) const {
  return *(std::upper_bound(lineStarts_.begin(), lineStarts_.end(), offset) - 1);
}

Place Source::placeOf(int offset) const {
  const auto line = std::upper_bound(lineStarts_.begin(), lineStarts_.end(), offset) - 1;
  Place place{static_cast<int>(line - lineStarts_.begin()) + 1, 1};
  for (int i = *line; i < offset && i < static_cast<int>(text_.size()); ++i)
    if ((static_cast<unsigned char>(text_[i]) & 0xC0) != 0x80) ++place.column;
  return place;
}

int Source::offsetOf(const Place& place) const {
  if (place.line > static_cast<int>(lineStarts_.size())) return static_cast<int>(text_.size());
  int offset = lineStarts_[place.line - 1];
  const auto isInside = [&] { return offset < static_cast<int>(text_.size()); };
  for (int column = 1; column < place.column && isInside(); ++column) do
      ++offset;
    while (isInside() && (static_cast<unsigned char>(text_[offset]) & 0xC0) == 0x80);
  return offset;
}

std::string_view Source::lineAt(int offset) const {
  const int begin = lineStart(offset);
  std::size_t end = text_.find('\n', begin);
  if (end == std::string::npos) end = text_.size();
  if (end > static_cast<std::size_t>(begin) && text_[end - 1] == '\r') --end;
  return std::string_view(text_).substr(begin, end - begin);
}

int Sources::add(std::string name, std::string text) {
  require(text.size() <= kLongestText, name + ": a script may have 16 MiB at most");
  files_.emplace_back(std::move(name), std::move(text));
  return count() - 1;
}

std::string_view Sources::textOf(const Span& span) const {
  return std::string_view(files_[span.file].text()).substr(span.begin, span.end - span.begin);
}

}  // namespace nephele::felt
