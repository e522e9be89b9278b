// Pictures by random paths. Layers that say where things are and not how they are lit come from a march
// without light, so that they have no noise.
//
// Limits: suns that shine through a narrow forward peak make noise that falls slowly, since they are points
// and no direction but the exact one finds them.
#include "nephele/render/march/path_trace.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

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
    bool deep = scene.lights.deepTolerance.has_value();
    for (const DistantLight& sun : scene.lights.suns) deep = deep || sun.deepShadow;
    for (const LocalLight& light : scene.lights.locals) deep = deep || light.deepShadow;
    require(!deep, "path tracing: deep shadow maps can only be marched");
    require(!scene.surfaces, "path tracing: objects can only be marched");
    require(!scene.holdout, "path tracing: holdouts can only be marched");
    require(!film.options().deep, "path tracing: deep pictures can only be marched");
    require(!scene.volume.field(),
            "path tracing: needs a density that is a grid; fieldVolume makes one of a field");
    if (!isSeen(scene.volume, scene.medium)) return false;
    progress_ = &progress;
    tracer_.emplace(scene, options_);
    if (film.wantsDepth() || film.wantsPoints()) {
      unlit_.emplace(scene.volume, scene.medium, Lights{}, sightOptions_.octaves, nullptr, progress, nullptr);
      sight_.emplace(*unlit_, scene, sightOptions_, film);
    }
    albedo_ = scene.medium.albedo;
    return true;
  }

  std::unique_ptr<TileWorker> worker() const override { return std::make_unique<Worker>(*this); }

 private:
  class Worker final : public TileWorker {
   public:
    explicit Worker(const PathIntegrator& of) : of_(of), scratch_(of.sightOptions_) {}

    void integrate(const PixelBox& tile, Film& film) override {
      for (int y = tile.y0; y != tile.y1; ++y)
        for (int x = tile.x0; x != tile.x1; ++x) {
          of_.progress_->check();
          detail::PathSums sums;
          of_.tracer_->pixel(x, y, sums);
          samples += sums.scatterings;
          rays += std::uint64_t(of_.options_.samplesPerPixel);
          film.set(film.placeOf(x, y), sumOf(sums, film.wantsDepth() ? depthAt(x, y) : INFINITY));
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
      pixel.albedo = pixel.opacity * of_.albedo_;
      pixel.emission = Vec3f(sums.emission * share);
      for (std::size_t i = 0; i != sums.light.size(); ++i) pixel.light[i] = Vec3f(sums.light[i] * share);
      return pixel;
    }

    const PathIntegrator& of_;
    detail::Picture::Scratch scratch_;
  };

  PathOptions options_;
  // Of the march without light.
  RenderOptions sightOptions_;
  std::optional<detail::BakedLight> unlit_;
  std::optional<detail::Picture> sight_;
  std::optional<detail::PathTracer> tracer_;
  const Progress* progress_ = nullptr;
  Vec3f albedo_{};
};

}  // namespace

std::unique_ptr<Integrator> pathIntegrator(const PathOptions& options) {
  return std::make_unique<PathIntegrator>(options);
}

RenderResult pathTraceImage(const RenderVolume& volume, const Medium& medium, const Lights& lights,
                            const Camera& camera, const PathOptions& options, const Progress& progress) {
  const RenderScene scene(volume, medium, lights, camera, options);
  return render(scene, *pathIntegrator(options), Film(scene, options), progress);
}

}  // namespace nephele
