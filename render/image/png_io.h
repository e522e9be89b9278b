#pragma once

#include <map>
#include <string>

#include "nephele/render/image/view_transform.h"

namespace nephele {

/// Writes `image` in 8 bits, through `view`. Written beside `path` and renamed. `metadata` and the name of
/// the view (`view_transform`) become text chunks, in UTF-8 (iTXt) where they are more than ASCII. The file
/// says that its numbers follow the sRGB curve, or none (raw); of a configView it says nothing.
/// @throws Error naming the path; no partial file stays.
void writePng(const std::string& path, const Image& image, const ViewTransform& view,
              const std::map<std::string, std::string>& metadata = {});

}  // namespace nephele
