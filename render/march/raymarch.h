#pragma once

#include <memory>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/march/integrator.h"
#include "nephele/render/march/render_options.h"
#include "nephele/render/scene/camera.h"
#include "nephele/render/scene/lights.h"
#include "nephele/render/scene/medium.h"
#include "nephele/render/scene/surfaces.h"
#include "nephele/render/volume/render_volume.h"

namespace nephele {

/// Extinction that suits a volume whatever its units: an optical depth of 150 across its longest side at
/// density 1, or at the typical density where that is larger. It gives a cumulus its crisp edge. 1 for an
/// empty volume.
float defaultExtinction(const RenderVolume& volume);
/// The same of a volume of this longest side (world units) and typical density.
float defaultExtinction(float longestSide, float typicalDensity);

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
struct SkyPart;
}  // namespace detail

/// A volume with the light in it, made once, that any number of cameras may look at: renderImage in two
/// parts. The pictures are the same. Cheap to copy.
class LitVolume {
 public:
  /// Keeps a reference to `volume`, which must outlive it and its copies. `surfaces`, if there are any, cast
  /// their shadows into it, and belong into the options of its pictures. @throws Error if an argument is
  /// outside its range, or there are objects and nothing to be seen of the volume.
  LitVolume(const RenderVolume& volume, const Medium& medium, const Lights& lights, const Octaves& octaves,
            const Progress& progress = silent(), std::shared_ptr<const Surfaces> surfaces = nullptr);
  /// A volume that is gone at once cannot be looked at.
  LitVolume(const RenderVolume&&, const Medium&, const Lights&, const Octaves&, const Progress& = silent(),
            std::shared_ptr<const Surfaces> = nullptr) = delete;

  /// Puts the same volume under `lights`; copies keep theirs. What they have in common with the present ones
  /// is not made again: the sky's part, where only suns differ. The rest goes first, so that two lights never
  /// stand side by side. After an error, or where it was cancelled, there are no pictures until it is called
  /// again.
  void relight(const Lights& lights, const Progress& progress = silent());

  /// @throws Error as renderImage does, if octaves or objects are not those that the light was made with, or
  /// if there is no light, see `relight`.
  /// `lightSeconds` of the result is 0.
  RenderResult render(const Camera& camera, const RenderOptions& options,
                      const Progress& progress = silent()) const;

  /// What marches the rays of such a picture, for nephele::render. The volume and this may not go before it.
  /// @throws Error as `render` does.
  std::unique_ptr<Integrator> integrator(const RenderOptions& options) const;

  const Lights& lights() const { return lights_; }
  /// Null where there are none.
  const std::shared_ptr<const Surfaces>& surfaces() const { return surfaces_; }
  /// What it took to make the light.
  double lightSeconds() const { return lightSeconds_; }

 private:
  const RenderVolume* volume_;
  Medium medium_;
  Lights lights_;
  Octaves octaves_;
  std::shared_ptr<const Surfaces> surfaces_;
  std::shared_ptr<const detail::BakedLight> light_;
  // Of a light that is gone.
  std::shared_ptr<const detail::SkyPart> skyPart_;
  bool isLit_ = false;
  double lightSeconds_ = 0;
};

/// Bytes that renderImage will hold beside the volume, at most.
double estimateRenderBytes(const RenderVolume& volume, const Lights& lights, const Camera& camera,
                           const RenderOptions& options);

}  // namespace nephele
