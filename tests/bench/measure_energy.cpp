// What comes out of clouds that absorb nothing, over what they take of a sun: 1 if no light is lost.
//
//   measure_energy [VOLUME.vdb ...]
//
// Marches balls of several radii, and the volumes, whose voxels are 0.05 to 16 free paths deep and scatter
// evenly in all directions. Prints a row of a Markdown table for each, and one of what was scattered once.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/light/detail/harmonics.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"

namespace nephele {
namespace {

constexpr int kPixels = 120;
constexpr float kDepths[] = {0.05f, 0.3f, 1, 2, 4, 8, 16};

// Sum over the pixels of a view without perspective, times the area of one.
double sumOver(const LitVolume& lit, const Box& box, const RenderOptions& options, const Vec3f& from,
               const char* channel) {
  const Vec3f middle = (box.min + box.max) * 0.5f;
  Camera::Frame frame;
  frame.width = frame.height = kPixels;
  frame.projection = Camera::Projection::orthographic;
  const float width = length(box.size());
  frame.orthographicWidth = width;
  const Vec3f up = std::fabs(from.y) > 0.9f ? Vec3f{1, 0, 0} : Vec3f{0, 1, 0};
  const Camera camera = Camera::lookingAt(middle + from * (4 * width), middle, up, frame);
  const Image image = lit.render(camera, options).image;
  double sum = 0;
  for (int y = 0; y != kPixels; ++y)
    for (int x = 0; x != kPixels; ++x) sum += double(image.at(channel, x, y));
  return sum * std::pow(double(width) / kPixels, 2);
}

double shareThatComesOut(const RenderVolume& volume, float depth, const Octaves& octaves) {
  const Vec3f towards = normalize(Vec3f{0.4f, 0.7f, 0.5f});
  const Medium medium{depth / volume.density().voxelSize(), {1, 1, 1}, Phase()};
  const LitVolume lit(volume, medium, {{{"sun", towards, {1, 1, 1}}}, {}}, octaves);
  RenderOptions options;
  options.octaves = octaves;
  options.aovs = {"Z"};
  double out = 0;
  for (const auto& [way, weight] : detail::levelSymmetric(8))
    out += 4 * double(kPi) * double(weight) * sumOver(lit, volume.worldBounds(), options, way, "R");
  return out / sumOver(lit, volume.worldBounds(), options, towards, "A");
}

void measure(const std::string& name, const RenderVolume& volume) {
  const auto printRow = [&](const std::string& what, const Octaves& octaves) {
    std::printf("| %s |", what.c_str());
    for (const float depth : kDepths) {
      std::printf(" %.3f |", shareThatComesOut(volume, depth, octaves));
      std::fflush(stdout);
    }
    std::printf("\n");
  };
  printRow(name, {});
  printRow(name + ", scattered once", {.count = 1});
}

int run(int argc, char** argv) {
  std::printf("| optical depth of a voxel |");
  for (const float depth : kDepths) std::printf(" %g |", double(depth));
  std::printf("\n|---|---|---|---|---|---|---|---|\n");
  for (const int radius : {10, 20, 40, 160})
    measure("ball, " + std::to_string(radius) + " voxels", RenderVolume(test::ball(1.0f, 1 / float(radius))));
  for (int i = 1; i < argc; ++i)
    measure(std::filesystem::path(argv[i]).stem().string(),
            RenderVolume(toBricks(readScalarGrid(argv[i], ""))));
  return 0;
}

}  // namespace
}  // namespace nephele

int main(int argc, char** argv) {
  try {
    return nephele::run(argc, argv);
  } catch (const nephele::Error& error) {
    std::fprintf(stderr, "measure_energy: %s\n", error.what());
    return 1;
  }
}
