#pragma once

#include <memory>
#include <vector>

#include "nephele/levelset/warp/transfer_quality.h"
#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/render/image/image.h"
#include "nephele/render/scene/surfaces.h"

namespace nephele {

struct TransferPictureOptions {
  int width = 1280, height = 640;
  /// Where the camera stands, seen from either shape.
  float azimuthDegrees = 30.0f, elevationDegrees = 12.0f;
  /// Fields of a chess board across the unit square of texture coordinates, where there is no texture.
  int checkers = 32;
  int samples = 8;
};

/// The reference on the left and the object on the right, equally large and seen from the same side, with a
/// checker or pictures on their texture coordinates: `texture` that of the reference, `objectTexture` that of
/// the object, else the same.
/// @throws Error if a mesh has no faces or no corner attribute "uv", or an option is outside its range;
/// Cancelled.
Image pictureTransfer(const Mesh& reference, const Mesh& object, std::shared_ptr<const Image> texture,
                      std::shared_ptr<const Image> objectTexture, const TransferPictureOptions& options = {},
                      const Progress& progress = silent());

/// The same two shapes painted by how well a map from the object to the reference keeps them: the object from
/// grey (kept) over yellow to red (stretched by TransferQuality::kBadStretch), violet where its triangles
/// have collapsed or are turned over; the reference grey, violet where no image lies.
/// @throws Error as pictureTransfer, or if `quality` is not that of these meshes; Cancelled.
Image pictureDistortion(const Mesh& reference, const Mesh& object, const TransferQuality& quality,
                        const TransferPictureOptions& options = {}, const Progress& progress = silent());

/// What these pictures show, for a camera of one's own: two objects on the ground y = 0, the gap between them
/// over the origin, as they stand but side by side for a camera of azimuth `options.azimuthDegrees`. Each is
/// one unit long. @throws Error as these.
std::vector<SurfaceObject> transferObjects(const Mesh& reference, const Mesh& object,
                                           std::shared_ptr<const Image> texture,
                                           std::shared_ptr<const Image> objectTexture,
                                           const TransferPictureOptions& options = {});
std::vector<SurfaceObject> distortionObjects(const Mesh& reference, const Mesh& object,
                                             const TransferQuality& quality,
                                             const TransferPictureOptions& options = {});

}  // namespace nephele
