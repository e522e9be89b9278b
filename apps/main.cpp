#include <malloc.h>

#include "apps/app.h"

int main(int argc, char** argv) {
  using namespace nephele::apps;
  // The allocator raises this limit by itself and then keeps what large vectors leave behind, stage after
  // stage.
  mallopt(M_MMAP_THRESHOLD, 1 << 17);
  return runProgram(argc, argv,
                    {levelsetVerb(), cloudVerb(), advectVerb(), wispsVerb(), meshVerb(), cutVerb(),
                     transferVerb(), renderVerb(), turntableVerb(), infoVerb()});
}
