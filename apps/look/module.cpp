#include "apps/look/functions.h"

extern "C" __attribute__((visibility("default")))
const nephele::apps::LookFunctions nepheleLookFunctions{.make = &nephele::apps::makeLookServer};
