#pragma once

#include <span>
#include <vector>

#include "nephele/levelset/cut/cut_parts.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/render/image/image.h"
#include "nephele/render/scene/surfaces.h"

namespace nephele {

struct PiecesPictureOptions {
  int width = 1280, height = 720;
  /// Where the camera stands; it frames all pieces.
  float azimuthDegrees = 25.0f, elevationDegrees = 18.0f;
  /// How far pieces are moved apart, see `explodedOffsets`.
  double explode = 0.4;
  /// Rays per pixel, fewer where there is only open ground.
  int samples = 8;
};

/// Colours that tell `count` pieces apart, linear, all different: pieces that touch get colours far from each
/// other, large pieces the clearest. `neighbours` and `sizes` go by piece.
std::vector<Vec3f> pieceColours(std::span<const std::vector<PieceContact>> neighbours,
                                std::span<const double> sizes);

/// Pieces moved apart as `explodedOffsets` says, as objects in the colours of `picturePieces`. @throws Error
/// if there are no pieces.
std::vector<SurfaceObject> piecesObjects(const Pieces& pieces, double explode);

/// Pieces moved apart, on a ground that fades into the backdrop, each in its colour, inner faces paler; soft
/// light of a lamp and a sky, and what faces throw on each other. Channels R, G, B, A, linear, opaque. The
/// same at any number of threads.
/// @throws Error if there are no pieces or an option is outside its range; Cancelled.
Image picturePieces(const Pieces& pieces, const PiecesPictureOptions& options,
                    const Progress& progress = silent());

}  // namespace nephele
