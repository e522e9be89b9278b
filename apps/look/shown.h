#pragma once

#include <string>
#include <vector>

#include "nephele/render/image/image.h"
#include "nephele/render/image/view_transform.h"

namespace nephele::apps {

/// What of a picture is shown.
struct LookShow {
  enum class What {
    cloud,
    surface,  ///< Of the cloud, or where the density is half of its most, shaded.
    checker   ///< What the cloud grows on, with a chess board on its texture coordinates.
  };
  What what = What::cloud;
  /// "beauty", "depth", "normal", "transmittance", "albedo", or "light_NAME".
  std::string layer = "beauty";
  /// Luminance in colours, a stop each; grey is green.
  bool falseColor = false;

  /// The layers that the marcher must make for it.
  std::vector<std::string> layers() const;
};

/// What is shown of `image`, as a JPEG file. @throws Error where the layer is not there.
std::string shownJpeg(const Image& image, const LookShow& show, const ViewTransform& view, int quality = 88);

/// A JPEG file of 8 bit red, green and blue.
std::string jpegOf(const std::vector<std::uint8_t>& rgb, int width, int height, int quality);

}  // namespace nephele::apps
