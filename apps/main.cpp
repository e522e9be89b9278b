#include "apps/app.h"

int main(int argc, char** argv) {
  using namespace nephele::apps;
  return runProgram(argc, argv, {levelsetVerb(), cloudVerb(), meshVerb(), renderVerb(), infoVerb()});
}
