#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

// Memory for many small arrays, and for a large one. Not for other folders.
namespace nephele::detail {

/// Small arrays of plain values that live as long as this.
class MemoryChunks {
 public:
  /// `count` values that are not set.
  template <class T>
  std::span<T> take(std::size_t count) {
    static_assert(std::is_trivially_destructible_v<T> && alignof(T) <= alignof(std::max_align_t));
    const std::size_t begin = (used_ + alignof(T) - 1) / alignof(T) * alignof(T);
    if (!chunks_.empty() && begin + count * sizeof(T) <= size_) {
      used_ = begin + count * sizeof(T);
      return {reinterpret_cast<T*>(chunks_.back().get() + begin), count};
    }
    size_ = std::max(count * sizeof(T), std::min<std::size_t>(2 * size_ + 4096, std::size_t(1) << 18));
    chunks_.push_back(std::make_unique_for_overwrite<std::byte[]>(size_));
    used_ = count * sizeof(T);
    return {reinterpret_cast<T*>(chunks_.back().get()), count};
  }

  template <class T>
  std::span<T> copyOf(std::span<const T> values) {
    const std::span<T> copy = take<T>(values.size());
    std::copy(values.begin(), values.end(), copy.begin());
    return copy;
  }

 private:
  std::vector<std::unique_ptr<std::byte[]>> chunks_;
  std::size_t used_ = 0, size_ = 0;
};

/// Floats that are not set, on huge pages where there are many and the system offers them. Memory that is
/// never touched costs nothing.
class LargeArray {
 public:
  explicit LargeArray(std::size_t count = 0);

  float* data() { return values_.get(); }
  const float* data() const { return values_.get(); }

 private:
  struct Free {
    void operator()(float* values) const;
  };
  std::unique_ptr<float[], Free> values_;
};

}  // namespace nephele::detail
