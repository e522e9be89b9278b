#pragma once

#include <string>

#include "apps/options/options.h"
#include "nephele/render/image/exr_io.h"

namespace nephele::apps {

/// Declares an option that says how the numbers of a picture file stand for light.
inline CLI::Option* addColourEncoding(CLI::App& app, const std::string& option, ColourEncoding& encoding,
                                      const std::string& description) {
  return addChoice(app, option, encoding,
                   {{"auto", ColourEncoding::automatic},
                    {"linear", ColourEncoding::linear},
                    {"srgb", ColourEncoding::srgb}},
                   description);
}

}  // namespace nephele::apps
