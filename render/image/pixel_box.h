#pragma once

#include <algorithm>

namespace nephele {

/// Pixels x0 <= x < x1, y0 <= y < y1 of a picture; (0, 0) is the upper left one.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  bool contains(int x, int y) const { return x >= x0 && x < x1 && y >= y0 && y < y1; }
  /// So many pixels farther to all sides.
  PixelBox grownBy(int pixels) const { return {x0 - pixels, y0 - pixels, x1 + pixels, y1 + pixels}; }
  /// Of width or height 0 or less where they do not meet.
  PixelBox sharedWith(const PixelBox& other) const {
    return {std::max(x0, other.x0), std::max(y0, other.y0), std::min(x1, other.x1), std::min(y1, other.y1)};
  }
  bool operator==(const PixelBox&) const = default;
};

}  // namespace nephele
