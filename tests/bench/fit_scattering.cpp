// How far the marcher's multiple scattering is from path tracing, and which Octaves bring it nearest.
//
//   fit_scattering CACHE [--fit] VOLUME.vdb ...
//
// Looks at every volume under three suns and a sky, through five media, at 160x120 pixels: path traced, which
// is kept as CACHE/*.exr for the next run, and marched. Prints the relative error of the mean, the root mean
// square and the largest error over regions of 8x8 pixels (32x32 of a picture 640 wide) that are covered by
// half or more, and the share of regions off by more than 15 %. The noise of a region is about 2 %. With
// --fit it then looks for the gain, bend and lookAhead that make the sum of squares of mean and region errors
// least, one after another.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/image/exr_io.h"
#include "nephele/render/march/path_trace.h"
#include "nephele/render/march/raymarch.h"

namespace nephele {
namespace {

constexpr int kWidth = 160, kHeight = 120, kRegion = 8, kPaths = 192;

struct Errors {
  double mean = 0, rms = 0, most = 0, bad = 0;
};

Errors compare(const Image& marched, const Image& traced) {
  Errors errors;
  double sumMarched = 0, sumTraced = 0;
  int regions = 0;
  for (int y0 = 0; y0 != kHeight; y0 += kRegion)
    for (int x0 = 0; x0 != kWidth; x0 += kRegion) {
      double a = 0, b = 0, alpha = 0;
      for (int y = y0; y != y0 + kRegion; ++y)
        for (int x = x0; x != x0 + kRegion; ++x) {
          a += double(marched.at("G", x, y));
          b += double(traced.at("G", x, y));
          alpha += double(traced.at("A", x, y));
        }
      sumMarched += a;
      sumTraced += b;
      if (alpha < 0.5 * kRegion * kRegion) continue;
      const double error = a / b - 1;
      ++regions;
      errors.rms += error * error;
      errors.most = std::max(errors.most, std::fabs(error));
      errors.bad += std::fabs(error) > 0.15;
    }
  errors.mean = sumMarched / sumTraced - 1;
  errors.rms = std::sqrt(errors.rms / regions);
  errors.bad /= regions;
  return errors;
}

struct Scene {
  std::string name;
  const RenderVolume* volume;
  Medium medium;
  Lights lights;
  Image traced;

  Camera camera() const { return Camera::framing(volume->outline(), 25, 5, {kWidth, kHeight, 35}); }
  Errors errors(const Octaves& octaves) const {
    RenderOptions options;
    options.octaves = octaves;
    options.aovs = {};
    return compare(renderImage(*volume, medium, lights, camera(), options).image, traced);
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
  } media[] = {{"usual", 1, 0.99f, "hg:0.3"},
               {"forward", 1, 0.99f, "hg:0.85"},
               {"grey", 1, 0.9f, "hg:0.3"},
               {"white", 1, 1, "isotropic"},
               {"thin", 0.25f, 0.99f, "hg:0.3"}};
  std::vector<Scene> scenes;
  for (const auto& medium : media)
    for (const auto& sun : suns) {
      Scene& scene = scenes.emplace_back();
      scene.name = name + "_" + medium.name + "_" + sun.name;
      scene.volume = &volume;
      const float a = medium.albedo;
      scene.medium = {medium.thickness * defaultExtinction(volume), {a, a, a}, Phase::parse(medium.phase)};
      scene.lights = {{{"sun", directionTowards(sun.azimuth, sun.elevation), {6.5f, 6.5f, 6.5f}}},
                      {0.17f, 0.17f, 0.17f}};
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

double cost(const std::vector<Scene>& scenes, const Octaves& octaves) {
  double sum = 0;
  for (const Scene& scene : scenes) {
    const Errors errors = scene.errors(octaves);
    sum += errors.mean * errors.mean + errors.rms * errors.rms;
  }
  return sum;
}

Octaves fit(const std::vector<Scene>& scenes) {
  Octaves best;
  double least = cost(scenes, best);
  struct Parameter {
    const char* name;
    float Octaves::*value;
    float step;
  } parameters[] = {{"gain", &Octaves::gain, 0.04f},
                    {"lookAhead", &Octaves::lookAhead, 0.4f},
                    {"bend", &Octaves::bend, 0.5f}};
  for (int round = 0; round != 4; ++round)
    for (Parameter& parameter : parameters) {
      bool improved = false;
      for (const float side : {1.0f, -1.0f}) {
        Octaves next = best;
        next.*parameter.value += side * parameter.step;
        const double now = cost(scenes, next);
        if (!(now < least)) continue;
        best = next;
        least = now;
        improved = true;
        break;
      }
      if (!improved) parameter.step /= 2;
      std::printf("gain %.4f lookAhead %.3f bend %.3f: %.4f\n", best.gain, best.lookAhead, best.bend, least);
    }
  return best;
}

void print(const std::vector<Scene>& scenes, const Octaves& octaves) {
  std::printf("%-28s %7s %7s %7s %7s\n", "", "mean", "rms", "most", ">15%");
  for (const Scene& scene : scenes) {
    const Errors e = scene.errors(octaves);
    std::printf("%-28s %+6.1f%% %6.1f%% %6.1f%% %6.1f%%\n", scene.name.c_str(), 100 * e.mean, 100 * e.rms,
                100 * e.most, 100 * e.bad);
  }
}

int run(int argc, char** argv) {
  bool fitted = false;
  std::vector<std::string> arguments;
  for (int i = 1; i < argc; ++i)
    if (std::strcmp(argv[i], "--fit") == 0)
      fitted = true;
    else
      arguments.push_back(argv[i]);
  if (arguments.size() < 2) {
    std::fprintf(stderr, "usage: fit_scattering CACHE [--fit] VOLUME.vdb ...\n");
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
  print(scenes, {});
  if (fitted) print(scenes, fit(scenes));
  return 0;
}

}  // namespace
}  // namespace nephele

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  try {
    return nephele::run(argc, argv);
  } catch (const nephele::Error& error) {
    std::fprintf(stderr, "fit_scattering: %s\n", error.what());
    return 1;
  }
}
