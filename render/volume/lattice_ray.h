#pragma once

#include "nephele/modeling/base/math.h"

namespace nephele {

/// A line through one lattice: position at distance s is origin + s direction.
struct LatticeRay {
  Vec3f origin, direction;
};

}  // namespace nephele
