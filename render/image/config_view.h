#pragma once

#include <memory>
#include <string>

#include "nephele/render/image/view_transform.h"

namespace nephele {

/// A view of the OpenColorIO configuration at `path`: "DISPLAY/VIEW", a view's name (of the first display
/// that has one of this name, the default one before others), or "" for the default view of the default
/// display.
///
/// Light comes in as linear Rec. 709: by a colour space of a common name for it ("lin_rec709", "Linear
/// Rec.709 (sRGB)" ...), or else through the role aces_interchange; a configuration that has neither is taken
/// to have Rec. 709 primaries in its role scene_linear.
/// @throws Error naming the path if the configuration or a table that it needs cannot be read, if there is no
/// such view (the message lists those that there are), or if this library was built without OpenColorIO.
std::shared_ptr<const ConfigView> readConfigView(const std::string& path, const std::string& view);

/// Says what such a view does: equal where two views show the same, whatever files they were read from.
/// @throws Error as readConfigView does.
std::string configViewIdentity(const std::string& path, const std::string& view);

}  // namespace nephele
