#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "nephele/levelset/io/detail/mesh_io_private.h"

// The data part of PLY files, value by value.
namespace nephele::detail {

enum class PlyType { none, int8, uint8, int16, uint16, int32, uint32, float32, float64 };

/// `none` for names that PLY does not have.
PlyType plyTypeNamed(std::string_view name);
/// Bytes of a value; 0 for `none`.
inline std::size_t sizeOf(PlyType type);
/// What full intensity is in a colour of this type.
double fullScale(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::none;
  /// Lists only.
  PlyType countType = PlyType::none;

  bool isList() const { return countType != PlyType::none; }
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

enum class PlyEncoding { text, littleEndian, bigEndian };

/// Reads scalars one after the other from the data part of a file. What cannot be read is an error that names
/// the row, and in text its line.
class PlySource {
 public:
  /// From byte `offset` on, which is in line `line`.
  PlySource(const MeshFile& file, std::size_t offset, PlyEncoding encoding, std::size_t line)
      : file_(file),
        cursor_(file.bytes.data() + offset),
        end_(file.bytes.data() + file.bytes.size()),
        encoding_(encoding),
        line_(line) {}

  void startRow(const PlyElement& element, std::uint64_t row) {
    element_ = &element;
    row_ = row;
  }
  std::size_t bytesLeft() const { return static_cast<std::size_t>(end_ - cursor_); }
  bool isText() const { return encoding_ == PlyEncoding::text; }

  double value(PlyType type) {
    if (isText()) return textValue();
    const std::size_t size = sizeOf(type);
    if (bytesLeft() < size) failShort();
    const char* at = cursor_;
    cursor_ += size;
    switch (type) {
      case PlyType::int8:
        return load<std::int8_t>(at);
      case PlyType::uint8:
        return load<std::uint8_t>(at);
      case PlyType::int16:
        return load<std::int16_t>(at);
      case PlyType::uint16:
        return load<std::uint16_t>(at);
      case PlyType::int32:
        return load<std::int32_t>(at);
      case PlyType::uint32:
        return load<std::uint32_t>(at);
      case PlyType::float32:
        return static_cast<double>(load<float>(at));
      case PlyType::float64:
        return load<double>(at);
      case PlyType::none:
        break;
    }
    return 0;
  }

  /// A list length: whole, not negative, and no longer than the bytes that are left.
  std::size_t length(const PlyProperty& list);
  void skip(const PlyProperty& property);
  [[noreturn]] void fail(const std::string& what) const;

 private:
  template <class T>
  T load(const char* at) const {
    T value;
    if (encoding_ == PlyEncoding::littleEndian) {
      std::memcpy(&value, at, sizeof value);
    } else {
      char reversed[sizeof value];
      std::reverse_copy(at, at + sizeof value, reversed);
      std::memcpy(&value, reversed, sizeof value);
    }
    return value;
  }

  double textValue();
  [[noreturn]] void failShort() const;

  static_assert(std::endian::native == std::endian::little);
  const MeshFile& file_;
  const char* cursor_;
  const char* end_;
  PlyEncoding encoding_;
  std::size_t line_;
  const PlyElement* element_ = nullptr;
  std::uint64_t row_ = 0;
};

inline std::size_t sizeOf(PlyType type) {
  constexpr std::size_t kSizes[]{0, 1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

}  // namespace nephele::detail
