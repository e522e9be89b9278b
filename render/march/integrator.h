#pragma once

#include <cstdint>
#include <memory>

#include "nephele/modeling/base/progress.h"
#include "nephele/render/march/film.h"
#include "nephele/render/march/render_scene.h"

namespace nephele {

/// Estimates the light that reaches the pixels of a film: by marching rays, or by following random paths.
///
/// `render` asks for a picture: `prepare` once, then a `TileWorker` for every thread, then the tiles.
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// The work of one thread on a picture, with the memory that it keeps from tile to tile.
  class TileWorker {
   public:
    virtual ~TileWorker() = default;
    /// Fills pixels with what their rays gather. The tile counts in the whole picture, whatever the film's
    /// window. A pixel must not depend on the tile that it is asked for in.
    virtual void integrate(const PixelBox& tile, Film& film) = 0;
    /// Fills pixels with what the rays through their centres meet, where Film::wantsPoints().
    virtual void findPoints(const PixelBox& tile, Film& film) = 0;

    std::uint64_t rays = 0, samples = 0;
  };

  /// What the work is called to the user.
  virtual const char* stage() const = 0;
  /// Pixels along the edge of a tile.
  virtual int tileSize() const { return 16; }
  virtual int raysPerPixel() const = 0;
  /// What is darker need not be told apart as finely by FilmOptions::adaptiveThreshold.
  virtual float faintRadiance() const { return 0.0f; }

  /// Makes ready for a picture: whatever depends on the camera and not on a single pixel, passes over the
  /// whole picture included. False if there is nothing to be seen. `scene` and `film` stay until the last
  /// tile is done. @throws Error if the integrator cannot do what is asked for; Cancelled.
  virtual bool prepare(const RenderScene& scene, const Film& film, const Progress& progress) = 0;
  virtual std::unique_ptr<TileWorker> worker() const = 0;
};

/// Fills `film` with what `integrator` sees of `scene`: tiles on all cores, in passes where the film is
/// adaptive, with progress and cancelling. The same at any number of threads.
/// @throws Error if the scene or the film's options are outside their ranges; Cancelled.
RenderResult render(const RenderScene& scene, Integrator& integrator, Film film,
                    const Progress& progress = silent());

}  // namespace nephele
