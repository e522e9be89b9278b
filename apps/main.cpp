#include <hwy/nanobenchmark.h>
#ifdef NEPHELE_WITH_MIMALLOC
#include <mimalloc.h>
#endif

#include "apps/app.h"
#include "nephele/modeling/base/system.h"

// Highway's library measures this whenever it is loaded, for benchmarks that are none of the program's, and
// that is a sixth of the time in which it starts. The program's own function comes before the library's.
uint64_t hwy::platform::TimerResolution() {
  return 1;
}

namespace {

// Grids are filled once and freed: the first touch of their memory costs most, and less in large pages.
void prepareAllocator() {
#ifdef NEPHELE_WITH_MIMALLOC
  mi_option_set_enabled_default(mi_option_large_os_pages, true);
  // Else the first segment of each thread comes in small pages, and short runs need no second one.
  mi_option_set_default(mi_option_eager_commit_delay, 0);
#else
  nephele::returnLargeBlocksAtOnce();
#endif
}

}  // namespace

int main(int argc, char** argv) {
  prepareAllocator();
  return nephele::apps::runProgram(argc, argv, nephele::apps::allVerbs());
}
