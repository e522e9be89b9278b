#include "nephele/modeling/base/system.h"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <new>

namespace nephele {
namespace {

/// Calls advise(begin, size) for the whole pages of a size, a power of two, between two addresses.
template <class Advise>
void forWholePages(void* first, void* last, std::uintptr_t size, const Advise& advise) {
  const auto begin = (reinterpret_cast<std::uintptr_t>(first) + size - 1) & ~(size - 1);
  const auto end = reinterpret_cast<std::uintptr_t>(last) & ~(size - 1);
  if (begin < end) advise(reinterpret_cast<void*>(begin), end - begin);
}

}  // namespace

double allowedMemory() {
  double bytes = double(sysconf(_SC_PHYS_PAGES)) * double(sysconf(_SC_PAGE_SIZE));
  for (const char* path : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    std::ifstream file(path);
    double limit = 0;
    if (file >> limit && limit > 0) bytes = std::min(bytes, limit);
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
    bytes = std::min(bytes, double(limit.rlim_cur));
  return bytes;
}

double peakMemory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) * 1024;
}

void returnLargeBlocksAtOnce() {
  mallopt(M_MMAP_THRESHOLD, 1 << 17);
}

int memoryFile(const char* name) {
  return memfd_create(name, MFD_CLOEXEC);
}

namespace detail {

void* newPages(std::size_t bytes) {
  void* const pages = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (pages == MAP_FAILED) throw std::bad_alloc();
  return pages;
}

void freePages(void* pages, std::size_t bytes) {
  munmap(pages, bytes);
}

void adviseHugePages(void* first, void* last) {
  constexpr std::uintptr_t kHugePage = std::uintptr_t(1) << 21;
  // Where the system refuses, ordinary pages do.
  forWholePages(first, last, kHugePage, [](void* begin, std::size_t bytes) {
    static_cast<void>(madvise(begin, bytes, MADV_HUGEPAGE));
  });
}

void dropPages(void* first, void* last) {
  static const auto page = std::uintptr_t(sysconf(_SC_PAGE_SIZE));
  forWholePages(first, last, page, [](void* begin, std::size_t bytes) {
    static_cast<void>(madvise(begin, bytes, MADV_DONTNEED));
  });
}

void trimAllocator() {
  malloc_trim(0);
}

}  // namespace detail
}  // namespace nephele
