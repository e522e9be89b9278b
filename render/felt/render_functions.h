#pragma once

#include "nephele/modeling/felt/registry.h"

namespace nephele::felt {

/// Adds what makes pictures: render. To be added after `addLevelsetFunctions`.
void addRenderFunctions(Registry& registry);

}  // namespace nephele::felt
