#pragma once

namespace nephele {

/// Pixels x0 <= x < x1, y0 <= y < y1 of a picture; (0, 0) is the upper left one.
struct PixelBox {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;

  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  bool operator==(const PixelBox&) const = default;
};

}  // namespace nephele
