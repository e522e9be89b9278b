#include "nephele/levelset/felt/grid_functions.h"

#include "nephele/levelset/felt/detail/functions.h"
#include "nephele/levelset/felt/flow_functions.h"

namespace nephele::felt {

void addLevelsetFunctions(Registry& registry) {
  registry.beginData();
  addCacheFunctions(registry);
  addMeshFunctions(registry);
  addFileFunctions(registry);
  addGriddedCloudFunctions(registry);
  addFlowFunctions(registry);
}

}  // namespace nephele::felt
