#pragma once

#include "nephele/modeling/base/box.h"

namespace nephele {

/// An eighth of a box: the upper half along axis i where bit i of `index` is set, else the lower one.
inline Box octant(const Box& box, int index) {
  const Vec3f middle = box.center();
  Box part = box;
  for (int axis = 0; axis < 3; ++axis) (index >> axis & 1 ? part.min : part.max)[axis] = middle[axis];
  return part;
}

}  // namespace nephele
