#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/image.h"
#include "nephele/render/image/pixel_box.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/scene/holdout.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/scene/surfaces.h"

namespace nephele {

/// How close the opacity and colour of deep samples follow the rays at every depth.
struct DeepOptions {
  /// Largest error of the opacity in front of any depth, and of the colour as a share of the pixel's.
  /// Samples become as long as it allows. What all samples together give is exact whatever it is.
  float tolerance = 0.004f;
};

/// How finely rays look at a density that is a field and not a grid, see gridlessVolume.
struct Refinement {
  /// A step is halved where that changes the opacity that is seen of it, behind all that is in front, by more
  /// than this.
  float threshold = 1.0f / 1024;
  /// As often as this at most, 0 to 16. 0: steps of one length through all bricks of 8^3 voxels that may hold
  /// anything.
  int halvings = 5;
};

/// Called when a tile is finished, with its pixels in the image, whose first one is (0, 0): only these may be
/// read. By one thread at a time, in no fixed order.
using TileObserver = std::function<void(const PixelBox&, const Image&)>;

/// What a picture keeps, see Film, and which of its pixels are integrated.
struct FilmOptions {
  /// Extra layers: "Z" (distance along the line of sight at which the opacity passes 0.5 %, the nearest of
  /// the pixel's rays; +inf where none does), "transmittance" (1 - opacity), "albedo" (times opacity),
  /// "light" (light_<name> for every sun, and light_sky: their share of R, G, B), and what the ray through
  /// the pixel's centre meets in the middle of the shutter: "Z_median", "Z_mean" (where half of its opacity
  /// is met, and the mean weighted by opacity; +inf where there is none), "position", "normal" (world space,
  /// at the median), "motion" (pixels per frame, right and down).
  std::vector<std::string> aovs{"Z"};
  /// Makes RenderResult::deep as well.
  std::optional<DeepOptions> deep{};
  /// 0: every pixel is integrated. Otherwise every fourth of every fourth row is, and those between only
  /// where their four neighbours differ by more than this: in R, G or B as a share of the brightest of them
  /// (or of a fiftieth of what suns and sky make of a thin white medium), or in opacity. The others get the
  /// mean of the four (adaptive subdivision of the picture, Whitted 1980). Details less than four pixels wide
  /// may be missed. At most 1; not for deep pictures, and not for noisy ones.
  float adaptiveThreshold = 0.0f;
  TileObserver onTile{};
};

/// What a picture shows beside volume, medium and lights, and what it keeps: the same for every integrator.
struct FrameOptions : FilmOptions {
  /// Moves the pattern of the samples, or chooses the random numbers.
  std::uint64_t seed = 0;
  /// When the volume is looked at, if it moves; the camera's own shutter is in Camera::withShutter.
  Shutter shutter{};
  /// Of the volume, while the shutter is open. The light in it moves along with it.
  std::optional<RigidMotion> volumeMotion{};
  /// The camera one frame later, for motion in pixels where the shutter is open for an instant only.
  std::optional<Camera> nextCamera{};
  /// Hides what is behind it; for pictures of the camera's size.
  std::shared_ptr<const Holdout> holdout{};
  /// Opaque objects, lit by suns, points, spots and the sky through the volume, and casting the shadows of
  /// suns, points and spots into it. They stand still. Layer light_objects. In marched pictures they scatter
  /// no light into the volume; see PathOptions for traced ones.
  std::shared_ptr<const Surfaces> surfaces{};
};

/// How a picture is marched.
struct RenderOptions : FrameOptions {
  Octaves octaves;
  /// Longest step in world units; default: one voxel, four where the density hardly varies. Where a voxel is
  /// nearly opaque steps are shorter by themselves; where a pixel is wider than a step, or little is seen of
  /// one since much lies in front, steps grow, to 4 times that at most. Opacity does not depend on it.
  /// Of a field: how far apart the first samples of a ray are, at most; they stand as close as pixels are
  /// wide where that is less. Default: a quarter of a voxel.
  std::optional<float> step;
  /// Where the density is a field.
  Refinement refinement{};
  /// Rays per pixel. One goes through the centre; more are spread over a tent two pixels wide.
  int samples = 4;
};

/// A picture and what it took.
struct RenderResult {
  Image image;
  /// The same with depth, if FilmOptions::deep asks for it: flattened it is `image`.
  std::optional<DeepImage> deep{};
  std::uint64_t rays = 0;
  std::uint64_t samples = 0;
  double lightSeconds = 0;
  double marchSeconds = 0;
};

}  // namespace nephele
