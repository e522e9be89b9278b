#pragma once

#include <map>
#include <string>

#include "nephele/render/image/image.h"

namespace nephele {

/// Writes `image` as an 8 bit sRGB picture, through `view`. Written beside `path` and renamed. `metadata`
/// becomes text chunks, in UTF-8 (iTXt) where it is more than ASCII.
/// @throws Error naming the path; no partial file stays.
void writePng(const std::string& path, const Image& image, const ViewTransform& view,
              const std::map<std::string, std::string>& metadata = {});

}  // namespace nephele
