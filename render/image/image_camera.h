#pragma once

#include <array>

namespace nephele {

/// Row-major 4x4 matrix for row vectors, p' = p M, as images store it.
using Mat44 = std::array<float, 16>;

/// What an image keeps of the camera that saw it, as OpenEXR's standard attributes have it; see Camera.
struct ImageCamera {
  Mat44 worldToCamera{}, worldToNdc{};
  /// Width of the whole picture at distance 1 along the line of sight.
  float screenWidth = 1.0f;
};

}  // namespace nephele
