// The loop that fills a film, whatever the integrator.
#include <gtest/gtest.h>

#include <type_traits>

#include "nephele/modeling/base/error.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

// No reference to a volume that ends with the statement.
static_assert(std::is_constructible_v<LitVolume, const RenderVolume&, Medium, Lights, Octaves>);
static_assert(!std::is_constructible_v<LitVolume, RenderVolume, Medium, Lights, Octaves>);

const Lights kLights{{{"sun", {1, 1, 1}, {3, 3, 3}}}, {0.1f, 0.2f, 0.3f}};

TEST(Render, ShowsEveryPixelOnceWhenItIsDone) {
  // What the observer is shown, put together, is the picture; each pixel is shown by one tile.
  for (const auto& crop : {std::optional<PixelBox>(), std::optional<PixelBox>({7, 5, 40, 30})})
    for (const float threshold : {0.0f, 0.05f}) {
      std::vector<float> seen;
      std::vector<int> times;
      const auto watch = [&](FrameOptions& options) {
        seen.assign(45 * 37, -1.0f);
        times.assign(45 * 37, 0);
        options.onTile = [&](const PixelBox& tile, const Image& image) {
          ASSERT_TRUE(tile.x0 >= 0 && tile.y0 >= 0 && tile.x1 <= image.width && tile.y1 <= image.height);
          for (int y = tile.y0; y != tile.y1; ++y)
            for (int x = tile.x0; x != tile.x1; ++x) {
              const std::size_t at = std::size_t(y) * std::size_t(image.width) + std::size_t(x);
              seen[at] = image.at("R", x, y);
              ++times[at];
            }
        };
      };
      const auto expectAll = [&](const Image& image) {
        const std::vector<float>& red = image.channel("R").values;
        for (std::size_t i = 0; i != red.size(); ++i) {
          ASSERT_EQ(times[i], 1);
          ASSERT_EQ(seen[i], red[i]);
        }
      };
      const RenderVolume volume(test::ball(1.0f, 0.2f));
      Camera::Frame frame{45, 37, 30};
      frame.crop = crop;
      const Camera camera = Camera::framing(volume.outline(), 20, 10, frame);
      RenderOptions marching;
      marching.adaptiveThreshold = threshold;
      watch(marching);
      expectAll(renderImage(volume, {}, kLights, camera, marching).image);
      PathOptions tracing;
      tracing.samplesPerPixel = 2;
      watch(tracing);
      expectAll(pathTraceImage(volume, {}, kLights, camera, tracing).image);
    }
}

// Paints every pixel with where it is.
class Painter final : public Integrator {
 public:
  class Worker final : public TileWorker {
   public:
    void integrate(const PixelBox& tile, Film& film) override {
      for (int y = tile.y0; y != tile.y1; ++y)
        for (int x = tile.x0; x != tile.x1; ++x) {
          PixelSum pixel;
          pixel.alpha = float(x);
          pixel.emission = {float(x), float(y), 0};
          film.set(film.placeOf(x, y), pixel);
          ++rays;
        }
    }
    void findPoints(const PixelBox&, Film&) override {}
  };

  const char* stage() const override { return "paint"; }
  int tileSize() const override { return 7; }
  int raysPerPixel() const override { return 1; }
  bool prepare(const RenderScene&, const Film&, const Progress&) override { return true; }
  std::unique_ptr<TileWorker> worker() const override { return std::make_unique<Worker>(); }
};

TEST(Render, TellsAnIntegratorWhereItsPixelsAre) {
  const RenderVolume volume(test::ball(1.0f, 0.2f));
  Camera::Frame frame{45, 37, 30};
  frame.crop = PixelBox{7, 5, 40, 30};
  const Camera camera = Camera::framing(volume.outline(), 20, 10, frame);
  const Medium medium{10.0f};
  FrameOptions options;
  const RenderScene scene(volume, medium, kLights, camera, options);
  Painter painter;
  const RenderResult result = render(scene, painter, Film(scene, options));
  ASSERT_EQ(result.image.width, 33);
  for (int y = 0; y != 25; ++y)
    for (int x = 0; x != 33; ++x) {
      EXPECT_EQ(result.image.at("R", x, y), float(x + 7));
      EXPECT_EQ(result.image.at("G", x, y), float(y + 5));
    }
  EXPECT_EQ(result.rays, 33u * 25u);
}

TEST(Render, StopsWhenItIsCancelled) {
  struct Stopped : Progress {
    bool cancelled() const override { return true; }
  };
  const RenderVolume volume(test::ball(1.0f, 0.2f));
  const Camera camera = Camera::framing(volume.outline(), 20, 10, {45, 37, 30});
  EXPECT_THROW(renderImage(volume, {}, kLights, camera, {}, Stopped()), Cancelled);
  EXPECT_THROW(pathTraceImage(volume, {}, kLights, camera, {}, Stopped()), Cancelled);
}

}  // namespace
}  // namespace nephele
