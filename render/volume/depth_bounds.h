#pragma once

#include <limits>
#include <vector>

#include "nephele/render/scene/camera.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// For every part of a picture the depths between which a volume may hold anything, so that most rays which
/// miss it need not be marched, and the others start near it.
class DepthBounds {
 public:
  /// Depths along the line of sight, world units. Empty if near > far: nothing is there.
  struct Range {
    float near = std::numeric_limits<float>::infinity(), far = -std::numeric_limits<float>::infinity();

    bool isEmpty() const { return near > far; }
  };

  /// For the pixels `window` of pictures of `camera` where it stands at the frame, through a pinhole. A
  /// volume that reaches behind the camera may be anywhere. Cost: some 10^4 boxes projected, and one pass
  /// over the occupied bricks.
  DepthBounds(const RenderVolume& volume, const Camera& camera, const PixelBox& window);

  /// For rays through the pixel (x, y) and up to one pixel around it, half a voxel to all sides of them
  /// included. The pixel must be in the window.
  const Range& at(int x, int y) const {
    return cells_[std::size_t((y - window_.y0) / kCell) * std::size_t(across_) +
                  std::size_t((x - window_.x0) / kCell)];
  }

 private:
  static constexpr int kCell = 8;

  PixelBox window_;
  int across_ = 0;
  std::vector<Range> cells_;
};

}  // namespace nephele
