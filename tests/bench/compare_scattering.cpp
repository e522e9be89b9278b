// How far the marcher's multiple scattering is from path tracing.
//
//   compare_scattering CACHE VOLUME.vdb ...
//
// Looks at every volume under three suns, through media of several phase functions, at 160x120 pixels: path
// traced, which is kept as CACHE/*.exr for the next run, and marched. Prints the relative error of the mean,
// the root mean square and the largest error over regions of 16x16 pixels that are covered by half or more.
// Regions with less than a tenth of the light of the brightest are left out of the last two columns. The
// noise of a region is about 1 %.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"

namespace nephele {
namespace {

constexpr int kWidth = 160, kHeight = 120, kRegion = 16, kPaths = 256;

struct Errors {
  double mean = 0, rms = 0, most = 0;
};

// Over regions that have at least `least` of the light of the brightest.
Errors compare(const Image& marched, const Image& traced, double least) {
  struct Region {
    double marched = 0, traced = 0;
  };
  std::vector<Region> regions;
  double sumMarched = 0, sumTraced = 0, brightest = 0;
  for (int y0 = 0; y0 + kRegion <= kHeight; y0 += kRegion)
    for (int x0 = 0; x0 != kWidth; x0 += kRegion) {
      Region region;
      double alpha = 0;
      for (int y = y0; y != y0 + kRegion; ++y)
        for (int x = x0; x != x0 + kRegion; ++x) {
          region.marched += double(marched.at("G", x, y));
          region.traced += double(traced.at("G", x, y));
          alpha += double(traced.at("A", x, y));
        }
      sumMarched += region.marched;
      sumTraced += region.traced;
      if (alpha < 0.5 * kRegion * kRegion) continue;
      brightest = std::max(brightest, region.traced);
      regions.push_back(region);
    }
  Errors errors;
  int count = 0;
  for (const Region& region : regions) {
    if (region.traced < least * brightest) continue;
    const double error = region.marched / region.traced - 1;
    ++count;
    errors.rms += error * error;
    errors.most = std::max(errors.most, std::fabs(error));
  }
  errors.mean = sumMarched / sumTraced - 1;
  errors.rms = std::sqrt(errors.rms / std::max(count, 1));
  return errors;
}

struct Scene {
  std::string name;
  const RenderVolume* volume;
  Medium medium;
  Lights lights;
  Image traced;

  Camera camera() const { return Camera::framing(volume->outline(), 25, 5, {kWidth, kHeight, 35}); }
  Image marched() const {
    RenderOptions options;
    options.aovs = {};
    return renderImage(*volume, medium, lights, camera(), options).image;
  }
};

std::vector<Scene> scenesOf(const std::string& name, const RenderVolume& volume, const std::string& cache) {
  const struct {
    const char* name;
    float azimuth, elevation;
  } suns[] = {{"front", 45, 35}, {"side", 115, 30}, {"back", 195, 25}};
  const struct {
    const char* name;
    float thickness, albedo;
    const char* phase;
  } media[] = {{"usual", 1, 0.9999f, "hg:0.3"},   {"forward", 1, 0.9999f, "hg:0.85"},
               {"cloud", 1, 0.9999f, "hg:0.877"}, {"grey", 1, 0.9f, "hg:0.3"},
               {"droplets", 1, 0.999f, "mie:20"}, {"thin", 0.25f, 0.99f, "hg:0.3"}};
  std::vector<Scene> scenes;
  for (const auto& medium : media)
    for (const auto& sun : suns) {
      Scene& scene = scenes.emplace_back();
      scene.name = name + "_" + medium.name + "_" + sun.name;
      scene.volume = &volume;
      const float a = medium.albedo;
      scene.medium = {medium.thickness * defaultExtinction(volume), {a, a, a}, Phase::parse(medium.phase)};
      scene.lights = {{{"sun", directionTowards(sun.azimuth, sun.elevation), {6.5f, 6.5f, 6.5f}}}, {}};
      const std::string path = cache + "/" + scene.name + ".exr";
      if (!std::filesystem::exists(path)) {
        PathOptions paths;
        paths.samplesPerPixel = kPaths;
        paths.aovs = {};
        const RenderResult result = pathTraceImage(volume, scene.medium, scene.lights, scene.camera(), paths);
        std::fprintf(stderr, "%s: %.1f s, %.0f scatterings\n", path.c_str(), result.marchSeconds,
                     double(result.samples));
        writeExr(path, result.image, scene.camera());
      }
      scene.traced = readImage(path);
    }
  return scenes;
}

void print(const std::vector<Scene>& scenes) {
  std::printf("%-28s %7s %7s %7s %7s %7s\n", "", "mean", "rms", "most", "rms", "most");
  for (const Scene& scene : scenes) {
    const Image marched = scene.marched();
    const Errors all = compare(marched, scene.traced, 0), bright = compare(marched, scene.traced, 0.1);
    std::printf("%-28s %+6.1f%% %6.1f%% %6.1f%% %6.1f%% %6.1f%%\n", scene.name.c_str(), 100 * all.mean,
                100 * all.rms, 100 * all.most, 100 * bright.rms, 100 * bright.most);
  }
}

int run(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  if (arguments.size() < 2) {
    std::fprintf(stderr, "usage: compare_scattering CACHE VOLUME.vdb ...\n");
    return 2;
  }
  std::filesystem::create_directories(arguments[0]);
  std::vector<std::unique_ptr<RenderVolume>> volumes;
  std::vector<Scene> scenes;
  for (std::size_t i = 1; i != arguments.size(); ++i) {
    volumes.push_back(std::make_unique<RenderVolume>(toBricks(readScalarGrid(arguments[i], ""))));
    for (Scene& scene :
         scenesOf(std::filesystem::path(arguments[i]).stem().string(), *volumes.back(), arguments[0]))
      scenes.push_back(std::move(scene));
  }
  print(scenes);
  return 0;
}

}  // namespace
}  // namespace nephele

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    return nephele::run(argc, argv);
  } catch (const nephele::Error& error) {
    std::fprintf(stderr, "compare_scattering: %s\n", error.what());
    return 1;
  }
}
