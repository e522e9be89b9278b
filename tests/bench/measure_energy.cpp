// What comes out of clouds that absorb nothing, over what they take of a sun: 1 if no light is lost.
//
//   measure_energy [VOLUME.vdb ...]
//
// Marches balls of several radii, and the volumes, whose voxels are 0.05 to 16 free paths deep and scatter
// evenly in all directions. Prints a row of a Markdown table for each, and one of what was scattered once.
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "nephele/levelset/io/vdb_io.h"
#include "nephele/modeling/base/error.h"
#include "nephele/render/march/raymarch.h"
#include "tests/support/density.h"
#include "tests/support/energy.h"

namespace nephele {
namespace {

constexpr int kPixels = 120;
constexpr float kDepths[] = {0.05f, 0.3f, 1, 2, 4, 8, 16};

double shareOf(const RenderVolume& volume, float depth, const Octaves& octaves) {
  const Vec3f towards = normalize(Vec3f{0.4f, 0.7f, 0.5f});
  const Medium medium{depth / volume.density().voxelSize(), {1, 1, 1}, Phase()};
  const LitVolume lit(volume, medium, {{{"sun", towards, {1, 1, 1}}}, {}}, octaves);
  RenderOptions options;
  options.octaves = octaves;
  const Box box = volume.worldBounds();
  return test::shareThatComesOut(lit, towards, {(box.min + box.max) * 0.5f, length(box.size()), kPixels}, 8,
                                 options);
}

void measure(const std::string& name, const RenderVolume& volume) {
  const auto printRow = [&](const std::string& what, const Octaves& octaves) {
    std::printf("| %s |", what.c_str());
    for (const float depth : kDepths) {
      std::printf(" %.3f |", shareOf(volume, depth, octaves));
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
