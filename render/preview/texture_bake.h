#pragma once

#include <span>

#include "nephele/modeling/base/mesh.h"
#include "nephele/modeling/base/progress.h"
#include "nephele/render/image/image.h"

namespace nephele {

struct TextureBakeOptions {
  int width = 1024, height = 1024;
  /// Samples per texel along u and along v.
  int samples = 3;
  /// Texels around charts that continue them, so that filters do not reach what is no colour.
  int gutter = 16;
};

/// What was baked, and how much of it.
struct BakedTexture {
  /// R, G, B and A = 1, linear light; row 0 is at v = 1.
  Image image;
  /// Share of the texels that the object's charts cover.
  double covered = 0;
};

/// The reference's picture, laid out for the object's own texture coordinates.
///
/// Each texel is the mean of its samples: point of the object, its image on the reference (`images`, one for
/// every position of `object`, linear in between), the nearest point of the reference's surface, that point's
/// texture coordinates, and the picture there, filtered over what the sample covers of it. Every sample finds
/// its own chart, so that nothing is mixed or smeared at seams. Coordinates outside the unit square repeat.
/// Texels that no chart covers continue their neighbours for `gutter` texels, and are the mean colour beyond.
/// Cost: about a microsecond per sample. All cores; the same result at any number of threads.
/// @throws Error if a mesh lacks the corner or vertex attribute "uv" of two numbers or has no faces, there
/// are not as many images as positions, one is not finite, or an option is below 1 (the gutter: below 0);
/// Cancelled.
BakedTexture bakeTexture(const Mesh& reference, const Image& picture, const Mesh& object,
                         std::span<const Vec3d> images, const TextureBakeOptions& options = {},
                         const Progress& progress = silent());

/// Memory, in bytes, that `bakeTexture` takes beside what it is given. Measured.
constexpr double estimateBakeBytes(int width, int height) {
  return 48.0 * width * height;
}

}  // namespace nephele
