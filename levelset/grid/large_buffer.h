#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "nephele/modeling/base/system.h"

namespace nephele::detail {

/// Leaves plain values unset where a vector grows by `resize(count)`, so that threads touch its pages first
/// that then write them.
template <class T>
struct UnsetAllocator : std::allocator<T> {
  template <class U>
  struct rebind {
    using other = UnsetAllocator<U>;
  };
  using std::allocator<T>::allocator;

  template <class U>
  void construct(U* place) {
    ::new (static_cast<void*>(place)) U;
  }
  template <class U, class... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    std::construct_at(place, std::forward<Arguments>(arguments)...);
  }
};

template <class T>
using UnsetVector = std::vector<T, UnsetAllocator<T>>;

/// Asks for huge pages where values have not been touched yet: first touch then costs a fifth.
template <class T>
void useHugePages(T* first, T* last) {
  adviseHugePages(first, last);
}

/// Makes room in a large vector of plain values, on huge pages where the system offers them.
template <class Vector>
void reserveLarge(Vector& values, std::size_t count) {
  values.reserve(count);
  useHugePages(values.data(), values.data() + values.capacity());
}

/// Grows a large vector of plain values on huge pages.
template <class Vector>
void resizeLarge(Vector& values, std::size_t count) {
  reserveLarge(values, count);
  values.resize(count);
}

/// Gives the whole pages of values that are no longer needed back to the system; they read as 0 from then on.
template <class T>
void releasePages(T* first, T* last) {
  dropPages(first, last);
}

/// Gives back what the allocator keeps of memory that was freed: after a stage with many small parts, before
/// one with few large ones.
inline void releaseFreed() {
  trimAllocator();
}

}  // namespace nephele::detail
