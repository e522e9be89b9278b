// The distance is a maximum over axes, so it is exact when it is taken one axis at a time: the minimum over y
// of max(|y|, d(y)) only needs d to be known along the axes done before.
#include "nephele/render/volume/detail/brick_distances.h"

#include <algorithm>

#include "nephele/modeling/base/parallel.h"

namespace nephele::detail {

void spreadDistances(std::vector<std::uint8_t>& distances, const Vec3i& n) {
  const std::size_t stride[3] = {1, std::size_t(n.x), std::size_t(n.x) * n.y};
  for (int axis = 0; axis != 3; ++axis) {
    const int along = n[axis], a = (axis + 1) % 3, b = (axis + 2) % 3;
    parallelFor(std::size_t(n[b]), 4, [&](std::size_t begin, std::size_t end) {
      std::vector<int> line(along), nearest(along);
      for (std::size_t j = begin; j != end; ++j)
        for (int i = 0; i != n[a]; ++i) {
          std::uint8_t* start = distances.data() + j * stride[b] + std::size_t(i) * stride[a];
          for (int k = 0; k != along; ++k) line[k] = start[std::size_t(k) * stride[axis]];
          // Distances of neighbours in the plane already done differ freely, so each entry looks as far as it
          // can improve.
          for (int k = 0; k != along; ++k) {
            int best = line[k];
            for (int step = 1; step < best; ++step) {
              if (k - step >= 0) best = std::min(best, std::max(step, line[k - step]));
              if (k + step < along) best = std::min(best, std::max(step, line[k + step]));
            }
            nearest[k] = best;
          }
          for (int k = 0; k != along; ++k) start[std::size_t(k) * stride[axis]] = std::uint8_t(nearest[k]);
        }
    });
  }
}

}  // namespace nephele::detail
