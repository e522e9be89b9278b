#pragma once

#include "nephele/modeling/base/math.h"

namespace nephele::detail {

/// Voxels [first, last], both included.
struct VoxelBox {
  Vec3i first, last;

  bool isEmpty() const { return first.x > last.x || first.y > last.y || first.z > last.z; }
  bool contains(const Vec3i& v) const {
    return v.x >= first.x && v.y >= first.y && v.z >= first.z && v.x <= last.x && v.y <= last.y &&
           v.z <= last.z;
  }
  bool contains(const VoxelBox& b) const { return contains(b.first) && contains(b.last); }
  VoxelBox intersection(const VoxelBox& b) const { return {max(first, b.first), min(last, b.last)}; }
};

}  // namespace nephele::detail
