#pragma once

#include <string>
#include <vector>

#include "nephele/modeling/base/box.h"

namespace nephele::apps {

/// How large an input is and where: what lengths in percent, voxels, cameras and extinctions are chosen by.
struct Extent {
  Box box;
  /// Of the box; of several inputs, that of the largest.
  double longestSide = 0;
  /// What a camera frames.
  std::vector<Vec3f> outline{};
  /// See RenderVolume::typicalDensity; of several inputs, the largest.
  float typicalDensity = 0;

  /// Goes on to describe this and the other input, taken together.
  void include(const Extent& other);
  /// Equal ones have equal texts.
  std::string text() const;
};

/// Extent of a mesh or points, or of the first grid of a volume that holds numbers: of a level set, of its
/// surface, to a voxel. @throws Error naming the path.
Extent extentOfFile(const std::string& path);

}  // namespace nephele::apps
