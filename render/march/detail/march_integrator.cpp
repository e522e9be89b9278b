#include "nephele/render/march/detail/march_integrator.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "nephele/modeling/base/error.h"

namespace nephele::detail {

class MarchIntegrator::Worker final : public TileWorker {
 public:
  explicit Worker(const MarchIntegrator& of)
      : picture_(*of.picture_), raysPerPixel_(of.options_.samples), scratch_(of.options_) {}

  void integrate(const PixelBox& tile, Film& film) override {
    const int together = picture_.pixelsTogether();
    for (int y = tile.y0; y != tile.y1; ++y)
      for (int x = tile.x0; x < tile.x1; x += together) {
        const int count = std::min(together, tile.x1 - x);
        picture_.march(x, y, count, scratch_);
        for (int i = 0; i != count; ++i) {
          samples += picture_.gather(i, scratch_);
          const std::size_t place = film.placeOf(x + i, y);
          film.set(place, scratch_.sum);
          if (film.deep()) film.set(place, std::move(scratch_.samples));
        }
        rays += std::uint64_t(count) * std::uint64_t(raysPerPixel_);
      }
  }

  void findPoints(const PixelBox& tile, Film& film) override {
    picture_.points(tile, scratch_);
    const PixelPoint* point = scratch_.points.data();
    for (int y = tile.y0; y != tile.y1; ++y)
      for (int x = tile.x0; x != tile.x1; ++x) film.set(film.placeOf(x, y), *point++);
  }

 private:
  const Picture& picture_;
  int raysPerPixel_;
  Picture::Scratch scratch_;
};

MarchIntegrator::MarchIntegrator(std::shared_ptr<const BakedLight> light, const RenderOptions& options)
    : light_(std::move(light)), options_(options) {
  check(options);
}

void MarchIntegrator::check(const Octaves& octaves) {
  require(octaves.count >= 1 && octaves.count <= MarchScene::kMostOctaves,
          fmt::format("octaves: expected 1 to {}, got {}", MarchScene::kMostOctaves, octaves.count));
  require(octaves.cells == 0 || (octaves.cells >= 8 && octaves.cells <= 512),
          fmt::format("octaves: cells must be 0 or from 8 to 512, got {}", octaves.cells));
}

void MarchIntegrator::check(const RenderOptions& options) {
  check(options.octaves);
  require(options.samples >= 1 && options.samples <= 4096,
          fmt::format("samples: expected 1 to 4096, got {}", options.samples));
  require(!options.step || (std::isfinite(*options.step) && *options.step > 0),
          fmt::format("step: expected a length > 0, got {}", options.step.value_or(0)));
  require(std::isfinite(options.refinement.threshold) && options.refinement.threshold > 0,
          fmt::format("refinement: expected a threshold > 0, got {}", options.refinement.threshold));
  require(options.refinement.halvings >= 0 && options.refinement.halvings <= 16,
          fmt::format("refinement: expected 0 to 16 halvings, got {}", options.refinement.halvings));
}

// A fiftieth of what a thin white medium sends back of suns and sky.
float MarchIntegrator::faintRadiance() const {
  Vec3f sum = light_->sky ? light_->sky->mean() : light_->lights.sky;
  for (const DistantLight& sun : light_->distant) sum += sun.irradiance / (4 * kPi);
  return 0.02f * std::max({sum.x, sum.y, sum.z});
}

bool MarchIntegrator::prepare(const RenderScene& scene, const Film& film, const Progress&) {
  if (!light_) return false;
  picture_.emplace(*light_, scene, options_, film);
  return true;
}

std::unique_ptr<Integrator::TileWorker> MarchIntegrator::worker() const {
  return std::make_unique<Worker>(*this);
}

}  // namespace nephele::detail
