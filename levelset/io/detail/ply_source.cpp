#include "nephele/levelset/io/detail/ply_source.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace nephele::detail {

PlyType plyTypeNamed(std::string_view name) {
  static constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
      {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
      {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
      {"float64", PlyType::float64}};
  for (const auto& [text, type] : kNames)
    if (text == name) return type;
  return PlyType::none;
}

double fullScale(PlyType type) {
  switch (type) {
    case PlyType::float32:
    case PlyType::float64:
      return 1.0;
    case PlyType::int16:
    case PlyType::uint16:
      return 65535.0;
    default:
      return 255.0;
  }
}

std::size_t PlySource::length(const PlyProperty& list) {
  const double count = value(list.countType);
  const double room = static_cast<double>(isText() ? (bytesLeft() + 1) / 2 : bytesLeft() / sizeOf(list.type));
  if (!(count >= 0) || count != std::floor(count)) fail(fmt::format("list length {} makes no sense", count));
  if (count > room) {
    if (room == 0) failShort();
    fail(fmt::format("a list of {} values is longer than the file", count));
  }
  return static_cast<std::size_t>(count);
}

void PlySource::skip(const PlyProperty& property) {
  std::size_t count = property.isList() ? length(property) : 1;
  if (isText()) {
    for (; count > 0; --count) textValue();
  } else {
    if (bytesLeft() / sizeOf(property.type) < count) failShort();
    cursor_ += count * sizeOf(property.type);
  }
}

void PlySource::fail(const std::string& what) const {
  const std::string row = fmt::format("{} {} of {}: {}", element_->name, row_ + 1, element_->count, what);
  if (isText()) file_.failAtLine(line_, row);
  file_.fail(row);
}

double PlySource::textValue() {
  while (cursor_ != end_ && static_cast<unsigned char>(*cursor_) <= ' ') {
    if (*cursor_ == '\n' || (*cursor_ == '\r' && (end_ - cursor_ < 2 || cursor_[1] != '\n'))) ++line_;
    ++cursor_;
  }
  if (cursor_ == end_) failShort();
  const char* first = cursor_ + (*cursor_ == '+' ? 1 : 0);
  double result = 0;
  const auto [last, error] = std::from_chars(first, end_, result);
  if (error == std::errc::invalid_argument || (last != end_ && static_cast<unsigned char>(*last) > ' ')) {
    const char* stop = cursor_;
    while (stop != end_ && static_cast<unsigned char>(*stop) > ' ') ++stop;
    fail(fmt::format("expected a number, found {}",
                     excerpt({cursor_, static_cast<std::size_t>(stop - cursor_)})));
  }
  if (error == std::errc::result_out_of_range)
    result = std::strtod(std::string(first, last).c_str(), nullptr);
  cursor_ = last;
  return result;
}

void PlySource::failShort() const {
  fail("the file ends here: it is cut short");
}

}  // namespace nephele::detail
