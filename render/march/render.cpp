// From a scene to a picture: tiles of the film in parallel, each filled by an integrator.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <mutex>

#include "nephele/modeling/base/parallel.h"
#include "nephele/render/march/integrator.h"

namespace nephele {

namespace {

// Where only some pixels are integrated: wide enough that few of them are at a border.
constexpr int kAdaptiveTile = 32;
// Fills tiles of a film where only some pixels are integrated: pixels far apart first, then those in the
// middle of four, then those between, and so on half as far apart. Neighbours beyond the tile are not asked,
// so that tiles do not depend on each other. Of the tile only what is wanted is filled, and what that depends
// on.
class AdaptivePasses {
 public:
  /// `film` is of one tile.
  AdaptivePasses(Integrator::TileWorker& worker, const Integrator& integrator, Film& film)
      : worker_(worker),
        film_(film),
        tile_(film.window()),
        threshold_(film.options().adaptiveThreshold),
        faint_(integrator.faintRadiance()) {}

  void run(const PixelBox& wanted) {
    const int first = Film::kFirstApart;
    needed_ = wanted.grownBy(Film::reachOf(first));
    for (int y = tile_.y0; y < tile_.y1; y += first)
      for (int x = tile_.x0; x < tile_.x1; x += first)
        if (needed_.contains(x, y)) integrate(x, y);
    for (int apart = first; apart != 1; apart /= 2) {
      const int half = apart / 2;
      needed_ = wanted.grownBy(Film::reachOf(half) + half);
      for (int y = tile_.y0 + half; y < tile_.y1; y += apart)
        for (int x = tile_.x0 + half; x < tile_.x1; x += apart)
          fill(x, y, {{{-half, -half}, {half, -half}, {-half, half}, {half, half}}});
      needed_ = wanted.grownBy(Film::reachOf(half));
      for (int y = tile_.y0; y < tile_.y1; y += half)
        for (int x = tile_.x0 + ((y - tile_.y0) % apart == 0 ? half : 0); x < tile_.x1; x += apart)
          fill(x, y, {{{-half, 0}, {half, 0}, {0, -half}, {0, half}}});
    }
  }

 private:
  void integrate(int x, int y) { worker_.integrate({x, y, x + 1, y + 1}, film_); }

  void fill(int x, int y, const std::array<std::array<int, 2>, 4>& around) {
    if (!needed_.contains(x, y)) return;
    std::array<std::size_t, 4> from;
    for (std::size_t i = 0; i != 4; ++i) {
      const int nextX = x + around[i][0], nextY = y + around[i][1];
      if (!tile_.contains(nextX, nextY)) return integrate(x, y);
      from[i] = film_.placeOf(nextX, nextY);
    }
    if (!film_.interpolate(film_.placeOf(x, y), from, threshold_, faint_)) integrate(x, y);
  }

  Integrator::TileWorker& worker_;
  Film& film_;
  PixelBox tile_, needed_;
  float threshold_, faint_;
};

RenderResult finished(Film& film) {
  RenderResult result;
  result.image = std::move(film.image());
  result.deep = std::move(film.deep());
  return result;
}

}  // namespace

RenderResult render(const RenderScene& scene, Integrator& integrator, Film film, const Progress& progress) {
  scene.check();
  const auto start = std::chrono::steady_clock::now();
  const PixelBox window = film.window();
  const std::size_t pixels = std::size_t(window.width()) * std::size_t(window.height());
  if (!integrator.prepare(scene, film, progress)) {
    for (std::size_t i = 0; i != pixels; ++i) {
      film.set(i, PixelSum{});
      film.set(i, PixelPoint{});
    }
    RenderResult result = finished(film);
    result.rays = pixels * std::uint64_t(integrator.raysPerPixel());
    return result;
  }
  progress.begin(integrator.stage());
  const FilmOptions& options = film.options();
  const bool isAdaptive = options.adaptiveThreshold > 0;
  const int side = isAdaptive ? kAdaptiveTile : integrator.tileSize();
  // The tiles of adaptive pictures are those of the whole, so that its parts fit together.
  const PixelBox whole = isAdaptive ? film.picture() : window;
  const int firstX = window.x0 - (window.x0 - whole.x0) % side,
            firstY = window.y0 - (window.y0 - whole.y0) % side;
  const int across = (window.x1 - firstX + side - 1) / side, down = (window.y1 - firstY + side - 1) / side;
  std::atomic<std::uint64_t> samples{0}, rays{0};
  std::mutex observing;
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t end) {
        const std::unique_ptr<Integrator::TileWorker> worker = integrator.worker();
        for (std::size_t i = begin; i != end; ++i) {
          const int x0 = firstX + int(i % std::size_t(across)) * side,
                    y0 = firstY + int(i / std::size_t(across)) * side;
          const PixelBox ofWhole = PixelBox{x0, y0, x0 + side, y0 + side}.sharedWith(whole),
                         tile = ofWhole.sharedWith(window);
          if (isAdaptive) {
            Film part = film.part(ofWhole);
            AdaptivePasses(*worker, integrator, part).run(tile);
            film.take(part);
          } else {
            worker->integrate(tile, film);
          }
          if (film.wantsPoints()) worker->findPoints(tile, film);
          if (!options.onTile) continue;
          const std::lock_guard lock(observing);
          options.onTile({tile.x0 - window.x0, tile.y0 - window.y0, tile.x1 - window.x0, tile.y1 - window.y0},
                         film.image());
        }
        samples += worker->samples;
        rays += worker->rays;
      },
      progress);
  RenderResult result = finished(film);
  result.rays = rays;
  result.samples = samples;
  progress.count("rays", double(result.rays));
  progress.count("samples", double(result.samples));
  result.marchSeconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace nephele
