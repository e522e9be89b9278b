#pragma once

#include "nephele/render/image/image.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/clear_sky.h"

namespace nephele {

/// The air between a camera and what its picture shows: what is far is paler, and bluer or redder as the sun
/// stands.
struct AerialPerspective {
  ClearSky sky;
  /// World units are so long, above 0.
  float metresPerUnit = 1;
  /// Multiplies the light of the air, as Environment::Options::intensity that of the sky.
  float intensity = 1;
};

/// Puts the air into a picture by its layer Z_mean: of a pixel at that depth the share `left` of R, G, B, of
/// light_* and of emission stays, and A times the light of the air is added to R, G, B and to a layer
/// light_air, which there is where there are layers of lights. A, and pixels in which there is nothing, stay
/// as they are.
/// Cost: a ray through the air for every tile, of 16 x 16 pixels in large pictures, and 9 depths.
/// @throws Error if there is no layer Z_mean, or `air` is outside its range.
/// Source: Hillaire (2020), section 5.4, whose grid over picture and depth this is.
void addAir(Image& image, const Camera& camera, const AerialPerspective& air);

}  // namespace nephele
