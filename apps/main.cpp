#ifdef NEPHELE_WITH_MIMALLOC
#include <mimalloc.h>
#endif

#include "apps/app.h"
#include "nephele/modeling/base/system.h"

namespace {

// Grids are filled once and freed: the first touch of their memory costs most, and less in large pages.
void prepareAllocator() {
#ifdef NEPHELE_WITH_MIMALLOC
  mi_option_set_enabled_default(mi_option_large_os_pages, true);
#else
  nephele::returnLargeBlocksAtOnce();
#endif
}

}  // namespace

int main(int argc, char** argv) {
  prepareAllocator();
  return nephele::apps::runProgram(argc, argv, nephele::apps::allVerbs());
}
