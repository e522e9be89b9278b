#pragma once

#include <optional>

#include "nephele/modeling/base/math.h"

namespace nephele {

/// From where a volume is looked at: a place, or the way of all rays.
struct Viewpoint {
  std::optional<Vec3f> place, forward;
};

}  // namespace nephele
