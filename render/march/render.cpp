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
// How far apart the first of these are.
constexpr int kApart = 4;

// Fills tiles of a film where only some pixels are integrated: pixels far apart first, then those in the
// middle of four, then those between, and so on half as far apart. Neighbours beyond the tile are not asked,
// so that tiles do not depend on each other.
class AdaptivePasses {
 public:
  AdaptivePasses(Integrator::TileWorker& worker, const Integrator& integrator, Film& film)
      : worker_(worker),
        film_(film),
        threshold_(film.options().adaptiveThreshold),
        faint_(integrator.faintRadiance()) {}

  void run(const PixelBox& tile) {
    for (int y = tile.y0; y < tile.y1; y += kApart)
      for (int x = tile.x0; x < tile.x1; x += kApart) integrate(x, y);
    for (int apart = kApart; apart != 1; apart /= 2) {
      const int half = apart / 2;
      for (int y = tile.y0 + half; y < tile.y1; y += apart)
        for (int x = tile.x0 + half; x < tile.x1; x += apart)
          fill(tile, x, y, {{{-half, -half}, {half, -half}, {-half, half}, {half, half}}});
      for (int y = tile.y0; y < tile.y1; y += half)
        for (int x = tile.x0 + ((y - tile.y0) % apart == 0 ? half : 0); x < tile.x1; x += apart)
          fill(tile, x, y, {{{-half, 0}, {half, 0}, {0, -half}, {0, half}}});
    }
  }

 private:
  void integrate(int x, int y) { worker_.integrate({x, y, x + 1, y + 1}, film_); }

  void fill(const PixelBox& tile, int x, int y, const std::array<std::array<int, 2>, 4>& around) {
    std::array<std::size_t, 4> from;
    for (std::size_t i = 0; i != 4; ++i) {
      const int nextX = x + around[i][0], nextY = y + around[i][1];
      if (nextX < tile.x0 || nextY < tile.y0 || nextX >= tile.x1 || nextY >= tile.y1) return integrate(x, y);
      from[i] = film_.placeOf(nextX, nextY);
    }
    if (!film_.interpolate(film_.placeOf(x, y), from, threshold_, faint_)) integrate(x, y);
  }

  Integrator::TileWorker& worker_;
  Film& film_;
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
  const int across = (window.width() + side - 1) / side, down = (window.height() + side - 1) / side;
  std::atomic<std::uint64_t> samples{0}, rays{0};
  std::mutex observing;
  parallelFor(
      std::size_t(across) * down, 1,
      [&](std::size_t begin, std::size_t end) {
        const std::unique_ptr<Integrator::TileWorker> worker = integrator.worker();
        for (std::size_t i = begin; i != end; ++i) {
          const int x0 = window.x0 + int(i % std::size_t(across)) * side,
                    y0 = window.y0 + int(i / std::size_t(across)) * side;
          const PixelBox tile{x0, y0, std::min(x0 + side, window.x1), std::min(y0 + side, window.y1)};
          if (isAdaptive)
            AdaptivePasses(*worker, integrator, film).run(tile);
          else
            worker->integrate(tile, film);
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
