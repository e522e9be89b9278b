#pragma once

#include <span>

#include "nephele/render/march/march_kernels.h"

namespace nephele::test {

/// As marchRays, sample by sample: the truth that the vectors are tested against.
void marchRaysScalar(const MarchScene& scene, std::span<const MarchRay> rays, std::span<MarchResult> results);

}  // namespace nephele::test
