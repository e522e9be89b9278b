// Pictures by random paths. Layers that say where things are and not how they are lit come from a march
// without light, so that they have no noise.
//
// Limits: suns that shine through a narrow forward peak make noise that falls slowly, since they are points
// and no direction but the exact one finds them.
#include "nephele/render/march/path_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/detail/path_tracer.h"
#include "nephele/render/march/detail/picture.h"

namespace nephele {

namespace {

void check(const PathOptions& options) {
  require(options.samplesPerPixel >= 1 && options.samplesPerPixel <= 1 << 20,
          fmt::format("spp: expected 1 to {}, got {}", 1 << 20, options.samplesPerPixel));
  require(options.maxScatterings >= 0,
          fmt::format("scatterings: expected 0 (no limit) or more, got {}", options.maxScatterings));
}

class PathIntegrator final : public Integrator {
 public:
  explicit PathIntegrator(const PathOptions& options) : options_(options) {
    check(options);
    static_cast<FrameOptions&>(sightOptions_) = options;
    sightOptions_.deep.reset();
    sightOptions_.octaves.count = 1;
  }

  const char* stage() const override { return "trace"; }
  int tileSize() const override { return 8; }
  int raysPerPixel() const override { return options_.samplesPerPixel; }

  bool prepare(const RenderScene& scene, const Film& film, const Progress& progress) override {
    require(film.options().adaptiveThreshold == 0, "adaptive threshold: path traced pixels are too noisy");
    if (!isSeen(scene.volume, scene.medium)) return false;
    tracer_.emplace(scene, options_, film.options().deep.has_value(), progress);
    if (film.wantsDepth() || film.wantsPoints()) {
      unlit_.emplace(scene.volume, scene.medium, Lights{}, sightOptions_.octaves, nullptr, progress, nullptr);
      sight_.emplace(*unlit_, scene, sightOptions_, film);
    }
    return true;
  }

  std::unique_ptr<TileWorker> worker() const override { return std::make_unique<Worker>(*this); }

 private:
  class Worker final : public TileWorker {
   public:
    explicit Worker(const PathIntegrator& of)
        : of_(of), scratch_(of.sightOptions_), deep_(of.options_.deep.value_or(DeepOptions{})) {}

    void integrate(const PixelBox& tile, Film& film) override {
      const std::size_t perPixel = std::size_t(of_.options_.samplesPerPixel);
      of_.tracer_->trace(tile, wave_, sums_);
      samples += std::exchange(wave_.scatterings, 0);
      rays += perPixel * sums_.size();
      detail::PathSums* sums = sums_.data();
      for (int y = tile.y0; y != tile.y1; ++y)
        for (int x = tile.x0; x != tile.x1; ++x, ++sums) {
          const std::size_t place = film.placeOf(x, y);
          film.set(place, sumOf(*sums, film.wantsDepth() ? depthAt(x, y) : INFINITY));
          if (film.deep()) film.set(place, deep_.samples(sums->events, perPixel));
        }
    }

    void findPoints(const PixelBox& tile, Film& film) override {
      of_.sight_->points(tile, scratch_);
      const PixelPoint* point = scratch_.points.data();
      for (int y = tile.y0; y != tile.y1; ++y)
        for (int x = tile.x0; x != tile.x1; ++x) film.set(film.placeOf(x, y), *point++);
    }

   private:
    float depthAt(int x, int y) {
      of_.sight_->march(x, y, 1, scratch_);
      of_.sight_->gather(0, scratch_);
      return scratch_.sum.depth;
    }

    PixelSum sumOf(const detail::PathSums& sums, float depth) const {
      const double share = 1.0 / of_.options_.samplesPerPixel;
      PixelSum pixel;
      pixel.depth = depth;
      pixel.alpha = float((sums.opacity.x + sums.opacity.y + sums.opacity.z) / 3 * share);
      pixel.opacity = Vec3f(sums.opacity * share);
      pixel.albedo = Vec3f(sums.albedo * share);
      pixel.emission = Vec3f(sums.emission * share);
      for (std::size_t i = 0; i != sums.light.size(); ++i) pixel.light[i] = Vec3f(sums.light[i] * share);
      return pixel;
    }

    const PathIntegrator& of_;
    detail::PathTracer::Wave wave_;
    std::vector<detail::PathSums> sums_;
    detail::Picture::Scratch scratch_;
    detail::DeepPixel deep_;
  };

  PathOptions options_;
  // Of the march without light.
  RenderOptions sightOptions_;
  std::optional<detail::BakedLight> unlit_;
  std::optional<detail::Picture> sight_;
  std::optional<detail::PathTracer> tracer_;
};

}  // namespace

double estimatePathBytes(const Camera& camera, const PathOptions& options) {
  if (!options.deep) return 0;
  // Where opacity grows by the tolerance there may be a sample.
  const double perPixel = std::min(double(options.samplesPerPixel), 2 / double(options.deep->tolerance));
  return perPixel * sizeof(DeepSample) * camera.window().width() * camera.window().height();
}

std::unique_ptr<Integrator> pathIntegrator(const PathOptions& options) {
  return std::make_unique<PathIntegrator>(options);
}

RenderResult pathTraceImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                            const Camera& camera, const PathOptions& options, const Progress& progress) {
  const RenderScene scene(volume, medium, lights, camera, options);
  return render(scene, *pathIntegrator(options), Film(scene, options), progress);
}

}  // namespace nephele
