#pragma once

#include "nephele/render/image/image.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"

namespace nephele {

/// Adds the layer backdrop.R, .G, .B to `image`: a sky to stand behind it in previews, see `displayed`. R, G,
/// B and A stay as they are.
///
/// Of a clear sky, its radiance, and below the horizon the haze that hangs there: of the height sin e of a
/// direction (sin e + sqrt(sin^2 e + 0.04^2)) / 2 is taken. Of another map of the sky, its radiance, smoothed
/// over its pixels. Else a gradient: at elevation e
///     haze + (0.7 sky - haze) (1 - exp(-3 sin e)),  haze = 0.6 sky + 0.7 max(sky),
/// and the haze below the horizon.
void addBackdrop(Image& image, const Camera& camera, const Lights& lights);

}  // namespace nephele
