#pragma once

#include <Imath/ImathBox.h>
#include <OpenEXR/ImfHeader.h>

#include <exception>
#include <map>
#include <optional>
#include <string>

#include "nephele/render/image/image.h"
#include "nephele/render/image/image_camera.h"
#include "nephele/render/image/image_file.h"

namespace nephele::detail {

/// Pixels of an image in the picture that it is a part of.
Imath::Box2i dataWindow(int width, int height, const std::optional<Image::Display>& display);

/// The header that all of our OpenEXR files have in common: windows, camera, colours, metadata.
Imf::Header exrHeader(int width, int height, const std::optional<Image::Display>& display,
                      const ImageCamera& camera, const std::map<std::string, std::string>& metadata);

/// What a header says before the pixels. @throws Error naming `path`
ImageHeader imageHeader(const std::string& path, const Imf::Header& header);

/// Gives the rows of a deep file, made of scan lines, to `reader`. @throws Error naming the path
void readDeepRows(const std::string& path, const ImageReader& reader);

/// Within a handler: passes our errors on, and says in our words what OpenEXR's are about.
[[noreturn]] void refuseExr(const std::string& path, const std::exception& error);

}  // namespace nephele::detail
