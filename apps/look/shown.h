#pragma once

#include <optional>
#include <string>
#include <vector>

#include "nephele/render/image/image.h"
#include "nephele/render/image/view_transform.h"

namespace nephele::apps {

/// What of a picture is shown.
struct LookShow {
  enum class What {
    cloud,    ///< Or the density that is there.
    surface,  ///< Of the cloud, or where the density is half of its most, shaded.
    checker,  ///< What the cloud grows on, with a chess board on its texture coordinates.
    wisps,    ///< Fine dots in place of a cloud.
    pieces,   ///< What is cut, its pieces moved apart.
    transfer  ///< Two meshes, and what is carried from the first to the second.
  };
  /// What pages and the command line call it.
  static const std::string& word(What what);
  static std::optional<What> named(const std::string& word);
  /// The verb whose options say what it is.
  static std::string verb(What what);
  What what = What::cloud;
  /// "beauty", "depth", "normal", "transmittance", "albedo", or "light_NAME".
  std::string layer = "beauty";
  /// Luminance in colours, a stop each; grey is green.
  bool falseColor = false;

  /// Marched, with layers; the others are surfaces, shaded in a light of their own.
  bool isVolume() const { return what == What::cloud || what == What::wisps; }
  /// The layers that the marcher must make for it.
  std::vector<std::string> layers() const;
};

/// What is shown of `image`, as a JPEG file. @throws Error where the layer is not there.
std::string shownJpeg(const Image& image, const LookShow& show, const ViewTransform& view, int quality = 88);

/// A JPEG file of 8 bit red, green and blue.
std::string jpegOf(const std::vector<std::uint8_t>& rgb, int width, int height, int quality);

}  // namespace nephele::apps
