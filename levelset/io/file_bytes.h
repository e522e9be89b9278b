#pragma once

#include <cstdint>
#include <fstream>
#include <memory>
#include <streambuf>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace nephele {

/// The bytes of a file as a stream that throws rather than end. Only a window of the file is in memory.
class FileBytes final : public std::streambuf {
 public:
  /// @throws Error without the path if the file cannot be read.
  explicit FileBytes(const std::string& path);

  std::int64_t size() const { return size_; }
  std::int64_t position() const { return start_ + (gptr() - eback()); }
  std::int64_t left() const { return size_ - position(); }
  /// What is left in the window, to be asked at the beginning of the file.
  bool startsWith(std::string_view text);

  /// The next value, as it lies in the file. @throws Error if the file ends before.
  template <class T>
  T take() {
    T value{};
    sgetn(reinterpret_cast<char*>(&value), sizeof(value));
    return value;
  }
  /// @throws Error if the file ends before.
  void skip(std::int64_t count) { pubseekoff(count, std::ios_base::cur, std::ios_base::in); }
  void moveTo(std::int64_t position) { pubseekpos(position, std::ios_base::in); }

  /// From now on the byte at `position` reads as `value`.
  void replace(std::int64_t position, char value);

 protected:
  int_type underflow() override;
  std::streamsize xsgetn(char* target, std::streamsize count) override;
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode mode) override;
  pos_type seekpos(pos_type position, std::ios_base::openmode mode) override;

 private:
  static constexpr std::int64_t kWindow = std::int64_t(1) << 20;

  [[noreturn]] void failShort() const;
  /// An empty window at `position`.
  void emptyAt(std::int64_t position);
  /// A full window at the present position.
  void fill();
  void readAt(std::int64_t position, char* target, std::int64_t count);

  std::ifstream file_;
  std::unique_ptr<char[]> window_ = std::make_unique_for_overwrite<char[]>(kWindow);
  /// Where in the file the window begins.
  std::int64_t start_ = 0;
  std::int64_t size_ = 0;
  std::vector<std::pair<std::int64_t, char>> replaced_;
};

}  // namespace nephele
