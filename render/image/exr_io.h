#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "nephele/render/image/image.h"
#include "nephele/render/image/image_camera.h"

namespace nephele {

class OutputFile;

/// What a MemoryFile holds of a picture that was written to it.
struct ExrContent {
  Image image;
  ImageCamera camera;
  std::map<std::string, std::string> metadata;
};

/// Writes an OpenEXR file, ZIP compressed: channels as 16 or 32 bit floats as they say, linear Rec. 709.
///
/// Carries `chromaticities`, `worldToCamera` and `worldToNDC` of the camera (a Camera will do; for row
/// vectors) and `metadata` as text attributes, the screen window for the picture's width at distance 1. The
/// data window is the image's, in a display window of the whole picture's size (Image::display). 16 bit
/// values beyond 65504 are clamped to it, NaN among them becomes 0 (see notFiniteCount). Written beside
/// `path` and renamed.
/// @throws Error naming the path; no partial file stays.
void writeExr(const std::string& path, const Image& image, const ImageCamera& camera,
              const std::map<std::string, std::string>& metadata = {});

/// Likewise into `output`, which the caller commits.
void writeExr(const OutputFile& output, const Image& image, const ImageCamera& camera,
              const std::map<std::string, std::string>& metadata = {});

/// What an OpenEXR file, flat or deep, says of the camera that saw it; nothing if it does not say all of it.
/// @throws Error naming the path if it cannot be read.
std::optional<ImageCamera> readImageCamera(const std::string& path);

/// Reads all channels of an OpenEXR (flat, first part), PNG or Radiance file as the file has them; integers
/// as 0 to 1. The pixels are those of the data window, the display is set where it is another. Nothing is
/// allocated that the file cannot hold, nor more than `mostBytes`.
/// @throws Error naming the path and what is wrong, also where only pixels are damaged.
Image readImage(const std::string& path, double mostBytes = std::numeric_limits<double>::infinity());

/// How the numbers of a picture file stand for light.
enum class ColourEncoding {
  /// As the file says: OpenEXR and Radiance hold light; in PNG the chunks iCCP, sRGB and gAMA count, in this
  /// order, and a file without them, or with a profile that is not of curves, is on the sRGB curve, with 8
  /// bits or 16.
  automatic,
  linear,
  srgb
};

/// As readImage, with R, G, B (three of grey) in linear light, premultiplied by the opacity A, which PNG
/// files do not hold so; other channels stay as they are.
/// @throws Error also where the file has no colours.
Image readLinearImage(const std::string& path, ColourEncoding encoding = ColourEncoding::automatic,
                      double mostBytes = std::numeric_limits<double>::infinity());

/// What is in an image file, as lines for a person: size, channels with types and ranges, layers, attributes;
/// of deep OpenEXR files of scan lines also the number of samples. Reads every pixel.
/// @throws Error as readImage does; also if more than `mostBytes` of pixels would have to be held at once, as
/// of interlaced PNG files.
std::vector<std::string> describeImage(const std::string& path,
                                       double mostBytes = std::numeric_limits<double>::infinity());

}  // namespace nephele
