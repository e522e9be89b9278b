#include "apps/app.h"
#include "nephele/modeling/base/system.h"

int main(int argc, char** argv) {
  using namespace nephele::apps;
  nephele::returnLargeBlocksAtOnce();
  return runProgram(argc, argv,
                    {levelsetVerb(), cloudVerb(), advectVerb(), wispsVerb(), meshVerb(), cutVerb(),
                     transferVerb(), transformVerb(), renderVerb(), turntableVerb(), infoVerb(), feltVerb()});
}
