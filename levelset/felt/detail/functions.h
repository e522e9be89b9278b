#pragma once

#include "nephele/modeling/felt/argument.h"
#include "nephele/modeling/felt/registry.h"

/// The built-in functions of levelset, by the headings of the reference.
namespace nephele::felt {

void addCacheFunctions(Registry& registry);
void addMeshFunctions(Registry& registry);
void addFileFunctions(Registry& registry);
void addGriddedCloudFunctions(Registry& registry);

/// What was written to a cache last. @throws CallError if nothing was.
template <class T>
const Field<T>& samplesOf(const Cache<T>& cache) {
  if (!cache.values)
    throw CallError(Code::noValue, "nothing has been written to this cache yet",
                    "cachewrite(cache, field) fills it");
  return *cache.values;
}

/// The closed mesh of triangles that a shape stands for, repaired as far as that goes; what was done is told
/// as notes. @throws Error as `repairMesh`; Cancelled.
Mesh solidOf(const Shape& shape, const Context& context);
/// `level` cut off by a box that holds all of its inside, so that its ranges show where that ends: beyond the
/// box it falls by at least `slope` per world unit.
ScalarField endingAt(const ScalarField& level, const Box& box, float slope);

}  // namespace nephele::felt
