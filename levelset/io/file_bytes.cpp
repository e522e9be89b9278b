#include "nephele/levelset/io/file_bytes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "nephele/modeling/base/error.h"

namespace nephele {

FileBytes::FileBytes(const std::string& path) : file_(path, std::ios::binary | std::ios::ate) {
  size_ = file_ ? std::int64_t(file_.tellg()) : -1;
  if (size_ < 0) throw Error("cannot be read");
  emptyAt(0);
}

bool FileBytes::startsWith(std::string_view text) {
  if (gptr() == egptr() && size_ > 0) fill();
  return std::string_view(gptr(), std::size_t(egptr() - gptr())).starts_with(text);
}

void FileBytes::replace(std::int64_t position, char value) {
  replaced_.emplace_back(position, value);
  if (position >= start_ && position < start_ + (egptr() - eback())) eback()[position - start_] = value;
}

FileBytes::int_type FileBytes::underflow() {
  if (position() >= size_) failShort();
  fill();
  return traits_type::to_int_type(*gptr());
}

std::streamsize FileBytes::xsgetn(char* target, std::streamsize count) {
  if (count < 0 || count > left()) failShort();
  const std::streamsize there = std::min<std::streamsize>(count, egptr() - gptr());
  // A block of nothing may have no memory to go to.
  if (there > 0) std::memcpy(target, gptr(), std::size_t(there));
  setg(eback(), gptr() + there, egptr());
  if (const std::streamsize rest = count - there; rest >= kWindow) {
    readAt(position(), target + there, rest);
    emptyAt(position() + rest);
  } else if (rest > 0) {
    fill();
    std::memcpy(target + there, gptr(), std::size_t(rest));
    setg(eback(), gptr() + rest, egptr());
  }
  return count;
}

FileBytes::pos_type FileBytes::seekoff(off_type offset, std::ios_base::seekdir from,
                                       std::ios_base::openmode) {
  const off_type base = from == std::ios::beg   ? 0
                        : from == std::ios::cur ? off_type(position())
                                                : off_type(size_);
  if (offset > off_type(size_) - base || offset < -base) failShort();
  const std::int64_t target = base + offset;
  if (target >= start_ && target <= start_ + (egptr() - eback()))
    setg(eback(), eback() + (target - start_), egptr());
  else
    emptyAt(target);
  return target;
}

FileBytes::pos_type FileBytes::seekpos(pos_type position, std::ios_base::openmode mode) {
  return seekoff(off_type(position), std::ios::beg, mode);
}

void FileBytes::failShort() const {
  throw Error(fmt::format("the file is cut short: it ends after {} bytes", size_));
}

void FileBytes::emptyAt(std::int64_t position) {
  start_ = position;
  setg(window_.get(), window_.get(), window_.get());
}

void FileBytes::fill() {
  emptyAt(position());
  const std::int64_t count = std::min(kWindow, size_ - start_);
  readAt(start_, window_.get(), count);
  setg(window_.get(), window_.get(), window_.get() + count);
}

void FileBytes::readAt(std::int64_t position, char* target, std::int64_t count) {
  file_.seekg(position);
  file_.read(target, count);
  // It was longer when it was opened.
  if (!file_) throw Error(fmt::format("the file is cut short: it ends before byte {}", position + count));
  for (const auto& [place, value] : replaced_)
    if (place >= position && place < position + count) target[place - position] = value;
}

}  // namespace nephele
