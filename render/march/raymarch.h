#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/image/deep_image.h"
#include "nephele/render/image/image.h"
#include "nephele/render/scene/camera_motion.h"
#include "nephele/render/scene/holdout.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/scene/surfaces.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// How close the opacity and colour of deep samples follow the march at every depth.
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

/// How a picture is made.
struct RenderOptions {
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
  /// Moves the pattern of the samples.
  std::uint64_t seed = 0;
  /// 0: every pixel is marched. Otherwise every fourth of every fourth row is, and those between only where
  /// their four neighbours differ by more than this: in R, G or B as a share of the brightest of them (or
  /// of a fiftieth of what suns and sky make of a thin white medium), or in opacity. The others get the mean
  /// of the four (adaptive subdivision of the picture, Whitted 1980). Details less than four pixels wide may
  /// be missed. At most 1; not for deep pictures.
  float adaptiveThreshold = 0.0f;
  /// When the volume is looked at, if it moves; the camera's own shutter is in Camera::withShutter.
  Shutter shutter{};
  /// Of the volume, while the shutter is open. The light in it moves along with it.
  std::optional<RigidMotion> volumeMotion{};
  /// The camera one frame later, for motion in pixels where the shutter is open for an instant only.
  std::optional<Camera> nextCamera{};
  /// Makes RenderResult::deep as well.
  std::optional<DeepOptions> deep{};
  /// Hides what is behind it; for pictures of the camera's size.
  std::shared_ptr<const Holdout> holdout{};
  /// Opaque objects, lit by suns, points, spots and the sky through the volume, and casting the shadows of
  /// suns, points and spots into it. They stand still, and scatter no light into it. Layer light_objects.
  std::shared_ptr<const Surfaces> surfaces{};
  /// Extra layers, see Film: "Z" (distance along the line of sight at which the opacity passes 0.5 %, the
  /// nearest of the pixel's rays; +inf where none does), "transmittance" (1 - opacity), "albedo" (times
  /// opacity), "light" (light_<name> for every sun, and light_sky: their share of R, G, B), and what the ray
  /// through the pixel's centre meets in the middle of the shutter: "Z_median", "Z_mean" (where half of its
  /// opacity is met, and the mean weighted by opacity; +inf where there is none), "position", "normal"
  /// (world space, at the median), "motion" (pixels per frame, right and down).
  std::vector<std::string> aovs{"Z"};
};

/// A picture and what it took.
struct RenderResult {
  Image image;
  /// The same with depth, if RenderOptions::deep asks for it: flattened it is `image`.
  std::optional<DeepImage> deep{};
  std::uint64_t rays = 0;
  std::uint64_t samples = 0;
  double lightSeconds = 0;
  double marchSeconds = 0;
};

/// Extinction that suits a volume whatever its units: an optical depth of 150 across its longest side at
/// density 1, or at the typical density where that is larger. It gives a cumulus its crisp edge. 1 for an
/// empty volume.
float defaultExtinction(const RenderVolume& volume);

/// Looks at `volume` through `camera`: light precomputed, then marched, front to back, from every pixel.
///
/// C += T (1 - dT) * albedo * sum over lights;  a sun gives  irradiance * (phase * exp(-extinction * column)
/// + light scattered before, see Octaves), the sky radiance * J, see ScatteredLight. alpha = 1 - T; rays end
/// at T < 1e-4, what is left stays in alpha. Channels R, G, B, A (half, premultiplied, linear) and `aovs`
/// (float). An empty volume gives a picture of zeros. The same at any number of threads.
/// @throws Error if an option is outside its range or a layer is unknown.
RenderResult renderImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                         const Camera& camera, const RenderOptions& options = {},
                         const Progress& progress = silent());

namespace detail {
struct BakedLight;
}

/// A volume with the light in it, made once, that any number of cameras may look at: renderImage in two
/// parts. The pictures are the same. Cheap to copy.
class LitVolume {
 public:
  /// Keeps a reference to `volume`. `surfaces`, if there are any, cast their shadows into it, and belong into
  /// the options of its pictures. @throws Error if an argument is outside its range, or there are objects and
  /// nothing to be seen of the volume.
  LitVolume(const RenderVolume& volume, const Medium& medium, const Lights& lights, const Octaves& octaves,
            const Progress& progress = silent(), std::shared_ptr<const Surfaces> surfaces = nullptr);

  /// The same volume under `lights`. What they have in common with the present ones is not made again: the
  /// sky's part, where only suns differ.
  LitVolume underOther(const Lights& lights, const Progress& progress = silent()) const;

  /// @throws Error as renderImage does, or if octaves or objects are not those that the light was made with.
  /// `lightSeconds` of the result is 0.
  RenderResult render(const Camera& camera, const RenderOptions& options,
                      const Progress& progress = silent()) const;

  const Lights& lights() const { return lights_; }
  /// What it took to make the light.
  double lightSeconds() const { return lightSeconds_; }

 private:
  const RenderVolume* volume_;
  Medium medium_;
  Lights lights_;
  Octaves octaves_;
  std::shared_ptr<const Surfaces> surfaces_;
  std::shared_ptr<const detail::BakedLight> light_;
  double lightSeconds_ = 0;
};

/// Bytes that renderImage will hold beside the volume, at most.
double estimateRenderBytes(const RenderVolume& volume, const Lights& lights, const Camera& camera,
                           const RenderOptions& options);

}  // namespace nephele
