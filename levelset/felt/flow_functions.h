#pragma once

#include "nephele/modeling/felt/registry.h"

namespace nephele::felt {

/// Adds what simulates flows: tdivfree.
void addFlowFunctions(Registry& registry);

}  // namespace nephele::felt
