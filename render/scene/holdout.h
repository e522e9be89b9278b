#pragma once

#include <memory>
#include <string>
#include <vector>

#include "nephele/render/image/deep_image.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/holdout_curve.h"

namespace nephele {

/// What stands in front of a picture's pixels: of everything behind it only a share is seen.
///
/// With T_h(z) the transmittance in front of depth z, the march becomes
///     C += T_h T (1 - dT) S,   alpha += T_h T (1 - dT),   T *= dT
/// so that what is in front of the holdout stays as it is, and two elements held out by each other add up to
/// the picture of both, opacity included.
class Holdout {
 public:
  /// From samples that need not be sorted or apart from each other: transmittances multiply. @throws Error
  /// as DeepImage::check does.
  explicit Holdout(const DeepImage& image);

  /// At the pixel (x, y) of the whole picture; nothing is held out outside the image.
  HoldoutCurve at(int x, int y) const;

  /// Size of the whole picture that it is for.
  int width() const { return display_.width; }
  int height() const { return display_.height; }
  std::size_t memoryBytes() const;

 private:
  Image::Display display_;
  int width_, height_;
  std::vector<std::size_t> start_;
  std::vector<HoldoutCurve::Knot> knots_;
};

/// The holdout of a deep OpenEXR file. @throws Error naming the path if it cannot be read, or if it is not
/// for pictures of the size of `camera`'s, or was made by another camera: one whose `worldToCamera` turns or
/// shifts what `camera` sees by more than a ten-thousandth, or, where `screenWindowWidth` is not the 1 that
/// says nothing, whose picture is not as wide. Files without a camera are taken as they are, and so is a
/// camera that looks along its -z.
std::shared_ptr<const Holdout> readHoldout(const std::string& path, const Camera& camera,
                                           double mostBytes = 8e9);

}  // namespace nephele
