#pragma once

#include <malloc.h>
#include <sys/mman.h>

#include <cstdint>
#include <vector>

namespace nephele::detail {

/// Asks for huge pages where values have not been touched yet: first touch then costs a fifth.
template <class T>
void useHugePages(T* first, T* last) {
  constexpr std::uintptr_t kHugePage = std::uintptr_t(1) << 21;
  const auto begin = (reinterpret_cast<std::uintptr_t>(first) + kHugePage - 1) & ~(kHugePage - 1);
  const auto end = reinterpret_cast<std::uintptr_t>(last) & ~(kHugePage - 1);
  // A hint: where the system refuses, ordinary pages do.
  if (begin < end) static_cast<void>(madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE));
}

/// Makes room in a large vector of plain values, on huge pages where the system offers them.
template <class T>
void reserveLarge(std::vector<T>& values, std::size_t count) {
  values.reserve(count);
  useHugePages(values.data(), values.data() + values.capacity());
}

/// Grows a large vector of plain values on huge pages.
template <class T>
void resizeLarge(std::vector<T>& values, std::size_t count) {
  reserveLarge(values, count);
  values.resize(count);
}

/// Gives the whole pages of values that are no longer needed back to the system; they read as 0 from then on.
template <class T>
void releasePages(T* first, T* last) {
  constexpr std::uintptr_t kPage = 4096;
  const auto begin = (reinterpret_cast<std::uintptr_t>(first) + kPage - 1) & ~(kPage - 1);
  const auto end = reinterpret_cast<std::uintptr_t>(last) & ~(kPage - 1);
  if (begin < end) static_cast<void>(madvise(reinterpret_cast<void*>(begin), end - begin, MADV_DONTNEED));
}

/// Gives back what the allocator keeps of memory that was freed: after a stage with many small parts, before
/// one with few large ones.
inline void releaseFreed() {
  malloc_trim(0);
}

}  // namespace nephele::detail
