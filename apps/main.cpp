#include "apps/app.h"
#include "nephele/modeling/base/system.h"

int main(int argc, char** argv) {
  nephele::returnLargeBlocksAtOnce();
  return nephele::apps::runProgram(argc, argv, nephele::apps::allVerbs());
}
