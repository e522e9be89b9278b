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

}  // namespace
}  // namespace nephele
